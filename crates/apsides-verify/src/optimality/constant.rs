//! Conditions of an optimum among controls that are constant on each interval of the trajectory's control.
//!
//! ```text
//! integral of dL/du over an interval = 0, or pushing against a bound
//! lengths free:    H is the same on both sides of the end of an interval
//! lengths given:   dJ/dtf = integral of (H + s T dH/dt) ds,   dJ/dt0 = -integral of (H - (1 - s) T dH/dt) ds,   t = t0 + s T
//! ```
//!
//! They are the conditions of the nonlinear program in the constants and times. A change of a control over a whole interval is not a needle:
//! the Hamiltonian need not be least at any time.

use super::{KIND, PhaseConditions, natural_residual};
use crate::place::place;
use crate::worst::{Worst, relative};
use crate::{Check, VerifySettings};

/// The lengths of the intervals of constant controls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lengths {
    /// Any.
    Free,
    /// Given parts of the duration.
    Given,
}

impl PhaseConditions<'_> {
    /// The mean over each interval of `dL/du`, times the scale of the control and relative to the Hamiltonian.
    pub(crate) fn mean_slopes(&mut self, segment: usize) -> Vec<f64> {
        let nx = self.equations.nx;
        let mut slopes = vec![0.0; self.equations.nu];
        let mut length = 0.0;
        self.integrate_over(segment, |_, point, _, _, weight| {
            slopes.iter_mut().zip(&point.gradient[nx..]).for_each(|(s, g)| *s += weight * g);
            length += weight;
        });
        let scales = &self.scaling.controls;
        slopes.iter().zip(scales).map(|(s, c)| relative(s / length * c, self.slope_size)).collect()
    }

    pub(super) fn mean_stationarity(&mut self, settings: &VerifySettings) -> Option<Check> {
        let phase = self.equations.phase;
        let mut control = vec![0.0; self.equations.nu];
        let mut worst = Worst::default();
        for segment in 0..self.found.control.segments().len() {
            let start = self.found.control.breaks()[segment];
            let slopes = self.mean_slopes(segment);
            self.found.control.evaluate_in(segment, start, &mut control);
            for (j, c) in phase.controls.iter().enumerate() {
                let residual = natural_residual(slopes[j], control[j], &c.bounds, self.scaling.controls[j]);
                let at = || format!("{}, interval from {}", c.name, place(phase, start));
                worst.consider(residual, settings.stationarity_tolerance, "-", at);
            }
        }
        worst.into_check(
            format!("mean stationarity of the Hamiltonian in the controls of {}", phase.name),
            KIND,
        )
    }

    /// The quantities that take the place of the Hamiltonian at both ends where all intervals are stretched with the phase.
    pub(super) fn stretching_hamiltonians(&mut self) -> [f64; 2] {
        let (t0, tf) = (self.found.initial_time, self.found.final_time);
        let duration = tf - t0;
        let [mut first, mut last] = [0.0; 2];
        for segment in 0..self.found.control.segments().len() {
            self.integrate_over(segment, |_, point, h, time, weight| {
                let by_time = point.gradient.last().copied().unwrap_or(f64::NAN);
                first += weight / duration * (h - (tf - time) * by_time);
                last += weight / duration * (h + (time - t0) * by_time);
            });
        }
        [first, last]
    }
}
