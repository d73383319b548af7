//! The error of the crate: an ill-posed request.

use thiserror::Error;

/// An ill-posed request. A singular matrix is no error: see [`Inertia::zero`](crate::Inertia::zero).
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum KktError {
    /// A slice has the wrong length.
    #[error("{what}: length {found}, expected {expected}")]
    Dimension {
        /// The argument.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length the system needs.
        expected: usize,
    },
    /// More primal rows than rows.
    #[error("{primal} primal rows exceed the {n} rows of the system")]
    PrimalRows {
        /// Primal rows asked for.
        primal: usize,
        /// Rows of the system.
        n: usize,
    },
    /// A triplet lies outside the matrix.
    #[error("triplet {index}: entry ({row}, {col}) lies outside the {n} x {n} matrix")]
    OutOfBounds {
        /// Position in the triplet list.
        index: usize,
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        col: usize,
        /// Rows of the system.
        n: usize,
    },
    /// The custom elimination order is no permutation of the rows.
    #[error("elimination order: position {position} holds row {row}, which is repeated or not below {n}")]
    Permutation {
        /// Position in the elimination order.
        position: usize,
        /// The offending row.
        row: usize,
        /// Rows of the system.
        n: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what}: entry {index} is not finite")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Position in the argument (0 for a scalar).
        index: usize,
    },
    /// A setting or shift is out of its range.
    #[error("{what} is {value}, allowed is a finite number of at least 0")]
    Negative {
        /// The setting or argument.
        what: &'static str,
        /// Its value, as text so that the error can be compared.
        value: f64,
    },
    /// The factor has more entries than 32-bit indices address, or memory ran out.
    #[error("the factor of the {n} x {n} system does not fit in memory or in 32-bit indices")]
    TooLarge {
        /// Rows of the system.
        n: usize,
    },
    /// `solve` before a successful `factor`.
    #[error("solve was called before a successful factor")]
    NotFactored,
}
