//! Rates of path constraint rows that vanish at touch points and at the junctions of arcs along bounds, both with free times.
//!
//! With the time of a touch point as an unknown and the rate as a condition the program has the curvature of the problem itself: a contact
//! that is pushed down moves aside. Held at a fixed time instead, it is often no minimum.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::{Ocp, PathConstraint, Phase};
use apsides_transcription::Layout;

use crate::junction::{RateArc, RateRow, depends_on_time, order as order_of_row, row_function};
use crate::layout::CollocationPhase;
use crate::row_rate::RowRate;

/// The rate of a row at an end of an interval: a derivative of the polynomial through the values of the row at the points of the
/// interval, in units in which the largest factor is one.
pub(crate) struct RateTerm {
    function: Arc<dyn NodeFunction>,
    /// Per output of the function, its part in what is differentiated.
    parts: Vec<f64>,
    rate: RateRow,
    /// Order of the derivative of the polynomial of these parts.
    order: usize,
    /// True where no control is in the rate.
    is_of_states: bool,
    points: Vec<RatePoint>,
    inputs: Vec<f64>,
    values: Vec<f64>,
    weights: Vec<f64>,
    hessian: Vec<f64>,
}

/// A point of the polynomial.
struct RatePoint {
    factor: f64,
    /// Per input the columns that it is a sum of, with factors: the time comes from those of the ends of the arc.
    columns: Vec<Vec<(usize, f64)>>,
    /// Derivatives of all outputs at the point of [`RateTerm::refresh`].
    entries: Vec<f64>,
    inputs: Vec<f64>,
}

/// All rates that vanish.
pub(crate) fn rate_terms(ocp: &Ocp, layout: &Layout<CollocationPhase>) -> Vec<RateTerm> {
    let mut terms = Vec::new();
    for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
        for rate in &p.rate_rows {
            if let Some((path, output)) = row_function(phase, rate.row) {
                // No equation of motion holds the polynomials at the very end: there the rate is that of the equations.
                // Nor does a polynomial show what a row makes of time alone. Where an arc ends that has the rate at its points, the rate is that of
                // the equations, too.
                let is_touch = !rate.at_end && p.exit_at(p.interval_start(rate.interval), rate.row).is_none();
                let is_exit = |a: &RateArc| a.row == rate.row && a.ends[1] == rate.interval;
                let ends_rates = !rate.at_end && p.rate_arcs.iter().any(is_exit);
                let from_rates = rate.order > 1
                    || ends_rates
                    || rate.at_end && rate.interval + 1 == p.mesh.intervals()
                    || is_touch && depends_on_time(phase, rate.row);
                let (function, parts, order) = differentiated(phase, path, output, rate.order, from_rates);
                let mut term = RateTerm::new(&function, parts, rate, order, p, layout.first_parameter);
                term.is_of_states = order_of_row(phase, rate.row).is_some_and(|o| rate.order < o.order);
                terms.push(term);
            }
        }
    }
    terms
}

/// The function whose derivative is the rate, its parts, and the order of the derivative. The second rate is the first derivative of the
/// first one, made of values of the equations of motion: a second derivative of the polynomial of the row is bent so much by
/// the multiplier of the condition that the condition has another solution near by. Where the row is linear in the states the
/// first rate is a sum of rates.
fn differentiated(
    phase: &Phase,
    path: &PathConstraint,
    output: usize,
    order: usize,
    from_rates: bool,
) -> (Arc<dyn NodeFunction>, Vec<f64>, usize) {
    let pattern = path.function.pattern();
    let inputs = path.function.inputs();
    let (mut values, mut entries) = (vec![0.0; path.function.outputs()], vec![0.0; pattern.jacobian_len()]);
    let mut parts = vec![0.0; path.function.outputs()];
    parts[output] = 1.0;
    let here = || pattern.jacobian_entries().zip(0..).filter(|((r, _), _)| *r == output);
    let is_linear = pattern.hessian.is_empty() && here().all(|((_, c), _)| c < phase.states.len());
    if !from_rates {
        return (Arc::clone(&path.function), parts, order);
    }
    if !is_linear {
        return match RowRate::new(&path.function, output, &phase.dynamics) {
            Some(rate) => (Arc::new(rate), vec![1.0], order - 1),
            None => (Arc::clone(&path.function), parts, order),
        };
    }
    path.function.jacobian(&vec![0.0; inputs], &mut values, &mut entries);
    let mut rates = vec![0.0; phase.states.len()];
    for ((_, c), k) in here() {
        rates[c] += entries[k];
    }
    (Arc::clone(&phase.dynamics), rates, order - 1)
}

/// Weights of the values at the support points of an interval in a derivative at one of its ends by the normalised time of the mesh.
fn slopes(p: &CollocationPhase, rate: &RateRow, order: usize) -> Vec<f64> {
    let support = p.rules[rate.interval].support_basis();
    let n = support.nodes().len();
    let once = support.differentiation_matrix();
    let end = if rate.at_end { n - 1 } else { 0 };
    let mut row: Vec<f64> = (0..n).map(|j| f64::from(u8::from(j == end))).collect();
    for _ in 0..order {
        row = (0..n).map(|j| row.iter().enumerate().map(|(k, v)| v * once[k * n + j]).sum()).collect();
    }
    let [start, end] = [rate.interval, rate.interval + 1].map(|k| p.mesh.fractions()[k]);
    let factor = (2.0 / (end - start)).powi(order as i32);
    row.iter_mut().for_each(|v| *v *= factor);
    row
}

