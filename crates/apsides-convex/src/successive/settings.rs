//! Settings of successive convexification.

use apsides_conic::ConicSettings;

use crate::ConvexError;
use crate::error::require;

/// Settings of [`SuccessiveConvexification`](super::SuccessiveConvexification).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuccessiveSettings {
    /// Equal intervals per phase, with controls that are linear on each, default 40.
    pub intervals: usize,
    /// Convex programs at most, default 100.
    pub max_iterations: usize,
    /// The method ends when the convex model promises less than this, in units of the objective's scale, default 1e-7.
    pub tolerance: f64,
    /// Largest violation of equations of motion and constraints that counts as met, in units of their scales, default 1e-6.
    pub feasibility_tolerance: f64,
    /// Price of violations at the start, in units of the objective's scale; raised tenfold, up to five times, while it is too
    /// low. Default 100.
    pub penalty: f64,
    /// Weight of the squared step at the start, default 1; adapted.
    pub proximal_weight: f64,
    /// Tolerance of the integration of equations of motion and variational equations, default 1e-10.
    pub integration_tolerance: f64,
    /// Settings of the conic solver.
    pub conic: ConicSettings,
}

impl Default for SuccessiveSettings {
    fn default() -> Self {
        Self {
            intervals: 40,
            max_iterations: 100,
            tolerance: 1e-7,
            feasibility_tolerance: 1e-6,
            penalty: 100.0,
            proximal_weight: 1.0,
            integration_tolerance: 1e-10,
            conic: ConicSettings::default(),
        }
    }
}

impl SuccessiveSettings {
    pub(crate) fn check(&self) -> Result<(), ConvexError> {
        require(self.intervals > 0, "number of intervals", self.intervals as f64, "", "at least 1")?;
        require(
            self.max_iterations > 0,
            "limit of iterations",
            self.max_iterations as f64,
            "",
            "at least 1",
        )?;
        for (what, value) in [
            ("tolerance", self.tolerance),
            ("feasibility tolerance", self.feasibility_tolerance),
            ("penalty", self.penalty),
            ("proximal weight", self.proximal_weight),
            ("integration tolerance", self.integration_tolerance),
        ] {
            require(value > 0.0 && value.is_finite(), what, value, "", "positive and finite")?;
        }
        Ok(())
    }
}
