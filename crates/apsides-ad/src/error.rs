//! Reasons to refuse a formula or a table.

use std::fmt;

/// An ill-formed formula, or a table that cannot be interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AdError {
    /// An input that the formula does not have.
    #[error("there is no input {index}: there are {inputs}")]
    Input {
        /// Its index.
        index: usize,
        /// Number of inputs.
        inputs: usize,
    },
    /// An operation or an output takes a value that does not stand before it.
    #[error("{taker} takes value {value}, which does not stand before it")]
    Operand {
        /// The operation or output that takes it.
        taker: Taker,
        /// The value.
        value: usize,
    },
    /// An operation looks up a table that does not exist or has another number of variables.
    #[error(
        "operation {operation} looks up table {table}, which does not exist or has another number of variables"
    )]
    Table {
        /// Index of the operation.
        operation: usize,
        /// Index of the table.
        table: usize,
    },
    /// A value, an exponent or a function of constants is not a number.
    #[error("operation {operation} is a constant that is not a number")]
    NotANumber {
        /// Index of the operation.
        operation: usize,
    },
    /// A handle belongs to another builder.
    #[error("a value belongs to another formula")]
    Foreign,
    /// The width of a smooth function is not a positive number.
    #[error("the width of a smooth function must be positive and finite")]
    Width,
    /// There are more than 2^31 values.
    #[error("a formula has at most 2^31 values")]
    TooLarge,
    /// Fewer knots in a direction than the table takes.
    #[error("the table takes at least {least} knots in each direction")]
    TooShort {
        /// The fewest knots.
        least: usize,
    },
    /// Knots that do not increase, or a number that is not finite.
    #[error("the knots must be finite and increase, the values be finite")]
    Knots,
    /// The number of values is not that of the knots.
    #[error("{found} values for {expected} knots")]
    Length {
        /// Values that the knots ask for.
        expected: usize,
        /// Values given.
        found: usize,
    },
}

/// A place of a formula that takes values, by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taker {
    /// An operation.
    Operation(usize),
    /// An output; outputs stand after all operations.
    Output(usize),
}

impl fmt::Display for Taker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Operation(index) => write!(f, "operation {index}"),
            Self::Output(index) => write!(f, "output {index}"),
        }
    }
}
