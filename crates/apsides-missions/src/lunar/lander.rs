//! The common part of all lunar missions: the vehicle, its parking orbit, and what may be done with the engine.

use apsides_dynamics::Engine;
use apsides_dynamics::planar::{HORIZONTAL_SPEED, MASS, PlanarFlight, RADIAL_SPEED, STATES};
use apsides_ocp::Trajectory;
use apsides_pipeline::Error;
use apsides_pipeline::values::Values;
use apsides_radau::{Explanation, rounded_up};

use super::keys;
use crate::Refuse;
use crate::data::central_body;

/// The size of the thrust along a landing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Throttle {
    /// It is full all the time, and the flight time is least.
    Full,
    /// It is zero up to an ignition and full from there on; the final mass is largest.
    Coast,
    /// It is a control between zero and full; the final mass is largest.
    Free,
}

impl Throttle {
    pub(super) fn read(values: &Values) -> Result<Self, Error> {
        Ok(match values.word(keys::THROTTLE_PATH)? {
            keys::FREE => Self::Free,
            keys::COAST => Self::Coast,
            // The key takes no other words.
            _ => Self::Full,
        })
    }
}

/// The quantity that is optimised where the thrust is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// Least flight time.
    FlightTime,
    /// Largest final mass: the same optimum, since the mass flow is constant.
    FinalMass,
}

impl Objective {
    pub(super) fn read(values: &Values) -> Result<Self, Error> {
        Ok(match values.word(keys::OBJECTIVE)? {
            keys::FINAL_MASS => Self::FinalMass,
            // The key takes no other words.
            _ => Self::FlightTime,
        })
    }
}

/// Direction of the thrust at touchdown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchdownThrust {
    /// It is free.
    Free,
    /// It is vertical, up.
    Vertical,
}

impl TouchdownThrust {
    pub(super) fn read(values: &Values) -> Result<Self, Error> {
        Ok(match values.word(keys::TOUCHDOWN_THRUST)? {
            keys::VERTICAL => Self::Vertical,
            // The key takes no other words.
            _ => Self::Free,
        })
    }
}

/// A lander in a circular parking orbit, and how it may fly down; planar, around a body that does not rotate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LunarLander {
    /// Central body and engine.
    pub flight: PlanarFlight,
    /// Mass in the parking orbit, kg.
    pub initial_mass: f64,
    /// Mass without propellant, kg.
    pub dry_mass: f64,
    /// Altitude of the circular parking orbit above the surface, m.
    pub orbit_altitude: f64,
    /// Radial speed at touchdown, positive up, m/s.
    pub touchdown_radial_speed: f64,
    /// The size of the thrust. A [`LunarTransfer`](super::LunarTransfer) coasts in a phase of its own and has full thrust otherwise.
    pub throttle: Throttle,
    /// The quantity that is optimised where the thrust is full.
    pub objective: Objective,
    /// Largest rate of the thrust angle, rad/s; with none the angle may jump.
    pub max_pitch_rate: Option<f64>,
    /// Direction of the thrust at touchdown; vertical only with a `max_pitch_rate`. A [`TwoPhaseLanding`](super::TwoPhaseLanding) ends
    /// vertically in any case.
    pub touchdown_thrust: TouchdownThrust,
}

/// Part of the weight at ignition up to which a lander needs to burn propellant before it can brake.
const LITTLE_THRUST: f64 = 0.4;

/// Significant digits of a thrust that would do: that the ratio at the end is the same for all is true to as many.
const DIGITS_OF_THRUST: i32 = 3;

/// Times of a flight at which its costates are looked at.
const LOOKS: u32 = 200;
/// Size of the costates of the speeds, by their largest one, below which the direction of the thrust has no effect.
const NO_EFFECT: f64 = 1e-4;
/// Part of a flight from which that is worth saying.
const LEAST_PART: f64 = 0.1;

impl LunarLander {
    /// With little thrust the mass at the end is what matters: how the lander brakes follows from the thrust by the mass, and all that comes
    /// before burns propellant until the thrust is enough for it. What a smaller dry mass would mend, so much more thrust would, too.
    pub(super) fn missing_thrust(&self, explanation: &Explanation) -> Option<String> {
        let engine = self.flight.engine;
        let gravity = self.flight.body.surface_gravity();
        if self.throttle != Throttle::Full || engine.thrust > LITTLE_THRUST * self.initial_mass * gravity {
            return None;
        }
        let of_mass = explanation.remedies.iter().find(|r| r.requirement.name == MASS.name)?;
        let dry_mass = Some(of_mass.to).filter(|m| (0.0..self.dry_mass).contains(m))?;
        let thrust = engine.thrust * self.dry_mass / dry_mass;
        Some(format!(
            "with `dry_mass_kg` as it is, `thrust_n` has to be about {}: the braking ends with {:.3} m/s2 of thrust by mass, and the \
             engine burns all the time",
            rounded_up(thrust, DIGITS_OF_THRUST),
            engine.thrust / dry_mass
        ))
    }

