//! Polynomial interpolation through arbitrary nodes, barycentric form.

use crate::BasisError;

/// Polynomial interpolation through arbitrary distinct nodes by the second (true) barycentric formula
///
/// ```text
/// p(x) = sum_k w_k f_k / (x - x_k)  /  sum_k w_k / (x - x_k),      w_k = 1 / prod_{j != k} (x_k - x_j)
/// ```
///
/// exact at the nodes, `O(n)` per value, nothing allocated after construction. Values of several components are
/// row-major, one row per node. Where a slice is shorter than its documented length the methods panic, as indexing
/// does; a NaN abscissa gives NaN. Berrut and Trefethen (2004), doi:10.1137/S0036144502417715, eqs. 4.2 and 9.4.
#[derive(Debug, Clone, PartialEq)]
pub struct Barycentric {
    nodes: Vec<f64>,
    weights: Vec<f64>,
}

impl Barycentric {
    /// Interpolation through `nodes`, in any order.
    ///
    /// # Errors
    /// [`BasisError::NoNodes`], [`BasisError::NotFinite`] or [`BasisError::Coincident`].
    pub fn new(nodes: &[f64]) -> Result<Self, BasisError> {
        if nodes.is_empty() {
            return Err(BasisError::NoNodes);
        }
        for (index, &value) in nodes.iter().enumerate() {
            if !value.is_finite() {
                return Err(BasisError::NotFinite { index, value });
            }
            if let Some(first) = nodes[..index].iter().position(|&x| x == value) {
                return Err(BasisError::Coincident { first, second: index, value });
            }
        }
        Ok(Self { nodes: nodes.to_vec(), weights: barycentric_weights(nodes) })
    }

    /// The nodes, in the order given.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// The barycentric weights up to a common factor, the largest magnitude between 1/2 and 1.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The interpolant at `x` of the component whose value at node `k` is `values[k * stride + offset]`.
    pub fn evaluate(&self, values: &[f64], stride: usize, offset: usize, x: f64) -> f64 {
        let mut numerator = 0.0;
        let mut denominator = 0.0;
        for (k, (&node, &weight)) in self.nodes.iter().zip(&self.weights).enumerate() {
            let value = values[k * stride + offset];
            let distance = x - node;
            if distance == 0.0 {
                return value;
            }
            let term = weight / distance;
            numerator += term * value;
            denominator += term;
        }
        numerator / denominator
    }

    /// The interpolant at `x` of `out.len()` components; `values` is row-major, nodes by components.
    pub fn evaluate_all(&self, values: &[f64], x: f64, out: &mut [f64]) {
        // Small numbers of components as constants: their sums stay in registers.
        match out.len() {
            1 => self.evaluate_small::<1>(values, x, out),
            2 => self.evaluate_small::<2>(values, x, out),
            3 => self.evaluate_small::<3>(values, x, out),
            4 => self.evaluate_small::<4>(values, x, out),
            5 => self.evaluate_small::<5>(values, x, out),
            6 => self.evaluate_small::<6>(values, x, out),
            7 => self.evaluate_small::<7>(values, x, out),
            8 => self.evaluate_small::<8>(values, x, out),
            _ => self.evaluate_into(values, x, out),
        }
    }

    fn evaluate_small<const N: usize>(&self, values: &[f64], x: f64, out: &mut [f64]) {
        let mut sums = [0.0; N];
        self.evaluate_into(values, x, &mut sums);
        out.copy_from_slice(&sums);
    }

    #[inline(always)]
    fn evaluate_into(&self, values: &[f64], x: f64, out: &mut [f64]) {
        let rows = values.chunks_exact(out.len().max(1));
        out.fill(0.0);
        let mut denominator = 0.0;
        for ((&node, &weight), row) in self.nodes.iter().zip(&self.weights).zip(rows) {
            let distance = x - node;
            if distance == 0.0 {
                out.copy_from_slice(row);
                return;
            }
            let term = weight / distance;
            denominator += term;
            for (sum, v) in out.iter_mut().zip(row) {
                *sum += term * v;
            }
        }
        for sum in out {
            *sum /= denominator;
        }
    }

