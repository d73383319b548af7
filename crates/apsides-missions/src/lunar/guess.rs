//! Guesses: impulses, a two-body coast, and braking at the mean.

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_dynamics::Hohmann;
use apsides_ocp::{OcpError, PhaseGuess};

use super::ignition::Ignition;
use super::lander::LunarLander;
use super::phases::Target;

/// Backwards and up: between braking (180 deg) and holding the height (90 deg).
const THRUST_ANGLE: f64 = 150.0 / 180.0 * PI;
/// The angle at which the thrust begins to turn upright.
const TURN_FROM: f64 = 130.0 / 180.0 * PI;
/// Against the motion.
const BACKWARDS: f64 = PI;

/// Coast past a perilune, s.
const SHORT_COAST: f64 = 100.0;
/// Points along a coast.
const COAST_POINTS: usize = 24;

/// A guessed flight at one time, in SI units.
#[derive(Clone, Copy)]
pub(super) struct FlightPoint {
    pub(super) time: f64,
    radius: f64,
    polar_angle: f64,
    horizontal_speed: f64,
    radial_speed: f64,
    pub(super) mass: f64,
    thrust_angle: f64,
    pitch_rate: f64,
    throttle: f64,
}

impl FlightPoint {
    /// In the order of the states of planar flight.
    fn state(&self) -> Vec<f64> {
        vec![self.radius, self.polar_angle, self.horizontal_speed, self.radial_speed, self.mass]
    }
}

/// A phase with the states and controls of powered flight.
pub(super) fn powered(points: &[FlightPoint], lander: &LunarLander) -> Result<PhaseGuess, OcpError> {
    let row = |p: &FlightPoint| {
        let (mut state, mut control) = (p.state(), Vec::new());
        if lander.pitches() {
            state.push(p.thrust_angle);
            control.push(p.pitch_rate);
        } else {
            control.push(p.thrust_angle);
        }
        if lander.throttles() {
            control.push(p.throttle);
        }
        (state, control)
    };
    let times: Vec<f64> = points.iter().map(|p| p.time).collect();
    let (states, controls) = points.iter().map(row).unzip();
    PhaseGuess::samples(&times, states, controls)
}

/// A phase without controls.
pub(super) fn coasting(points: &[FlightPoint]) -> Result<PhaseGuess, OcpError> {
    let times: Vec<f64> = points.iter().map(|p| p.time).collect();
    let states = points.iter().map(FlightPoint::state).collect();
    PhaseGuess::samples(&times, states, vec![vec![]; points.len()])
}

/// Time and polar angle at the end of a phase.
pub(super) fn end(points: &[FlightPoint]) -> (f64, f64) {
    points.last().map_or((0.0, 0.0), |p| (p.time, p.polar_angle))
}

impl Ignition {
    /// A short flight on at the same height and speed.
    pub(super) fn coast_points(&self) -> Vec<FlightPoint> {
        let at = |time: f64| FlightPoint {
            time,
            radius: self.radius,
            polar_angle: time * self.horizontal_speed / self.radius,
            horizontal_speed: self.horizontal_speed,
            radial_speed: 0.0,
            mass: self.mass,
            thrust_angle: BACKWARDS,
            pitch_rate: 0.0,
            throttle: 0.0,
        };
        vec![at(0.0), at(SHORT_COAST)]
    }

    /// Braking at the mean from time and polar angle of ignition to the target, whose radial speed is guessed; one profile
    /// per phase.
    pub(super) fn braking_points(
        &self,
        target: Target,
        radial_speed: f64,
        begin: (f64, f64),
    ) -> Vec<Vec<FlightPoint>> {
        let time = self.expected_time();
        let flow = self.lander.flight.engine.mass_flow();
        let angle = 0.5 * time * self.horizontal_speed / self.radius;
        let at = |fraction: f64, thrust_angle: f64| {
            let mean = |a: f64, b: f64| a + fraction * (b - a);
            FlightPoint {
                time: begin.0 + fraction * time,
                radius: mean(self.radius, target.radius),
                polar_angle: begin.1 + fraction * angle,
                horizontal_speed: mean(self.horizontal_speed, 0.0),
                radial_speed: fraction * radial_speed,
                mass: self.mass - fraction * time * flow,
                thrust_angle,
                pitch_rate: 0.0,
                throttle: 1.0,
            }
        };
        let Some(rate) = self.lander.turn_rate() else {
            let end = if self.lander.is_upright() { FRAC_PI_2 } else { THRUST_ANGLE };
            return vec![vec![at(0.0, THRUST_ANGLE), at(1.0, end)]];
        };
        // At most half of the flight is spent turning.
        let turn = ((TURN_FROM - FRAC_PI_2) / rate / time).min(0.5);
        let turning = |p: FlightPoint| FlightPoint { pitch_rate: -rate, ..p };
        vec![
            vec![at(0.0, THRUST_ANGLE), at(1.0 - turn, TURN_FROM)],
            vec![turning(at(1.0 - turn, TURN_FROM)), turning(at(1.0, FRAC_PI_2))],
        ]
    }

    /// The burn that leaves the orbit, and the coast after it.
    pub(super) fn transfer_points(&self, transfer: &Hohmann, arrival: &Self) -> [Vec<FlightPoint>; 2] {
        let burn = (self.mass - arrival.mass) / self.lander.flight.engine.mass_flow();
        let angle = burn * self.horizontal_speed / self.radius;
        let leaving = FlightPoint {
            time: 0.0,
            radius: self.radius,
            polar_angle: 0.0,
            horizontal_speed: self.horizontal_speed,
            radial_speed: 0.0,
            mass: self.mass,
            thrust_angle: BACKWARDS,
            pitch_rate: 0.0,
            throttle: 1.0,
        };
        let left = FlightPoint {
            time: burn,
            polar_angle: angle,
            horizontal_speed: transfer.departure_speed,
            mass: arrival.mass,
            ..leaving
        };
        let coast = (0..=COAST_POINTS).map(|k| {
            let p = transfer.point(PI * k as f64 / COAST_POINTS as f64);
            FlightPoint {
                time: burn + p.time,
                radius: p.radius,
                polar_angle: angle + p.angle,
                horizontal_speed: p.horizontal_speed,
                radial_speed: p.radial_speed,
                throttle: 0.0,
                ..left
            }
        });
        [vec![leaving, left], coast.collect()]
    }
}
