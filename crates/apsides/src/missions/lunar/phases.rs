//! The phases of a landing: bounds, scales by bounds, largest misses.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::Quantity;
use apsides_dynamics::planar::{
    Coasting, ConstantThrust, HORIZONTAL_SPEED, MASS, PITCH_RATE, POLAR_ANGLE, PitchRate, PlanarFlight,
    RADIAL_SPEED, RADIUS, THROTTLE, THRUST_ANGLE, ThrottledThrust, ThrottledVerticalThrust, VerticalThrust,
};
use apsides_ocp::{Bounds, Direction, Phase, State, Variable};

use super::keys;
use super::vehicle::Start;
use crate::key::Values;

/// Largest miss of a re-simulation, from the precision wanted of a landing.
const POSITION_MISS_M: f64 = 1e-3;
const SPEED_MISS_M_S: f64 = 1e-6;
const MASS_MISS_KG: f64 = 1e-6;
const ANGLE_MISS_RAD: f64 = 1e-8;

/// Full turns in the expected time of the braking that the thrust may make before it turns upright: about a hundred times what
/// optimal steering takes.
const STEERING_TURNS: f64 = 10.0;

/// Names of phases.
pub(super) const DEORBIT: &str = "deorbit";
pub(super) const COAST: &str = "coast";
pub(super) const BRAKING: &str = "braking";
pub(super) const PITCH_UP: &str = "pitch-up";
pub(super) const DESCENT: &str = "descent";

/// What is known of the size of the thrust.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Throttle {
    /// Full all the time.
    Full,
    /// None up to an ignition, full from there on.
    Coast,
    /// Between none and full at any time: a control.
    Free,
}

/// What may be done with the engine.
#[derive(Clone, Copy)]
pub(super) struct Steering {
    /// Size of the thrust.
    pub(super) throttle: Throttle,
    /// Largest rate of the thrust angle, rad/s; infinite: the angle may jump.
    pub(super) pitch_rate: f64,
    /// Whether the thrust is vertical at the end.
    pub(super) upright: bool,
}

impl Steering {
    /// Full thrust in any direction at any time.
    pub(super) const FULL: Self =
        Self { throttle: Throttle::Full, pitch_rate: f64::INFINITY, upright: false };

    /// From the keys; those that a mission does not have are free.
    pub(super) fn of(v: &Values) -> Result<Self, String> {
        let limit = v.number(keys::PITCH_RATE[0].path);
        let steering = Self {
            throttle: match v.word(keys::THROTTLE_PATH) {
                keys::FREE => Throttle::Free,
                keys::COAST => Throttle::Coast,
                _ => Throttle::Full,
            },
            pitch_rate: limit.to_radians(),
            upright: v.word(keys::TOUCHDOWN[0].path) == keys::VERTICAL,
        };
        if steering.upright && limit.is_infinite() {
            return Err(
                "`touchdown_thrust` is \"vertical\", but `max_pitch_rate_deg_s` is inf: a jump at the last \
                        instant costs nothing; give a rate above 0, for instance 5"
                    .into(),
            );
        }
        Ok(steering)
    }

    /// Whether the throttle is a control.
    pub(super) fn throttles(&self) -> bool {
        self.throttle == Throttle::Free
    }

    /// Whether propellant is saved rather than time.
    pub(super) fn saves_propellant(&self) -> bool {
        self.throttle != Throttle::Full
    }

    /// Whether radius and polar angle are flat outputs: full thrust in a direction that may jump.
    pub(super) fn is_flat(&self) -> bool {
        self.throttle == Throttle::Full && !self.pitches()
    }

    /// Whether the flight ends with a phase that turns the thrust upright at the largest rate. With a free throttle it is not
    /// known beforehand how the vehicle turns.
    pub(super) fn turns_in_a_phase(&self) -> bool {
        self.upright && !self.throttles()
    }

    /// Whether the thrust angle is a state.
    pub(super) fn pitches(&self) -> bool {
        self.pitch_rate.is_finite()
    }

    fn model(&self, name: &str, flight: PlanarFlight) -> Phase {
        match (self.throttles(), self.pitches()) {
            (false, false) => Phase::new(name, ConstantThrust(flight)),
            (true, false) => Phase::new(name, ThrottledThrust(flight)),
            (false, true) => Phase::new(name, PitchRate(ConstantThrust(flight))),
            (true, true) => Phase::new(name, PitchRate(ThrottledThrust(flight))),
        }
    }
}

/// Where a flight above the surface ends.
#[derive(Clone, Copy)]
pub(super) struct Target {
    pub(super) radius: f64,
    /// Radial speed, if it is given.
    pub(super) radial_speed: Option<f64>,
}

impl Start {
    pub(super) fn touchdown(&self) -> Target {
        Target { radius: self.body_radius(), radial_speed: Some(self.touchdown_speed) }
    }

    /// States of planar flight between the surface and above the orbit. Angle and mass begin away from bounds that they cannot
    /// cross: a barrier there would disturb the costates of a coast.
    fn states(&self, longest_angle: f64) -> [State; 5] {
        let ceiling = self.radius + 100e3;
        let fast = 1.5 * self.horizontal_speed;
        [
            state(RADIUS, POSITION_MISS_M).within(self.body_radius(), ceiling),
            state(POLAR_ANGLE, POSITION_MISS_M / self.body_radius())
                .within(-0.1 * longest_angle, longest_angle),
            state(HORIZONTAL_SPEED, SPEED_MISS_M_S).within(-0.1 * fast, fast),
            state(RADIAL_SPEED, SPEED_MISS_M_S).within(-fast, fast),
            state(MASS, MASS_MISS_KG).within(self.dry_mass, 1.1 * self.mass),
        ]
    }