impl RateTerm {
    fn new(
        function: &Arc<dyn NodeFunction>,
        parts: Vec<f64>,
        rate: &RateRow,
        order: usize,
        p: &CollocationPhase,
        first_parameter: usize,
    ) -> Self {
        let inputs = vec![0.0; function.inputs()];
        let nodes = p.interval_start(rate.interval)..;
        let points = slopes(p, rate, order).into_iter().zip(nodes).map(|(factor, node)| RatePoint {
            factor,
            columns: columns(p, rate.interval, node, inputs.len(), first_parameter),
            entries: vec![0.0; function.pattern().jacobian_len()],
            inputs: inputs.clone(),
        });
        Self {
            parts,
            rate: *rate,
            order,
            is_of_states: false,
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
        for point in &self.points {
            for &pair in &self.function.pattern().hessian {
                point.each_pair(pair, 0.0, |i, j, _| hessian.push((i, j)));
            }
        }
    }

    pub(crate) fn add_values(&mut self, x: &[f64], rows: &mut [f64]) {
        for point in &self.points {
            fill(&mut self.inputs, &point.columns, x);
            self.function.value(&self.inputs, &mut self.values);
            let value: f64 = self.values.iter().zip(&self.parts).map(|(v, part)| v * part).sum();
            rows[self.rate.at] += point.factor * value;
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
                let factor = point.factor * self.parts[r];
                if factor != 0.0 {
                    point.columns[c].iter().for_each(|(c, f)| emit(self.rate.at, *c, factor * v * f));
                }
            }
        }
    }

    /// Puts the multiplier of the condition into those of the equations of motion, as far as both say the same.
    ///
    /// The derivative of a row at the start of its interval is a sum of the equations of motion at the points and a condition on the state at that
    /// start alone: a change of the states that vanishes there changes the derivative by what it changes the rates, `sum_i D_0i g_i A_ij` for
    /// that at point `j`, with the gradients `g_i` of the row and the integrals `A_ij` of the polynomials of the points. Left where it is, the
    /// multiplier bends the costates of the whole interval. That of a rate with a control stays: it vanishes at an optimum, and is part of
    /// what makes the Hamiltonian stationary.
    pub(crate) fn move_into_equations(&self, p: &CollocationPhase, x: &[f64], y: &mut [f64]) {
        let RateRow { at, interval, at_end, .. } = self.rate;
        if at_end || self.order != 1 || !self.is_of_states {
            return;
        }
        let (rule, first) = (&p.rules[interval], p.interval_start(interval));
        let multiplier = y[at];
        let mut inputs = self.inputs.clone();
        let (mut values, mut entries) = (self.values.clone(), self.points[0].entries.clone());
        for (point, integrals) in self.points[1..].iter().zip(rule.integration().chunks(rule.points())) {
            fill(&mut inputs, &point.columns, x);
            self.function.jacobian(&inputs, &mut values, &mut entries);
            for ((r, c), v) in self.function.pattern().jacobian_entries().zip(&entries) {
                if c < p.states {
                    let slope = multiplier * point.factor * self.parts[r] * v;
                    for (node, integral) in (first..).zip(integrals) {
                        y[p.defect_row(node) + c] += slope * integral;
                    }
                }
            }
        }
    }

    /// The constraint row of the condition.
    pub(crate) fn constraint(&self) -> usize {
        self.rate.at
    }

    /// Calls `emit(i, j, value)` with `i >= j`, after [`refresh`](Self::refresh).
    pub(crate) fn each_hessian(&mut self, multipliers: &[f64], mut emit: impl FnMut(usize, usize, f64)) {
        for point in &self.points {
            for (w, part) in self.weights.iter_mut().zip(&self.parts) {
                *w = point.factor * part * multipliers[self.rate.at];
            }
            self.function.hessian(&point.inputs, &self.weights, &mut self.hessian);
            for (&pair, &h) in self.function.pattern().hessian.iter().zip(&self.hessian) {
                point.each_pair(pair, h, &mut emit);
            }
        }
    }
}

impl RatePoint {
    /// Calls `emit(i, j, value)` with `i >= j` for the second derivative by a pair of inputs.
    fn each_pair(&self, (i, j): (usize, usize), h: f64, mut emit: impl FnMut(usize, usize, f64)) {
        for (k, (a, fa)) in self.columns[i].iter().enumerate() {
            let others = if i == j { &self.columns[j][..=k] } else { &self.columns[j][..] };
            for (b, fb) in others {
                emit(*a.max(b), *a.min(b), h * fa * fb);
            }
        }
    }
}

fn fill(inputs: &mut [f64], columns: &[Vec<(usize, f64)>], x: &[f64]) {
    for (z, columns) in inputs.iter_mut().zip(columns) {
        *z = columns.iter().map(|(c, f)| x[*c] * f).sum();
    }
}

/// Columns of states, controls, parameters and time at a point of the polynomial of an interval. These rows do not depend on controls, so
/// that any columns do for them.
fn columns(
    p: &CollocationPhase,
    interval: usize,
    node: usize,
    inputs: usize,
    first_parameter: usize,
) -> Vec<Vec<(usize, f64)>> {
    let states = p.state_column(node)..p.state_column(node) + p.states;
    let control = p.control_column(node.min(p.nodes.len() - 1));
    let parameters = inputs - p.states - p.controls - 1;
    let arc = &p.arcs[p.arc_of(p.interval_start(interval))];
    let share = if node < arc.nodes.end { p.nodes[node].share } else { 1.0 };
    states
        .chain(control..control + p.controls)
        .chain(first_parameter..first_parameter + parameters)
        .map(|column| vec![(column, 1.0)])
        .chain([vec![(arc.start_time, 1.0 - share), (arc.end_time, share)]])
        .collect()
}
