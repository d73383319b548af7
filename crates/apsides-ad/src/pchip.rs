//! Tables in one variable by piecewise cubics that keep the shape of the data: monotone where the data are, with one continuous
//! derivative.
//!
//! The slopes are the weighted harmonic means of F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300,
//! doi 10.1137/0905021, within the monotone region of F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238,
//! doi 10.1137/0717021; at the ends the three-point formula, limited to it. These are the slopes of scipy's `PchipInterpolator`.
//!
//! ```
//! use apsides_ad::{Outside, Pchip};
//!
//! let step = Pchip::new(&[0.0, 1.0, 2.0, 3.0], &[0.0, 0.0, 1.0, 1.0], Outside::Constant)?;
//! assert_eq!(step.at(1.5_f64), 0.5);
//! assert_eq!(step.at(7.0_f64), 1.0); // no overshoot, no extrapolation
//! # Ok::<(), apsides_ad::AdError>(())
//! ```

use crate::error::AdError;
use crate::spline::{check_knots, check_values};

/// The rule by which a table continues outside its knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The value at the nearest end.
    Constant,
    /// The tangent at the nearest end.
    Linear,
}

/// A shape-preserving piecewise cubic through a table of one variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Pchip {
    knots: Vec<f64>,
    /// Value and slope at each knot.
    nodes: Vec<[f64; 2]>,
    outside: Outside,
}

impl Pchip {
    /// The table with the given values at increasing knots, at least two.
    ///
    /// # Errors
    /// The table does not fit: see [`AdError`].
    pub fn new(knots: &[f64], values: &[f64], outside: Outside) -> Result<Self, AdError> {
        check_knots(knots, 2)?;
        check_values(values, knots.len())?;
        let nodes = values.iter().zip(slopes(knots, values)).map(|(v, s)| [*v, s]).collect();
        Ok(Self { knots: knots.into(), nodes, outside })
    }

    /// The knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The values at the knots.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.nodes.iter().map(|node| node[0])
    }

    /// The rule outside the knots.
    #[must_use]
    pub fn outside(&self) -> Outside {
        self.outside
    }

    /// Knots at which the slope jumps: the ends, where the value stays what it is there and the slope before is not zero.
    pub fn kinks(&self) -> impl Iterator<Item = f64> + '_ {
        let last = self.knots.len() - 1;
        let ends = [0, last].into_iter().filter(|&k| self.nodes[k][1] != 0.0);
        ends.filter(|_| self.outside == Outside::Constant).map(|k| self.knots[k])
    }

    /// Value, first and second derivative at `x`; for compositions inside one [`Scalar::map`](crate::Scalar::map).
    #[inline]
    #[must_use]
    pub fn derivatives(&self, x: f64) -> [f64; 3] {
        let last = self.knots.len() - 1;
        if x < self.knots[0] {
            return self.beyond(0, x);
        }
        if x > self.knots[last] {
            return self.beyond(last, x);
        }
        let k = self.knots[1..last].partition_point(|knot| *knot <= x);
        let ([a, slope_a], [b, slope_b]) = (self.nodes[k], self.nodes[k + 1]);
        let h = self.knots[k + 1] - self.knots[k];
        let t = x - self.knots[k];
        let secant = (b - a) / h;
        let quadratic = (3.0 * secant - 2.0 * slope_a - slope_b) / h;
        let cubic = (slope_a + slope_b - 2.0 * secant) / (h * h);
        [
            a + t * (slope_a + t * (quadratic + t * cubic)),
            slope_a + t * (2.0 * quadratic + 3.0 * t * cubic),
            2.0 * quadratic + 6.0 * t * cubic,
        ]
    }

    /// The same beyond an end.
    fn beyond(&self, end: usize, x: f64) -> [f64; 3] {
        let [value, slope] = self.nodes[end];
        match self.outside {
            Outside::Constant => [value, 0.0, 0.0],
            Outside::Linear => [value + slope * (x - self.knots[end]), slope, 0.0],
        }
    }
}

/// Slopes at the knots.
fn slopes(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let h: Vec<f64> = knots.windows(2).map(|w| w[1] - w[0]).collect();
    let secants: Vec<f64> = values.windows(2).zip(&h).map(|(w, h)| (w[1] - w[0]) / h).collect();
    let last = h.len();
    if last == 1 {
        return vec![secants[0]; 2];
    }
    let mut slopes = vec![0.0; last + 1];
    slopes[0] = end_slope(h[0], h[1], secants[0], secants[1]);
    slopes[last] = end_slope(h[last - 1], h[last - 2], secants[last - 1], secants[last - 2]);
    for k in 1..last {
        let (before, after) = (secants[k - 1], secants[k]);
        if before * after > 0.0 {
            let (w1, w2) = (2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]);
            slopes[k] = (w1 + w2) / (w1 / before + w2 / after);
        }
    }
    slopes
}

