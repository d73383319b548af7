//! What the values of a mission say: vehicle, orbits, burns and limits; and what no flight can mend.

use apsides_dynamics::equinoctial::{EARTH_J2, OrbitalFlight};
use apsides_dynamics::{Body, DynamicsError, Engine};

use super::impulsive::Impulses;
use super::keys;
use crate::key::Values;

/// Where on its orbit a burn is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Apsis {
    /// The lower end.
    Perigee,
    /// The upper end.
    Apogee,
}

/// Who chooses the direction of the thrust.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Steering {
    /// The optimisation, at every instant.
    Optimal,
    /// Nobody: it is that of the velocity.
    Velocity,
    /// The optimisation, once per burn.
    InertialFixed,
}

/// Vehicle, orbits, burns, limits; SI units.
#[derive(Clone, Debug)]
pub(super) struct Injection {
    pub(super) flight: OrbitalFlight,
    pub(super) mass: f64,
    pub(super) propellant: f64,
    pub(super) parking_radius: f64,
    /// Semi-major axis and eccentricity of the target.
    pub(super) target_axis: f64,
    pub(super) target_eccentricity: f64,
    /// Of the parking orbit, rad; zero keeps the flight in one plane.
    pub(super) inclination: f64,
    pub(super) pattern: Vec<Apsis>,
    pub(super) steering: Steering,
    pub(super) longest_burn: f64,
    pub(super) longest_flight: f64,
    pub(super) apogee_cap: f64,
}

impl Injection {
    pub(super) fn of(v: &Values) -> Result<Self, String> {
        let body =
            Body::new(v.number("gravitational_parameter_km3_s2") * 1e9, v.number("earth_radius_km") * 1e3)
                .map_err(text)?;
        let (thrust, flow) = (v.number("thrust_n"), v.number("mass_flow_kg_s"));
        let engine = Engine::with_exhaust_velocity(thrust, thrust / flow).map_err(text)?;
        let injection = Self {
            flight: OrbitalFlight::new(body, engine).with_j2(if v.flag("j2") { EARTH_J2 } else { 0.0 }),
            mass: v.number("initial_mass_kg"),
            propellant: v.number("propellant_kg"),
            parking_radius: body.radius + v.number("parking_altitude_km") * 1e3,
            target_axis: v.number("target_radius_km") * 1e3,
            target_eccentricity: v.number("target_eccentricity"),
            inclination: v.number("inclination_deg").to_radians(),
            pattern: pattern(v.count(keys::BURNS), v.word(keys::PATTERN))?,
            steering: match v.word(keys::STEERING) {
                keys::VELOCITY => Steering::Velocity,
                keys::INERTIAL => Steering::InertialFixed,
                _ => Steering::Optimal,
            },
            longest_burn: v.number("max_burn_s"),
            longest_flight: v.number(keys::MAX_FLIGHT_TIME) * 3600.0,
            apogee_cap: v.number("apogee_cap_km") * 1e3,
        };
        injection.check_orbits()?;
        let restarts = v.count("max_restarts");
        if restarts + 1 < injection.burns() {
            return Err(format!(
                "`max_restarts` is {restarts}, but {} burns (`burns`) take {}",
                injection.burns(),
                injection.burns() - 1
            ));
        }
        injection.check_propellant()?;
        Ok(injection)
    }

    pub(super) fn burns(&self) -> usize {
        self.pattern.len()
    }

    /// Whether the flight leaves the equatorial plane.
    pub(super) fn is_spatial(&self) -> bool {
        self.inclination > 0.0
    }

    /// Whether the coasts are phases of the problem that is solved; else they follow in closed form.
    pub(super) fn has_coast_phases(&self) -> bool {
        self.flight.j2 != 0.0
    }

    /// Whether the flight ends with burns that lower the apogee.
    pub(super) fn is_supersynchronous(&self) -> bool {
        self.burns() > 1 && self.pattern.last() == Some(&Apsis::Perigee)
    }

    pub(super) fn mu(&self) -> f64 {
        self.flight.body.gravitational_parameter
    }

    pub(super) fn engine(&self) -> Engine {
        self.flight.engine
    }

    pub(super) fn dry_mass(&self) -> f64 {
        self.mass - self.propellant
    }

    /// Perigee and apogee radius of the target.
    pub(super) fn target_apses(&self) -> [f64; 2] {
        [1.0 - self.target_eccentricity, 1.0 + self.target_eccentricity].map(|k| self.target_axis * k)
    }

