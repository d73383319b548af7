//! Reasons to refuse a solve.

use apsides_basis::BasisError;
use apsides_nlp::NlpError;
use apsides_ocp::OcpError;

/// An ill-posed request. Not converging is a status of the solution, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FlatnessError {
    /// The guess does not fit the problem.
    #[error(transparent)]
    Problem(#[from] OcpError),
    /// Knots or points that do not exist.
    #[error("{place}: {source}")]
    Basis {
        /// Phase.
        place: String,
        /// The reason why they do not exist.
        source: BasisError,
    },
    /// The discretised problem or the solver's settings are refused.
    #[error("discretised problem: {0}")]
    Nlp(#[from] NlpError),
    /// A setting is out of range.
    #[error("{place}: flatness setting `{name}` is {value}, allowed is {allowed}")]
    Setting {
        /// Phase, or the method.
        place: String,
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The allowed range in words.
        allowed: String,
    },
    /// The flat systems do not fit the phases.
    #[error("{place}: expected {expected} {what}, found {found}")]
    Dimension {
        /// Problem or phase.
        place: String,
        /// The things that are counted.
        what: &'static str,
        /// The size that fits.
        expected: usize,
        /// The size that was given.
        found: usize,
    },
    /// More equations than unknowns.
    #[error(
        "{place}: {points} points make {equalities} equality constraints for {variables} variables of the whole problem; \
         allowed are {least} to {most} points"
    )]
    TooManyConstraints {
        /// Phase with most points.
        place: String,
        /// Its points.
        points: usize,
        /// Equality constraints of the whole discretised problem.
        equalities: usize,
        /// Its variables.
        variables: usize,
        /// Fewest points that determine the outputs.
        least: usize,
        /// Most points for which there are not more constraints than variables.
        most: usize,
    },
    /// A constraint on what the flat map makes constant, or on what other constraints fix already, cannot be met.
    #[error("{row}: {value} is not within [{lower}, {upper}] {unit}, and no variable can change it")]
    Contradiction {
        /// Phase and constraint.
        row: String,
        /// Its value.
        value: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
        /// Unit.
        unit: String,
    },
}
