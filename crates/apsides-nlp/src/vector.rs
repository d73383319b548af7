//! Norms and products of vectors.

/// Accumulators that do not wait for each other.
const LANES: usize = 4;

/// Largest absolute value; zero if there is none.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut lanes = [0.0; LANES];
    for (k, value) in values.into_iter().enumerate() {
        // One instruction, where `f64::max` takes several; it passes over what is not a number, too.
        let lane = &mut lanes[k % LANES];
        *lane = if value.abs() > *lane { value.abs() } else { *lane };
    }
    lanes.into_iter().fold(0.0, f64::max)
}

/// Largest absolute entry; zero for an empty vector.
pub(crate) fn max_abs(values: &[f64]) -> f64 {
    largest(values.iter().copied())
}

/// Largest absolute product of an entry with its factor.
pub(crate) fn max_product(values: &[f64], factors: &[f64]) -> f64 {
    largest(values.iter().zip(factors).map(|(value, factor)| value * factor))
}

/// Sum of the natural logarithms of positive numbers between 1e-200 and 1e200: of their products, as far as they are in range.
pub(crate) fn sum_of_logarithms(values: impl IntoIterator<Item = f64>) -> f64 {
    const RANGE: std::ops::RangeInclusive<f64> = 1e-100..=1e100;
    let mut products = [1.0; LANES];
    let mut sum = 0.0;
    for (k, value) in values.into_iter().enumerate() {
        let product = &mut products[k % LANES];
        *product *= value;
        if !RANGE.contains(product) {
            sum += product.ln();
            *product = 1.0;
        }
    }
    sum + products.into_iter().map(f64::ln).sum::<f64>()
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of a sum of some hundred terms.
    const ROUNDING: f64 = 1e-13;

    #[test]
    fn logarithms_are_summed_beyond_the_range_of_the_products() {
        let values = || (0..999).map(|k| 10.0_f64.powi(k % 41 - 30) * (1.0 + f64::from(k)));
        let expected: f64 = values().map(f64::ln).sum();
        assert!((sum_of_logarithms(values()) / expected - 1.0).abs() < ROUNDING);
        assert_eq!(sum_of_logarithms([]), 0.0);
        assert_eq!(sum_of_logarithms([2.0, 0.0]), f64::NEG_INFINITY);
        assert!(sum_of_logarithms([1.0, f64::NAN]).is_nan());
    }

    #[test]
    fn the_largest_magnitude_passes_over_what_is_not_a_number() {
        assert_eq!(max_abs(&[1.0, -3.0, f64::NAN, 2.0, 0.5]), 3.0);
        assert_eq!(max_abs(&[]), 0.0);
        assert_eq!(max_product(&[1.0, -3.0], &[5.0, 2.0]), 6.0);
    }
}
