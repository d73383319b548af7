//! A function of one time, weighted: its share of the Hamiltonian and of its derivatives.

use std::sync::Arc;

use apsides_ad::NodeFunction;

/// A function of `[x, u, p, t]` with storage for its values and derivatives. Indices given to closures are those of the
/// whole list of inputs, whether or not the function takes the parameters.
pub(super) struct Term {
    function: Arc<dyn NodeFunction>,
    /// Input of the whole list, per input of the function.
    columns: Vec<usize>,
    inputs: Vec<f64>,
    pub(super) values: Vec<f64>,
    entries: Vec<f64>,
    hessian: Vec<f64>,
    /// Output and input of each entry, and pair of inputs of each second derivative.
    slopes: Vec<(usize, usize)>,
    pairs: Vec<(usize, usize)>,
}

impl Term {
    /// A function of a phase with so many states and controls together, and parameters.
    pub(super) fn new(function: Arc<dyn NodeFunction>, base: usize, parameters: usize) -> Self {
        let taken = function.inputs() - base - 1;
        let columns: Vec<usize> = (0..base + taken).chain([base + parameters]).collect();
        let pattern = function.pattern();
        Self {
            slopes: pattern.jacobian_entries().map(|(row, c)| (row, columns[c])).collect(),
            pairs: pattern.hessian.iter().map(|&(i, j)| (columns[i], columns[j])).collect(),
            columns,
            inputs: vec![0.0; function.inputs()],
            values: vec![0.0; function.outputs()],
            entries: vec![0.0; function.pattern().jacobian_len()],
            hessian: vec![0.0; function.pattern().hessian_len()],
            function,
        }
    }

    /// Says whether it depends on the input.
    pub(super) fn depends_on(&self, column: usize) -> bool {
        self.slopes.iter().any(|s| s.1 == column)
    }

    /// Says whether it is nonlinear in the pair of inputs.
    pub(super) fn is_nonlinear_in(&self, a: usize, b: usize) -> bool {
        self.pairs.contains(&(a.max(b), a.min(b)))
    }

    fn fill(&mut self, z: &[f64]) {
        for (input, &c) in self.inputs.iter_mut().zip(&self.columns) {
            *input = z[c];
        }
    }

    pub(super) fn evaluate(&mut self, z: &[f64]) {
        self.fill(z);
        self.function.value(&self.inputs, &mut self.values);
    }

    pub(super) fn linearise(&mut self, z: &[f64]) {
        self.fill(z);
        self.function.jacobian(&self.inputs, &mut self.values, &mut self.entries);
    }

    /// Entries `(output, input, value)` of the Jacobian at the last [`linearise`](Self::linearise).
    pub(super) fn each_slope(&self, mut emit: impl FnMut(usize, usize, f64)) {
        for (&(row, c), &v) in self.slopes.iter().zip(&self.entries) {
            emit(row, c, v);
        }
    }

    /// Entries `(i, j, value)`, `i >= j`, of the Hessian of the weighted sum at the last point.
    pub(super) fn each_curvature(&mut self, weights: &[f64], mut emit: impl FnMut(usize, usize, f64)) {
        self.function.hessian(&self.inputs, weights, &mut self.hessian);
        for (&(i, j), &v) in self.pairs.iter().zip(&self.hessian) {
            emit(i, j, v);
        }
    }
}
