//! Legendre-Gauss rules.

use std::sync::Arc;

use crate::legendre::{legendre, legendre_after, legendre_double};
use crate::quadrature::{Root, check_points, differentiation_rows, integration_matrix, newton};
use crate::shared::Shared;
use crate::{Barycentric, BasisError};

/// Legendre-Gauss rule of `N` points inside `(-1, 1)`.
///
/// The nodes are the roots of `P_N`, ascending. Quadrature is exact to degree `2 N - 1`. The state is the polynomial
/// of degree `N` through the `N + 1` support points (-1 and the nodes).
#[derive(Debug, Clone)]
pub struct Gauss {
    nodes: Vec<f64>,
    weights: Vec<f64>,
    support: Barycentric,
    differentiation: Vec<f64>,
    integration: Vec<f64>,
}

static RULES: Shared<Gauss> = Shared::new();

impl Gauss {
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
        check_points("Legendre-Gauss", points, 1)?;
        let n = points as f64;
        let mut nodes = Vec::with_capacity(points);
        let mut weights = Vec::with_capacity(points);
        for j in 0..points {
            // Tricomi's leading term for the zeros of P_N. The middle of an odd rule is exactly zero.
            let start = -(std::f64::consts::PI * (j as f64 + 0.75) / (n + 0.5)).cos();
            let root = if 2 * j + 1 == points {
                Root::exact(0.0)
            } else {
                newton(start, |x| (legendre_double(points, x).1.value(), legendre(points, x).1))
            };
            // (1 - x^2) P_N' = N P_{N-1} at a root of P_N, so w = 2 (1 - x^2) / (N P_{N-1})^2.
            let x = root.node;
            let value = root.value(legendre_double(points, x).0.value(), legendre(points - 1, x).1);
            let width = root.value((1.0 - x) * (1.0 + x), -2.0 * x);
            nodes.push(x);
            weights.push(2.0 * width / (n * value).powi(2));
        }
        let mut support = vec![-1.0];
        support.extend_from_slice(&nodes);
        let integration = integration_matrix(&nodes, &weights, &nodes, None);
        let support = Barycentric::new(&support)?;
        let differentiation = differentiation_rows(&support, 1..points + 1);
        Ok(Self { nodes, weights, support, differentiation, integration })
    }

    /// Number of collocation points `N`.
    pub fn points(&self) -> usize {
        self.nodes.len()
    }

    /// Coefficients of the Legendre polynomials of degree 0 to `N - 1` whose sum has these `N` values at the nodes.
    pub fn legendre_coefficients(&self, values: &[f64]) -> Vec<f64> {
        let mut coefficients = vec![0.0; self.points()];
        for ((&x, weight), value) in self.nodes.iter().zip(&self.weights).zip(values) {
            let [mut before, mut current] = [0.0, 1.0];
            for (k, coefficient) in coefficients.iter_mut().enumerate() {
                *coefficient += (k as f64 + 0.5) * weight * value * current;
                [before, current] = [current, legendre_after(k, x, [before, current])];
            }
        }
        coefficients
    }

    /// The `N` collocation points, ascending.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// The `N` quadrature weights, positive, of sum 2.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The `N + 1` support points: -1 and the nodes.
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

    /// Row-major `N x N` matrix `A` with `x(t_i) = x(-1) + sum_j A_ij f_j` at the collocation points; the state at +1
    /// is `x(-1) + sum_j w_j f_j`.
    pub fn integration(&self) -> &[f64] {
        &self.integration
    }
}