/// The slope at an end from the two intervals next to it, the outer one first.
fn end_slope(h0: f64, h1: f64, outer: f64, inner: f64) -> f64 {
    let slope = ((2.0 * h0 + h1) * outer - h0 * inner) / (h0 + h1);
    if slope * outer <= 0.0 {
        0.0
    } else if outer * inner <= 0.0 && slope.abs() > 3.0 * outer.abs() {
        3.0 * outer
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-13;

    const KNOTS: [f64; 7] = [-1.0, 0.0, 0.4, 1.5, 2.0, 3.0, 3.5];
    const VALUES: [f64; 7] = [2.0, 1.0, 1.0, -0.5, -0.6, 4.0, 3.0];

    /// `scipy.interpolate.PchipInterpolator` 1.17.1: value, first and second derivative.
    const SCIPY: [(f64, [f64; 3]); 9] = [
        (-1.0, [2.0, -1.7142857142857144, 0.8571428571428577]),
        (-0.7, [1.5320000000000003, -1.38, 1.3714285714285719]),
        (-0.1, [1.0125714285714287, -0.24857142857142844, 2.4]),
        (0.2, [1.0, 0.0, 0.0]),
        (0.9, [0.3915549019294404, -1.9362341544511406, -0.8871908819156937]),
        (1.7, [-0.5581787234042552, -0.24970212765957445, 0.5412765957446808]),
        (2.3, [0.3935999999999989, 5.795999999999998, 11.04000000000001]),
        (3.1, [3.9632, -0.7440000000000005, -7.68]),
        (3.45, [3.1980999999999993, -3.7260000000000018, -9.360000000000003]),
    ];

    #[test]
    fn scipy_agrees() {
        let table = Pchip::new(&KNOTS, &VALUES, Outside::Linear).unwrap();
        for (x, expected) in SCIPY {
            for (found, expected) in table.derivatives(x).into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < ROUNDING * expected.abs().max(1.0),
                    "{x}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn outside_as_stated() {
        let constant = Pchip::new(&KNOTS, &VALUES, Outside::Constant).unwrap();
        let linear = Pchip::new(&KNOTS, &VALUES, Outside::Linear).unwrap();
        assert_eq!(constant.derivatives(-3.0), [2.0, 0.0, 0.0]);
        assert_eq!(constant.derivatives(9.0), [3.0, 0.0, 0.0]);
        let [_, slope, _] = linear.derivatives(-1.0);
        assert_eq!(linear.derivatives(-3.0), [2.0 - 2.0 * slope, slope, 0.0]);
        let two = Pchip::new(&[0.0, 2.0], &[1.0, 2.0], Outside::Linear).unwrap();
        assert_eq!([two.at(-2.0), two.at(1.0), two.at(4.0)], [0.0, 1.5, 3.0]);
    }

    #[test]
    fn monotone_where_the_data_are() {
        let (knots, values) = ([0.0, 1.0, 1.1, 5.0, 6.0], [0.0, 0.1, 3.0, 3.0, 10.0]);
        let table = Pchip::new(&knots, &values, Outside::Constant).unwrap();
        let samples: Vec<f64> = (0..=600).map(|k| table.at(f64::from(k) * 0.01)).collect();
        assert!(samples.windows(2).all(|w| w[1] >= w[0]));
    }

    #[test]
    fn tables_that_do_not_fit() {
        let error = |knots: &[f64], values: &[f64]| Pchip::new(knots, values, Outside::Constant).unwrap_err();
        assert_eq!(error(&[0.0], &[0.0]), AdError::TooShort { least: 2 });
        assert_eq!(error(&[0.0, 1.0, 1.0], &[0.0; 3]), AdError::Knots);
        assert_eq!(error(&[0.0, f64::NAN], &[0.0; 2]), AdError::Knots);
        assert_eq!(error(&[0.0, 1.0], &[0.0, f64::INFINITY]), AdError::Knots);
        assert_eq!(error(&[0.0, 1.0], &[0.0; 3]), AdError::Length { expected: 2, found: 3 });
    }
}
