//! Sums of products of coefficients, `sum_(0 < j < k) a[j] b[k - j]`, all those of an order at once, four in the lanes of a vector.

use std::array::from_fn;

use super::places::{Places, WIDTH};

/// Orders that there is room for.
pub(super) const ROOM: usize = 32;

/// A sum of products: two values, whether those of the first count times their order, and the factor of the sum, which is then
/// divided by the order of the sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Products {
    pub(super) first: u32,
    pub(super) second: u32,
    pub(super) by_order: bool,
    /// Index of the factor among the coefficients of the substitution.
    pub(super) factor: usize,
}

/// Four sums of products, with the coefficients that they are of, at an address at which vectors do not cross lines of the cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct History {
    /// Coefficients of both factors, those of each order together.
    numbers: [[[f64; WIDTH]; ROOM]; 2],
    first: [u32; WIDTH],
    second: [u32; WIDTH],
    factors: [usize; WIDTH],
    /// One where coefficients count as they are, and one where they count times their order.
    plain: [f64; WIDTH],
    by_order: [f64; WIDTH],
    scale: [f64; WIDTH],
}

impl History {
    /// Lanes without products repeat the last ones.
    pub(super) fn new(products: &[Products]) -> Self {
        let lane = |l: usize| products[l.min(products.len() - 1)];
        let by_order = from_fn(|l| f64::from(u8::from(lane(l).by_order)));
        Self {
            first: from_fn(|l| lane(l).first),
            second: from_fn(|l| lane(l).second),
            factors: from_fn(|l| lane(l).factor),
            plain: by_order.map(|v| 1.0 - v),
            by_order,
            scale: [0.0; WIDTH],
            numbers: [[[0.0; WIDTH]; ROOM]; 2],
        }
    }

    /// Takes the factors.
    pub(super) fn scale(&mut self, coefficients: &[f64]) {
        self.scale = self.factors.map(|k| coefficients[k]);
    }

    /// The sums of order `K` above one, where `row` has the values of the order before; those of lower orders were given in turn.
    ///
    /// From the middle to both ends, in two sums: those found last stand at the ends, so that nothing waits for them before the last
    /// addition.
    #[inline(always)]
    pub(super) fn advance<const K: usize, R: Places + ?Sized>(
        &mut self,
        reciprocal: f64,
        row: &R,
    ) -> [f64; WIDTH] {
        let order = (K - 1) as f64;
        let [a, b] = &mut self.numbers;
        let first = self.first.map(|v| row.at(v));
        a[K - 1] = from_fn(|l| first[l] * (self.plain[l] + self.by_order[l] * order));
        let second = self.second.map(|v| row.at(v));
        b[K - 1] = from_fn(|l| second[l] * self.scale[l]);
        let mut sums = [[0.0; WIDTH]; 2];
        if K.is_multiple_of(2) {
            sums[0] = from_fn(|l| a[K / 2][l] * b[K / 2][l]);
        }
        for j in (1..K.div_ceil(2)).rev() {
            for l in 0..WIDTH {
                sums[0][l] += a[j][l] * b[K - j][l];
                sums[1][l] += a[K - j][l] * b[j][l];
            }
        }
        from_fn(|l| (sums[0][l] + sums[1][l]) * (self.plain[l] + self.by_order[l] * reciprocal))
    }
}
