//! Tolerances and limits.

use crate::ConicError;

/// Settings of a [`ConicProgram`](crate::ConicProgram).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConicSettings {
    /// Absolute and relative duality gap, default `1e-8`: smaller costs one or two iterations per digit pair.
    pub gap_tolerance: f64,
    /// Relative residual of the constraints and of the dual ones, default `1e-8`.
    pub feasibility_tolerance: f64,
    /// Most iterations of a solve, default 60; a well-scaled program takes 8 to 25.
    pub max_iterations: u32,
}

impl Default for ConicSettings {
    fn default() -> Self {
        Self { gap_tolerance: 1e-8, feasibility_tolerance: 1e-8, max_iterations: 60 }
    }
}

impl ConicSettings {
    pub(crate) fn check(&self) -> Result<(), ConicError> {
        for (setting, value) in
            [("gap_tolerance", self.gap_tolerance), ("feasibility_tolerance", self.feasibility_tolerance)]
        {
            if !(value > 0.0 && value < 1.0) {
                let allowed = "above 0 and below 1";
                return Err(ConicError::Setting { setting, value, allowed });
            }
        }
        if self.max_iterations == 0 {
            let (setting, allowed) = ("max_iterations", "at least 1");
            return Err(ConicError::Setting { setting, value: 0.0, allowed });
        }
        Ok(())
    }
}
