//! Legendre-Gauss-Radau rules.

use std::sync::Arc;

use crate::legendre::{legendre, legendre_double, legendre_pair};
use crate::quadrature::{check_points, differentiation_rows, integration_matrix, newton};
use crate::shared::Shared;
use crate::{Barycentric, BasisError};

/// Legendre-Gauss-Radau rule of `N` points on `[-1, 1)`: -1 is a point, +1 is not.
///
/// The nodes are the roots of `P_{N-1} + P_N`, ascending. Quadrature is exact to degree `2 N - 2`. The state is the
/// polynomial of degree `N` through the `N + 1` support points (the nodes and +1).
#[derive(Debug, Clone)]
pub struct Lgr {
    nodes: Vec<f64>,
    weights: Vec<f64>,
    support: Barycentric,
    differentiation: Vec<f64>,
    integration: Vec<f64>,
}

static RULES: Shared<Lgr> = Shared::new();

impl Lgr {
    /// The rule of `points` points, computed once in a process.
    ///
    /// # Errors
    /// [`BasisError::PointCount`] outside 1 to [`MAX_POINTS`](crate::MAX_POINTS).
    pub fn shared(points: usize) -> Result<Arc<Self>, BasisError> {
        RULES.get(points, Self::new)
    }

    /// The rule of `points` points, 1 to [`MAX_POINTS`](crate::MAX_POINTS).
    ///
    /// # Errors
    /// [`BasisError::PointCount`] outside that range.
    pub fn new(points: usize) -> Result<Self, BasisError> {
        check_points("Legendre-Gauss-Radau", points, 1)?;
        let n = points as f64;
        let mut nodes = vec![-1.0];
        let mut weights = vec![2.0 / (n * n)];
        for j in 1..points {
            // Leading term of the asymptotic zeros of the Jacobi polynomial P^(0,1)_{N-1} = (P_{N-1} + P_N) / (1 + x).
            let start = (std::f64::consts::PI * ((points - j) as f64 - 0.25) / n).cos();
            let root = newton(start, |x| {
                let (before, current) = legendre_double(points, x);
                let (before_f, current_f) = legendre_pair(points, x);
                (before.plus(current).value(), before_f.1 + current_f.1)
            });
            let slope = legendre(points - 1, root.node).1;
            let value = root.value(legendre_double(points, root.node).0.value(), slope);
            nodes.push(root.node);
            weights.push(root.value(1.0 - root.node, -1.0) / (n * value).powi(2));
        }
        let mut support = nodes.clone();
        support.push(1.0);
        let integration = integration_matrix(&nodes, &weights, &support[1..], None);
        let support = Barycentric::new(&support)?;
        let differentiation = differentiation_rows(&support, 0..points);
        Ok(Self { nodes, weights, support, differentiation, integration })
    }

    /// Number of collocation points `N`.
    pub fn points(&self) -> usize {
        self.nodes.len()
    }

    /// The `N` collocation points, ascending from -1.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// The `N` quadrature weights, positive, of sum 2.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The `N + 1` support points: the nodes and +1.
    pub fn support(&self) -> &[f64] {
        self.support.nodes()
    }

    /// Interpolation through the `N + 1` support points.
    pub fn support_basis(&self) -> &Barycentric {
        &self.support
    }

    /// Row-major `N x (N + 1)`: derivative at the collocation points of the interpolant through the support.
    pub fn differentiation(&self) -> &[f64] {
        &self.differentiation
    }

    /// Row-major `N x N` matrix `A` with `x(t_i) = x(-1) + sum_j A_ij f_j`, row `i` for support point `i + 1`
    /// (all but -1), `f_j` the rate at collocation point `j`. Inverse of the last `N` columns of
    /// [`differentiation`](Self::differentiation); the last row is the [`weights`](Self::weights).
    pub fn integration(&self) -> &[f64] {
        &self.integration
    }
}
