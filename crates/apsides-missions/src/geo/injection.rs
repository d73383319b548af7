//! The injection: vehicle, orbits, burns and limits; and what no flight can mend.

use apsides_dynamics::Engine;
use apsides_dynamics::equinoctial::OrbitalFlight;
use apsides_dynamics::impulsive::{Apsis, ImpulsiveTransfer, TransferOrbits};
use apsides_pipeline::Error;
use apsides_pipeline::values::Values;

use super::keys;
use crate::Refuse;
use crate::data::{J2, central_body};

/// The rule for the direction of the thrust.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BurnSteering {
    /// It is free at every instant.
    Optimal,
    /// It is that of the velocity; only in the equatorial plane.
    Velocity,
    /// It is fixed in inertial space along each burn, and free for each.
    InertialFixed,
}

/// Injection of a restartable upper stage from a circular or elliptic parking orbit into an equatorial orbit, with the largest final mass.
#[derive(Clone, Debug, PartialEq)]
pub struct GeoInjection {
    /// Central body with its oblateness (zero for a sphere), and engine.
    pub flight: OrbitalFlight,
    /// Mass in the parking orbit, kg.
    pub initial_mass: f64,
    /// Propellant in the parking orbit, kg.
    pub propellant: f64,
    /// Radius of the parking orbit, of its perigee where it is elliptic, from the centre, m.
    pub parking_radius: f64,
    /// Eccentricity of the parking orbit, whose perigee is at the ascending node.
    pub parking_eccentricity: f64,
    /// Inclination of the parking orbit to the equator, rad; zero keeps the flight in one plane.
    pub inclination: f64,
    /// Semi-major axis of the target orbit, m.
    pub target_semi_major_axis: f64,
    /// Eccentricity of the target orbit; the direction of its perigee is free.
    pub target_eccentricity: f64,
    /// Where each burn is, in order: at perigee or at apogee. At least one burn.
    pub pattern: Vec<Apsis>,
    /// The rule for the direction of the thrust.
    pub steering: BurnSteering,
    /// Longest time of each burn, s.
    pub burn_time_limit: Option<f64>,
    /// Longest time from the first ignition to the last cut-off, s.
    pub flight_time_limit: Option<f64>,
    /// Largest apogee radius of the orbits between the burns, m; needed where the pattern ends with retro burns at perigee.
    pub apogee_limit: Option<f64>,
    /// Restarts that the engine allows, one less than burns.
    pub max_restarts: usize,
}

/// Shortest time in which the engine may burn all propellant, s: a burn is no impulse.
const SHORTEST_BURN_S: f64 = 1.0;

impl GeoInjection {
    /// The injection of values, checked.
    pub(super) fn from_values(values: &Values) -> Result<Self, Error> {
        let refuse = |reason: String| values.conflict(reason);
        let body = central_body(values)?;
        let engine = Engine::new(values.number("thrust_n")?, values.number("isp_s")?)
            .map_err(values.refusal(&["isp_s", "thrust_n"]))?;
        let j2 = if values.flag("oblateness")? { values.number(&J2.path)? } else { 0.0 };
        let injection = Self {
            flight: OrbitalFlight::new(body, engine).with_j2(j2),
            initial_mass: values.number("initial_mass_kg")?,
            propellant: values.number("propellant_kg")?,
            parking_radius: body.radius + values.number("parking_altitude_km")? * 1e3,
            parking_eccentricity: values.number(keys::PARKING_ECCENTRICITY)?,
            inclination: values.number("inclination_deg")?.to_radians(),
            target_semi_major_axis: values.number("target_radius_km")? * 1e3,
            target_eccentricity: values.number("target_eccentricity")?,
            pattern: pattern(
                values.count(keys::BURNS)?,
                values.word(keys::PATTERN)?,
                values.number(keys::PARKING_ECCENTRICITY)? > 0.0,
                &refuse,
            )?,
            steering: match values.word(keys::STEERING)? {
                keys::VELOCITY => BurnSteering::Velocity,
                keys::INERTIAL => BurnSteering::InertialFixed,
                // The key takes no other words.
                _ => BurnSteering::Optimal,
            },
            burn_time_limit: values.limit("max_burn_time_s")?,
            flight_time_limit: values.limit(keys::MAX_FLIGHT_TIME)?,
            apogee_limit: values.limit("apogee_cap_km")?.map(|km| km * 1e3),
            max_restarts: values.count("max_restarts")?,
        };
        injection.check(&refuse)?;
        Ok(injection)
    }

