//! A node function at every collocation point of an arc of a phase: defects, path constraints, integrands.
//!
//! A rate (dynamics, integrand) enters a row or the cost as `factor * (tf - t0) * f(x, u, p, t)` and a path function as
//! `factor * f(x, u, p, t)`, both at `t = (1 - s) t0 + s tf` with the times `t0` and `tf` of the arc's ends and the
//! normalised time `s` of the point. The chain rule to `t0` and `tf` is applied here, once, for every method of
//! differentiation above it.

use std::ops::Range;
use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_transcription::{Workers, in_pieces};

use crate::layout::{ArcLayout, CollocationPhase};
use crate::node_derivatives::{
    End, FirstDerivative, NodeDerivatives, NodeValues, Point, SecondDerivative, of_each,
};

/// The place to which the outputs of a term go.
#[derive(Clone, Copy)]
pub(crate) enum Target {
    /// Output `k` at node `i` of the arc goes to row `first + i * stride + k`.
    Rows { first: usize, stride: usize },
    /// The sum over the nodes goes to a row, if there is one, and to the cost with a weight.
    Sum { row: Option<usize>, cost: f64 },
}

/// Nodes whose functions are evaluated in one call.
const BATCH: usize = 32;

/// A node function on one arc, with the places of its inputs and outputs.
pub(crate) struct NodeTerm {
    function: Arc<dyn NodeFunction>,
    is_rate: bool,
    target: Target,
    points: Vec<Point>,
    first_parameter: usize,
    initial_time: usize,
    final_time: usize,
    /// Inputs `x` and `u` come from the node, then parameters, then time.
    node_inputs: usize,
    time_input: usize,
    derivatives: NodeDerivatives,
    /// Inputs, values and Jacobian entries at all nodes, for the point of [`Self::refresh`].
    inputs: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    /// Values at all nodes, for any point.
    outputs: Vec<f64>,
    /// One per piece of the nodes that a thread works on at a time.
    scratch: Vec<Scratch>,
    /// Entries per node of the Jacobian and of the Hessian.
    emitted: (usize, usize),
}

/// Inputs, weights and Hessians of a batch of nodes.
#[derive(Clone)]
struct Scratch {
    inputs: Vec<f64>,
    weights: Vec<f64>,
    hessians: Vec<f64>,
    /// Gradients of the weighted sums of outputs with respect to the inputs.
    slopes: Vec<f64>,
}

impl NodeTerm {
    pub(crate) fn new(
        function: Arc<dyn NodeFunction>,
        is_rate: bool,
        target: Target,
        phase: &CollocationPhase,
        arc: &ArcLayout,
        first_parameter: usize,
        time_fixed: (bool, bool),
        factor: impl Fn(usize) -> f64,
    ) -> Self {
        let node_inputs = phase.states + phase.controls;
        let time_input = function.inputs() - 1;
        let derivatives = NodeDerivatives::new(function.pattern(), time_input, is_rate, time_fixed);
        let point = |i: usize| Point {
            column: phase.state_column(i),
            fraction: phase.nodes[i].share,
            factor: factor(i),
        };
        let points: Vec<Point> = arc.nodes.clone().map(point).collect();
        let (outputs, entries) = (function.outputs(), function.pattern().jacobian_len());
        Self {
            inputs: vec![0.0; points.len() * function.inputs()],
            values: vec![0.0; points.len() * outputs],
            entries: vec![0.0; points.len() * entries],
            outputs: vec![0.0; points.len() * outputs],
            scratch: vec![Scratch {
                inputs: vec![0.0; BATCH * function.inputs()],
                weights: vec![0.0; BATCH * outputs],
                hessians: vec![0.0; BATCH * function.pattern().hessian_len()],
                slopes: vec![0.0; BATCH * function.inputs()],
            }],
            emitted: (0, 0),
            function,
            is_rate,
            target,
            points,
            first_parameter,
            initial_time: arc.start_time,
            final_time: arc.end_time,
            node_inputs,
            time_input,
            derivatives,
        }
    }

