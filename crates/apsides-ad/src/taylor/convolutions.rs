//! Sums of products of coefficients, `sum_(0 < j < k) a[j] b[k - j]`, all those of an order at once.
//!
//! The coefficients of one factor are kept in their order and those of the other one in reverse, so that eight products at a time are of
//! neighbours. What was found last is not read back from there, which would wait until it is written: its two products are added from rows.

use pulp::Simd;

/// Orders that there is room for.
pub(super) const ROOM: usize = 32;
/// Products that are taken at once.
const LANES: usize = 8;
/// Lowest order that is kept with others; the products with that of order one are added from rows.
const LOWEST: usize = 2;
/// Place of order zero among coefficients in reverse, which is zero there, as are the places after it.
const ZEROTH: usize = ROOM - LANES + 2;

/// The factor by which the product of `a[j]` and `b[k - j]` counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Weight {
    One,
    /// `j`.
    Order,
    /// `(c + 1) j - k`, as of the power `a^c`.
    Power(f64),
}

/// A sum of products of two values, at an address at which few vectors cross lines of the cache.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Convolution {
    /// Coefficients of the first factor from order two on; those that are not known yet are zero.
    forward: [f64; ROOM],
    /// Coefficients of the second factor from order two on, the highest first.
    reverse: [f64; ROOM],
    /// `(c + 1) j` of a power, from order two on.
    multiples: [f64; ROOM],
    /// Coefficients of order one.
    start: [f64; 2],
    first: usize,
    second: usize,
    weight: Weight,
}

impl Convolution {
    /// The products of two values.
    pub(super) fn new(first: usize, weight: Weight, second: usize) -> Self {
        let slope = if let Weight::Power(c) = weight { c + 1.0 } else { 0.0 };
        let multiples = std::array::from_fn(|k| slope * (k + LOWEST) as f64);
        let zeros = [0.0; ROOM];
        Self { first, second, weight, multiples, start: [0.0; 2], forward: zeros, reverse: zeros }
    }

    /// The newest coefficients, of a row; the first one times its order where that is its weight.
    #[inline(always)]
    fn newest(&self, order: f64, row: &[f64]) -> [f64; 2] {
        let first = row[self.first];
        [if self.weight == Weight::Order { first * order } else { first }, row[self.second]]
    }

    /// The rest of the weight of the coefficient of an order `j`, at the order `k`.
    #[inline(always)]
    fn rest(&self, j: f64, k: f64) -> f64 {
        if let Weight::Power(c) = self.weight { (c + 1.0) * j - k } else { 1.0 }
    }
}

/// The sums of an order of all `convolutions`, where rows before it are given in turn from order one on: `before` is the last one.
#[inline(always)]
pub(super) fn advance<S: Simd>(
    convolutions: &mut [Convolution],
    simd: S,
    order: usize,
    before: &[f64],
    sums: &mut [f64],
) {
    let each = sums.iter_mut().zip(convolutions.iter_mut());
    match order {
        0 => {}
        1 => {
            for (sum, c) in each {
                c.forward = [0.0; ROOM];
                *sum = 0.0;
            }
        }
        2 => {
            for (sum, c) in each {
                c.start = c.newest(1.0, before);
                *sum = c.start[0] * c.start[1] * c.rest(1.0, 2.0);
            }
        }
        _ => {
            // From two to the order less two, by eight.
            match (order - 3).div_ceil(LANES) {
                0 => sum::<S, 0>(convolutions, simd, order, before, sums),
                1 => sum::<S, 1>(convolutions, simd, order, before, sums),
                2 => sum::<S, 2>(convolutions, simd, order, before, sums),
                _ => sum::<S, 3>(convolutions, simd, order, before, sums),
            }
        }
    }
}

/// Products of `N` times eight kept coefficients and those of the newest ones, which are kept then.
#[inline(always)]
fn sum<S: Simd, const N: usize>(
    convolutions: &mut [Convolution],
    simd: S,
    order: usize,
    before: &[f64],
    sums: &mut [f64],
) {
    let newest = order - 1;
    // Where the coefficients of the order less two are.
    let from = ZEROTH + 1 - newest;
    let parts = LANES / S::F64_LANES;
    let (k, whole) = (order as f64, simd.splat_f64s(order as f64));
    for (sum, c) in sums.iter_mut().zip(convolutions) {
        let (a, _) = S::as_simd_f64s(&c.forward[..N * LANES]);
        let (multiples, _) = S::as_simd_f64s(&c.multiples[..N * LANES]);
        let (b, _) = S::as_simd_f64s(&c.reverse[from..from + N * LANES]);
        let mut lanes = [0.0; LANES];
        let (parts_of_sum, _) = S::as_mut_simd_f64s(&mut lanes);
        let is_power = matches!(c.weight, Weight::Power(_));
        for (j, ((&a, &b), &multiple)) in a.iter().zip(b).zip(multiples).enumerate() {
            let a = if is_power { simd.mul_f64s(simd.sub_f64s(multiple, whole), a) } else { a };
            let product = simd.mul_f64s(a, b);
            let sum = &mut parts_of_sum[j % parts];
            *sum = if j < parts { product } else { simd.add_f64s(*sum, product) };
        }
        let four: [f64; 4] = std::array::from_fn(|l| lanes[l] + lanes[l + 4]);
        let kept = (four[0] + four[2]) + (four[1] + four[3]);
        let [a, b] = c.newest(newest as f64, before);
        *sum = kept + (c.start[0] * c.rest(1.0, k) * b + a * c.rest(newest as f64, k) * c.start[1]);
        c.forward[newest - LOWEST] = a;
        c.reverse[ZEROTH - newest] = b;
    }
}
