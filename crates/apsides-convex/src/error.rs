//! Reasons to refuse a request.

use apsides_basis::BasisError;
use apsides_conic::ConicError;
use apsides_ocp::OcpError;
use apsides_ode::OdeError;
use apsides_stage_cone::StageError;
use thiserror::Error;

/// An ill-posed request. What cannot be reached is no error but a status.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConvexError {
    /// A number is not finite or out of its range.
    #[error("{what} is {value} {unit}; it must be {allowed}")]
    Value {
        /// The quantity.
        what: &'static str,
        /// Its value.
        value: String,
        /// Its unit.
        unit: &'static str,
        /// The allowed range in words.
        allowed: &'static str,
    },
    /// Bounds in the wrong order.
    #[error("{what}: [{lower}, {upper}] {unit} is not an interval")]
    Bounds {
        /// The quantity.
        what: &'static str,
        /// Lower bound.
        lower: String,
        /// Upper bound.
        upper: String,
        /// Unit of both.
        unit: &'static str,
    },
    /// The start violates a limit that holds along the whole flight.
    #[error("the start violates the limit `{limit}`: {value}, allowed {allowed} {unit}")]
    Start {
        /// The limit.
        limit: &'static str,
        /// Value at the start.
        value: String,
        /// The allowed range in words.
        allowed: String,
        /// Unit of both.
        unit: &'static str,
    },
    /// The conic program.
    #[error(transparent)]
    Conic(#[from] ConicError),
    /// The conic program over stages.
    #[error("conic program over stages: {0}")]
    Stage(#[from] StageError),
    /// Problem, guess or trajectory.
    #[error(transparent)]
    Ocp(#[from] OcpError),
    /// Integration of the equations of motion.
    #[error(transparent)]
    Ode(#[from] OdeError),
    /// Polynomials of the solution.
    #[error("interpolation of the solution: {0}")]
    Basis(#[from] BasisError),
}

/// Checks a number.
pub(crate) fn require(
    holds: bool,
    what: &'static str,
    value: f64,
    unit: &'static str,
    allowed: &'static str,
) -> Result<(), ConvexError> {
    if holds { Ok(()) } else { Err(ConvexError::Value { what, value: value.to_string(), unit, allowed }) }
}