    fn column(&self, point: &Point, input: usize) -> usize {
        if input < self.node_inputs {
            point.column + input
        } else {
            self.first_parameter + input - self.node_inputs
        }
    }

    fn row(&self, node: usize, output: usize) -> Option<usize> {
        match self.target {
            Target::Rows { first, stride } => Some(first + node * stride + output),
            Target::Sum { row, .. } => row,
        }
    }

    /// Inputs of consecutive nodes, node after node; one input of all of them at a time, since a node has so few that each call to copy them would
    /// take longer than the copy.
    fn fill_batch(&self, nodes: Range<usize>, x: &[f64], inputs: &mut [f64]) {
        let width = self.function.inputs();
        let points = &self.points[nodes];
        // Nodes follow each other.
        let values = &x[points.first().map_or(0, |p| p.column)..];
        for k in 0..self.node_inputs {
            let values = of_each(values, self.node_inputs, k);
            for ((input, value), _) in inputs[k..].iter_mut().step_by(width).zip(values).zip(points) {
                *input = *value;
            }
        }
        let own = points.len() * width;
        for k in self.node_inputs..self.time_input {
            let parameter = x[self.first_parameter + k - self.node_inputs];
            inputs[k..own].iter_mut().step_by(width).for_each(|input| *input = parameter);
        }
        let (initial, last) = (x[self.initial_time], x[self.final_time]);
        for (input, p) in inputs[self.time_input..].iter_mut().step_by(width).zip(points) {
            *input = (1.0 - p.fraction) * initial + p.fraction * last;
        }
    }

    /// Lets workers share the nodes, where there are enough of them; false where there are not.
    pub(crate) fn share(&mut self, workers: &Workers) -> bool {
        let scratch = self.scratch[0].clone();
        self.scratch.resize(workers.pieces(self.points.len()), scratch);
        self.scratch.len() > 1
    }

    fn duration(&self, x: &[f64]) -> f64 {
        if self.is_rate { x[self.final_time] - x[self.initial_time] } else { 1.0 }
    }

    /// Adds the outputs to the rows and returns the share of the cost, summed node after node.
    pub(crate) fn add_values(&mut self, x: &[f64], rows: &mut [f64]) -> f64 {
        let m = self.function.outputs();
        let (mut outputs, mut scratch) =
            (std::mem::take(&mut self.outputs), std::mem::take(&mut self.scratch));
        // Values are cheap: more threads did not pay at 15,000 nodes.
        in_pieces(&mut scratch[..1], self.points.len(), [(&mut outputs, m)], |nodes, scratch, [outputs]| {
            let first = nodes.start;
            for batch in batches(nodes) {
                self.fill_batch(batch.clone(), x, &mut scratch.inputs);
                let outputs = &mut outputs[(batch.start - first) * m..(batch.end - first) * m];
                self.function.values(batch.len(), &scratch.inputs, outputs);
            }
        });
        (self.outputs, self.scratch) = (outputs, scratch);
        let duration = self.duration(x);
        let outputs = self.outputs.chunks_exact(m.max(1));
        match self.target {
            Target::Rows { first, stride } => {
                let rows = rows.get_mut(first..).unwrap_or_default().chunks_mut(stride);
                for ((p, outputs), rows) in self.points.iter().zip(outputs).zip(rows) {
                    let factor = p.factor * duration;
                    rows.iter_mut().zip(outputs).for_each(|(row, v)| *row += factor * v);
                }
                0.0
            }
            Target::Sum { row, cost: weight } => {
                let mut row = row.and_then(|row| rows.get_mut(row));
                let mut cost = 0.0;
                for (p, outputs) in self.points.iter().zip(outputs) {
                    let factor = p.factor * duration;
                    for v in outputs {
                        if let Some(row) = &mut row {
                            **row += factor * v;
                        }
                        cost += weight * factor * v;
                    }
                }
                cost
            }
        }
    }

