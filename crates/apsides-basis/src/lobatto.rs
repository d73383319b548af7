//! Legendre-Gauss-Lobatto rules.

use crate::legendre::legendre_double;
use crate::quadrature::{Root, check_points, integration_matrix, newton};
use crate::{Barycentric, BasisError};

/// Legendre-Gauss-Lobatto rule of `N` points on `[-1, 1]`, both ends included.
///
/// The nodes are -1, the roots of `P'_{N-1}` and +1, ascending. Quadrature is exact to degree `2 N - 3`. The support
/// of the state is the nodes themselves.
#[derive(Debug, Clone)]
pub struct Lobatto {
    weights: Vec<f64>,
    support: Barycentric,
    differentiation: Vec<f64>,
    integration: Vec<f64>,
}

impl Lobatto {
    /// The rule of `points` points, 2 to [`MAX_POINTS`](crate::MAX_POINTS).
    ///
    /// # Errors
    /// [`BasisError::PointCount`] outside that range.
    pub fn new(points: usize) -> Result<Self, BasisError> {
        check_points("Legendre-Gauss-Lobatto", points, 2)?;
        let degree = points - 1;
        let scale = (points * degree) as f64;
        let mut nodes = Vec::with_capacity(points);
        let mut weights = Vec::with_capacity(points);
        for j in 0..points {
            let root = if j == 0 || 2 * j == degree || j == degree {
                Root::exact(2.0 * j as f64 / degree as f64 - 1.0)
            } else {
                // P'_{N-1} vanishes where x P_{N-1} - P_{N-2} does, a function of slope N P_{N-1}.
                let start = -(std::f64::consts::PI * j as f64 / degree as f64).cos();
                newton(start, |x| {
                    let (before, current) = legendre_double(degree, x);
                    (current.times(x).plus(before.times(-1.0)).value(), points as f64 * current.value())
                })
            };
            // P_{N-1} is stationary at the inner nodes, so the weight does not feel the rounding of the node.
            nodes.push(root.node);
            weights.push(2.0 / (scale * legendre_double(degree, root.node).1.value().powi(2)));
        }
        // The rule integrates P_{N-1}^2 (degree 2 N - 2) to 2 / (N - 1).
        let integration = integration_matrix(&nodes, &weights, &nodes[1..], Some(2.0 / degree as f64));
        let support = Barycentric::new(&nodes)?;
        let differentiation = support.differentiation_matrix();
        Ok(Self { weights, support, differentiation, integration })
    }

    /// Number of collocation points `N`.
    pub fn points(&self) -> usize {
        self.weights.len()
    }

    /// The `N` collocation points, ascending from -1 to 1.
    pub fn nodes(&self) -> &[f64] {
        self.support.nodes()
    }

    /// The `N` quadrature weights, positive, of sum 2.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The support points, equal to the nodes.
    pub fn support(&self) -> &[f64] {
        self.support.nodes()
    }

    /// Interpolation through the support points.
    pub fn support_basis(&self) -> &Barycentric {
        &self.support
    }

    /// Row-major `N x N`: derivative at the nodes of the interpolant through the nodes (singular).
    pub fn differentiation(&self) -> &[f64] {
        &self.differentiation
    }

    /// Row-major `(N - 1) x N` matrix `A` with `x(t_i) = x(-1) + sum_j A_ij f_j`, row `i` for node `i + 1`; the
    /// last row is the [`weights`](Self::weights).
    pub fn integration(&self) -> &[f64] {
        &self.integration
    }
}
