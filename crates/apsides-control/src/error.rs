//! Reasons to refuse a request.

use thiserror::Error;

/// An ill-posed request. A run that ends early is an [`Ending`](crate::simulation::Ending), not an error.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// A number is outside its range.
    #[error("{what} is {value}, allowed is {allowed}")]
    Parameter {
        /// The quantity that was given.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The allowed range in words.
        allowed: &'static str,
    },
    /// Limits are not in order.
    #[error("{what}: the lower limit {lower} is not below the upper limit {upper}")]
    Limits {
        /// The quantity that is limited.
        what: &'static str,
        /// The lower limit given.
        lower: f64,
        /// The upper limit given.
        upper: f64,
    },
    /// Sizes do not go together.
    #[error("{what}: {found} given, {expected} needed")]
    Dimension {
        /// The object of that size.
        what: &'static str,
        /// Size needed.
        expected: usize,
        /// Size found.
        found: usize,
    },
    /// The Riccati equation has no stabilising solution that can be computed.
    #[error("no stabilising solution of the Riccati equation: {reason}")]
    Riccati {
        /// The failure, in words.
        reason: &'static str,
    },
    /// A matrix to be inverted is singular.
    #[error("{what} is singular")]
    Singular {
        /// The matrix.
        what: &'static str,
    },
    /// Eigenvalues that an iteration does not find.
    #[error("the eigenvalues of {what} do not converge")]
    Eigenvalues {
        /// The matrix.
        what: &'static str,
    },
    /// No time to go fulfils the equation of a guidance law.
    #[error("no time to go leads from this state to the target: {reason}")]
    NoTimeToGo {
        /// The obstacle, in words.
        reason: &'static str,
    },
    /// A request that the integrator refuses.
    #[error("integrator: {0}")]
    Integrator(#[from] apsides_ode::OdeError),
}

/// Passes a finite number on.
pub(crate) fn finite(what: &'static str, value: f64) -> Result<f64, ControlError> {
    within(what, value, "a finite number", true)
}

/// Most control steps of a delay: each is a place in memory.
const MAX_WAITING: usize = 1_000_000;

/// Control steps of a time (s): the least whole number that is not shorter, but for round-off.
pub(crate) fn steps_of(what: &'static str, time: f64, control_step: f64) -> Result<usize, ControlError> {
    let steps = (time / control_step * (1.0 - 1e-9)).ceil() as usize;
    if steps <= MAX_WAITING {
        Ok(steps)
    } else {
        Err(ControlError::Parameter { what, value: time, allowed: "at most a million control steps" })
    }
}

/// Passes a finite number above zero on.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, ControlError> {
    within(what, value, "a positive finite number", value > 0.0)
}

/// Passes a finite number of zero or more on.
pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<f64, ControlError> {
    within(what, value, "zero or a positive finite number", value >= 0.0)
}

/// Passes a number above zero, infinity included, on.
pub(crate) fn limit(what: &'static str, value: f64) -> Result<f64, ControlError> {
    if value > 0.0 {
        Ok(value)
    } else {
        Err(ControlError::Parameter { what, value, allowed: "a positive number or infinity" })
    }
}

/// Passes limits in order on; infinite ones are allowed.
pub(crate) fn ordered(what: &'static str, [lower, upper]: [f64; 2]) -> Result<[f64; 2], ControlError> {
    if lower < upper { Ok([lower, upper]) } else { Err(ControlError::Limits { what, lower, upper }) }
}

/// Passes a finite number on that meets a condition.
fn within(
    what: &'static str,
    value: f64,
    allowed: &'static str,
    condition: bool,
) -> Result<f64, ControlError> {
    if value.is_finite() && condition {
        Ok(value)
    } else {
        Err(ControlError::Parameter { what, value, allowed })
    }
}
