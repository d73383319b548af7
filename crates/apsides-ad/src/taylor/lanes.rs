//! The recurrences of up to four values of one rule at once.

use std::array::from_fn;

use pulp::Simd;

use super::convolutions::ROOM;
use super::rules::{Item, Kind};

/// Values that are computed at once.
pub(super) const WIDTH: usize = 4;

/// A number of each lane for each order.
type History = Box<[[f64; WIDTH]; ROOM]>;

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
    a: History,
    b: History,
    /// Those of the first factor times their orders, of powers.
    moments: History,
}

impl Lanes {
    /// Lanes without an item repeat the last one.
    pub(super) fn new(kind: Kind, items: &[Item]) -> Self {
        let item = |l: usize| items[l.min(items.len() - 1)];
        let room = || Box::new([[0.0; WIDTH]; ROOM]);
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
            moments: room(),
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
            Kind::Square | Kind::Product => (self.a[0], self.b[0]) = (first, second),
            Kind::Quotient => (self.b[0], self.inverse) = (out, second.map(f64::recip)),
            Kind::Power => (self.b[0], self.inverse) = (out, first.map(f64::recip)),
            Kind::Integral => self.b[0] = second,
        }
    }

    /// Coefficients of order `k` above zero in `row`, given those of the order before in `before`.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(
        &mut self,
        simd: S,
        k: usize,
        reciprocal: f64,
        before: &[f64],
        row: &mut [f64],
    ) {
        let (k, order) = (k % ROOM, k as f64);
        let Self { a, b, inverse, .. } = self;
        let first = self.first.map(|v| row[v]);
        let found: [f64; WIDTH] = match self.kind {
            Kind::Square => {
                a[k] = first;
                let (half, zeroth) = (k.div_ceil(2), a[0]);
                let sum = products(simd, &a[1..half], &a[k + 1 - half..k]);
                let middle = if k.is_multiple_of(2) { a[k / 2].map(|v| v * v) } else { [0.0; WIDTH] };
                from_fn(|l| 2.0 * (sum[l] + first[l] * zeroth[l]) + middle[l])
            }
            Kind::Product => {
                let second = self.second.map(|v| row[v]);
                let (x, y, sum) = (a[0], b[0], products(simd, &a[1..k], &b[1..k]));
                (a[k], b[k]) = (first, second);
                from_fn(|l| sum[l] + (first[l] * y[l] + x[l] * second[l]))
            }
            Kind::Quotient => {
                let by = self.second.map(|v| row[v]);
                let (zeroth, sum) = (b[0], products(simd, &a[1..k], &b[1..k]));
                let found = from_fn(|l| (first[l] - (sum[l] + by[l] * zeroth[l])) * inverse[l]);
                (a[k], b[k]) = (by, found);
                found
            }
            Kind::Power => {
                let plain = products(simd, &a[1..k], &b[1..k]);
                let weighted = products(simd, &self.moments[1..k], &b[1..k]);
                let (zeroth, c) = (b[0], self.exponent);
                let found = from_fn(|l| {
                    let sum = (c[l] + 1.0) * weighted[l] - order * plain[l];
                    (sum + first[l] * (order * (c[l] * zeroth[l]))) * (reciprocal * inverse[l])
                });
                (a[k], b[k], self.moments[k]) = (first, found, first.map(|v| v * order));
                found
            }
            Kind::Integral => {
                b[k - 1] = self.second.map(|v| before[v]);
                let sum = products(simd, &a[1..k], &b[1..k]);
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
#[inline(always)]
fn products<S: Simd>(simd: S, a: &[[f64; WIDTH]], b: &[[f64; WIDTH]]) -> [f64; WIDTH] {
    let mut sum = [0.0; WIDTH];
    // The rest is of machines with more lanes than these.
    let (parts, rest) = S::as_mut_simd_f64s(&mut sum);
    for (a, b) in a.iter().zip(b.iter().rev()) {
        let ((a, more_a), (b, more_b)) = (S::as_simd_f64s(a), S::as_simd_f64s(b));
        for (sum, (&a, &b)) in parts.iter_mut().zip(a.iter().zip(b)) {
            *sum = simd.add_f64s(*sum, simd.mul_f64s(a, b));
        }
        for (sum, (a, b)) in rest.iter_mut().zip(more_a.iter().zip(more_b)) {
            *sum += a * b;
        }
    }
    sum
}