    /// With little thrust the direction of the thrust may matter for the last part of the flight alone: the engine has to burn until the
    /// mass is small enough to land on it, and all flights that keep clear of the ground until then are equally good.
    pub(super) fn without_direction(&self, solution: &Trajectory) -> Option<String> {
        let phase = solution.phases.last()?;
        let costates = phase.costate.as_ref()?;
        let speeds = [HORIZONTAL_SPEED, RADIAL_SPEED].map(|q| STATES.iter().position(|s| s.name == q.name));
        let [Some(u), Some(w)] = speeds else { return None };
        let mut at = vec![0.0; costates.dimension()];
        let sizes: Vec<f64> = (0..=LOOKS)
            .map(|k| {
                costates.evaluate(phase.time_at(f64::from(k) / f64::from(LOOKS)), &mut at);
                at.get(u).zip(at.get(w)).map_or(f64::NAN, |(u, w)| u.hypot(*w))
            })
            .collect();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let without = sizes.iter().take_while(|size| **size < NO_EFFECT * largest).count();
        let part = without as f64 / f64::from(LOOKS);
        if part < LEAST_PART {
            return None;
        }
        Some(format!(
            "until t = {:.0} s the direction of the thrust has no effect on the objective: the engine burns until the mass is small enough to \
             land, so that many flights are equally good and none is found to the tolerance; raise `thrust_n` ({} N now), or accept a flight \
             that is feasible alone, by `--method multiple-shooting`",
            phase.time_at(part.min(1.0)),
            self.flight.engine.thrust
        ))
    }

    /// The keys that all lunar missions have; full thrust, whose direction at touchdown is free.
    pub(super) fn read(values: &Values) -> Result<Self, Error> {
        let body = central_body(values)?;
        let exhaust_velocity = values.number("isp_s")? * values.number("standard_gravity_m_s2")?;
        let engine = Engine::with_exhaust_velocity(values.number("thrust_n")?, exhaust_velocity)
            .map_err(values.refusal(&["isp_s", "standard_gravity_m_s2", "thrust_n"]))?;
        Ok(Self {
            flight: PlanarFlight::new(body, engine),
            initial_mass: values.number("initial_mass_kg")?,
            dry_mass: values.number("dry_mass_kg")?,
            orbit_altitude: values.number("orbit_altitude_km")? * 1e3,
            touchdown_radial_speed: values.number("touchdown_radial_velocity_m_s")?,
            throttle: Throttle::Full,
            objective: Objective::FlightTime,
            max_pitch_rate: values.limit(keys::MAX_PITCH_RATE)?.map(f64::to_radians),
            touchdown_thrust: TouchdownThrust::Free,
        })
    }

    /// Refuses a direction of the thrust at touchdown that costs nothing.
    pub(super) fn check_steering(&self, refuse: Refuse<'_>) -> Result<(), Error> {
        if self.is_upright() && !self.pitches() {
            return Err(refuse(
                "`touchdown_thrust` is \"vertical\", but `max_pitch_rate_deg_s` is inf: a jump at the last \
                 instant costs nothing; give a rate above 0, for instance 5"
                    .into(),
            ));
        }
        Ok(())
    }

    /// The same with full thrust in any direction at any time.
    pub(super) fn at_full_thrust(self) -> Self {
        Self {
            throttle: Throttle::Full,
            max_pitch_rate: None,
            touchdown_thrust: TouchdownThrust::Free,
            ..self
        }
    }

    /// The same whose thrust is upright at the end where its direction is a state.
    pub(super) fn upright_where_it_pitches(self) -> Self {
        let touchdown_thrust = if self.pitches() { TouchdownThrust::Vertical } else { TouchdownThrust::Free };
        Self { touchdown_thrust, ..self }
    }

    /// Returns true if the throttle is a control.
    pub(super) fn throttles(&self) -> bool {
        self.throttle == Throttle::Free
    }

    /// Returns true if propellant is saved rather than time.
    pub(super) fn saves_propellant(&self) -> bool {
        self.throttle != Throttle::Full
    }

    /// Returns true if the thrust angle is a state.
    pub(super) fn pitches(&self) -> bool {
        self.max_pitch_rate.is_some()
    }

    /// Returns true if the thrust is vertical at touchdown.
    pub(super) fn is_upright(&self) -> bool {
        self.touchdown_thrust == TouchdownThrust::Vertical
    }

    /// The rate of the phase that ends the flight by turning the thrust upright, rad/s, where there is one. With a free throttle it is
    /// not known beforehand how the vehicle turns.
    pub(super) fn turn_rate(&self) -> Option<f64> {
        self.max_pitch_rate.filter(|_| self.is_upright() && !self.throttles())
    }
}
