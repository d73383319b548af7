//! A function of end quantities: boundary conditions, linkages, end costs.

use std::sync::Arc;

use apsides_ad::NodeFunction;

/// A function of a few columns that goes to rows or, with a weight, to the cost.
pub(crate) struct EndpointTerm {
    function: Arc<dyn NodeFunction>,
    columns: Vec<usize>,
    /// First row; none for a share of the cost.
    first_row: Option<usize>,
    cost: f64,
    inputs: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    weights: Vec<f64>,
    hessian: Vec<f64>,
}

impl EndpointTerm {
    pub(crate) fn new(
        function: Arc<dyn NodeFunction>,
        columns: Vec<usize>,
        first_row: Option<usize>,
        cost: f64,
    ) -> Self {
        Self {
            inputs: vec![0.0; function.inputs()],
            values: vec![0.0; function.outputs()],
            entries: vec![0.0; function.pattern().jacobian_len()],
            weights: vec![0.0; function.outputs()],
            hessian: vec![0.0; function.pattern().hessian_len()],
            function,
            columns,
            first_row,
            cost,
        }
    }

    fn fill_inputs(&mut self, x: &[f64]) {
        for (z, &c) in self.inputs.iter_mut().zip(&self.columns) {
            *z = x[c];
        }
    }

    /// Writes the rows, if any, and returns the share of the cost.
    pub(crate) fn add_values(&mut self, x: &[f64], rows: &mut [f64]) -> f64 {
        self.fill_inputs(x);
        self.function.value(&self.inputs, &mut self.values);
        match self.first_row {
            Some(first) if !rows.is_empty() => {
                for (r, v) in rows[first..].iter_mut().zip(&self.values) {
                    *r += v;
                }
                0.0
            }
            Some(_) => 0.0,
            None => self.cost * self.values[0],
        }
    }

    pub(crate) fn has_cost(&self) -> bool {
        self.first_row.is_none()
    }

    pub(crate) fn refresh(&mut self, x: &[f64]) {
        self.fill_inputs(x);
        self.function.jacobian(&self.inputs, &mut self.values, &mut self.entries);
    }

    pub(crate) fn each_jacobian(&self, mut emit: impl FnMut(usize, usize, f64)) {
        let Some(first) = self.first_row else { return };
        for ((r, c), &v) in self.function.pattern().jacobian_entries().zip(&self.entries) {
            emit(first + r, self.columns[c], v);
        }
    }

    pub(crate) fn add_gradient(&self, gradient: &mut [f64]) {
        if self.has_cost() {
            for ((_, c), v) in self.function.pattern().jacobian_entries().zip(&self.entries) {
                gradient[self.columns[c]] += self.cost * v;
            }
        }
    }

    pub(crate) fn each_hessian(
        &mut self,
        cost: f64,
        multipliers: &[f64],
        mut emit: impl FnMut(usize, usize, f64),
    ) {
        match self.first_row {
            Some(first) => {
                let rows = first..first + self.weights.len();
                self.weights.copy_from_slice(&multipliers[rows]);
            }
            None => self.weights[0] = cost * self.cost,
        }
        self.function.hessian(&self.inputs, &self.weights, &mut self.hessian);
        for (&(i, j), &h) in self.function.pattern().hessian.iter().zip(&self.hessian) {
            let (a, b) = (self.columns[i], self.columns[j]);
            // The same column may be listed twice: both orders of the pair then fall on its diagonal.
            let twice = if i != j && a == b { 2.0 } else { 1.0 };
            emit(a.max(b), a.min(b), twice * h);
        }
    }
}
