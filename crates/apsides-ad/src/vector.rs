//! Small vectors of scalars: products and norms that are smooth everywhere.

use crate::Scalar;

/// Inner product.
#[inline]
#[must_use]
pub fn dot<S: Scalar, const N: usize>(a: &[S; N], b: &[S; N]) -> S {
    if N == 0 {
        return S::from(0.0);
    }
    let mut sum = a[0] * b[0];
    for k in 1..N {
        sum += a[k] * b[k];
    }
    sum
}

/// Cross product.
#[inline]
#[must_use]
pub fn cross<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> [S; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Vector times a scalar.
#[inline]
#[must_use]
pub fn scale<S: Scalar, const N: usize>(a: &[S; N], factor: S) -> [S; N] {
    a.map(|x| x * factor)
}

/// Sum of two vectors.
#[inline]
#[must_use]
pub fn add<S: Scalar, const N: usize>(a: &[S; N], b: &[S; N]) -> [S; N] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// Euclidean norm `sqrt(a.a + epsilon^2)`: exact for `epsilon = 0`, smooth at the origin for `epsilon > 0`
/// (same unit as `a`), where it is `epsilon` too large at the origin and `epsilon^2 / (2 |a|)` elsewhere.
#[inline]
#[must_use]
pub fn norm<S: Scalar, const N: usize>(a: &[S; N], epsilon: f64) -> S {
    (dot(a, a) + epsilon * epsilon).sqrt()
}
