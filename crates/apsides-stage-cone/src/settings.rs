//! Tolerances and limits.

use crate::error::StageError;

/// Settings of a solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageSettings {
    /// Absolute and relative duality gap, default `1e-8`.
    pub gap_tolerance: f64,
    /// Relative residual of the constraints and of the dual ones, and of certificates; default `1e-8`.
    pub feasibility_tolerance: f64,
    /// Most iterations of a solve, default 60; a well-scaled program takes 8 to 20. The most work of one iteration depends on sizes alone.
    pub max_iterations: u32,
}

impl Default for StageSettings {
    fn default() -> Self {
        Self { gap_tolerance: 1e-8, feasibility_tolerance: 1e-8, max_iterations: 60 }
    }
}

impl StageSettings {
    pub(crate) fn check(&self) -> Result<(), StageError> {
        for (setting, value) in
            [("gap_tolerance", self.gap_tolerance), ("feasibility_tolerance", self.feasibility_tolerance)]
        {
            if !(value > 0.0 && value < 1.0) {
                return Err(StageError::Setting { setting });
            }
        }
        if self.max_iterations == 0 { Err(StageError::Setting { setting: "max_iterations" }) } else { Ok(()) }
    }
}
