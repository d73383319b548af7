//! Where a solve starts: braking at the mean, then constant decelerations.

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_ocp::{OcpError, PhaseGuess};

use super::divert::Divert;
use super::lander::{Lander, Motion};

/// Pitch of the thrust at the end of the main braking, above the direction against the flight, rad.
const LAST_PITCH: f64 = 0.4;
/// The same in the adjustment.
const ADJUSTMENT_PITCH: f64 = 1.0;
/// Part of the speed at the gate that is downwards, and the part that is forwards.
const DOWNWARD: f64 = 0.4;
const FORWARD: f64 = 0.9;

/// A flight at one time.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) time: f64,
    pub(super) radius: f64,
    /// Central angle to the site, rad.
    pub(super) angle: f64,
    pub(super) forward: f64,
    pub(super) upward: f64,
    pub(super) mass: f64,
    /// Pitch of the thrust above the direction against the flight, rad.
    pub(super) pitch: f64,
}

impl Lander {
    /// From the perilune to the gate.
    pub(super) fn braking_samples(&self) -> [Sample; 2] {
        let time = self.expected_braking();
        let burnt = time * self.descent.engine.mass_flow();
        let start = Sample {
            time: 0.0,
            radius: self.perilune_radius,
            angle: 0.55 * self.start_speed * time / self.perilune_radius,
            forward: self.start_speed,
            upward: 0.0,
            mass: self.initial_mass,
            pitch: 0.0,
        };
        let end = Sample {
            time,
            radius: self.gate_radius,
            angle: 0.0,
            forward: FORWARD * self.gate_speed,
            upward: -DOWNWARD * self.gate_speed,
            mass: (self.initial_mass - burnt).max(self.dry_mass),
            pitch: LAST_PITCH,
        };
        [start, end]
    }

    /// From a sample on to a distance from the centre with an upward speed and no other, at constant deceleration and half thrust.
    pub(super) fn next_sample(&self, from: Sample, radius: f64, upward: f64) -> Sample {
        let time = ((from.radius - radius) / (0.5 * (from.upward + upward)).abs().max(1.0)).max(1.0);
        let burnt = 0.5 * time * self.descent.engine.mass_flow();
        Sample {
            time: from.time + time,
            radius,
            angle: 0.0,
            forward: 0.0,
            upward,
            mass: (from.mass - burnt).max(self.dry_mass),
            pitch: ADJUSTMENT_PITCH,
        }
    }

    /// A phase with the thrust in any direction.
    pub(super) fn steered_guess(&self, samples: &[Sample]) -> Result<PhaseGuess, OcpError> {
        let (times, states, controls) = self.steered_samples(samples);
        PhaseGuess::samples(&times, states, controls)
    }

    /// Times, states and controls of such a phase.
    pub(super) fn steered_samples(&self, samples: &[Sample]) -> (Vec<f64>, Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let first = samples.first().map_or(0.0, |s| s.angle);
        let (sin, cos) = self.azimuth.sin_cos();
        let [longitude, latitude] = self.site;
        let carried = self.descent.rotation_rate * self.perilune_radius;
        let row = |s: &Sample| match self.motion {
            Motion::Plane => {
                (vec![s.radius, first - s.angle, s.forward, s.upward, s.mass], vec![PI - s.pitch, 1.0])
            }
            Motion::Space => {
                let south = latitude - s.angle * cos;
                // Over the ground the plane of the orbit turns to the west as long as the flight is fast.
                let drift = carried * south.cos() * s.forward / self.start_speed;
                (
                    vec![
                        s.radius,
                        longitude - s.angle * sin / latitude.cos(),
                        south,
                        s.upward,
                        s.forward * sin - drift,
                        s.forward * cos,
                        s.mass,
                    ],
                    vec![self.azimuth + PI, s.pitch.min(FRAC_PI_2), 1.0],
                )
            }
        };
        let (states, controls) = samples.iter().map(row).unzip();
        (samples.iter().map(|s| s.time).collect(), states, controls)
    }

    /// From above one place to above another at constant speed; vertical where they are the same.
    pub(super) fn avoidance_guess(
        &self,
        divert: &Divert,
        samples: &[Sample; 2],
        throttle: f64,
    ) -> Result<PhaseGuess, OcpError> {
        if !divert.is_needed() {
            return self.vertical_guess(samples, Some(throttle));
        }
        let [start, end] = samples;
        let forward = divert.angle * start.radius / (end.time - start.time);
        let row = |s: &Sample, angle: f64| vec![s.radius, angle, s.upward, forward, s.mass];
        let states = vec![row(start, 0.0), row(end, divert.angle)];
        PhaseGuess::samples(&[start.time, end.time], states, vec![vec![0.0, throttle]; 2])
    }

    /// A phase of vertical flight; without a throttle at rest.
    pub(super) fn vertical_guess(
        &self,
        samples: &[Sample],
        throttle: Option<f64>,
    ) -> Result<PhaseGuess, OcpError> {
        let times: Vec<f64> = samples.iter().map(|s| s.time).collect();
        let states = samples.iter().map(|s| vec![s.radius, s.upward, s.mass]).collect();
        PhaseGuess::samples(&times, states, vec![throttle.into_iter().collect(); samples.len()])
    }
}
