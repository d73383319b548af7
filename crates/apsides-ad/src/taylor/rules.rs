//! The recurrences of the coefficients of one order, given the sums of products of those before.

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
    /// Coefficients of order zero that newest ones are multiplied with.
    pub(super) zeroth: [f64; 2],
    /// Reciprocal of the coefficient of order zero of what is divided by.
    pub(super) inverse: f64,
}

impl Kind {
    /// Coefficients of an order above zero in `row`, given the sums of products of coefficients between, one for each item.
    #[inline(always)]
    pub(super) fn advance(self, items: &[Item], sums: &[f64], order: f64, reciprocal: f64, row: &mut [f64]) {
        let each = items.iter().zip(sums);
        match self {
            Self::Square | Self::Product => {
                for (i, sum) in each {
                    row[i.out] = sum + (row[i.first] * i.zeroth[1] + i.zeroth[0] * row[i.second]);
                }
            }
            Self::Quotient => {
                for (i, sum) in each {
                    row[i.out] = (row[i.first] - (sum + row[i.second] * i.zeroth[0])) * i.inverse;
                }
            }
            Self::Power => {
                for (i, sum) in each {
                    let newest = row[i.first] * (order * i.zeroth[0]);
                    row[i.out] = (sum + newest) * (reciprocal * i.inverse);
                }
            }
            Self::Integral => {
                for (i, sum) in each {
                    row[i.out] = sum * reciprocal + row[i.first] * i.zeroth[1];
                }
            }
        }
    }

    /// Coefficients of order zero.
    pub(super) fn begin(self, items: &mut [Item], row: &mut [f64]) {
        for item in items {
            let first = row[item.first];
            row[item.out] = match self {
                Self::Square | Self::Product => first * row[item.second],
                Self::Quotient => first / row[item.second],
                Self::Power | Self::Integral => item.started(row),
            };
        }
    }

    /// Takes what is needed of the coefficients of order zero, once all are known.
    pub(super) fn take(self, items: &mut [Item], zeroth: &[f64]) {
        for item in items {
            let [first, second, out] = [item.first, item.second, item.out].map(|v| zeroth[v]);
            match self {
                Self::Square | Self::Product | Self::Integral => item.zeroth = [first, second],
                Self::Quotient => (item.zeroth[0], item.inverse) = (out, second.recip()),
                Self::Power => (item.zeroth[0], item.inverse) = (item.exponent * out, first.recip()),
            }
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
