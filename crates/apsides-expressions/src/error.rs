//! Reasons to refuse a formula, each with its place.

use std::ops::Range;

/// A part of one of several texts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// The text, by the number that it was parsed with.
    pub text: usize,
    /// Its bytes.
    pub bytes: Range<usize>,
}

/// A mistake in a formula.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// Something else was expected.
    #[error("expected {expected}, found {found}")]
    Syntax {
        /// The place.
        at: Span,
        /// The words that may stand there.
        expected: &'static str,
        /// The word that does.
        found: String,
    },
    /// A formula that is too deep or too long.
    #[error("{what} more than {limit}, which is the most: {advice}")]
    Limit {
        /// The place.
        at: Span,
        /// The things that are counted.
        what: &'static str,
        /// The most.
        limit: usize,
        /// A way to do with less.
        advice: &'static str,
    },
    /// A name that stands for nothing.
    #[error("no {what} is named `{name}`{suggestion}")]
    UnknownName {
        /// The place.
        at: Span,
        /// Quantity, function or unit.
        what: &'static str,
        /// The name.
        name: String,
        /// The nearest name, as the end of the sentence.
        suggestion: String,
    },
    /// A text in brackets is no unit.
    #[error("{reason}")]
    Unit {
        /// The place.
        at: Span,
        /// The mistake, and what is allowed.
        reason: String,
    },
    /// A function with the wrong number of arguments.
    #[error("`{function}` takes {expected} argument{}, found {found}", if *.expected == 1 { "" } else { "s" })]
    Arguments {
        /// The place.
        at: Span,
        /// The function.
        function: String,
        /// The number that it takes.
        expected: usize,
        /// The number that it was given.
        found: usize,
    },
    /// Units that do not go together.
    #[error("{reason}")]
    Dimension {
        /// The place.
        at: Span,
        /// The contradiction.
        reason: String,
    },
    /// A definition that needs itself.
    #[error("the definition `{name}` needs itself: {path}")]
    Circle {
        /// The place.
        at: Span,
        /// The definition.
        name: String,
        /// The way round.
        path: String,
    },
    /// A name that stands for something that has no value here.
    #[error("{reason}")]
    Misplaced {
        /// The place.
        at: Span,
        /// The reason, and what to write.
        reason: String,
    },
    /// Arithmetic of numbers alone that has no finite value.
    #[error("{what} is {value}, no finite number")]
    NotFinite {
        /// The place.
        at: Span,
        /// The operation with its operands.
        what: String,
        /// Its value.
        value: f64,
    },
}

impl ExpressionError {
    /// The place of the mistake.
    #[must_use]
    pub fn at(&self) -> &Span {
        match self {
            Self::Syntax { at, .. }
            | Self::Limit { at, .. }
            | Self::UnknownName { at, .. }
            | Self::Unit { at, .. }
            | Self::Arguments { at, .. }
            | Self::Dimension { at, .. }
            | Self::Circle { at, .. }
            | Self::Misplaced { at, .. }
            | Self::NotFinite { at, .. } => at,
        }
    }
}
