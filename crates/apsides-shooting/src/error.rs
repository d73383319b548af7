//! Reasons to refuse a solve.

use apsides_basis::BasisError;
use apsides_nlp::NlpError;
use apsides_ocp::OcpError;
use apsides_ode::OdeError;

/// An ill-posed request. Not converging is a status of the solution, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShootingError {
    /// The guess or the mesh does not fit the problem.
    #[error(transparent)]
    Problem(#[from] OcpError),
    /// A segment has more control points than the basis supports.
    #[error("control points of a segment: {0}")]
    Basis(#[from] BasisError),
    /// The discretised problem or the solver's settings are refused.
    #[error("discretised problem: {0}")]
    Nlp(#[from] NlpError),
    /// The integration is refused.
    #[error("integration: {0}")]
    Ode(#[from] OdeError),
    /// A setting is out of range.
    #[error("shooting setting `{name}` is {value}, allowed is {allowed}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
}
