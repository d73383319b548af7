//! Requests that cannot be answered.

use apsides_kkt::KktError;

/// An ill-posed problem or setting. Failing to converge is not an error but a [`Status`](crate::Status).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NlpError {
    /// A pattern names a position outside its matrix.
    #[error(
        "entry {entry} of the {matrix} pattern is ({row}, {col}); the matrix has {rows} rows and {cols} columns"
    )]
    PatternRange {
        /// "Jacobian" or "Hessian".
        matrix: &'static str,
        /// Index of the entry in the pattern.
        entry: usize,
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        cols: usize,
    },
    /// The Hessian pattern names a position above the diagonal.
    #[error(
        "entry {entry} of the Hessian pattern is ({row}, {col}); only the lower triangle (row >= column) is allowed"
    )]
    UpperTriangle {
        /// Index of the entry in the pattern.
        entry: usize,
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
    },
    /// A vector has the wrong length.
    #[error("{what} has length {found}; {expected} is needed")]
    Length {
        /// Name of the vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length needed.
        expected: usize,
    },
    /// Bounds are NaN, reversed, or infinite on the wrong side.
    #[error(
        "{kind} {index} has the bounds [{lower}, {upper}]; lower <= upper is needed, lower < inf, upper > -inf, no NaN"
    )]
    Bounds {
        /// "variable" or "constraint".
        kind: &'static str,
        /// Its index.
        index: usize,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A scale is not positive and finite.
    #[error("the unit of {kind} {index} is {value}; a positive finite number is needed")]
    Scale {
        /// "variable", "constraint" or "objective".
        kind: &'static str,
        /// Its index; zero for the objective.
        index: usize,
        /// The unit found.
        value: f64,
    },
    /// A starting value is not finite.
    #[error("{what}[{index}] is {value}; a finite number is needed")]
    Start {
        /// Name of the starting vector.
        what: &'static str,
        /// Index in it.
        index: usize,
        /// The value found.
        value: f64,
    },
    /// A setting is outside its range.
    #[error("setting `{name}` is {value}; {allowed} is needed")]
    Setting {
        /// Field of [`NlpSettings`](crate::NlpSettings).
        name: &'static str,
        /// The value found.
        value: f64,
        /// The values that are allowed.
        allowed: &'static str,
    },
    /// A perturbation does not fit the problem or its solution.
    #[error("perturbation, {what} {index}: {reason}")]
    Perturbation {
        /// The part of it that does not fit.
        what: &'static str,
        /// Index of the variable or constraint; zero for the objective.
        index: usize,
        /// The defect, or what is allowed.
        reason: &'static str,
    },
    /// A point has no derivative with respect to a parameter.
    #[error("the solution has no derivative with respect to a parameter: {reason}")]
    NoDerivative {
        /// The reason.
        reason: &'static str,
    },
    /// The linear system could not be analysed.
    #[error("linear system: {0}")]
    Kkt(#[from] KktError),
}
