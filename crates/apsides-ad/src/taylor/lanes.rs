//! The recurrences of up to four values of one rule at once.

use std::array::from_fn;

use super::convolutions::ROOM;
use super::rules::{Item, Kind};

/// Values that are computed at once.
pub(super) const WIDTH: usize = 4;

/// A number of each lane for each order, at an address at which vectors do not cross lines of the cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct History([[f64; WIDTH]; ROOM]);

/// Values of one rule, with the coefficients of what they are made of.
///
/// Places of values are below the length of a row.
#[derive(Clone, Debug)]
pub(super) struct Lanes {
    kind: Kind,
    items: Vec<Item>,
    out: [usize; WIDTH],
    first: [usize; WIDTH],
    second: [usize; WIDTH],
    exponent: [f64; WIDTH],
    /// Reciprocals of coefficients of order zero.
    inverse: [f64; WIDTH],
    /// Coefficients of the factors; of the second they are the values themselves in quotients and powers.
    a: Box<History>,
    b: Box<History>,
}

impl Lanes {
    /// Lanes without an item repeat the last one.
    pub(super) fn new(kind: Kind, items: &[Item]) -> Self {
        let item = |l: usize| items[l.min(items.len() - 1)];
        let room = || Box::new(History([[0.0; WIDTH]; ROOM]));
        Self {
            kind,
            items: items.to_vec(),
            out: from_fn(|l| item(l).out),
            first: from_fn(|l| item(l).first),
            second: from_fn(|l| item(l).second),
            exponent: from_fn(|l| item(l).exponent),
            inverse: [0.0; WIDTH],
            a: room(),
            b: room(),
        }
    }

    /// Coefficients of order zero.
    pub(super) fn begin(&mut self, row: &mut [f64]) {
        self.kind.begin(&mut self.items, row);
    }

    /// Takes what is needed of the coefficients of order zero, once all are known.
    pub(super) fn take(&mut self, zeroth: &[f64]) {
        let [first, second, out] =
            [self.first, self.second, self.out].map(|values| values.map(|v| zeroth[v]));
        match self.kind {
            Kind::Square | Kind::Product => (self.a.0[0], self.b.0[0]) = (first, second),
            Kind::Quotient => (self.b.0[0], self.inverse) = (out, second.map(f64::recip)),
            Kind::Power => (self.b.0[0], self.inverse) = (out, first.map(f64::recip)),
            Kind::Integral => self.b.0[0] = second,
        }
    }

    /// Coefficients of order `k` above zero in `row`, given those of the order before in `before`.
    #[inline(always)]
    pub(super) fn advance(&mut self, k: usize, reciprocal: f64, before: &[f64], row: &mut [f64]) {
        let (k, order) = (k % ROOM, k as f64);
        let Self { a, b, inverse, .. } = self;
        let (a, b) = (&mut a.0, &mut b.0);
        let first = self.first.map(|v| row[v]);
        let found: [f64; WIDTH] = match self.kind {
            Kind::Square => {
                a[k] = first;
                let (half, zeroth) = (k.div_ceil(2), a[0]);
                let sum = products(&a[1..half], &a[k + 1 - half..k]);
                let middle = if k.is_multiple_of(2) { a[k / 2].map(|v| v * v) } else { [0.0; WIDTH] };
                from_fn(|l| 2.0 * (sum[l] + first[l] * zeroth[l]) + middle[l])
            }
            Kind::Product => {
                let second = self.second.map(|v| row[v]);
                let (x, y, sum) = (a[0], b[0], products(&a[1..k], &b[1..k]));
                (a[k], b[k]) = (first, second);
                from_fn(|l| sum[l] + (first[l] * y[l] + x[l] * second[l]))
            }
            Kind::Quotient => {
                let by = self.second.map(|v| row[v]);
                let (zeroth, sum) = (b[0], products(&a[1..k], &b[1..k]));
                let found = from_fn(|l| (first[l] - (sum[l] + by[l] * zeroth[l])) * inverse[l]);
                (a[k], b[k]) = (by, found);
                found
            }
            Kind::Power => {
                let (zeroth, c) = (b[0], self.exponent);
                let mut sum: [f64; WIDTH] = from_fn(|l| first[l] * (order * (c[l] * zeroth[l])));
                for j in 1..k {
                    for l in 0..WIDTH {
                        sum[l] += ((c[l] + 1.0) * j as f64 - order) * a[j][l] * b[k - j][l];
                    }
                }
                let found = from_fn(|l| sum[l] * (reciprocal * inverse[l]));
                (a[k], b[k]) = (first, found);
                found
            }
            Kind::Integral => {
                b[k - 1] = self.second.map(|v| before[v]);
                let sum = products(&a[1..k], &b[1..k]);
                let (zeroth, moment) = (b[0], first.map(|v| v * order));
                a[k] = moment;
                from_fn(|l| (sum[l] + moment[l] * zeroth[l]) * reciprocal)
            }
        };
        for l in 0..WIDTH {
            row[self.out[l]] = found[l];
        }
    }
}

/// `sum_j a[j] b[n - 1 - j]` of `n` numbers in each lane.
///
/// From the middle to both ends, in two sums: those found last stand at the ends, so that nothing waits for them before the last addition.
#[inline(always)]
fn products(a: &[[f64; WIDTH]], b: &[[f64; WIDTH]]) -> [f64; WIDTH] {
    let n = a.len().min(b.len());
    let half = n / 2;
    let mut sums = [[0.0; WIDTH]; 2];
    if n % 2 == 1 {
        sums[0] = from_fn(|l| a[half][l] * b[half][l]);
    }
    let low = a[..half].iter().rev().zip(b[..half].iter().rev());
    let high = a[n - half..n].iter().zip(&b[n - half..n]);
    for ((a_low, b_low), (a_high, b_high)) in low.zip(high) {
        for l in 0..WIDTH {
            sums[0][l] += a_low[l] * b_high[l];
            sums[1][l] += a_high[l] * b_low[l];
        }
    }
    from_fn(|l| sums[0][l] + sums[1][l])
}
