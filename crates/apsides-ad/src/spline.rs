//! Tables as twice continuously differentiable functions of scalars: cubic splines in one variable and their tensor product in
//! two, with not-a-knot ends (C. de Boor, A Practical Guide to Splines, 2001, chapters IV and XVII).
//!
//! Outside the table the polynomial of the outermost interval goes on.
//!
//! ```
//! use apsides_ad::{CubicSpline, Scalar};
//!
//! let table = CubicSpline::new(&[0.0, 1.0, 2.0, 4.0], &[0.0, 1.0, 8.0, 64.0])?;
//! assert!((table.at(3.0_f64) - 27.0).abs() < 1e-12);
//! # Ok::<(), apsides_ad::AdError>(())
//! ```

use crate::error::AdError;

/// A cubic spline through a table of one variable.
#[derive(Clone, Debug, PartialEq)]
pub struct CubicSpline {
    knots: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the knots.
    curvatures: Vec<f64>,
}

/// A cubic spline in each variable through a table of two.
#[derive(Clone, Debug, PartialEq)]
pub struct BicubicSpline {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Per knot `(i, j)`, at `i * y.len() + j`: the value, its second derivatives by `x`, by `y`, and by both.
    nodes: Vec<[f64; 4]>,
}

impl CubicSpline {
    /// The spline with the given values at increasing knots, at least four.
    ///
    /// # Errors
    /// The table does not fit: see [`AdError`].
    pub fn new(knots: &[f64], values: &[f64]) -> Result<Self, AdError> {
        check(knots)?;
        check_values(values, knots.len())?;
        Ok(Self { knots: knots.into(), values: values.into(), curvatures: curvatures(knots, values) })
    }

    /// The knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The values at the knots.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Value, first and second derivative at `x`; for compositions inside one [`Scalar::map`](crate::Scalar::map).
    #[inline]
    #[must_use]
    pub fn derivatives(&self, x: f64) -> [f64; 3] {
        let (k, weights) = weights(&self.knots, x);
        weights.map(|[a, b, c, d]| {
            a * self.values[k] + b * self.values[k + 1] + c * self.curvatures[k] + d * self.curvatures[k + 1]
        })
    }
}

impl BicubicSpline {
    /// The spline with the values of a table with one row per knot of `x` and one column per knot of `y`.
    ///
    /// # Errors
    /// The table does not fit: see [`AdError`].
    pub fn new(x: &[f64], y: &[f64], values: &[f64]) -> Result<Self, AdError> {
        check(x)?;
        check(y)?;
        check_values(values, x.len() * y.len())?;
        let columns = y.len();
        let by_y = |table: &[f64]| -> Vec<f64> {
            table.chunks(columns).flat_map(|row| curvatures(y, row)).collect()
        };
        let mut by_x = vec![0.0; values.len()];
        for j in 0..columns {
            let column: Vec<f64> = values.iter().skip(j).step_by(columns).copied().collect();
            for (i, c) in curvatures(x, &column).into_iter().enumerate() {
                by_x[i * columns + j] = c;
            }
        }
        let (second, both) = (by_y(values), by_y(&by_x));
        let nodes = (0..values.len()).map(|k| [values[k], by_x[k], second[k], both[k]]).collect();
        Ok(Self { x: x.into(), y: y.into(), nodes })
    }

    /// The knots of `x` and of `y`.
    #[must_use]
    pub fn knots(&self) -> [&[f64]; 2] {
        [&self.x, &self.y]
    }

    /// The values at the knots, with one row per knot of `x` and one column per knot of `y`.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.nodes.iter().map(|node| node[0])
    }

    /// Value, derivatives by `x` and `y`, second derivatives by `xx`, `xy` and `yy`, at `(x, y)`; for compositions inside one
    /// [`Scalar::map2`](crate::Scalar::map2).
    #[inline]
    #[must_use]
    pub fn derivatives(&self, x: f64, y: f64) -> [f64; 6] {
        let (i, in_x) = weights(&self.x, x);
        let (j, in_y) = weights(&self.y, y);
        let sum = |p: usize, q: usize| {
            let mut sum = 0.0;
            for a in 0..2 {
                for b in 0..2 {
                    let [value, by_x, by_y, both] = self.nodes[(i + a) * self.y.len() + j + b];
                    let (value_x, curve_x) = (in_x[p][a], in_x[p][a + 2]);
                    let (value_y, curve_y) = (in_y[q][b], in_y[q][b + 2]);
                    sum += value_y * (value_x * value + curve_x * by_x)
                        + curve_y * (value_x * by_y + curve_x * both);
                }
            }
            sum
        };
        [sum(0, 0), sum(1, 0), sum(0, 1), sum(2, 0), sum(1, 1), sum(0, 2)]
    }
}

/// Knots of a spline.
fn check(knots: &[f64]) -> Result<(), AdError> {
    check_knots(knots, 4)
}

/// Increasing knots, not fewer than a number.
pub(crate) fn check_knots(knots: &[f64], least: usize) -> Result<(), AdError> {
    if knots.len() < least {
        return Err(AdError::TooShort { least });
    }
    let increasing = knots.windows(2).all(|w| w[0] < w[1]) && knots.iter().all(|k| k.is_finite());
    if increasing { Ok(()) } else { Err(AdError::Knots) }
}

pub(crate) fn check_values(values: &[f64], expected: usize) -> Result<(), AdError> {
    if values.len() != expected {
        return Err(AdError::Length { expected, found: values.len() });
    }
    if values.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(AdError::Knots) }
}

