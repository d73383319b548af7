//! Reasons to refuse a problem, a mesh, a guess.

/// An ill-posed request: where, what, and what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OcpError {
    /// The problem has no phase.
    #[error("problem `{problem}` has no phase: add at least one with `phase`")]
    NoPhase {
        /// Name of the problem.
        problem: String,
    },
    /// The problem has no objective.
    #[error("problem `{problem}` has no objective: state one with `objective`")]
    NoObjective {
        /// Name of the problem.
        problem: String,
    },
    /// An array or a function has the wrong size.
    #[error("{place}: expected {expected} {what}, found {found}")]
    Dimension {
        /// Phase or constraint.
        place: String,
        /// The things that are counted.
        what: &'static str,
        /// The size that fits.
        expected: usize,
        /// The size that was given.
        found: usize,
    },
    /// Two things of one kind share a name.
    #[error("{place}: the {kind} name `{name}` is used twice")]
    DuplicateName {
        /// Problem or phase.
        place: String,
        /// Phase, state, control, ...
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A reference to something that does not exist.
    #[error("{place}: no {kind} is named `{name}`; known: {known}")]
    UnknownName {
        /// The place of the reference.
        place: String,
        /// Phase, state, ...
        kind: &'static str,
        /// The name that was not found.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// Bounds that are not a number or reversed.
    #[error("{place}: bounds [{lower}, {upper}] {unit} are not an interval (lower <= upper, no NaN)")]
    Bounds {
        /// Phase and quantity.
        place: String,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
        /// Unit of both.
        unit: String,
    },
    /// Bounds that contradict each other.
    #[error("{place}: {reason}")]
    Contradiction {
        /// Phase and quantity.
        place: String,
        /// The two statements that contradict each other.
        reason: String,
    },
    /// A scale or tolerance that is not a positive finite number.
    #[error("{place}: {what} {value} must be positive and finite")]
    Scale {
        /// Phase and quantity.
        place: String,
        /// Scale, tolerance, ...
        what: &'static str,
        /// The value given.
        value: f64,
    },
    /// A mesh, or nodes of a polynomial or of samples, that do not fit.
    #[error("{place}: {reason}")]
    Mesh {
        /// Phase, mesh, polynomial or samples.
        place: String,
        /// The mistake, and what is allowed instead.
        reason: String,
    },
    /// A guess or a trajectory that does not fit.
    #[error("guess of {place}: {reason}")]
    Guess {
        /// Phase.
        place: String,
        /// The mistake, and what is allowed instead.
        reason: String,
    },
}
