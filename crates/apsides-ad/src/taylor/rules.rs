//! The rules that are convolutions, and their values of order zero.

use super::lowering::Start;
use crate::formula::Unary;

/// The rules that are convolutions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Kind {
    Square,
    Product,
    Quotient,
    Power,
    Integral,
}

/// One value of a rule: its place, those of its operands (of an integral the second is its slope), exponent and start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) out: usize,
    pub(super) first: usize,
    pub(super) second: usize,
    pub(super) exponent: f64,
    pub(super) start: Start,
    /// A fixed factor of the start.
    pub(super) by: Option<usize>,
}

impl Kind {
    /// Coefficients of order zero.
    pub(super) fn begin(self, items: &[Item], row: &mut [f64]) {
        for item in items {
            let first = row[item.first];
            row[item.out] = match self {
                Self::Square | Self::Product => first * row[item.second],
                Self::Quotient => first / row[item.second],
                Self::Power | Self::Integral => item.started(row),
            };
        }
    }
}

impl Item {
    fn started(&self, row: &[f64]) -> f64 {
        let first = row[self.first];
        let start = match self.start {
            Start::Unary(Unary::Sqrt) => first.sqrt(),
            Start::Unary(f) => f.apply(first),
            Start::Powf(c) => first.powf(c),
            Start::Atan2(x) => first.atan2(row[x]),
            Start::Zero => 0.0,
        };
        self.by.map_or(start, |by| start * row[by])
    }
}