/// The interval of `x`, and the weights of the values and of the second derivatives at its ends in the value, the first
/// and the second derivative.
#[inline]
fn weights(knots: &[f64], x: f64) -> (usize, [[f64; 4]; 3]) {
    let k = knots[1..knots.len() - 1].partition_point(|knot| *knot <= x);
    let h = knots[k + 1] - knots[k];
    let b = (x - knots[k]) / h;
    let a = 1.0 - b;
    let value = [a, b, (a * a * a - a) * h * h / 6.0, (b * b * b - b) * h * h / 6.0];
    let first = [-1.0 / h, 1.0 / h, (1.0 - 3.0 * a * a) * h / 6.0, (3.0 * b * b - 1.0) * h / 6.0];
    (k, [value, first, [0.0, 0.0, a, b]])
}

/// Second derivatives at the knots: continuous first derivatives, and one cubic over the two intervals at each end.
fn curvatures(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let last = knots.len() - 1;
    let h: Vec<f64> = knots.windows(2).map(|w| w[1] - w[0]).collect();
    let slope = |k: usize| (values[k + 1] - values[k]) / h[k];
    // The ends are eliminated: m0 = (1 + r) m1 - r m2 with r = h0 / h1, and likewise at the other end.
    let (r, s) = (h[0] / h[1], h[last - 1] / h[last - 2]);
    let inner = last - 1;
    let (mut lower, mut diagonal, mut upper, mut right) =
        (vec![0.0; inner], vec![0.0; inner], vec![0.0; inner], vec![0.0; inner]);
    for k in 0..inner {
        lower[k] = h[k];
        diagonal[k] = 2.0 * (h[k] + h[k + 1]);
        upper[k] = h[k + 1];
        right[k] = 6.0 * (slope(k + 1) - slope(k));
    }
    diagonal[0] += (1.0 + r) * h[0];
    upper[0] -= r * h[0];
    diagonal[inner - 1] += (1.0 + s) * h[last - 1];
    lower[inner - 1] -= s * h[last - 1];
    for k in 1..inner {
        let factor = lower[k] / diagonal[k - 1];
        diagonal[k] -= factor * upper[k - 1];
        right[k] -= factor * right[k - 1];
    }
    let mut m = vec![0.0; last + 1];
    for k in (0..inner).rev() {
        let next = if k + 1 < inner { upper[k] * m[k + 2] } else { 0.0 };
        m[k + 1] = (right[k] - next) / diagonal[k];
    }
    m[0] = (1.0 + r) * m[1] - r * m[2];
    m[last] = (1.0 + s) * m[last - 1] - s * m[last - 2];
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-11;

    const KNOTS: [f64; 6] = [-1.0, 0.0, 0.4, 1.5, 2.0, 3.0];

    /// Discretisation: derivatives a little to either side of a knot.
    const ACROSS_A_KNOT: f64 = 1e-9;

    fn near(found: f64, expected: f64) {
        assert!(
            (found - expected).abs() < ROUNDING * expected.abs().max(1.0),
            "{found} instead of {expected}"
        );
    }

    #[test]
    fn cubics_are_reproduced_with_derivatives_and_beyond_the_table() {
        let f = |x: f64| 2.0 - x + 0.5 * x * x - 3.0 * x * x * x;
        let table = CubicSpline::new(&KNOTS, &KNOTS.map(f)).unwrap();
        for x in [-1.5, -1.0, -0.3, 0.4, 1.1, 1.99, 3.0, 3.5] {
            let [v, d, dd] = table.derivatives(x);
            near(v, f(x));
            near(d, -1.0 + x - 9.0 * x * x);
            near(dd, 1.0 - 18.0 * x);
        }
    }

    #[test]
    fn two_continuous_derivatives_through_the_values() {
        let values = [0.0, 1.0, -1.0, 2.0, 2.0, 0.5];
        let table = CubicSpline::new(&KNOTS, &values).unwrap();
        for (k, v) in KNOTS.iter().zip(values) {
            near(table.at(*k), v);
            let (left, right) = (table.derivatives(k - 1e-13), table.derivatives(k + 1e-13));
            assert!(left.iter().zip(right).all(|(a, b)| (a - b).abs() < ACROSS_A_KNOT), "{left:?} {right:?}");
        }
    }

    #[test]
    fn products_of_cubics_are_reproduced_with_derivatives() {
        let (f, g) = (|x: f64| 1.0 + x * x * x, |y: f64| 2.0 - y + y * y * y);
        let (y, mut values) = ([0.0, 1.0, 1.5, 4.0], Vec::new());
        for a in KNOTS {
            values.extend(y.map(|b| f(a) * g(b)));
        }
        let table = BicubicSpline::new(&KNOTS, &y, &values).unwrap();
        for (a, b) in [(-0.7, 0.2), (0.1, 1.2), (1.5, 3.0), (2.9, 4.5)] {
            let (fa, fx, fxx) = (f(a), 3.0 * a * a, 6.0 * a);
            let (gb, gy, gyy) = (g(b), 3.0 * b * b - 1.0, 6.0 * b);
            let expected = [fa * gb, fx * gb, fa * gy, fxx * gb, fx * gy, fa * gyy];
            for (found, expected) in table.derivatives(a, b).into_iter().zip(expected) {
                near(found, expected);
            }
        }
    }

    #[test]
    fn tables_that_do_not_fit() {
        let error = |knots: &[f64], values: &[f64]| CubicSpline::new(knots, values).unwrap_err();
        assert_eq!(error(&[0.0, 1.0, 2.0], &[0.0; 3]), AdError::TooShort { least: 4 });
        assert_eq!(error(&[0.0, 1.0, 1.0, 2.0], &[0.0; 4]), AdError::Knots);
        assert_eq!(error(&[0.0, 1.0, 2.0, 3.0], &[f64::NAN; 4]), AdError::Knots);
        assert_eq!(error(&[0.0, 1.0, 2.0, 3.0], &[0.0; 3]), AdError::Length { expected: 4, found: 3 });
    }
}
