//! The rate at which the Legendre coefficients of states and controls fall in an interval.
//!
//! Those of an analytic function fall by the same factor with each degree, those of one with a kink or a jump by a power of the degree alone. So
//! the factor tells intervals that are too long from those that should be divided where the motion bends (F. Liu, W. Hager, A. Rao, Adaptive mesh
//! refinement method for optimal control using decay rates of Legendre polynomial coefficients, IEEE Trans. Control Syst. Technol. 26 (2018) 1475).

use apsides_basis::{Gauss, MAX_POINTS};
use apsides_ocp::{PhaseTrajectory, PiecewisePolynomial};

use crate::RadauError;

/// Fewest points of an interval that tell.
const LEAST_POINTS: usize = 6;

/// Natural logarithm of the least factor per degree of a smooth motion. A kink leaves a quarter of it at ten points.
const SMOOTH: f64 = std::f64::consts::LN_2;

/// Largest part of the largest coefficient of a state that may be left at the highest degree: the polynomials follow the motion closely, so that
/// their coefficients are its own.
const RESOLVED: f64 = 1e-4;

/// Coefficients below this part of the largest one of their state are rounding.
const ROUNDING: f64 = 1e-13;

/// Natural logarithm of the factor by which the coefficients fall with each degree in interval `k`, that of the state or control where they fall
/// slowest; none where the motion is not smooth there, or the interval has too few points to tell.
pub(crate) fn decay(p: &PhaseTrajectory, k: usize) -> Result<Option<f64>, RadauError> {
    let points = p.mesh.points()[k];
    if points < LEAST_POINTS {
        return Ok(None);
    }
    let states = spectra(&p.state, k, points + 1)?;
    if states.iter().any(|s| s.last().is_some_and(|last| *last > RESOLVED)) {
        return Ok(None);
    }
    let controls = spectra(&p.control, k, points)?;
    let slowest = states.iter().chain(&controls).map(|s| rate(s)).fold(f64::INFINITY, f64::min);
    Ok((slowest >= SMOOTH && slowest.is_finite()).then_some(slowest))
}

/// The part of each component's coefficients that is left from each degree above zero on in an interval, relative to the largest one.
fn spectra(polynomial: &PiecewisePolynomial, k: usize, points: usize) -> Result<Vec<Vec<f64>>, RadauError> {
    let (start, end) = (polynomial.breaks()[k], polynomial.breaks()[k + 1]);
    let rule = Gauss::shared(points.min(MAX_POINTS))?;
    let components = polynomial.dimension();
    let mut values = vec![0.0; rule.points() * components];
    for (tau, row) in rule.nodes().iter().zip(values.chunks_mut(components.max(1))) {
        polynomial.evaluate_in(k, start + 0.5 * (end - start) * (tau + 1.0), row);
    }
    let along = |c: usize| values.chunks(components).map(|row| row[c]).collect::<Vec<_>>();
    Ok((0..components).map(|c| left(&rule.legendre_coefficients(&along(c)))).collect())
}

fn left(coefficients: &[f64]) -> Vec<f64> {
    let largest = coefficients.iter().fold(0.0_f64, |a, c| a.max(c.abs()));
    let mut left: Vec<f64> = coefficients[1..].iter().map(|c| c.abs() / largest).collect();
    for k in (1..left.len()).rev() {
        left[k - 1] = left[k - 1].max(left[k]);
    }
    left
}

/// The slope of their logarithms by least squares; infinite where there is rounding alone.
fn rate(left: &[f64]) -> f64 {
    let significant = left.iter().take_while(|l| **l > ROUNDING).count();
    if significant < 2 {
        return f64::INFINITY;
    }
    let n = significant as f64;
    let middle = 0.5 * (n - 1.0);
    let slope: f64 = left[..significant].iter().enumerate().map(|(k, l)| (k as f64 - middle) * l.ln()).sum();
    -slope * 12.0 / (n * (n * n - 1.0))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn rate_of(f: impl Fn(f64) -> f64) -> f64 {
        let rule = Gauss::new(13).unwrap();
        let values: Vec<f64> = rule.nodes().iter().map(|x| f(*x)).collect();
        rate(&left(&rule.legendre_coefficients(&values)))
    }

    /// The coefficients of 1 / (a - x) fall with the powers of a + sqrt(a^2 - 1) (NIST Digital Library of Mathematical Functions, 18.18.ii).
    #[test]
    fn the_distance_of_a_pole_sets_the_rate() {
        const NEAR: f64 = 0.1;
        for a in [1.5_f64, 2.0, 3.0] {
            let exact = (a + (a * a - 1.0).sqrt()).ln();
            assert!((rate_of(|x| 1.0 / (a - x)) / exact - 1.0).abs() < NEAR, "{a}");
        }
    }

    #[test]
    fn kinks_and_jumps_are_not_smooth() {
        for at in [-0.6, 0.0, 0.1, 0.9] {
            assert!(rate_of(|x| (x - at).abs()) < SMOOTH);
            assert!(rate_of(|x| (x - at).signum()) < SMOOTH);
        }
    }

    #[test]
    fn a_constant_has_no_rate() {
        assert_eq!(rate_of(|_| 7.0), f64::INFINITY);
        assert_eq!(rate_of(|x| x), f64::INFINITY);
    }
}
