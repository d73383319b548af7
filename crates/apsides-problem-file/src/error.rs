//! Reasons to refuse the file of a problem.

use apsides_ad::AdError;
use apsides_expressions::ExpressionError;
use apsides_ocp::OcpError;

use crate::missing::Missing;
use crate::place::Place;

/// A mistake in the statement of a problem: where, what, and what is allowed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// The text is not TOML.
    #[error("{at}: {reason}{}", at.caret())]
    Syntax {
        /// The place.
        at: Box<Place>,
        /// The parser's message.
        reason: String,
    },
    /// A key that is not known.
    #[error("{at}: {owner} has no key `{key}`{suggestion}{}", at.caret())]
    UnknownKey {
        /// The place.
        at: Box<Place>,
        /// The table that it stands in.
        owner: String,
        /// The key.
        key: String,
        /// The nearest key or all of them, as the end of the sentence.
        suggestion: String,
    },
    /// A value of a wrong sort or size.
    #[error("{at}: {what} is {found}, allowed is {allowed}{}", at.caret())]
    Value {
        /// The place.
        at: Box<Place>,
        /// The value's path.
        what: String,
        /// The value.
        found: String,
        /// The values that are allowed.
        allowed: String,
    },
    /// A mistake in a formula.
    #[error("{at}: {source}{}{}", units(source), at.caret())]
    Formula {
        /// The place.
        at: Box<Place>,
        /// The mistake.
        source: ExpressionError,
    },
    /// Statements that do not go together, or a name that is used twice.
    #[error("{at}: {reason}{}", at.caret())]
    Conflict {
        /// The place.
        at: Box<Place>,
        /// The contradiction, and what to do.
        reason: String,
    },
    /// Parts of the problem that are not stated, all of them.
    #[error("{file}: the problem is not complete; missing {}:{}", if .missing.len() == 1 { "is" } else { "are" }, list(.missing))]
    Missing {
        /// Name of the file.
        file: String,
        /// The parts that are missing.
        missing: Vec<Missing>,
    },
    /// A table that cannot be interpolated.
    #[error("{at}: table `{name}`: {source}{}", at.caret())]
    Table {
        /// The place.
        at: Box<Place>,
        /// Name of the table.
        name: String,
        /// The mistake.
        source: AdError,
    },
    /// A formula without a value at any point.
    #[error("{at}: {source}{}", at.caret())]
    Program {
        /// The place.
        at: Box<Place>,
        /// The mistake.
        source: AdError,
    },
    /// The problem is refused as a whole.
    #[error("{file}: {source}")]
    Problem {
        /// Name of the file.
        file: String,
        /// The mistake.
        source: OcpError,
    },
}

/// The way out where a formula has no unit: one unit anywhere in a file has all of its formulas checked.
fn units(source: &ExpressionError) -> &'static str {
    match source {
        ExpressionError::Dimension { reason, .. } if reason.contains("no unit") => {
            "; one unit in a file has all formulas checked: give each quantity its own, or state `check_units = false` at the top of the file"
        }
        _ => "",
    }
}

fn list(missing: &[Missing]) -> String {
    missing.iter().map(|m| format!("\n  - {m}")).collect()
}
