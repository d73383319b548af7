//! An adjustment by the shortest path.
//!
//! A shortest path has no optimum with a free thrust: the least one, which cannot be switched off, would be turned from side to side ever
//! faster so as not to hold up the fall. So the thrust only slows the flight along its course, and does so in one vertical plane: its course is
//! a constant of the phase, which the end of the phase determines.

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_dynamics::planar;
use apsides_dynamics::powered_descent::{self, AngledThrust};
use apsides_ocp::{Bounds, OcpError, Phase, PhaseGuess, State, Variable};

use super::guess::Sample;
use super::lander::{GateDirection, Lander, Motion};

/// Largest angle between the course of the thrust and backwards along that of the orbit, rad.
const ASIDE: f64 = PI / 3.0;

/// Shortest part of a guess, s.
const SHORTEST_PART_S: f64 = 0.5;
/// Most of the way down that a guess takes while it slows.
const MOST_OF_WAY: f64 = 0.8;
/// Part of the fall in which the thrust of a guess turns upright.
const JUMP: f64 = 1e-3;

/// Name of the path's length as an integral of the speed.
pub(super) const PATH: &str = "path length";
/// Name of the state that is the course of the thrust.
const COURSE: &str = "course of the thrust";

/// Thrust on a constant course: states of [`AngledThrust`] and the course, controls its pitch and throttle.
struct OnOneCourse(AngledThrust);

impl Dynamics<8, 2> for OnOneCourse {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 8], u: &[S; 2], p: &[S; 0]) -> [S; 8] {
        let [radius, longitude, latitude, upward, east, north, mass, course] = *x;
        let flown = [radius, longitude, latitude, upward, east, north, mass];
        let [radius, longitude, latitude, upward, east, north, mass] =
            self.0.rate(t, &flown, &[course, u[0], u[1]], p);
        [radius, longitude, latitude, upward, east, north, mass, S::from(0.0)]
    }
}

/// The speed of a flight relative to the ground.
struct Speed;

fn speed<S: Scalar>(components: &[S]) -> S {
    components.iter().fold(S::from(0.0), |sum, v| sum + v.square()).sqrt()
}

impl PathFunction<5, 2, 1> for Speed {
    /// States in the order of [`planar::STATES`].
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        let [_radius, _angle, along, upward, _mass] = *x;
        [speed(&[along, upward])]
    }
}

impl PathFunction<7, 3, 1> for Speed {
    /// States in the order of [`powered_descent::STATES`].
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 7], _u: &[S; 3], _p: &[S; 0]) -> [S; 1] {
        let [_radius, _longitude, _latitude, upward, east, north, _mass] = *x;
        [speed(&[upward, east, north])]
    }
}

impl PathFunction<8, 2, 1> for Speed {
    /// States in the order of [`OnOneCourse`].
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 8], _u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        let [_radius, _longitude, _latitude, upward, east, north, _mass, _course] = *x;
        [speed(&[upward, east, north])]
    }
}

impl Lander {
    /// True where the thrust is held to one vertical plane: in space, unless the flight begins straight down.
    fn is_held_to_a_plane(&self) -> bool {
        self.motion == Motion::Space && self.gate_direction != GateDirection::Down
    }

    /// A phase of steered flight with the length of its path as an integral, the thrust held to slowing the flight.
    pub(super) fn with_path(&self, mut phase: Phase) -> Phase {
        let length = Variable::new(PATH, "m").scaled_by(1e3);
        if self.is_held_to_a_plane() {
            let course = self.azimuth + PI;
            let states = phase.states.into_iter();
            let kept = |u: &Variable| u.name != powered_descent::THRUST_COURSE.name;
            let course = State::new(COURSE, powered_descent::THRUST_COURSE.unit)
                .within(course - ASIDE, course + ASIDE)
                .guarded();
            return Phase::new(phase.name, OnOneCourse(AngledThrust(self.descent.clone())))
                .states(states.chain([course]))
                .controls(phase.controls.into_iter().filter(kept))
                .initial_time(phase.initial_time)
                .final_time(phase.final_time)
                .duration(phase.duration)
                .integral::<_, 8, 2, 0>(length, Speed);
        }
        match self.motion {
            Motion::Plane => {
                let backwards = Bounds::new(FRAC_PI_2, 1.5 * PI);
                let angle = phase.controls.iter_mut().filter(|u| u.name == planar::THRUST_ANGLE.name);
                for u in angle.filter(|_| self.gate_direction != GateDirection::Down) {
                    u.bounds = u.bounds.intersect(&backwards);
                    u.guards = [true; 2];
                }
                phase.integral::<_, 5, 2, 0>(length, Speed)
            }
            Motion::Space => phase.integral::<_, 7, 3, 0>(length, Speed),
        }
    }

    /// The guess of such a phase: the horizontal speed is taken away first, then the lander falls on the least thrust.
    pub(super) fn guess_with_path(&self, [gate, end]: [Sample; 2]) -> Result<PhaseGuess, OcpError> {
        let Self { descent, body, least_throttle, .. } = self;
        let gravity = body.surface_gravity();
        let (upward, forward) = match (self.gate_velocity, self.motion) {
            (Some([upward, _, forward]), Motion::Plane) => (upward, forward),
            (Some([upward, east, north]), Motion::Space) => (upward, east.hypot(north)),
            (None, _) => (gate.upward, gate.forward),
        };
        let deceleration = descent.engine.thrust / gate.mass;
        let slowing = (forward / deceleration).max(SHORTEST_PART_S);
        let slow = upward - gravity * slowing;
        let height = |t: f64, v: f64, a: f64| v * t + 0.5 * a * t * t;
        // At least a part of the way is left for the fall.
        let way = (gate.radius - end.radius).max(1.0);
        let fallen = (-height(slowing, upward, -gravity)).clamp(0.0, MOST_OF_WAY * way);
        let mass = gate.mass - slowing * descent.engine.mass_flow();
        let acceleration = (gravity - least_throttle * descent.engine.thrust / mass).max(0.0);
        let square = slow * slow + 2.0 * acceleration * (way - fallen);
        let falling = 2.0 * (way - fallen) / (square.sqrt() + slow.abs()).max(1.0);
        let stopped = Sample {
            time: gate.time + slowing,
            radius: gate.radius - fallen,
            forward: 0.0,
            upward: slow,
            mass,
            pitch: 0.0,
            ..gate
        };
        let down = Sample {
            time: stopped.time + falling,
            radius: end.radius,
            upward: -square.sqrt(),
            mass: mass - falling * least_throttle * descent.engine.mass_flow(),
            pitch: FRAC_PI_2,
            ..stopped
        };
        let turned = Sample { time: stopped.time + JUMP * falling, pitch: FRAC_PI_2, ..stopped };
        let begin = Sample { forward, upward, pitch: 0.0, ..gate };
        let (times, mut states, mut controls) = self.steered_samples(&[begin, stopped, turned, down]);
        for (k, u) in controls.iter_mut().enumerate() {
            if let Some(throttle) = u.last_mut().filter(|_| k > 1) {
                *throttle = *least_throttle;
            }
        }
        if self.is_held_to_a_plane() {
            for (x, u) in states.iter_mut().zip(&mut controls) {
                x.push(u.remove(0));
            }
        }
        PhaseGuess::samples(&times, states, controls)
    }
}
