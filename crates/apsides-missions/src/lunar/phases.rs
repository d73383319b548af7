//! The phases of a landing: bounds, scales by bounds, largest misses.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::Quantity;
use apsides_dynamics::planar::{
    Coasting, ConstantThrust, HORIZONTAL_SPEED, MASS, PITCH_RATE, POLAR_ANGLE, PitchRate, PlanarFlight,
    RADIAL_SPEED, RADIUS, THROTTLE, THRUST_ANGLE, ThrottledThrust, ThrottledVerticalThrust, VerticalThrust,
};
use apsides_ocp::{Bounds, Direction, Phase, State, Variable};

use super::ignition::Ignition;
use super::lander::{LunarLander, Throttle};

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

/// Above all speeds, as a part of that of an orbit along the surface: no closed orbit is faster anywhere than the escape from there, `sqrt(2)`
/// of it.
const FAST: f64 = 1.5;

/// The angle of a burn at most, as a part of the one that is flown at the speed of its start.
const BURN_ANGLE: f64 = 1.2;

/// The end of a flight above the surface.
#[derive(Clone, Copy)]
pub(super) struct Target {
    /// Distance from the centre of the body, m.
    pub(super) radius: f64,
    /// Radial speed, m/s; none where it is free.
    pub(super) radial_speed: Option<f64>,
}

impl LunarLander {
    /// The equations of motion of powered flight.
    fn model(&self, name: &str) -> Phase {
        match (self.throttles(), self.pitches()) {
            (false, false) => Phase::new(name, ConstantThrust(self.flight)),
            (true, false) => Phase::new(name, ThrottledThrust(self.flight)),
            (false, true) => Phase::new(name, PitchRate(ConstantThrust(self.flight))),
            (true, true) => Phase::new(name, PitchRate(ThrottledThrust(self.flight))),
        }
    }
}

impl Ignition {
    /// The surface, at the radial speed of a touchdown.
    pub(super) fn touchdown(&self) -> Target {
        Target { radius: self.body_radius(), radial_speed: Some(self.lander.touchdown_radial_speed) }
    }

    /// States of planar flight between the surface and above the orbit. Angle and mass begin away from bounds that they cannot
    /// cross: a barrier there would disturb the costates of a coast.
    fn states(&self, longest_angle: f64) -> [State; 5] {
        let ceiling = self.radius + 100e3;
        let fast = FAST * self.horizontal_speed.max(self.surface_circular_speed());
        [
            state(RADIUS, POSITION_MISS_M).within(self.body_radius(), ceiling).guarded_above(),
            state(POLAR_ANGLE, POSITION_MISS_M / self.body_radius())
                .within(-0.1 * longest_angle, longest_angle)
                .guarded(),
            state(HORIZONTAL_SPEED, SPEED_MISS_M_S).within(-0.1 * fast, fast).guarded(),
            state(RADIAL_SPEED, SPEED_MISS_M_S).within(-fast, fast).guarded(),
            state(MASS, MASS_MISS_KG).within(self.lander.dry_mass, 1.1 * self.mass).guarded_above(),
        ]
    }

    /// A phase that begins where and when the mission does.
    fn first(&self, mut phase: Phase) -> Phase {
        // In the order of the states of planar flight.
        let begin = [self.radius, 0.0, self.horizontal_speed, 0.0, self.mass];
        for (s, value) in phase.states.iter_mut().zip(begin) {
            s.initial = Bounds::fixed(value);
        }
        phase.initial_time(Bounds::fixed(0.0))
    }

    /// Flight with the engine on, or throttled, from anywhere to anywhere.
    fn powered(&self, name: &str, longest_angle: f64) -> Phase {
        let lander = &self.lander;
        let mut states = self.states(longest_angle).to_vec();
        let angle = control(THRUST_ANGLE).within(-0.5 * PI, 1.5 * PI).guarded();
        let mut controls = Vec::new();
        if let Some(rate) = lander.max_pitch_rate {
            let Bounds { lower, upper } = angle.bounds;
            states.push(state(THRUST_ANGLE, ANGLE_MISS_RAD).within(lower, upper).guarded());
            controls.push(control(PITCH_RATE).within(-rate, rate));
        } else {
            controls.push(angle);
        }
        if lander.throttles() {
            controls.push(control(THROTTLE).within(0.0, 1.0));
        }
        let phase = lander.model(name).states(states).controls(controls);
        if lander.pitches() { phase } else { phase.direction(Direction::InPlane { angle: 0 }) }
    }

    /// Speed of a circular orbit along the surface, m/s.
    fn surface_circular_speed(&self) -> f64 {
        let body = self.lander.flight.body;
        (body.gravitational_parameter / body.radius).sqrt()
    }

    /// Above the end of any flight of less than a revolution, s.
    fn longest_flight(&self) -> f64 {
        self.longest_burn() + if self.lander.saves_propellant() { self.longest_coast() } else { 0.0 }
    }