    /// Refuses values that do not go together, and what no flight can mend.
    pub(super) fn check(&self, refuse: Refuse<'_>) -> Result<(), Error> {
        if self.burns() == 0 {
            return Err(refuse(format!("`{}` is 0, an injection takes one at least", keys::BURNS)));
        }
        self.check_orbits(refuse)?;
        let burn = self.propellant / self.engine().mass_flow();
        if burn < SHORTEST_BURN_S {
            return Err(refuse(format!(
                "`thrust_n` is {:e}, it burns the propellant (`propellant_kg` = {}) in {burn:.3e} s; this must be at least {SHORTEST_BURN_S} s: \
                 reduce the thrust",
                self.engine().thrust,
                self.propellant
            )));
        }
        if self.max_restarts + 1 < self.burns() {
            return Err(refuse(format!(
                "`max_restarts` is {}, but {} burns (`burns`) take {}",
                self.max_restarts,
                self.burns(),
                self.burns() - 1
            )));
        }
        self.check_propellant(refuse)
    }

    /// Number of burns.
    #[must_use]
    pub fn burns(&self) -> usize {
        self.pattern.len()
    }

    /// Returns true if the flight leaves the equatorial plane.
    #[must_use]
    pub fn is_spatial(&self) -> bool {
        self.inclination > 0.0
    }

    /// Returns true if the coasts are phases of the problem that is solved; else they follow in closed form.
    pub(super) fn has_coast_phases(&self) -> bool {
        self.flight.j2 != 0.0
    }

    /// Returns true if the flight ends with burns that lower the apogee.
    #[must_use]
    pub fn is_supersynchronous(&self) -> bool {
        self.burns() > 1 && !self.starts_at_apogee() && self.pattern.last() == Some(&Apsis::Periapsis)
    }

    /// Returns true if the first burn is at the apogee of an elliptic parking orbit.
    pub(super) fn starts_at_apogee(&self) -> bool {
        self.parking_eccentricity > 0.0 && self.pattern.first() == Some(&Apsis::Apoapsis)
    }

    /// Perigee and apogee radius of the parking orbit, m.
    #[must_use]
    pub fn parking_apses(&self) -> [f64; 2] {
        let e = self.parking_eccentricity;
        [self.parking_radius, self.parking_radius * (1.0 + e) / (1.0 - e)]
    }

    /// Semi-latus rectum of the parking orbit, m.
    pub(super) fn parking_latus_rectum(&self) -> f64 {
        self.parking_radius * (1.0 + self.parking_eccentricity)
    }

    pub(super) fn mu(&self) -> f64 {
        self.flight.body.gravitational_parameter
    }

    pub(super) fn engine(&self) -> Engine {
        self.flight.engine
    }

    /// Mass without propellant, kg.
    #[must_use]
    pub fn dry_mass(&self) -> f64 {
        self.initial_mass - self.propellant
    }

    /// Perigee and apogee radius of the target, m.
    #[must_use]
    pub fn target_apses(&self) -> [f64; 2] {
        [1.0 - self.target_eccentricity, 1.0 + self.target_eccentricity]
            .map(|k| self.target_semi_major_axis * k)
    }

    /// The transfer by impulses between the same orbits, with the least sum: a bound on the velocity change of any flight.
    ///
    /// # Errors
    /// When the orbits are none, or a supersynchronous flight has no `apogee_limit`.
    pub fn impulsive_transfer(&self) -> Result<ImpulsiveTransfer, Error> {
        let transfer_apoapsis = match (self.is_supersynchronous(), self.apogee_limit) {
            (false, _) => None,
            (true, Some(limit)) => Some(limit),
            (true, None) => return Err(self.without_apogee_limit(&|reason| Error::in_mission(reason))),
        };
        let orbits = TransferOrbits {
            parking_apses: self.parking_apses(),
            first: if self.starts_at_apogee() { Apsis::Apoapsis } else { Apsis::Periapsis },
            inclination: self.inclination,
            target_apses: self.target_apses(),
            transfer_apoapsis,
        };
        ImpulsiveTransfer::least(&self.flight.body, &orbits).map_err(Error::model)
    }

    fn without_apogee_limit(&self, refuse: Refuse<'_>) -> Error {
        let [_, apogee] = self.target_apses();
        refuse(format!(
            "`pattern` ends with a retro burn at perigee, so that the flight passes above the target: give an \
             `apogee_cap_km` above {} km that is not inf",
            apogee / 1e3
        ))
    }

