//! Rows of a discretised problem in the words of its statement.

use std::fmt;

/// Amounts below this have no digit among the first six.
const LEAST_DIGIT: f64 = 5e-7;

/// The origin of a constraint row of a discretised problem.
#[derive(Clone, Debug, PartialEq)]
pub struct RowOrigin {
    /// Phase, unless the row joins ends of phases.
    pub phase: Option<String>,
    /// Name of the constraint: `equation of motion of speed`, `heat rate`, `link braking-descent: radius`.
    pub name: String,
    /// Unit of the row.
    pub unit: String,
    /// Time of the row in the phase, where it has one.
    pub time: Option<f64>,
}

/// The constraint that is violated most, relative to its scale, when no feasible point was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Unmet {
    /// The constraint and its place.
    pub origin: RowOrigin,
    /// By how much it is violated, in its unit; negative below a lower bound.
    pub amount: f64,
}

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RowOrigin { phase, name, unit, time } = &self.origin;
        if let Some(p) = phase {
            write!(f, "phase `{p}`, ")?;
        }
        write!(f, "constraint `{name}`")?;
        if let Some(t) = time {
            write!(f, ", t = {t:.3} s")?;
        }
        let amount = self.amount.abs();
        // Small amounts count where the scale of the constraint is small.
        if amount < LEAST_DIGIT {
            write!(f, ": violated by {amount:.2e} {unit}")
        } else {
            write!(f, ": violated by {amount:.6} {unit}")
        }
    }
}