    /// Says whether the term takes part in rows.
    pub(crate) fn has_rows(&self) -> bool {
        !matches!(self.target, Target::Sum { row: None, .. })
    }

    /// Says whether the term takes part in the cost.
    pub(crate) fn has_cost(&self) -> bool {
        matches!(self.target, Target::Sum { cost, .. } if cost != 0.0)
    }

    /// Evaluates values and Jacobians at all nodes.
    pub(crate) fn refresh(&mut self, x: &[f64]) {
        let (n, m) = (self.function.inputs(), self.function.outputs());
        let e = self.function.pattern().jacobian_len();
        let mut scratch = std::mem::take(&mut self.scratch);
        let mut inputs = std::mem::take(&mut self.inputs);
        let (mut values, mut entries) = (std::mem::take(&mut self.values), std::mem::take(&mut self.entries));
        let targets = [(&mut inputs[..], n), (&mut values[..], m), (&mut entries[..], e)];
        in_pieces(&mut scratch, self.points.len(), targets, |nodes, _, [inputs, values, entries]| {
            let first = nodes.start;
            for batch in batches(nodes) {
                let (from, to) = (batch.start - first, batch.end - first);
                let inputs = &mut inputs[from * n..to * n];
                self.fill_batch(batch.clone(), x, inputs);
                let (values, entries) = (&mut values[from * m..to * m], &mut entries[from * e..to * e]);
                self.function.jacobians(batch.len(), inputs, values, entries);
            }
        });
        (self.inputs, self.values, self.entries, self.scratch) = (inputs, values, entries, scratch);
    }

    /// Adds `(row, column)` of the entries that [`fill_jacobian`](Self::fill_jacobian) and
    /// [`fill_hessian`](Self::fill_hessian) write, in their order.
    pub(crate) fn add_patterns(
        &mut self,
        jacobian: &mut Vec<(usize, usize)>,
        places: &mut Vec<(usize, usize)>,
    ) {
        let before = (jacobian.len(), places.len());
        for (node, p) in self.points.iter().enumerate() {
            for first in &self.derivatives.first {
                let (output, column) = self.place_of_first(p, first);
                jacobian.extend(self.row(node, output).map(|row| (row, column)));
            }
            places.extend(self.derivatives.second.iter().map(|second| self.place_of_second(p, second)));
        }
        let nodes = self.points.len().max(1);
        self.emitted = ((jacobian.len() - before.0) / nodes, (places.len() - before.1) / nodes);
    }

