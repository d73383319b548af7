//! Reasons to refuse a parameter.

/// A physical parameter outside its range.
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
}

/// Passes a finite positive value on.
pub(crate) fn positive(what: &'static str, value: f64, unit: &'static str) -> Result<f64, DynamicsError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(DynamicsError::Parameter { what, value, unit, allowed: "a positive finite number" })
    }
}