    /// A phase that begins where and when the mission does.
    fn first(&self, phase: Phase) -> Phase {
        let begin = [self.radius, 0.0, self.horizontal_speed, 0.0, self.mass];
        let mut phase = phase;
        for (s, value) in phase.states.iter_mut().zip(begin) {
            s.initial = Bounds::fixed(value);
        }
        phase.initial_time(Bounds::fixed(0.0))
    }

    /// Flight with the engine on, or throttled, from anywhere to anywhere.
    fn powered(&self, name: &str, steering: &Steering, longest_angle: f64) -> Phase {
        let mut states = self.states(longest_angle).to_vec();
        let angle = control(THRUST_ANGLE).within(-0.5 * PI, 1.5 * PI);
        let mut controls = Vec::new();
        if steering.pitches() {
            let Bounds { lower, upper } = angle.bounds;
            states.push(state(THRUST_ANGLE, ANGLE_MISS_RAD).within(lower, upper));
            controls.push(control(PITCH_RATE).within(-steering.pitch_rate, steering.pitch_rate));
        } else {
            controls.push(angle);
        }
        if steering.throttles() {
            controls.push(control(THROTTLE).within(0.0, 1.0));
        }
        let phase = steering.model(name, self.flight).states(states).controls(controls);
        if steering.pitches() { phase } else { phase.direction(Direction::InPlane { angle: 0 }) }
    }

    /// Above the end of any flight of less than a revolution, s.
    fn longest_flight(&self, steering: &Steering) -> f64 {
        self.longest_burn() + if steering.saves_propellant() { self.longest_coast() } else { 0.0 }
    }

    /// The flight from the start to the target: a coast if the ignition is free, braking, and turning upright where that is a phase
    /// of its own.
    pub(super) fn landing(&self, steering: &Steering, target: Target) -> Vec<Phase> {
        let angle = if steering.saves_propellant() { TAU } else { PI };
        let longest = self.longest_flight(steering);
        let mut phases = Vec::new();
        let mut earliest = 1.0;
        if steering.throttle == Throttle::Coast {
            earliest = 0.0;
            phases.push(self.coast(Bounds::new(earliest, longest)));
        }
        phases.extend(self.braking(steering, target, angle, Bounds::new(earliest, longest)));
        phases[0] = self.first(phases[0].clone());
        phases
    }

    /// From anywhere to the target.
    pub(super) fn braking(
        &self,
        steering: &Steering,
        target: Target,
        longest_angle: f64,
        times: Bounds,
    ) -> Vec<Phase> {
        let phase =
            |name: &str| self.powered(name, steering, longest_angle).initial_time(times).final_time(times);
        let mut phases = vec![phase(BRAKING)];
        if steering.turns_in_a_phase() {
            // Steering before the turn is slow. With the rate of the turn a polynomial could jump at the end of its phase, where
            // no point sees it.
            let slow = steering.pitch_rate.min(STEERING_TURNS * TAU / self.expected_time());
            phases[0].controls[0].bounds = Bounds::new(-slow, slow);
            let mut turn = phase(PITCH_UP);
            turn.controls[0] = control(PITCH_RATE).equal_to(-steering.pitch_rate);
            phases.push(turn);
        }
        let last = phases.len() - 1;
        let ends = &mut phases[last].states;
        ends[0].terminal = Bounds::fixed(target.radius);
        ends[2].terminal = Bounds::fixed(0.0);
        if let Some(v) = target.radial_speed {
            ends[3].terminal = Bounds::fixed(v);
        }
        if steering.upright {
            ends[5].terminal = Bounds::fixed(FRAC_PI_2);
        }
        phases
    }

    /// Full thrust that leaves the orbit.
    pub(super) fn deorbit(&self, times: Bounds) -> Phase {
        self.first(self.powered(DEORBIT, &Steering::FULL, TAU)).final_time(times)
    }

    /// Flight without thrust.
    pub(super) fn coast(&self, times: Bounds) -> Phase {
        let phase = Phase::new(COAST, Coasting(self.flight)).states(self.states(TAU));
        phase.initial_time(times).final_time(times)
    }

    /// Vertical flight down to the surface.
    pub(super) fn descent(&self, steering: &Steering) -> Phase {
        let times = Bounds::new(1.0, self.longest_flight(steering));
        let surface = self.body_radius();
        let phase = if steering.throttles() {
            Phase::new(DESCENT, ThrottledVerticalThrust(self.flight))
                .controls([control(THROTTLE).within(0.0, 1.0)])
        } else {
            Phase::new(DESCENT, VerticalThrust(self.flight))
        };
        phase
            .states([
                state(RADIUS, POSITION_MISS_M).within(surface, self.radius).ends_at(surface),
                state(RADIAL_SPEED, SPEED_MISS_M_S)
                    .within(-0.5 * self.horizontal_speed, 0.0)
                    .ends_at(self.touchdown_speed),
                state(MASS, MASS_MISS_KG).within(self.dry_mass, self.mass),
            ])
            .initial_time(times)
            .final_time(times)
    }
}

fn state(q: Quantity, miss: f64) -> State {
    State::new(q.name, q.unit).miss_below(miss)
}

fn control(q: Quantity) -> Variable {
    Variable::new(q.name, q.unit)
}

/// Altitude (m) of the lowest point of the orbit through `[radius, horizontal speed, radial speed]`.
pub(super) struct PeriluneAltitude(pub(super) PlanarFlight);

impl VectorFunction<3, 1> for PeriluneAltitude {
    fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 1] {
        [self.0.periapsis_radius(z[0], z[1], z[2]) - self.0.body.radius]
    }
}