    /// Above the polar angle of any burn, rad, and of a coast of half a revolution before it where the flight has one.
    pub(super) fn longest_angle(&self, with_coast: bool) -> f64 {
        // Down from a high orbit the angle grows as fast as on an orbit along the surface.
        let rate =
            (self.horizontal_speed / self.radius).max(self.surface_circular_speed() / self.body_radius());
        let burn = BURN_ANGLE * rate * self.longest_burn();
        if with_coast { TAU.max(PI + burn) } else { PI.max(burn) }
    }

    /// The flight from the start to the target: a coast if the ignition is free, braking, and turning upright where that is a phase
    /// of its own.
    pub(super) fn landing(&self, target: Target) -> Vec<Phase> {
        let angle = self.longest_angle(self.lander.saves_propellant());
        let longest = self.longest_flight();
        if self.lander.throttle == Throttle::Coast {
            let times = Bounds::new(0.0, longest);
            let coast = self.first(self.coast(times));
            return [coast].into_iter().chain(self.braking(target, angle, times)).collect();
        }
        let mut phases = self.braking(target, angle, Bounds::new(1.0, longest));
        phases[0] = self.first(phases[0].clone());
        phases
    }

    /// From anywhere to the target: braking, and turning upright where that is a phase of its own.
    pub(super) fn braking(&self, target: Target, longest_angle: f64, times: Bounds) -> Vec<Phase> {
        let phase = |name: &str| self.powered(name, longest_angle).initial_time(times).final_time(times);
        let mut braking = phase(BRAKING);
        let Some(rate) = self.lander.turn_rate() else {
            return vec![self.last(braking, target)];
        };
        let pitching = |mut phase: Phase, bounds: Bounds| {
            for u in phase.controls.iter_mut().filter(|u| u.name == PITCH_RATE.name) {
                u.bounds = bounds;
            }
            phase
        };
        // Steering before the turn is slow. With the rate of the turn a polynomial could jump at the end of its phase, where
        // no point sees it.
        let slow = rate.min(STEERING_TURNS * TAU / self.expected_time());
        braking = pitching(braking, Bounds::new(-slow, slow));
        let turn = pitching(phase(PITCH_UP), Bounds::fixed(-rate));
        vec![braking, self.last(turn, target)]
    }

    /// A phase that ends at the target.
    fn last(&self, mut phase: Phase, target: Target) -> Phase {
        let ends = [
            (RADIUS, Some(target.radius)),
            (HORIZONTAL_SPEED, Some(0.0)),
            (RADIAL_SPEED, target.radial_speed),
            (THRUST_ANGLE, self.lander.is_upright().then_some(FRAC_PI_2)),
        ];
        for (quantity, value) in ends {
            for s in phase.states.iter_mut().filter(|s| s.variable.name == quantity.name) {
                s.terminal = value.map_or(s.terminal, Bounds::fixed);
            }
        }
        phase
    }

    /// Full thrust that leaves the orbit.
    pub(super) fn deorbit(&self, times: Bounds) -> Phase {
        let full = Self { lander: self.lander.at_full_thrust(), ..*self };
        self.first(full.powered(DEORBIT, self.longest_angle(true))).final_time(times)
    }

    /// Flight without thrust.
    pub(super) fn coast(&self, times: Bounds) -> Phase {
        let phase =
            Phase::new(COAST, Coasting(self.lander.flight)).states(self.states(self.longest_angle(true)));
        phase.initial_time(times).final_time(times)
    }

    /// Vertical flight down to the surface from an altitude (m).
    pub(super) fn descent(&self, altitude: f64) -> Phase {
        // What full thrust on the least mass stops within this altitude without gravity is above all that it does stop.
        let most = (2.0 * self.lander.flight.engine.thrust / self.lander.dry_mass * altitude).sqrt();
        let fast = (0.5 * self.horizontal_speed).max(most - self.lander.touchdown_radial_speed);
        let times = Bounds::new(1.0, self.longest_flight());
        let surface = self.body_radius();
        let phase = if self.lander.throttles() {
            Phase::new(DESCENT, ThrottledVerticalThrust(self.lander.flight))
                .controls([control(THROTTLE).within(0.0, 1.0)])
        } else {
            Phase::new(DESCENT, VerticalThrust(self.lander.flight))
        };
        phase
            .states([
                state(RADIUS, POSITION_MISS_M).within(surface, self.radius).guarded_above().ends_at(surface),
                state(RADIAL_SPEED, SPEED_MISS_M_S)
                    .within(-fast, 0.0)
                    .guarded()
                    .ends_at(self.lander.touchdown_radial_speed),
                state(MASS, MASS_MISS_KG).within(self.lander.dry_mass, self.mass).guarded_above(),
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
    fn evaluate<S: Scalar>(&self, &[radius, horizontal_speed, radial_speed]: &[S; 3]) -> [S; 1] {
        [self.0.periapsis_radius(radius, horizontal_speed, radial_speed) - self.0.body.radius]
    }
}
