//! Settings of the indirect method.

use crate::ShootingError;

/// Settings of the indirect method.
#[derive(Clone, Debug)]
pub struct IndirectSettings {
    /// Equal intervals per phase, which are the shooting segments, of a solve that starts from costates at the ends of phases or from a trajectory; 1.
    pub intervals: usize,
    /// Largest correction of a converged solution, in units of the unknowns' sizes; 1e-9.
    pub tolerance: f64,
    /// Relative tolerance of the integration; 1e-11.
    pub integration_tolerance: f64,
    /// The same while the corrections that remain are above [`EARLY`](Self::EARLY), where it is enough for the next one; 1e-7.
    pub early_integration_tolerance: f64,
    /// Most Newton iterations; 50.
    pub max_iterations: usize,
    /// Largest change of an unknown in one step, in units of its size; 100.
    pub step_limit: f64,
    /// Largest part of its duration that a phase may lose in one step; 0.75.
    pub duration_limit: f64,
    /// Weight of a square of each control that the Hamiltonian is linear in, per unit time and in units of the objective, with the
    /// control measured from the middle of its bounds in half widths; zero, which leaves them at their bounds.
    pub smoothing: f64,
    /// Threads that phases are flown on: 1, or those of the global pool of `rayon`; 1. Results do not depend on it.
    pub threads: usize,
}

impl Default for IndirectSettings {
    fn default() -> Self {
        Self {
            intervals: 1,
            tolerance: 1e-9,
            integration_tolerance: 1e-11,
            early_integration_tolerance: 1e-7,
            max_iterations: 50,
            step_limit: 100.0,
            duration_limit: 0.75,
            smoothing: 0.0,
            threads: 1,
        }
    }
}

impl IndirectSettings {
    /// Expected correction, in units of the unknowns' sizes, from which on the integration is as accurate as that of a solution.
    pub const EARLY: f64 = 1e-4;

    pub(super) fn early(&self) -> f64 {
        self.early_integration_tolerance.max(self.integration_tolerance)
    }

    pub(super) fn check(&self) -> Result<(), ShootingError> {
        let fail = |name, value, allowed| Err(ShootingError::Setting { name, value, allowed });
        for (name, value) in [
            ("tolerance", self.tolerance),
            ("integration_tolerance", self.integration_tolerance),
            ("early_integration_tolerance", self.early_integration_tolerance),
            ("step_limit", self.step_limit),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return fail(name, value, "a positive number");
            }
        }
        if !(self.duration_limit > 0.0 && self.duration_limit < 1.0) {
            return fail("duration_limit", self.duration_limit, "between 0 and 1");
        }
        if !(self.smoothing >= 0.0 && self.smoothing.is_finite()) {
            return fail("smoothing", self.smoothing, "zero or a positive number");
        }
        if self.max_iterations == 0 {
            return fail("max_iterations", 0.0, "at least 1");
        }
        Ok(())
    }
}
