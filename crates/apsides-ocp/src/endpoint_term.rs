//! Functions of end quantities (boundary conditions, linkages, end costs) as rows and cost of a discretised problem.

use std::sync::Arc;

use apsides_ad::NodeFunction;

use crate::{EndpointInput, Ocp};

/// A function of a few columns that goes to rows or, with a weight, to the cost.
pub struct EndpointTerm {
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
    /// The endpoint constraints of a problem, then the functions of its objective, the sign of the sense included. `column` is
    /// where an end quantity stands among the variables, `rows` has the first row of each constraint.
    #[must_use]
    pub fn all(ocp: &Ocp, rows: &[usize], column: impl Fn(EndpointInput) -> usize) -> Vec<Self> {
        let columns = |inputs: &[EndpointInput]| inputs.iter().map(|&i| column(i)).collect::<Vec<_>>();
        let sign = ocp.objective.sense.sign();
        let constraints = ocp.constraints.iter().zip(rows);
        let constraints = constraints
            .map(|(c, &row)| Self::new(Arc::clone(&c.function), columns(&c.inputs), Some(row), 0.0));
        let costs = ocp.objective.functions.iter();
        constraints
            .chain(costs.map(|(inputs, f)| Self::new(Arc::clone(f), columns(inputs), None, sign)))
            .collect()
    }

    fn new(
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

    /// Adds to the rows, if it has any and `rows` is not empty, and returns the share of the cost.
    pub fn add_values(&mut self, x: &[f64], rows: &mut [f64]) -> f64 {
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

    /// Returns true if the term takes part in the cost and has no row.
    #[must_use]
    pub fn has_cost(&self) -> bool {
        self.first_row.is_none()
    }

    /// Evaluates values and derivatives at `x`, all variables.
    pub fn refresh(&mut self, x: &[f64]) {
        self.fill_inputs(x);
        self.function.jacobian(&self.inputs, &mut self.values, &mut self.entries);
    }

    /// `emit(row, value)` for the rows, after [`refresh`](Self::refresh).
    pub fn each_value(&self, mut emit: impl FnMut(usize, f64)) {
        let Some(first) = self.first_row else { return };
        for (r, &v) in self.values.iter().enumerate() {
            emit(first + r, v);
        }
    }

    /// `emit(row, column, value)` for the derivatives of the rows, after [`refresh`](Self::refresh).
    pub fn each_jacobian(&self, mut emit: impl FnMut(usize, usize, f64)) {
        let Some(first) = self.first_row else { return };
        for ((r, c), &v) in self.function.pattern().jacobian_entries().zip(&self.entries) {
            emit(first + r, self.columns[c], v);
        }
    }

    /// Adds the gradient of the share of the cost, after [`refresh`](Self::refresh).
    pub fn add_gradient(&self, gradient: &mut [f64]) {
        if self.has_cost() {
            for ((_, c), v) in self.function.pattern().jacobian_entries().zip(&self.entries) {
                gradient[self.columns[c]] += self.cost * v;
            }
        }
    }

    /// `emit(i, j, value)` with `i >= j` for the Hessian weighted by the multipliers of all rows and the factor `cost`, after
    /// [`refresh`](Self::refresh). A pair may come more than once; the values are to be summed.
    pub fn each_hessian(&mut self, cost: f64, multipliers: &[f64], mut emit: impl FnMut(usize, usize, f64)) {
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