    /// Writes the Jacobian entries of the rows into the head of `entries` and returns the rest.
    pub(crate) fn fill_jacobian<'a>(&mut self, x: &[f64], entries: &'a mut [f64]) -> &'a mut [f64] {
        let duration = self.duration(x);
        let width = self.emitted.0;
        let (own, rest) = entries.split_at_mut(self.points.len() * width);
        let mut scratch = std::mem::take(&mut self.scratch);
        in_pieces(&mut scratch, self.points.len(), [(own, width)], |nodes, _, [own]| {
            if width > 0 {
                self.derivatives.fill_first(self.at_nodes(nodes, duration), own);
            }
        });
        self.scratch = scratch;
        rest
    }

    /// The quantities that are known at nodes after [`refresh`](Self::refresh).
    fn at_nodes(&self, nodes: Range<usize>, duration: f64) -> NodeValues<'_> {
        let (m, e) = (self.function.outputs(), self.function.pattern().jacobian_len());
        let values = &self.values[nodes.start * m..nodes.end * m];
        let entries = &self.entries[nodes.start * e..nodes.end * e];
        NodeValues { points: &self.points[nodes], duration, values, entries }
    }

    fn time_column(&self, end: End) -> usize {
        if end == End::Start { self.initial_time } else { self.final_time }
    }

    /// Output and column of a first derivative at a node.
    fn place_of_first(&self, p: &Point, first: &FirstDerivative) -> (usize, usize) {
        match *first {
            FirstDerivative::ByInput { output, input, .. } => (output, self.column(p, input)),
            FirstDerivative::ByTime { output, end, .. } => (output, self.time_column(end)),
        }
    }

    /// Row and column, in the lower triangle, of a second derivative at a node.
    fn place_of_second(&self, p: &Point, second: &SecondDerivative) -> (usize, usize) {
        let (i, j) = match *second {
            SecondDerivative::ByInputs { inputs: [i, j], .. } => (self.column(p, i), self.column(p, j)),
            SecondDerivative::AlongTime { input, end, .. }
            | SecondDerivative::ThroughDuration { input, end } => {
                (self.time_column(end), self.column(p, input))
            }
            SecondDerivative::ByTimes { ends: [i, j], .. } => (self.time_column(i), self.time_column(j)),
        };
        (i.max(j), i.min(j))
    }

    /// Adds the gradient of the share of the cost.
    pub(crate) fn add_gradient(&self, x: &[f64], gradient: &mut [f64]) {
        let Target::Sum { cost, .. } = self.target else { return };
        let at = self.at_nodes(0..self.points.len(), self.duration(x));
        for first in &self.derivatives.first {
            let mut points = self.points.iter();
            self.derivatives.first_values(first, at, &mut |v| {
                if let Some(p) = points.next() {
                    gradient[self.place_of_first(p, first).1] += cost * v;
                }
            });
        }
    }

    /// Writes the entries of the lower triangle of the weighted Hessian into the head of `values`, after
    /// [`refresh`](Self::refresh) at the same point, and returns the rest.
    ///
    /// `multipliers` weights the rows and `cost` the cost.
    pub(crate) fn fill_hessian<'a>(
        &mut self,
        x: &[f64],
        cost: f64,
        multipliers: &[f64],
        values: &'a mut [f64],
    ) -> &'a mut [f64] {
        let duration = self.duration(x);
        let width = self.emitted.1;
        let (own, rest) = values.split_at_mut(self.points.len() * width);
        let mut scratch = std::mem::take(&mut self.scratch);
        in_pieces(&mut scratch, self.points.len(), [(own, width)], |nodes, scratch, [own]| {
            if width == 0 {
                return;
            }
            for (batch, own) in batches(nodes).zip(own.chunks_mut(BATCH * width)) {
                self.weigh(batch.clone(), cost, multipliers, scratch);
                let Scratch { weights, hessians, slopes, .. } = scratch;
                let at = self.at_nodes(batch, duration);
                self.derivatives.fill_slopes(at.entries, weights, slopes);
                self.derivatives.fill_second(at, hessians, slopes, own);
            }
        });
        self.scratch = scratch;
        rest
    }

    /// Weights of the outputs, and Hessians of their weighted sums, of a batch of nodes.
    fn weigh(&self, batch: Range<usize>, cost: f64, multipliers: &[f64], scratch: &mut Scratch) {
        let Scratch { weights, hessians, .. } = scratch;
        let (n, m) = (self.function.inputs(), self.function.outputs());
        let points = &self.points[batch.clone()];
        let weights_of_nodes = weights.chunks_exact_mut(m.max(1)).zip(points);
        match self.target {
            Target::Rows { first, stride } => {
                let rows = multipliers[first + batch.start * stride..].chunks(stride);
                for ((weights, p), rows) in weights_of_nodes.zip(rows) {
                    weights.iter_mut().zip(rows).for_each(|(weight, y)| *weight = y * p.factor);
                }
            }
            Target::Sum { row, cost: share } => {
                let weight = row.map_or(0.0, |row| multipliers[row]) + cost * share;
                weights_of_nodes.for_each(|(weights, p)| weights.fill(weight * p.factor));
            }
        }
        let inputs = &self.inputs[batch.start * n..batch.end * n];
        self.function.hessians(batch.len(), inputs, weights, hessians);
    }
}

/// Nodes in batches.
fn batches(nodes: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = nodes.end;
    nodes.step_by(BATCH).map(move |first| first..(first + BATCH).min(end))
}
