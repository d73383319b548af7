//! Values with their dimensions.

use crate::dimension::Dimension;

/// A number that is known, or a value that operations make of what is not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<V> {
    /// A number.
    Number(f64),
    /// A value that operations made.
    Recorded(V),
}

/// A value in coherent SI units with its dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity<V> {
    /// Its value.
    pub value: Value<V>,
    /// Its dimension.
    pub dimension: Dimension,
    /// A zero that is written as such goes with any unit.
    pub(crate) zero: bool,
}

impl<V> Quantity<V> {
    /// A quantity of a dimension.
    #[must_use]
    pub fn new(value: Value<V>, dimension: Dimension) -> Self {
        Self { value, dimension, zero: false }
    }

    /// The number, where the quantity is known.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self.value {
            Value::Number(number) => Some(number),
            Value::Recorded(_) => None,
        }
    }
}
