//! Inertia tensors.

use apsides_ad::Scalar;

use crate::DynamicsError;

/// An inertia tensor with its inverse, kg m2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    matrix: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
    /// Says whether the axes are principal ones.
    diagonal: bool,
}

/// Least principal moment by the largest.
const LEAST_RATIO: f64 = 1e-9;

impl Inertia {
    /// A symmetric tensor: the diagonal holds the moments, the rest the products of inertia with negative sign.
    ///
    /// # Errors
    /// When an entry is not finite, the tensor not symmetric or not positive definite, or when moments of inertia break the triangle
    /// inequality: no moment about an axis, in any direction, exceeds the sum of the two across it. Names the value.
    pub fn new(matrix: [[f64; 3]; 3]) -> Result<Self, DynamicsError> {
        let refuse = |what, value, allowed| DynamicsError::Parameter { what, value, unit: "kg m2", allowed };
        for value in matrix.as_flattened() {
            crate::error::finite("inertia", *value, "kg m2")?;
        }
        let size = (0..3).map(|k| matrix[k][k].abs()).fold(0.0, f64::max);
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let gap = matrix[i][j] - matrix[j][i];
            if gap.abs() > 1e-12 * size {
                return Err(refuse("difference of mirrored products of inertia", gap, "0"));
            }
        }
        let least = smallest_principal(&matrix);
        if least <= LEAST_RATIO * size {
            return Err(refuse("least principal moment of inertia", least, "a positive number"));
        }
        // The tensor of second moments, half the trace less the inertia, must not have a negative principal value.
        let half = 0.5 * (matrix[0][0] + matrix[1][1] + matrix[2][2]);
        let spread: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| if i == j { half - matrix[i][j] } else { -matrix[i][j] })
        });
        let excess = smallest_principal(&spread);
        if excess < -1e-12 * size {
            let allowed = "not negative: a principal moment is at most the sum of the other two";
            return Err(refuse("half the trace of the inertia less its largest moment", excess, allowed));
        }
        let diagonal =
            [(0, 1), (0, 2), (1, 2)].iter().all(|&(i, j)| matrix[i][j] == 0.0 && matrix[j][i] == 0.0);
        Ok(Self { matrix, inverse: inverse(&matrix), diagonal })
    }

    /// Principal moments (kg m2) along the body axes.
    ///
    /// # Errors
    /// As [`Inertia::new`].
    pub fn principal([x, y, z]: [f64; 3]) -> Result<Self, DynamicsError> {
        Self::new([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]])
    }

    /// The tensor.
    #[must_use]
    pub fn matrix(&self) -> &[[f64; 3]; 3] {
        &self.matrix
    }

    /// The tensor times a vector.
    #[inline]
    pub fn times<S: Scalar>(&self, v: &[S; 3]) -> [S; 3] {
        self.product(&self.matrix, v)
    }

    /// The vector whose product with the tensor is `v`.
    #[inline]
    pub fn solve<S: Scalar>(&self, v: &[S; 3]) -> [S; 3] {
        self.product(&self.inverse, v)
    }

    #[inline(always)]
    fn product<S: Scalar>(&self, matrix: &[[f64; 3]; 3], v: &[S; 3]) -> [S; 3] {
        if self.diagonal {
            return std::array::from_fn(|k| v[k] * matrix[k][k]);
        }
        matrix.map(|row| v[0] * row[0] + v[1] * row[1] + v[2] * row[2])
    }
}

/// Solves with a symmetric matrix by its adjugate.
#[inline]
pub(crate) fn solve_symmetric<S: Scalar>(m: &[[S; 3]; 3], v: &[S; 3]) -> [S; 3] {
    let ([a, d, e], [_, b, f], [_, _, c]) = (m[0], m[1], m[2]);
    let (xx, xy, xz) = (b * c - f * f, e * f - d * c, d * f - e * b);
    let (yy, yz, zz) = (a * c - e * e, d * e - a * f, a * b - d * d);
    let inverse = (a * xx + d * xy + e * xz).recip();
    [
        (xx * v[0] + xy * v[1] + xz * v[2]) * inverse,
        (xy * v[0] + yy * v[1] + yz * v[2]) * inverse,
        (xz * v[0] + yz * v[1] + zz * v[2]) * inverse,
    ]
}

fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let column = |k: usize| solve_symmetric(m, &std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 }));
    [column(0), column(1), column(2)]
}

/// Smallest eigenvalue of a symmetric matrix, by the trigonometric solution of its characteristic equation (O. K. Smith, Comm. ACM 4, 1961,
/// 168, doi 10.1145/355578.366316).
fn smallest_principal(m: &[[f64; 3]; 3]) -> f64 {
    let mean = (m[0][0] + m[1][1] + m[2][2]) / 3.0;
    let across = m[0][1].powi(2) + m[0][2].powi(2) + m[1][2].powi(2);
    let spread = (0..3).map(|k| (m[k][k] - mean).powi(2)).sum::<f64>() + 2.0 * across;
    if spread == 0.0 {
        return mean;
    }
    let p = (spread / 6.0).sqrt();
    let [a, b, c] = [0, 1, 2].map(|k| (m[k][k] - mean) / p);
    let (d, e, f) = (m[0][1] / p, m[0][2] / p, m[1][2] / p);
    let half = 0.5 * (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e));
    let angle = half.clamp(-1.0, 1.0).acos() / 3.0;
    mean + 2.0 * p * (angle + std::f64::consts::TAU / 3.0).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn inertia_of_bodies() {
        let m = [[100.0, 3.0, -2.0], [3.0, 80.0, 1.5], [-2.0, 1.5, 90.0]];
        let inertia = Inertia::new(m).unwrap();
        let v = [0.3, -1.2, 0.8];
        let back = inertia.solve(&inertia.times(&v));
        assert!((0..3).all(|k| (back[k] - v[k]).abs() < ROUNDING));
        // Eigenvalues 1, 2 and 4 of a matrix turned in a plane.
        let (s, c) = 0.4_f64.sin_cos();
        let turned = [[c * c + 2.0 * s * s, s * c, 0.0], [s * c, s * s + 2.0 * c * c, 0.0], [0.0, 0.0, 4.0]];
        assert!((smallest_principal(&turned) - 1.0).abs() < ROUNDING);
    }

    #[test]
    fn what_no_body_has() {
        let text = |m: [f64; 3]| Inertia::principal(m).unwrap_err().to_string();
        assert!(text([0.0, 1.0, 1.0]).contains("least principal moment of inertia is"));
        assert!(text([-2.0, 1.0, 1.0]).contains("-2"));
        assert!(text([3.0, 1.0, 1.0]).contains("-0.5"));
        assert!(text([f64::NAN, 1.0, 1.0]).contains("NaN"));
        let crossed = Inertia::new([[1.0, 5.0, 0.0], [5.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap_err();
        assert!(crossed.to_string().contains("is -3.99"), "{crossed}");
        let lopsided = Inertia::new([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap_err();
        assert!(lopsided.to_string().contains("0.1"), "{lopsided}");
        // A thin rod and a flat plate are at the edge.
        assert!(Inertia::principal([2.0, 1.0, 1.0]).is_ok());
    }
}
