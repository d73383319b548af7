//! Methods, tolerances and limits.

use crate::OdeError;

/// The Runge-Kutta pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Dormand and Prince, order 8 with error estimates of order 5 and 3 and dense output of order 7; 12 evaluations a
    /// step. For tolerances below about 1e-6.
    #[default]
    Dop853,
    /// Dormand and Prince, order 5 with an error estimate of order 4 and dense output of order 4; 6 evaluations a step.
    Dopri5,
}

/// Absolute error tolerance, in the units of the state.
#[derive(Debug, Clone, PartialEq)]
pub enum Tolerance {
    /// The same for every component.
    Scalar(f64),
    /// One for each component.
    PerComponent(Vec<f64>),
}

impl From<f64> for Tolerance {
    fn from(value: f64) -> Self {
        Self::Scalar(value)
    }
}

impl From<Vec<f64>> for Tolerance {
    fn from(values: Vec<f64>) -> Self {
        Self::PerComponent(values)
    }
}

/// Settings of an [`Integrator`](crate::Integrator).
///
/// A step is accepted when the root mean square over the components of `error_i / (a_i + r |x_i|)` is at most one,
/// with `a` the absolute and `r` the relative tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct OdeSettings {
    /// The Runge-Kutta pair; default [`Method::Dop853`].
    pub method: Method,
    /// Relative tolerance per step, positive, dimensionless; default 1e-12. Below about 1e-15 rounding decides.
    pub relative_tolerance: f64,
    /// Absolute tolerance per step, positive, in units of the state; default 1e-12 for every component.
    pub absolute_tolerance: Tolerance,
    /// Only the first so many components enter the error norm; default `None`, all of them. The others ride along on
    /// the same steps, as a state-transition matrix does.
    pub controlled_components: Option<usize>,
    /// Magnitude of the first step, in units of time; default `None`, estimated from the rate and its change.
    pub initial_step: Option<f64>,
    /// Largest magnitude of a step, in units of time; default infinite.
    pub max_step: f64,
    /// Steps of this magnitude without error control, the last one fitted to the end; default `None`.
    pub fixed_step: Option<f64>,
    /// Attempted steps before the integration stops with [`Status::TooManySteps`](crate::Status::TooManySteps);
    /// default 1 000 000.
    pub max_steps: usize,
    /// Accepted steps between two tests for stiffness; default `Some(1000)`, `None` never tests.
    pub stiffness_interval: Option<usize>,
}

impl Default for OdeSettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            relative_tolerance: 1e-12,
            absolute_tolerance: Tolerance::Scalar(1e-12),
            controlled_components: None,
            initial_step: None,
            max_step: f64::INFINITY,
            fixed_step: None,
            max_steps: 1_000_000,
            stiffness_interval: Some(1000),
        }
    }
}

impl OdeSettings {
    /// Default settings with both tolerances equal to `tolerance`.
    pub fn with_tolerance(tolerance: f64) -> Self {
        Self {
            relative_tolerance: tolerance,
            absolute_tolerance: Tolerance::Scalar(tolerance),
            ..Self::default()
        }
    }

    /// Checks the settings for a system of `dimension` components; returns the absolute tolerance of each controlled
    /// component.
    pub(crate) fn checked(&self, dimension: usize) -> Result<Vec<f64>, OdeError> {
        let positive = |name, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(OdeError::Setting { name, value, allowed: "a positive finite number" })
            }
        };
        positive("relative_tolerance", self.relative_tolerance)?;
        let mut absolute = match &self.absolute_tolerance {
            Tolerance::Scalar(value) => vec![*value; dimension],
            Tolerance::PerComponent(values) => {
                crate::error::require_dimension("absolute_tolerance", dimension, values.len())?;
                values.clone()
            }
        };
        for &value in &absolute {
            positive("absolute_tolerance", value)?;
        }
        if let Some(step) = self.initial_step {
            positive("initial_step", step)?;
        }
        if let Some(step) = self.fixed_step {
            positive("fixed_step", step)?;
        }
        if self.max_step.is_nan() || self.max_step <= 0.0 {
            return Err(OdeError::Setting {
                name: "max_step",
                value: self.max_step,
                allowed: "a positive number or infinity",
            });
        }
        if let Some(controlled) = self.controlled_components {
            if controlled == 0 || controlled > dimension {
                return Err(OdeError::Setting {
                    name: "controlled_components",
                    value: controlled as f64,
                    allowed: "1 to the dimension of the system",
                });
            }
            absolute.truncate(controlled);
        }
        if self.stiffness_interval == Some(0) {
            return Err(OdeError::Setting {
                name: "stiffness_interval",
                value: 0.0,
                allowed: "at least 1, or None",
            });
        }
        Ok(absolute)
    }
}
