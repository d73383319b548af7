//! Root search and integration matrix, which the three Legendre rules share.

use crate::error::BasisError;
use crate::legendre::legendre;
use crate::{Barycentric, MAX_POINTS};

/// Checks the number of points of a rule against `min..=MAX_POINTS`.
pub(crate) fn check_points(rule: &'static str, points: usize, min: usize) -> Result<(), BasisError> {
    if (min..=MAX_POINTS).contains(&points) {
        Ok(())
    } else {
        Err(BasisError::PointCount { rule, points, min, max: MAX_POINTS })
    }
}

/// A root as the nearest double and what is missing to the true one.
pub(crate) struct Root {
    pub(crate) node: f64,
    pub(crate) rest: f64,
}

impl Root {
    /// A root known exactly.
    pub(crate) fn exact(node: f64) -> Self {
        Self { node, rest: 0.0 }
    }

    /// A function of the given value and slope at the node, taken at the true root.
    pub(crate) fn value(&self, value: f64, slope: f64) -> f64 {
        value + self.rest * slope
    }
}

/// Newton's method for a simple root near `start`; `f` returns value (relatively exact) and slope.
///
/// The asymptotic starts of the rules lie so near that four or five steps suffice; the cap only guards the loop.
pub(crate) fn newton(start: f64, f: impl Fn(f64) -> (f64, f64)) -> Root {
    let mut root = Root::exact(start);
    for _ in 0..20 {
        let (value, slope) = f(root.node);
        root.rest = -value / slope;
        if root.node + root.rest == root.node {
            break;
        }
        root.node += root.rest;
    }
    root
}

/// Integrals from -1 to each of `targets` of the Lagrange polynomials through `nodes`; row-major, one row per target.
///
/// The Lagrange polynomial in the Legendre basis is `l_j = sum_k w_j P_k(x_j) P_k / g_k`, with
/// `g_k = 2 / (2 k + 1)` the squared norm as the quadrature sees it. Only for Lobatto does the last one, passed
/// as `last_norm`, differ from the true norm. And `(2 k + 1) P_k = P'_{k+1} - P'_{k-1}` integrates exactly, so no
/// matrix is inverted.
pub(crate) fn integration_matrix(
    nodes: &[f64],
    weights: &[f64],
    targets: &[f64],
    last_norm: Option<f64>,
) -> Vec<f64> {
    let n = nodes.len();
    let mut matrix = vec![0.0; targets.len() * n];
    for k in 0..n {
        let norm = match last_norm {
            Some(norm) if k + 1 == n => norm,
            _ => 2.0 / (2 * k + 1) as f64,
        };
        let row: Vec<f64> = (0..n).map(|j| weights[j] * legendre(k, nodes[j]).0 / norm).collect();
        for (i, &t) in targets.iter().enumerate() {
            let integral = if k == 0 {
                t + 1.0
            } else {
                (legendre(k + 1, t).0 - legendre(k - 1, t).0) / (2 * k + 1) as f64
            };
            for j in 0..n {
                matrix[i * n + j] += row[j] * integral;
            }
        }
    }
    matrix
}

/// Rows `rows` of the differentiation matrix on the nodes of `basis`.
pub(crate) fn differentiation_rows(basis: &Barycentric, rows: std::ops::Range<usize>) -> Vec<f64> {
    let n = basis.nodes().len();
    basis.differentiation_matrix()[rows.start * n..rows.end * n].to_vec()
}
