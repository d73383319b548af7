//! The error of the crate: an ill-posed program.

use std::sync::Arc;

use thiserror::Error;

/// An ill-posed request. A program without a solution is no error: see [`Status`](crate::Status).
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConicError {
    /// An array has the wrong length.
    #[error("{what}: length {found}, expected {expected}")]
    Dimension {
        /// The argument.
        what: &'static str,
        /// The length that fits.
        expected: usize,
        /// The length that was given.
        found: usize,
    },
    /// There is nothing to choose.
    #[error("the program has no variable: `linear` needs one number per variable")]
    NoVariable,
    /// An entry lies outside its matrix.
    #[error("{what}: entry {index} at ({row}, {column}) lies outside {rows} x {columns}")]
    OutOfBounds {
        /// The matrix.
        what: &'static str,
        /// Position in the list of entries.
        index: usize,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// The quadratic term has an entry below its diagonal.
    #[error(
        "quadratic term: entry {index} at ({row}, {column}) is below the diagonal; give the upper triangle"
    )]
    LowerTriangle {
        /// Position in the list of entries.
        index: usize,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
    },
    /// A cone without components, or a second-order cone of one.
    #[error("cone {index}: {size} components; allowed are at least 1, and 2 for a second-order cone")]
    EmptyCone {
        /// Position in the list of cones.
        index: usize,
        /// Its components.
        size: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what}: number {index} is {value}; only finite numbers are allowed")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Position in the argument.
        index: usize,
        /// The number.
        value: f64,
    },
    /// A setting is out of its range.
    #[error("setting `{setting}` is {value}; it must be {allowed}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// The values that are allowed.
        allowed: &'static str,
    },
    /// The solver refused the program.
    #[error("the solver refuses the program: {0}")]
    Refused(#[source] Refusal),
}

/// The error of the solver behind the crate, whose type is not part of the interface.
#[derive(Clone, Debug, Error)]
#[error(transparent)]
pub struct Refusal(Arc<dyn std::error::Error + Send + Sync>);

impl Refusal {
    pub(crate) fn new(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }
}

impl PartialEq for Refusal {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

/// Checks a length.
pub(crate) fn require_length(what: &'static str, expected: usize, found: usize) -> Result<(), ConicError> {
    if expected == found { Ok(()) } else { Err(ConicError::Dimension { what, expected, found }) }
}

/// Checks that all numbers are finite.
pub(crate) fn require_finite(what: &'static str, values: &[f64]) -> Result<(), ConicError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(ConicError::NotFinite { what, index, value: values[index] }),
    }
}
