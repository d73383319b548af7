//! Interpolation to points that stay: one matrix for all values.

use crate::Barycentric;

/// Interpolation from the nodes of a basis to fixed points: the Lagrange polynomials of the nodes at each of them, found once.
///
/// ```
/// use apsides_basis::{Barycentric, Resampling};
///
/// let basis = Barycentric::new(&[-1.0, 0.0, 1.0])?;
/// let to_middles = Resampling::new(&basis, &[-0.5, 0.5]);
/// let mut out = [0.0; 2];
/// to_middles.apply(&[1.0, 0.0, 1.0], &mut out); // t^2
/// assert!(out.iter().all(|v| (v - 0.25).abs() < 1e-15));
/// # Ok::<(), apsides_basis::BasisError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Resampling {
    nodes: usize,
    /// `points x nodes`.
    rows: Vec<f64>,
}

impl Resampling {
    /// From the nodes of `basis` to `points`, in any order; a point that is a node has the value there.
    #[must_use]
    pub fn new(basis: &Barycentric, points: &[f64]) -> Self {
        let nodes = basis.nodes().len();
        let mut rows = vec![0.0; points.len() * nodes];
        for (row, x) in rows.chunks_exact_mut(nodes).zip(points) {
            basis.basis(*x, row);
        }
        Self { nodes, rows }
    }

    /// The interpolants of several components at all points: `values` is row-major, nodes by components, `out` points by components.
    pub fn apply(&self, values: &[f64], out: &mut [f64]) {
        let components = values.len() / self.nodes;
        if components == 0 {
            return;
        }
        for (row, out) in self.rows.chunks_exact(self.nodes).zip(out.chunks_exact_mut(components)) {
            out.fill(0.0);
            for (factor, values) in row.iter().zip(values.chunks_exact(components)) {
                for (sum, v) in out.iter_mut().zip(values) {
                    *sum += factor * v;
                }
            }
        }
    }
}
