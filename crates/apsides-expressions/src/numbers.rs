//! Formulas of numbers alone.

use crate::function::{Binary, Unary};
use crate::recorder::Recorder;
use crate::token::Comparison;

/// The recorder of formulas that depend on nothing: no operation ever reaches it.
#[derive(Clone, Copy, Debug)]
pub struct Numbers;

/// The value of an operation that is never recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Nothing;

impl Recorder for Numbers {
    type Value = Nothing;

    fn constant(&mut self, _: f64) -> Nothing {
        Nothing
    }

    fn unary(&mut self, _: Unary, _: Nothing) -> Nothing {
        Nothing
    }

    fn binary(&mut self, _: Binary, _: Nothing, _: Nothing) -> Nothing {
        Nothing
    }

    fn power(&mut self, _: Nothing, _: f64) -> Nothing {
        Nothing
    }

    fn select(&mut self, _: Comparison, _: Nothing, _: Nothing, _: Nothing, _: Nothing) -> Nothing {
        Nothing
    }

    fn table(&mut self, _: usize, _: &[Nothing]) -> Nothing {
        Nothing
    }
}
