//! Reasons to refuse a request.

use apsides_ad::TaylorError;
use thiserror::Error;

/// An ill-posed request. A solution that cannot be continued is a [`Status`](crate::Status), not an error.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum OdeError {
    /// An argument has the wrong number of components.
    #[error("{argument} has {found} components, {expected} are needed")]
    Dimension {
        /// Name of the argument.
        argument: &'static str,
        /// Number needed.
        expected: usize,
        /// Number found.
        found: usize,
    },
    /// A number of the request is NaN or infinite.
    #[error("component {index} of {argument} is {value}, a finite number is needed")]
    NotFinite {
        /// Name of the argument.
        argument: &'static str,
        /// Position in the argument, 0 for a single number.
        index: usize,
        /// The offending value.
        value: f64,
    },
    /// A setting is outside its range.
    #[error("setting `{name}` is {value}, allowed is {allowed}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The offending value.
        value: f64,
        /// The values that are allowed.
        allowed: &'static str,
    },
    /// Sample times do not run in one direction from the start time.
    #[error("sample time {index} is {time}, which turns back from {previous}")]
    SampleOrder {
        /// Position in the list of times.
        index: usize,
        /// The offending time.
        time: f64,
        /// The time before it.
        previous: f64,
    },
    /// A dense solution was asked for a time it does not cover.
    #[error("time {time} is outside the solution, which covers {start} to {end}")]
    OutsideInterval {
        /// The time asked for.
        time: f64,
        /// Time at which the solution starts.
        start: f64,
        /// Time at which the solution ends.
        end: f64,
    },
    /// The rates are no formula with Taylor coefficients.
    #[error(transparent)]
    Taylor(#[from] TaylorError),
}

/// `Err` if a component of `values` is NaN or infinite.
pub(crate) fn require_finite(argument: &'static str, values: &[f64]) -> Result<(), OdeError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(OdeError::NotFinite { argument, index, value: values[index] }),
        None => Ok(()),
    }
}

/// `Err` if `found` differs from `expected`.
pub(crate) fn require_dimension(
    argument: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), OdeError> {
    if expected == found { Ok(()) } else { Err(OdeError::Dimension { argument, expected, found }) }
}
