//! Reasons to refuse a solve.

use apsides_basis::BasisError;
use apsides_nlp::NlpError;
use apsides_ocp::OcpError;

/// An ill-posed request. Not converging is a status of the solution, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RadauError {
    /// The guess or the mesh does not fit the problem.
    #[error(transparent)]
    Problem(#[from] OcpError),
    /// An interval has more points than the basis supports.
    #[error("mesh interval: {0}")]
    Basis(#[from] BasisError),
    /// The discretised problem or the solver's settings are refused.
    #[error("discretised problem: {0}")]
    Nlp(#[from] NlpError),
    /// A setting is out of range.
    #[error("Radau setting `{name}` is {value}, allowed is {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The allowed range in words.
        allowed: &'static str,
    },
}
