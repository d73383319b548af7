//! Touch points with free times: the row is at its bound there, and its rate vanishes.
//!
//! With the time as an unknown and the rate as a condition the program has the curvature of the problem itself: a contact that is
//! pushed down moves aside. Held at a fixed time instead, it is often no minimum.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::Ocp;
use apsides_transcription::Layout;

use crate::layout::CollocationPhase;

/// The rate of a row at a touch point: the derivative of the polynomial through the values of the row at the points of the interval
/// after it.
pub(crate) struct RateTerm {
    function: Arc<dyn NodeFunction>,
    output: usize,
    row: usize,
    points: Vec<RatePoint>,
    inputs: Vec<f64>,
    values: Vec<f64>,
    weights: Vec<f64>,
    hessian: Vec<f64>,
}

/// A point of the polynomial.
struct RatePoint {
    factor: f64,
    columns: Vec<usize>,
    /// Derivatives of all outputs at the point of [`RateTerm::refresh`].
    entries: Vec<f64>,
    inputs: Vec<f64>,
}

/// The rates at all touch points.
pub(crate) fn rate_terms(ocp: &Ocp, layout: &Layout<CollocationPhase>) -> Vec<RateTerm> {
    let mut terms = Vec::new();
    for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
        for &(row, touch) in &p.rate_rows {
            let mut first = 0;
            let owner = phase.path.iter().find(|c| {
                first += c.rows.len();
                touch.row < first
            });
            if let Some(path) = owner {
                let output = touch.row + path.rows.len() - first;
                terms.push(RateTerm::new(&path.function, output, row, p, touch.end, layout.first_parameter));
            }
        }
    }
    terms
}

impl RateTerm {
    fn new(
        function: &Arc<dyn NodeFunction>,
        output: usize,
        row: usize,
        p: &CollocationPhase,
        interval: usize,
        first_parameter: usize,
    ) -> Self {
        let inputs = vec![0.0; function.inputs()];
        let slopes = &p.rules[interval].differentiation()[..=p.mesh.points()[interval]];
        let nodes = p.interval_start(interval)..;
        let points = slopes.iter().zip(nodes).map(|(&factor, node)| RatePoint {
            factor,
            columns: columns(p, node, inputs.len(), first_parameter),
            entries: vec![0.0; function.pattern().jacobian_len()],
            inputs: inputs.clone(),
        });
        Self {
            output,
            row,
            points: points.collect(),
            values: vec![0.0; function.outputs()],
            weights: vec![0.0; function.outputs()],
            hessian: vec![0.0; function.pattern().hessian_len()],
            inputs,
            function: Arc::clone(function),
        }
    }

    /// Adds the positions of the entries, in their order.
    pub(crate) fn add_patterns(&self, jacobian: &mut Vec<(usize, usize)>, hessian: &mut Vec<(usize, usize)>) {
        self.each_jacobian(|r, c, _| jacobian.push((r, c)));
        let positions = self.points.iter().flat_map(|point| {
            let pairs = self.function.pattern().hessian.iter();
            pairs.map(|&(i, j)| (point.columns[i], point.columns[j]))
        });
        hessian.extend(positions.map(|(a, b)| (a.max(b), a.min(b))));
    }

    pub(crate) fn add_values(&mut self, x: &[f64], rows: &mut [f64]) {
        for point in &self.points {
            fill(&mut self.inputs, &point.columns, x);
            self.function.value(&self.inputs, &mut self.values);
            rows[self.row] += point.factor * self.values[self.output];
        }
    }

    pub(crate) fn refresh(&mut self, x: &[f64]) {
        for point in &mut self.points {
            fill(&mut point.inputs, &point.columns, x);
            self.function.jacobian(&point.inputs, &mut self.values, &mut point.entries);
        }
    }

    /// Calls `emit(row, column, value)`, after [`refresh`](Self::refresh).
    pub(crate) fn each_jacobian(&self, mut emit: impl FnMut(usize, usize, f64)) {
        for point in &self.points {
            for ((r, c), v) in self.function.pattern().jacobian_entries().zip(&point.entries) {
                if r == self.output {
                    emit(self.row, point.columns[c], point.factor * v);
                }
            }
        }
    }

    /// Calls `emit(i, j, value)` with `i >= j`, after [`refresh`](Self::refresh).
    pub(crate) fn each_hessian(&mut self, multipliers: &[f64], mut emit: impl FnMut(usize, usize, f64)) {
        for point in &self.points {
            self.weights.fill(0.0);
            self.weights[self.output] = point.factor * multipliers[self.row];
            self.function.hessian(&point.inputs, &self.weights, &mut self.hessian);
            for (&(i, j), &h) in self.function.pattern().hessian.iter().zip(&self.hessian) {
                let (a, b) = (point.columns[i], point.columns[j]);
                emit(a.max(b), a.min(b), h);
            }
        }
    }
}

fn fill(inputs: &mut [f64], columns: &[usize], x: &[f64]) {
    for (z, &c) in inputs.iter_mut().zip(columns) {
        *z = x[c];
    }
}

/// Columns of states, controls, parameters and time of a node. Rows of touch points depend on neither controls nor time, so that any
/// columns do for these.
fn columns(p: &CollocationPhase, node: usize, inputs: usize, first_parameter: usize) -> Vec<usize> {
    let states = p.state_column(node)..p.state_column(node) + p.states;
    let control = p.control_column(node.min(p.nodes.len() - 1));
    let parameters = inputs - p.states - p.controls - 1;
    states
        .chain(control..control + p.controls)
        .chain(first_parameter..first_parameter + parameters)
        .chain([p.ends.initial_time])
        .collect()
}