    /// Apogee radius of the transfer: that of the target, or the highest where the flight passes above it.
    pub(super) fn transfer_apogee(&self) -> f64 {
        if self.is_supersynchronous() { self.apogee_cap } else { self.target_apses()[1] }
    }

    fn check_orbits(&self) -> Result<(), String> {
        let km = |m: f64| m / 1e3;
        let radius = self.flight.body.radius;
        let [perigee, apogee] = self.target_apses();
        if perigee <= radius {
            return Err(format!(
                "the perigee of the target is {} km from the centre (`target_radius_km` = {}, `target_eccentricity` = {}), it \
                 must be above the surface (`earth_radius_km` = {})",
                km(perigee),
                km(self.target_axis),
                self.target_eccentricity,
                km(radius)
            ));
        }
        if perigee <= self.parking_radius {
            return Err(format!(
                "the perigee of the target is {} km from the centre (`target_radius_km` = {}, `target_eccentricity` = {}), it \
                 must be above the parking orbit, {} km from the centre (`parking_altitude_km`)",
                km(perigee),
                km(self.target_axis),
                self.target_eccentricity,
                km(self.parking_radius)
            ));
        }
        if self.apogee_cap < apogee {
            return Err(format!(
                "`apogee_cap_km` is {}, it must not be below the apogee of the target, {} km",
                km(self.apogee_cap),
                km(apogee)
            ));
        }
        if self.is_supersynchronous() && !(self.apogee_cap.is_finite() && self.apogee_cap > apogee) {
            return Err(format!(
                "`pattern` ends with a retro burn at perigee, so that the flight passes above the target: give an \
                 `apogee_cap_km` above {} km that is not inf",
                km(apogee)
            ));
        }
        if self.is_spatial() && self.steering == Steering::Velocity {
            return Err(format!(
                "`steering` is \"velocity\", which cannot change the plane: set `inclination_deg` = 0 instead of {} or \
                 another steering",
                self.inclination.to_degrees()
            ));
        }
        Ok(())
    }

    /// Propellant and times that not even impulses would do with.
    fn check_propellant(&self) -> Result<(), String> {
        let dry = self.dry_mass();
        if dry <= 0.0 {
            return Err(format!(
                "`propellant_kg` is {}, it must be below `initial_mass_kg` = {}",
                self.propellant, self.mass
            ));
        }
        let needed = Impulses::of(self).velocity_change();
        let burnt = self.mass - self.engine().mass_after(self.mass, needed);
        let available = self.engine().velocity_change(self.mass, dry);
        if burnt > self.propellant {
            return Err(format!(
                "`propellant_kg` is {}, too little even for impulses: these take {burnt:.1} kg ({needed:.1} m/s), {:.1} kg \
                 and {:.1} m/s are missing",
                self.propellant,
                burnt - self.propellant,
                needed - available
            ));
        }
        let time = burnt / self.engine().mass_flow();
        if self.longest_burn * (self.burns() as f64) < time {
            return Err(format!(
                "`max_burn_s` is {}, but already without losses {} burns (`burns`) last {time:.1} s together",
                self.longest_burn,
                self.burns()
            ));
        }
        if self.longest_flight < time {
            return Err(format!(
                "`max_flight_time_h` is {}, but already without losses the burns alone last {:.4} h",
                self.longest_flight / 3600.0,
                time / 3600.0
            ));
        }
        Ok(())
    }
}

/// One apsis per burn.
fn pattern(burns: usize, letters: &str) -> Result<Vec<Apsis>, String> {
    if letters.is_empty() {
        let mut pattern = vec![Apsis::Perigee; burns];
        pattern[burns - 1] = Apsis::Apogee;
        return Ok(pattern);
    }
    let refuse = |why: &str| Err(format!("`{}` is \"{letters}\", {why}", keys::PATTERN));
    let apses: Option<Vec<Apsis>> = letters
        .chars()
        .map(|c| match c {
            'P' => Some(Apsis::Perigee),
            'A' => Some(Apsis::Apogee),
            _ => None,
        })
        .collect();
    let Some(apses) = apses else { return refuse("its letters must be P and A") };
    if apses.len() != burns {
        return refuse(&format!("which has {} letters for `{}` = {burns}", apses.len(), keys::BURNS));
    }
    let groups = apses.chunk_by(|a, b| a == b).count();
    if burns > 1 && (apses[0] != Apsis::Perigee || !(2..=3).contains(&groups)) {
        return refuse("it must be P.., then A.., then P.. for retro burns if there are any");
    }
    Ok(apses)
}

fn text(e: DynamicsError) -> String {
    e.to_string()
}
