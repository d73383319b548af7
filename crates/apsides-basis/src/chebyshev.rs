//! Chebyshev points and Clenshaw-Curtis quadrature.

use std::f64::consts::PI;

use crate::BasisError;

fn check(rule: &'static str, points: usize) -> Result<(), BasisError> {
    if (2..=4096).contains(&points) {
        Ok(())
    } else {
        Err(BasisError::PointCount { rule, points, min: 2, max: 4096 })
    }
}

/// The `points` extreme points of a Chebyshev polynomial on `[-1, 1]`, ascending, ends included.
///
/// Symmetric in floating point: `sin(pi (2 j - n) / (2 n))` instead of a cosine.
///
/// # Errors
/// [`BasisError::PointCount`] unless `points` is 2 to 4096.
pub fn chebyshev_lobatto(points: usize) -> Result<Vec<f64>, BasisError> {
    check("Chebyshev-Lobatto", points)?;
    let n = (points - 1) as f64;
    Ok((0..points).map(|j| (PI * (2.0 * j as f64 - n) / (2.0 * n)).sin()).collect())
}

/// Clenshaw-Curtis rule: the Chebyshev extreme points and their quadrature weights, exact to degree `points - 1`.
///
/// Weights by the cosine sum of Waldvogel, *BIT* 46 (2006) 195, doi:10.1007/s10543-006-0045-4.
///
/// # Errors
/// [`BasisError::PointCount`] unless `points` is 2 to 4096.
///
/// # Examples
/// ```
/// use apsides_basis::clenshaw_curtis;
///
/// let (points, weights) = clenshaw_curtis(16)?;
/// let integral: f64 = points.iter().zip(&weights).map(|(x, w)| w * x.exp()).sum();
/// assert!((integral - 2.0 * 1.0_f64.sinh()).abs() < 1e-14);
/// # Ok::<(), apsides_basis::BasisError>(())
/// ```
pub fn clenshaw_curtis(points: usize) -> Result<(Vec<f64>, Vec<f64>), BasisError> {
    check("Clenshaw-Curtis", points)?;
    let nodes = chebyshev_lobatto(points)?;
    let n = points - 1;
    let weights = (0..points)
        .map(|j| {
            let mut sum = 1.0;
            for k in 1..=n / 2 {
                let factor = if 2 * k == n { 1.0 } else { 2.0 };
                // Reduced modulo the period, so that the argument of the cosine stays small.
                let angle = ((2 * j * k) % (2 * n)) as f64 * PI / n as f64;
                sum -= factor * angle.cos() / (4 * k * k - 1) as f64;
            }
            let end = if j == 0 || j == n { 1.0 } else { 2.0 };
            end * sum / n as f64
        })
        .collect();
    Ok((nodes, weights))
}
