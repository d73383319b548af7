//! Reasons to refuse a parameter.

/// A physical parameter outside its range, or a state without an orbit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DynamicsError {
    /// The parameter is not a finite number in the allowed range.
    #[error("{what} is {value} {unit}, allowed is {allowed}")]
    Parameter {
        /// What was given.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The allowed range in words.
        allowed: &'static str,
    },
    /// A row of a table does not fit.
    #[error("{what} in row {row} of the table: {reason}")]
    Table {
        /// The quantity of the column.
        what: &'static str,
        /// The row, counted from 1.
        row: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The velocity is zero or along the radius: the motion has no orbital plane and no elements.
    #[error("rectilinear motion at {radius} m from the centre with {speed} m/s: no orbital plane")]
    Rectilinear {
        /// Distance from the centre of the body, m.
        radius: f64,
        /// Speed, m/s.
        speed: f64,
    },
}

/// Passes a finite value on.
pub(crate) fn finite(what: &'static str, value: f64, unit: &'static str) -> Result<f64, DynamicsError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(DynamicsError::Parameter { what, value, unit, allowed: "a finite number" })
    }
}

/// Passes a finite positive value on.
pub(crate) fn positive(what: &'static str, value: f64, unit: &'static str) -> Result<f64, DynamicsError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(DynamicsError::Parameter { what, value, unit, allowed: "a positive finite number" })
    }
}
