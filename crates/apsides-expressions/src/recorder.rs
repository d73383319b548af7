//! The interface to whatever a formula is made into.

use std::hash::Hash;

use crate::function::{Binary, Unary};
use crate::token::Comparison;

/// Takes the operations of a formula one by one, for instance into a program that is evaluated often.
///
/// Operations with numbers alone never arrive: their values do.
pub trait Recorder {
    /// A value that an operation made.
    type Value: Copy + Eq + Hash;

    /// A number.
    fn constant(&mut self, number: f64) -> Self::Value;

    /// A function of one value.
    fn unary(&mut self, function: Unary, x: Self::Value) -> Self::Value;

    /// A function of two values.
    fn binary(&mut self, function: Binary, x: Self::Value, y: Self::Value) -> Self::Value;

    /// A power with an exponent that is a number.
    fn power(&mut self, x: Self::Value, exponent: f64) -> Self::Value;

    /// `then` where `left` and `right` compare so, else `otherwise`.
    fn select(
        &mut self,
        comparison: Comparison,
        left: Self::Value,
        right: Self::Value,
        then: Self::Value,
        otherwise: Self::Value,
    ) -> Self::Value;

    /// A table, by its index, at as many values as it has variables.
    fn table(&mut self, index: usize, at: &[Self::Value]) -> Self::Value;
}
