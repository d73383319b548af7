//! Norms and products of vectors, and loops over them.

use pulp::Arch;

/// Accumulators that do not wait for each other.
const LANES: usize = 4;

/// Runs a loop without dependencies in the vectors that the machine has: the same operations, of more numbers at once. Slices are cut to one length
/// within the loop.
#[inline(always)]
pub(crate) fn in_vectors<T>(work: impl FnOnce() -> T) -> T {
    Arch::new().dispatch(work)
}

/// Takes items into accumulators that begin with zero, one after the other.
fn in_lanes<T>(items: &[T], take: impl Fn(&mut f64, &T)) -> [f64; LANES] {
    let mut lanes = [0.0; LANES];
    let (chunks, rest) = items.as_chunks::<LANES>();
    for chunk in chunks {
        for k in 0..LANES {
            take(&mut lanes[k], &chunk[k]);
        }
    }
    for (lane, item) in lanes.iter_mut().zip(rest) {
        take(lane, item);
    }
    lanes
}

/// The same for pairs.
fn pairs_in_lanes(a: &[f64], b: &[f64], take: impl Fn(&mut f64, f64, f64)) -> [f64; LANES] {
    let mut lanes = [0.0; LANES];
    let ((a_chunks, a_rest), (b_chunks, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a_chunks.iter().zip(b_chunks) {
        for k in 0..LANES {
            take(&mut lanes[k], a[k], b[k]);
        }
    }
    for (lane, (a, b)) in lanes.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        take(lane, *a, *b);
    }
    lanes
}

/// One instruction, where `f64::max` takes several.
fn raise(lane: &mut f64, size: f64) {
    *lane = if size > *lane { size } else { *lane };
}

fn total([a, b, c, d]: [f64; LANES]) -> f64 {
    (a + b) + (c + d)
}

/// Largest absolute value of some items; zero if there are none. It passes over what is not a number.
pub(crate) fn largest<T>(items: &[T], value: impl Fn(&T) -> f64) -> f64 {
    in_lanes(items, |lane, item| raise(lane, value(item).abs())).into_iter().fold(0.0, f64::max)
}

/// Sum of the values of some items.
pub(crate) fn sum<T>(items: &[T], value: impl Fn(&T) -> f64) -> f64 {
    total(in_lanes(items, |lane, item| *lane += value(item)))
}

/// Says whether all values are finite, without a branch for each.
pub(crate) fn all_finite(values: &[f64]) -> bool {
    in_vectors(|| values.iter().fold(true, |all, value| all & (value.abs() < f64::INFINITY)))
}

/// Largest absolute entry; zero for an empty vector.
pub(crate) fn max_abs(values: &[f64]) -> f64 {
    largest(values, |value| *value)
}

/// Sum of the absolute entries.
pub(crate) fn sum_abs(values: &[f64]) -> f64 {
    sum(values, |value| value.abs())
}

/// Largest absolute product of an entry with its factor.
pub(crate) fn max_product(values: &[f64], factors: &[f64]) -> f64 {
    let lanes = pairs_in_lanes(values, factors, |lane, value, factor| raise(lane, (value * factor).abs()));
    lanes.into_iter().fold(0.0, f64::max)
}

/// Inner product of vectors of one length.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    total(pairs_in_lanes(a, b, |lane, a, b| *lane += a * b))
}

/// A sum of natural logarithms of positive numbers between 1e-200 and 1e200, taken of products as far as those are in range.
pub(crate) struct LogarithmSum {
    products: [f64; LANES],
    sum: f64,
}

impl LogarithmSum {
    /// The sum of nothing.
    pub(crate) fn new() -> Self {
        Self { products: [1.0; LANES], sum: 0.0 }
    }

    /// Adds the logarithms of the values of some items.
    pub(crate) fn add<T>(&mut self, items: &[T], value: impl Fn(&T) -> f64) {
        const RANGE: std::ops::RangeInclusive<f64> = 1e-100..=1e100;
        let (chunks, rest) = items.as_chunks::<LANES>();
        for chunk in chunks {
            let mut is_inside = true;
            for k in 0..LANES {
                self.products[k] *= value(&chunk[k]);
                is_inside &= RANGE.contains(&self.products[k]);
            }
            if !is_inside {
                self.take_in_products();
            }
        }
        for (product, item) in self.products.iter_mut().zip(rest) {
            *product *= value(item);
        }
        if !self.products.iter().all(|product| RANGE.contains(product)) {
            self.take_in_products();
        }
    }

    fn take_in_products(&mut self) {
        self.sum = self.value();
        self.products = [1.0; LANES];
    }

    /// The sum so far.
    pub(crate) fn value(&self) -> f64 {
        self.sum + total(self.products.map(f64::ln))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of a sum of some hundred terms.
    const ROUNDING: f64 = 1e-13;

    fn sum_of_logarithms(values: &[f64]) -> f64 {
        let mut sum = LogarithmSum::new();
        sum.add(values, |value| *value);
        sum.value()
    }

    #[test]
    fn logarithms_are_summed_beyond_the_range_of_the_products() {
        let values: Vec<f64> = (0..999).map(|k| 10.0_f64.powi(k % 41 - 30) * (1.0 + f64::from(k))).collect();
        let expected: f64 = values.iter().map(|value| value.ln()).sum();
        assert!((sum_of_logarithms(&values) / expected - 1.0).abs() < ROUNDING);
        assert_eq!(sum_of_logarithms(&[]), 0.0);
        assert_eq!(sum_of_logarithms(&[2.0, 0.0]), f64::NEG_INFINITY);
        assert!(sum_of_logarithms(&[1.0, f64::NAN]).is_nan());
    }

    #[test]
    fn sums_and_products_of_all_lengths() {
        for length in 0..10_u8 {
            let a: Vec<f64> = (0..length).map(|k| f64::from(k) - 4.0).collect();
            let b: Vec<f64> = a.iter().map(|a| 2.0 * a + 1.0).collect();
            // Whole numbers are summed without rounding.
            assert_eq!(dot(&a, &b), a.iter().zip(&b).map(|(a, b)| a * b).sum());
            assert_eq!(sum_abs(&a), a.iter().map(|a| a.abs()).sum());
            assert_eq!(max_abs(&a), a.iter().fold(0.0, |m, a| a.abs().max(m)));
            assert_eq!(max_product(&a, &b), a.iter().zip(&b).fold(0.0, |m, (a, b)| (a * b).abs().max(m)));
        }
    }

    #[test]
    fn the_largest_magnitude_passes_over_what_is_not_a_number() {
        assert_eq!(max_abs(&[1.0, -3.0, f64::NAN, 2.0, 0.5]), 3.0);
        assert_eq!(max_abs(&[]), 0.0);
        assert_eq!(max_product(&[1.0, -3.0], &[5.0, 2.0]), 6.0);
        assert_eq!(max_product(&[1.0, -3.0, f64::NAN], &[5.0, 2.0, 1.0]), 6.0);
    }
}
