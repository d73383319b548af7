//! Guesses: impulses, a two-body coast, and braking at the mean.

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_dynamics::Hohmann;
use apsides_ocp::{OcpError, PhaseGuess};

use super::phases::{Steering, Target};
use super::vehicle::Start;

/// Backwards and up: between braking (180 deg) and holding the height (90 deg).
const THRUST_ANGLE: f64 = 150.0 / 180.0 * PI;
/// Where the thrust begins to turn upright.
const TURN_FROM: f64 = 130.0 / 180.0 * PI;
/// Against the motion.
const BACKWARDS: f64 = PI;

/// Coast past a perilune, s.
const SHORT_COAST: f64 = 100.0;
/// Points along a coast.
const COAST_POINTS: usize = 24;

/// A flight at one time.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) time: f64,
    /// Radius, polar angle, horizontal speed, radial speed, mass.
    pub(super) state: [f64; 5],
    thrust_angle: f64,
    pitch_rate: f64,
    throttle: f64,
}

/// A phase with the states and controls of powered flight.
pub(super) fn powered(samples: &[Sample], steering: &Steering) -> Result<PhaseGuess, OcpError> {
    let row = |s: &Sample| {
        let (mut state, mut control) = (s.state.to_vec(), Vec::new());
        if steering.pitches() {
            state.push(s.thrust_angle);
            control.push(s.pitch_rate);
        } else {
            control.push(s.thrust_angle);
        }
        if steering.throttles() {
            control.push(s.throttle);
        }
        (state, control)
    };
    let times: Vec<f64> = samples.iter().map(|s| s.time).collect();
    let (states, controls) = samples.iter().map(row).unzip();
    PhaseGuess::samples(&times, states, controls)
}

/// A phase without controls.
pub(super) fn coasting(samples: &[Sample]) -> Result<PhaseGuess, OcpError> {
    let times: Vec<f64> = samples.iter().map(|s| s.time).collect();
    let states = samples.iter().map(|s| s.state.to_vec()).collect();
    PhaseGuess::samples(&times, states, vec![vec![]; samples.len()])
}

/// Time and polar angle at the end of a phase.
pub(super) fn end(samples: &[Sample]) -> (f64, f64) {
    samples.last().map_or((0.0, 0.0), |s| (s.time, s.state[1]))
}

impl Start {
    /// A short flight on at the same height and speed.
    pub(super) fn coast_samples(&self) -> Vec<Sample> {
        let at = |time: f64| Sample {
            time,
            state: [
                self.radius,
                time * self.horizontal_speed / self.radius,
                self.horizontal_speed,
                0.0,
                self.mass,
            ],
            thrust_angle: BACKWARDS,
            pitch_rate: 0.0,
            throttle: 0.0,
        };
        vec![at(0.0), at(SHORT_COAST)]
    }

    /// Braking at the mean from time and polar angle of ignition to the target, whose radial speed is guessed; one profile
    /// per phase.
    pub(super) fn braking_samples(
        &self,
        steering: &Steering,
        target: Target,
        radial_speed: f64,
        begin: (f64, f64),
    ) -> Vec<Vec<Sample>> {
        let time = self.expected_time();
        let flow = self.flight.engine.mass_flow();
        let angle = 0.5 * time * self.horizontal_speed / self.radius;
        let at = |fraction: f64, thrust_angle: f64| {
            let mean = |a: f64, b: f64| a + fraction * (b - a);
            Sample {
                time: begin.0 + fraction * time,
                state: [
                    mean(self.radius, target.radius),
                    begin.1 + fraction * angle,
                    mean(self.horizontal_speed, 0.0),
                    fraction * radial_speed,
                    self.mass - fraction * time * flow,
                ],
                thrust_angle,
                pitch_rate: 0.0,
                throttle: 1.0,
            }
        };
        if !steering.turns_in_a_phase() {
            let end = if steering.upright { FRAC_PI_2 } else { THRUST_ANGLE };
            return vec![vec![at(0.0, THRUST_ANGLE), at(1.0, end)]];
        }
        // At most half of the flight is spent turning.
        let turn = ((TURN_FROM - FRAC_PI_2) / steering.pitch_rate / time).min(0.5);
        let turning = |s: Sample| Sample { pitch_rate: -steering.pitch_rate, ..s };
        vec![
            vec![at(0.0, THRUST_ANGLE), at(1.0 - turn, TURN_FROM)],
            vec![turning(at(1.0 - turn, TURN_FROM)), turning(at(1.0, FRAC_PI_2))],
        ]
    }

    /// The burn that leaves the orbit, and the coast after it.
    pub(super) fn transfer_samples(&self, transfer: &Hohmann, arrival: &Self) -> [Vec<Sample>; 2] {
        let burn = (self.mass - arrival.mass) / self.flight.engine.mass_flow();
        let angle = burn * self.horizontal_speed / self.radius;
        let sample = |time, state, throttle| Sample {
            time,
            state,
            thrust_angle: BACKWARDS,
            pitch_rate: 0.0,
            throttle,
        };
        let deorbit = vec![
            sample(0.0, [self.radius, 0.0, self.horizontal_speed, 0.0, self.mass], 1.0),
            sample(burn, [self.radius, angle, transfer.departure_speed, 0.0, arrival.mass], 1.0),
        ];
        let coast = (0..=COAST_POINTS).map(|k| {
            let p = transfer.point(PI * k as f64 / COAST_POINTS as f64);
            let state = [p.radius, angle + p.angle, p.horizontal_speed, p.radial_speed, arrival.mass];
            sample(burn + p.time, state, 0.0)
        });
        [deorbit, coast.collect()]
    }
}
