//! Reasons to refuse a parameter.

/// A physical parameter outside its range, or a state without an orbit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DynamicsError {
    /// The parameter is not a finite number in the allowed range.
    #[error("{what} is {value} {unit}, allowed is {allowed}")]
    Parameter {
        /// The quantity that was given.
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
        /// The defect of the row.
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

/// A refusal of a row, counted from 0.
fn row(what: &'static str, row: usize, reason: String) -> DynamicsError {
    DynamicsError::Table { what, row: row + 1, reason }
}

/// A refusal of a table of too few rows.
pub(crate) fn short(what: &'static str, rows: usize, least: usize) -> DynamicsError {
    row(what, rows, format!("the table has {rows} rows, at least {least} are needed"))
}

/// Finite numbers, each above the one before it.
pub(crate) fn increasing(what: &'static str, column: &[f64]) -> Result<(), DynamicsError> {
    for (k, value) in column.iter().enumerate() {
        if !value.is_finite() {
            return Err(row(what, k, format!("{value} is not finite")));
        }
        if k > 0 && *value <= column[k - 1] {
            return Err(row(what, k, format!("{value} is not above {} of the row before", column[k - 1])));
        }
    }
    if column.len() < 2 { Err(short(what, column.len(), 2)) } else { Ok(()) }
}

/// As many finite positive numbers as there are rows.
pub(crate) fn positive_column(what: &'static str, column: &[f64], rows: usize) -> Result<(), DynamicsError> {
    finite_column(what, column, rows)?;
    match column.iter().position(|value| *value <= 0.0) {
        Some(k) => Err(row(what, k, format!("{} is not positive", column[k]))),
        None => Ok(()),
    }
}

/// As many finite numbers as there are rows.
pub(crate) fn finite_column(what: &'static str, column: &[f64], rows: usize) -> Result<(), DynamicsError> {
    if column.len() != rows {
        let reason = format!("{} values for {rows} rows", column.len());
        return Err(row(what, column.len().min(rows), reason));
    }
    match column.iter().position(|value| !value.is_finite()) {
        Some(k) => Err(row(what, k, format!("{} is not finite", column[k]))),
        None => Ok(()),
    }
}
