//! The motion about the Moon of a landing: in its plane, by the radius and the polar angle.

use std::f64::consts::FRAC_PI_2;

use apsides_dynamics::planar::{MASS, POLAR_ANGLE, STATES};
use apsides_ephemeris::{About, Motion, Point};
use apsides_ocp::{PhaseTrajectory, Trajectory};

use super::lander::LunarLander;
use super::phases::{COAST, DEORBIT};

/// A landing with its solution.
#[derive(Clone)]
pub(super) struct LandingMotion {
    lander: LunarLander,
    names: Vec<String>,
    /// Mass at the start, kg.
    mass: f64,
    /// Polar angle over which the vertical flight is that has none as a state.
    last_angle: f64,
}

impl LandingMotion {
    /// The motion of a solution; none of one without phases.
    pub(super) fn of(lander: &LunarLander, solution: &Trajectory) -> Option<Self> {
        let mass = solution
            .phases
            .first()
            .map(|p| p.state.component(p.initial_time, const { MASS.index_in(&STATES) }))?;
        let planar = solution.phases.iter().rev().find(|p| p.state.dimension() >= STATES.len())?;
        let last_angle = planar.state.component(planar.final_time, const { POLAR_ANGLE.index_in(&STATES) });
        let names = solution.phases.iter().map(|p| p.name.clone()).collect();
        Some(Self { lander: *lander, names, mass, last_angle })
    }
}

impl LandingMotion {
    /// The motion of another solution for the rest of the same landing, whose vertical flight, if any, is over another polar angle where the rest
    /// has a flight in the plane.
    pub(super) fn of_rest(&self, phases: &[PhaseTrajectory]) -> Self {
        let planar = phases.iter().rev().find(|p| p.state.dimension() >= STATES.len());
        let angle = planar.map(|p| p.state.component(p.final_time, const { POLAR_ANGLE.index_in(&STATES) }));
        Self { last_angle: angle.unwrap_or(self.last_angle), ..self.clone() }
    }

    /// Polar angle over which the vertical flight is, rad.
    pub(super) fn last_angle(&self) -> f64 {
        self.last_angle
    }
}

impl Motion for LandingMotion {
    fn about(&self) -> About {
        let body = self.lander.flight.body;
        About::sphere(body.radius, body.gravitational_parameter)
    }

    fn point(&self, phase: usize, _time: f64, state: &[f64], control: &[f64]) -> Option<Point> {
        let (radius, angle, along, upward, mass, thrust_angle) = match *state {
            [radius, upward, mass] => (radius, self.last_angle, 0.0, upward, mass, FRAC_PI_2),
            [radius, angle, along, upward, mass] => {
                (radius, angle, along, upward, mass, control.first().copied().unwrap_or(FRAC_PI_2))
            }
            // The thrust angle is a state where its rate is limited.
            [radius, angle, along, upward, mass, thrust_angle] => {
                (radius, angle, along, upward, mass, thrust_angle)
            }
            _ => return None,
        };
        let engine = &self.lander.flight.engine;
        let part = match self.names.get(phase)?.as_str() {
            COAST => 0.0,
            DEORBIT => 1.0,
            _ if self.lander.throttles() => *control.last()?,
            _ => 1.0,
        };
        let (sin, cos) = angle.sin_cos();
        let in_plane = |up: f64, along: f64| [cos * up - sin * along, sin * up + cos * along, 0.0];
        let thrust = engine.thrust * part;
        Some(Point {
            position: in_plane(radius, 0.0),
            velocity: in_plane(upward, along),
            thrust: Some(in_plane(thrust * thrust_angle.sin(), thrust * thrust_angle.cos())),
            mass: Some(mass),
            delta_v: Some(engine.velocity_change(self.mass, mass)),
            attitude: None,
            loads: Vec::new(),
        })
    }
}
