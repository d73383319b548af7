//! Reasons to refuse a request.

use apsides_basis::BasisError;
use apsides_nlp::NlpError;
use apsides_ocp::OcpError;
use apsides_ode::OdeError;

/// An ill-posed request.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShootingError {
    /// A size does not fit the problem.
    #[error("{place}: expected {expected} {what}, found {found}")]
    Dimension {
        /// The place.
        place: String,
        /// The things that are counted.
        what: &'static str,
        /// The number that there should be.
        expected: usize,
        /// The number that there are.
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
        /// The place.
        place: String,
        /// The missing part, and what to do.
        reason: String,
    },
    /// The method does not cover the problem.
    #[error("{place}: {what} is beyond indirect shooting; {remedy}")]
    Unsupported {
        /// The place.
        place: String,
        /// The feature that is not covered.
        what: String,
        /// The way round it.
        remedy: &'static str,
    },
    /// A profile or the rules of its flights do not fit the problem.
    #[error("profile, {place}: {reason}")]
    Profile {
        /// The place.
        place: String,
        /// The misfit, and what to do.
        reason: String,
    },
    /// A segment has more control points than the basis supports.
    #[error("control points of a segment: {0}")]
    Basis(#[from] BasisError),
    /// The discretised problem or the settings of its solver are refused.
    #[error("discretised problem: {0}")]
    Nlp(#[from] NlpError),
    /// The problem refuses guess, mesh or result.
    #[error(transparent)]
    Ocp(#[from] OcpError),
    /// The integrator refuses its settings.
    #[error(transparent)]
    Ode(#[from] OdeError),
}