    fn check_orbits(&self, refuse: Refuse<'_>) -> Result<(), Error> {
        let km = |m: f64| m / 1e3;
        let radius = self.flight.body.radius;
        let [perigee, apogee] = self.target_apses();
        if perigee <= radius {
            return Err(refuse(format!(
                "the perigee of the target is {} km from the centre (`target_radius_km` = {}, `target_eccentricity` = {}), it \
                 must be above the surface (`body_radius_km` = {})",
                km(perigee),
                km(self.target_semi_major_axis),
                self.target_eccentricity,
                km(radius)
            )));
        }
        if perigee <= self.parking_radius {
            return Err(refuse(format!(
                "the perigee of the target is {} km from the centre (`target_radius_km` = {}, `target_eccentricity` = {}), it \
                 must be above the parking orbit, {} km from the centre (`parking_altitude_km`)",
                km(perigee),
                km(self.target_semi_major_axis),
                self.target_eccentricity,
                km(self.parking_radius)
            )));
        }
        if let Some(limit) = self.apogee_limit.filter(|limit| *limit < apogee) {
            return Err(refuse(format!(
                "`apogee_cap_km` is {}, it must not be below the apogee of the target, {} km",
                km(limit),
                km(apogee)
            )));
        }
        if self.is_supersynchronous() && self.apogee_limit.is_none_or(|limit| limit <= apogee) {
            return Err(self.without_apogee_limit(refuse));
        }
        if self.is_spatial() && self.steering == BurnSteering::Velocity {
            return Err(refuse(format!(
                "`steering` is \"velocity\", which cannot change the plane: set `inclination_deg` = 0 instead of {} or \
                 another steering",
                self.inclination.to_degrees()
            )));
        }
        Ok(())
    }

    /// Refuses propellant and times that not even impulses would do with.
    fn check_propellant(&self, refuse: Refuse<'_>) -> Result<(), Error> {
        let dry = self.dry_mass();
        if dry <= 0.0 {
            return Err(refuse(format!(
                "`propellant_kg` is {}, it must be below `initial_mass_kg` = {}",
                self.propellant, self.initial_mass
            )));
        }
        let needed = self.impulsive_transfer()?.velocity_change();
        let burnt = self.initial_mass - self.engine().mass_after(self.initial_mass, needed);
        let available = self.engine().velocity_change(self.initial_mass, dry);
        if burnt > self.propellant {
            return Err(refuse(format!(
                "`propellant_kg` is {}, too little even for impulses: these take {burnt:.1} kg ({needed:.1} m/s), {:.1} kg \
                 and {:.1} m/s are missing",
                self.propellant,
                burnt - self.propellant,
                needed - available
            )));
        }
        let time = burnt / self.engine().mass_flow();
        if let Some(limit) = self.burn_time_limit.filter(|limit| limit * (self.burns() as f64) < time) {
            return Err(refuse(format!(
                "`max_burn_time_s` is {limit}, but already without losses {} burns (`burns`) last {time:.1} s together",
                self.burns()
            )));
        }
        if let Some(limit) = self.flight_time_limit.filter(|limit| *limit < time) {
            return Err(refuse(format!(
                "`max_flight_time_s` is {limit}, but already without losses the burns alone last {time:.1} s"
            )));
        }
        Ok(())
    }
}

/// One apsis per burn.
fn pattern(burns: usize, letters: &str, elliptic: bool, refuse: Refuse<'_>) -> Result<Vec<Apsis>, Error> {
    if letters.is_empty() {
        let mut pattern = vec![Apsis::Periapsis; burns];
        if let Some(last) = pattern.last_mut() {
            *last = Apsis::Apoapsis;
        }
        return Ok(pattern);
    }
    let refused = |why: &str| Err(refuse(format!("`{}` is \"{letters}\", {why}", keys::PATTERN)));
    let apses: Option<Vec<Apsis>> = letters
        .chars()
        .map(|c| match c {
            'P' => Some(Apsis::Periapsis),
            'A' => Some(Apsis::Apoapsis),
            _ => None,
        })
        .collect();
    let Some(apses) = apses else { return refused("its letters must be P and A") };
    if apses.len() != burns {
        return refused(&format!("which has {} letters for `{}` = {burns}", apses.len(), keys::BURNS));
    }
    let groups = apses.chunk_by(|a, b| a == b).count();
    let starts_at_apogee = apses.first() == Some(&Apsis::Apoapsis);
    if starts_at_apogee && elliptic {
        if groups > 2 {
            return refused("it must be A.., then P.. if there are any");
        }
    } else if burns > 1 && (starts_at_apogee || !(2..=3).contains(&groups)) {
        return refused("it must be P.., then A.., then P.. for retro burns if there are any");
    }
    Ok(apses)
}
