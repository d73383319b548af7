//! Norms and products of vectors.

/// Largest absolute entry; zero for an empty vector.
pub(crate) fn max_abs(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Largest absolute product of an entry with its factor.
pub(crate) fn max_product(values: &[f64], factors: &[f64]) -> f64 {
    values.iter().zip(factors).fold(0.0, |largest, (value, factor)| largest.max((value * factor).abs()))
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
