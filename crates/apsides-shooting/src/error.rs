//! What is refused.

use apsides_ocp::OcpError;
use apsides_ode::OdeError;

/// An ill-posed request.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShootingError {
    /// A size does not fit the problem.
    #[error("{place}: expected {expected} {what}, found {found}")]
    Dimension {
        /// Where.
        place: String,
        /// What is counted.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A setting is outside its range.
    #[error("setting `{name}` is {value}, allowed is {allowed}")]
    Setting {
        /// Name of the field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The allowed range in words.
        allowed: &'static str,
    },
    /// The start cannot be used.
    #[error("start, {place}: {reason}")]
    Start {
        /// Where.
        place: String,
        /// What is missing, and what to do.
        reason: String,
    },
    /// The method does not cover the problem.
    #[error("{place}: {what} is beyond indirect shooting; {remedy}")]
    Unsupported {
        /// Where.
        place: String,
        /// What is not covered.
        what: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// The problem refuses the result.
    #[error(transparent)]
    Ocp(#[from] OcpError),
    /// The integrator refuses its settings.
    #[error(transparent)]
    Ode(#[from] OdeError),
}