    /// Derivative at `x` of the interpolant of `out.len()` components; `values` is row-major, nodes by components.
    ///
    /// With `k` the node nearest to `x`, `p = f_k + (x - x_k) q`, where `q` interpolates the divided differences
    /// on the other nodes with weights `w_j (x_j - x_k)`. Then `p' = q + (x - x_k) q'` loses nothing close to a node.
    pub fn derivative_all(&self, values: &[f64], x: f64, out: &mut [f64]) {
        let dim = out.len();
        let near = self.nearest(x);
        let origin = self.nodes[near];
        for (c, o) in out.iter_mut().enumerate() {
            let base = values[near * dim + c];
            let quotient = |j: usize| (values[j * dim + c] - base) / (self.nodes[j] - origin);
            let term = |j: usize| self.weights[j] * (self.nodes[j] - origin) / (x - self.nodes[j]);
            let others = || (0..self.nodes.len()).filter(|&j| j != near);
            let (mut sum, mut denominator) = (0.0, 0.0);
            for j in others() {
                sum += term(j) * quotient(j);
                denominator += term(j);
            }
            if denominator == 0.0 {
                // A single node: the interpolant is constant.
                *o = if x.is_nan() { f64::NAN } else { 0.0 };
                continue;
            }
            let q = sum / denominator;
            let mut slope = 0.0;
            for j in others() {
                slope += term(j) * (q - quotient(j)) / (x - self.nodes[j]);
            }
            *o = q + (x - origin) * slope / denominator;
        }
    }

    /// The values at `x` of the Lagrange polynomials, one per node: `p(x) = sum_k out[k] f_k`.
    pub fn basis(&self, x: f64, out: &mut [f64]) {
        assert_eq!(out.len(), self.nodes.len(), "one basis value per node");
        let mut denominator = 0.0;
        for k in 0..self.nodes.len() {
            let distance = x - self.nodes[k];
            if distance == 0.0 {
                out.fill(0.0);
                out[k] = 1.0;
                return;
            }
            out[k] = self.weights[k] / distance;
            denominator += out[k];
        }
        for o in out {
            *o /= denominator;
        }
    }

    /// Row-major `n x n`: derivative at the nodes of the interpolant through the nodes.
    ///
    /// Each diagonal entry is minus the sum of its row, so that constants have derivative zero.
    pub fn differentiation_matrix(&self) -> Vec<f64> {
        let n = self.nodes.len();
        let mut matrix = vec![0.0; n * n];
        for i in 0..n {
            let mut sum = 0.0;
            for j in (0..n).filter(|&j| j != i) {
                let entry = self.weights[j] / self.weights[i] / (self.nodes[i] - self.nodes[j]);
                matrix[i * n + j] = entry;
                sum += entry;
            }
            matrix[i * n + i] = -sum;
        }
        matrix
    }

    fn nearest(&self, x: f64) -> usize {
        let mut near = 0;
        for k in 1..self.nodes.len() {
            if (x - self.nodes[k]).abs() < (x - self.nodes[near]).abs() {
                near = k;
            }
        }
        near
    }
}

/// Products of the differences, with the exponent kept apart so that many nodes neither overflow nor underflow.
fn barycentric_weights(nodes: &[f64]) -> Vec<f64> {
    const LIMIT: f64 = 1.157920892373162e77; // 2^256
    let products: Vec<(f64, i32)> = nodes
        .iter()
        .enumerate()
        .map(|(k, &x)| {
            let (mut product, mut exponent) = (1.0f64, 0);
            for (j, &other) in nodes.iter().enumerate() {
                if j != k {
                    product *= x - other;
                    if product.abs() > LIMIT {
                        product /= LIMIT;
                        exponent += 256;
                    } else if product.abs() < 1.0 / LIMIT {
                        product *= LIMIT;
                        exponent -= 256;
                    }
                }
            }
            let shift = product.abs().log2().floor() as i32;
            (product * 2f64.powi(-shift), exponent + shift)
        })
        .collect();
    let smallest = products.iter().map(|&(_, e)| e).min().unwrap_or(0);
    products.iter().map(|&(p, e)| 2f64.powi(smallest - e) / p).collect()
}
