//! One segment: matching conditions, rows at its constraint points, shares of the integrals, with their derivatives.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::Phase;
use apsides_ode::{DiscreteFlow, Method, SmoothSystem};

use super::chain::{Chain, TermKind};
use super::layout::{Points, ShootingLayout, ShootingPhase};
use super::plan::step_grid;
use super::segment_system::SegmentSystem;
use crate::error::ShootingError;

/// Sizes agree by construction: systems and flows are made together.
const SIZES: &str = "invariant: the flow was made for this system";

/// One integral of a phase, where it is needed.
#[derive(Clone, Copy)]
pub(crate) struct Share {
    /// Index among the integrals of the phase.
    pub(crate) integral: usize,
    pub(crate) row: Option<usize>,
    /// Weight in the minimised cost.
    pub(crate) cost: f64,
}

/// One segment of a phase in the nonlinear program.
pub(crate) struct Shot {
    pub(crate) system: SegmentSystem,
    pub(crate) flow: DiscreteFlow,
    /// Column of each of `v = (x_0, c, p, t0, tf)`, the times being those of the phase or of the segment.
    columns: Vec<usize>,
    end_column: usize,
    matching_row: usize,
    path: Vec<PathRows>,
    bounds: Vec<BoundRow>,
    pub(crate) shares: Vec<Share>,
    /// The point `v` of the last evaluation.
    pub(crate) point: Vec<f64>,
    seeds: Vec<f64>,
    pub(crate) hessian: Vec<f64>,
}

/// A path constraint at one of its points.
struct PathRows {
    function: Arc<dyn NodeFunction>,
    /// Point of the step grid, normalised time.
    at: usize,
    place: f64,
    first_row: usize,
    inputs: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    weights: Vec<f64>,
    /// Derivatives by `v`, one row per output.
    rows: Vec<f64>,
}

/// A bounded state at a constraint point.
struct BoundRow {
    at: usize,
    state: usize,
    row: usize,
}

impl Shot {
    /// The segment `k` of a phase.
    pub(crate) fn new(
        phase: &Phase,
        p: &ShootingPhase,
        k: usize,
        layout: &ShootingLayout,
        shares: &[Share],
        method: Method,
    ) -> Result<Self, ShootingError> {
        let segment = &p.segments[k];
        let parameters = layout.parameter_columns().len();
        let mut functions = std::iter::once(&phase.dynamics)
            .chain(phase.path.iter().map(|c| &c.function))
            .chain(shares.iter().map(|s| &phase.integrals[s.integral].function));
        let parameters = if functions.any(|f| phase.takes_parameters(f.as_ref())) { parameters } else { 0 };
        let sizes = (p.states, p.controls, parameters);
        let mut chain = Chain::new(sizes, Arc::clone(&segment.controls.basis), segment.start, segment.width);
        for c in &phase.path {
            chain.admit(c.function.as_ref());
        }
        let integrands: Vec<_> =
            shares.iter().map(|s| Arc::clone(&phase.integrals[s.integral].function)).collect();
        let mut columns: Vec<usize> = (segment.state_column..segment.state_column + p.states).collect();
        for first in &segment.control_columns {
            columns.extend(*first..first + p.controls);
        }
        columns.extend(layout.first_parameter..layout.first_parameter + parameters);
        columns.extend([segment.times.0, segment.times.1]);
        let with_rows = !phase.path.is_empty() || !segment.bound_rows.is_empty();
        let places = |points: &Points| (0..points.count()).map(|j| points.place(j)).collect::<Vec<_>>();
        let mut stops = if with_rows { places(&segment.rows) } else { Vec::new() };
        if !resolves(method, segment.controls.count()) {
            stops.extend(places(&segment.controls));
        }
        stops.sort_by(f64::total_cmp);
        stops.dedup();
        let (grid, at) = step_grid(p.plan.steps[k], &stops);
        let at_row = |j: usize| at[stops.partition_point(|s| *s < segment.rows.place(j))];
        let mut path = Vec::new();
        for j in (0..segment.rows.count()).filter(|_| with_rows) {
            for (c, constraint) in phase.path.iter().enumerate() {
                let index = j * phase.path.len() + c;
                if segment.owns_path_row[index] {
                    let (place, row) = (segment.rows.place(j), segment.path_rows[index]);
                    path.push(PathRows::new(&constraint.function, at_row(j), place, row, chain.columns()));
                }
            }
        }
        let bound = |&(point, state, row): &(usize, usize, usize)| BoundRow { at: at_row(point), state, row };
        let order = chain.columns();
        let system = SegmentSystem::new(chain, &phase.dynamics, &integrands);
        let flow = DiscreteFlow::new(method, &system, grid)?;
        let outputs = system.states() + system.quadratures();
        Ok(Self {
            seeds: vec![0.0; (flow.steps() + 1) * outputs],
            point: vec![0.0; order],
            hessian: vec![0.0; order * order],
            columns,
            end_column: p.state_column(k + 1),
            matching_row: segment.matching_row,
            path,
            bounds: segment.bound_rows.iter().map(bound).collect(),
            shares: shares.to_vec(),
            system,
            flow,
        })
    }

    fn outputs(&self) -> usize {
        self.system.states() + self.system.quadratures()
    }

    /// Takes its unknowns from the vector of all.
    pub(crate) fn set_point(&mut self, x: &[f64]) {
        for (v, &c) in self.point.iter_mut().zip(&self.columns) {
            *v = x[c];
        }
    }

    /// Takes the steps and evaluates the path rows.
    #[expect(clippy::expect_used, reason = "invariant: the flow was made for this system")]
    pub(crate) fn run(&mut self, x: &[f64]) {
        self.set_point(x);
        let (x0, w) = self.point.split_at(self.system.states());
        self.flow.run(&mut self.system, x0, w).expect(SIZES);
        let n = x0.len();
        for path in &mut self.path {
            self.system.chain.set(path.place);
            self.system.chain.fill(&self.flow.value(path.at)[..n], w, &mut path.inputs);
            path.function.value(&path.inputs, &mut path.values);
        }
    }

    /// The same with first derivatives.
    #[expect(clippy::expect_used, reason = "invariant: the flow was made for this system")]
    pub(crate) fn differentiate(&mut self, x: &[f64]) {
        self.set_point(x);
        let n = self.system.states();
        let (x0, w) = self.point.split_at(n);
        self.flow.differentiate(&mut self.system, x0, w).expect(SIZES);
        let chain = &mut self.system.chain;
        for path in &mut self.path {
            chain.set(path.place);
            chain.fill(&self.flow.value(path.at)[..n], w, &mut path.inputs);
            path.function.jacobian(&path.inputs, &mut path.values, &mut path.entries);
            let sensitivity = self.flow.sensitivity(path.at);
            let function = path.function.as_ref();
            chain.rows(
                function,
                TermKind::Plain,
                w,
                &path.values,
                &path.entries,
                sensitivity,
                &mut path.rows,
            );
        }
    }

    /// Adds to the rows, after [`run`](Self::run) or [`differentiate`](Self::differentiate) at the same point.
    pub(crate) fn add_values(&self, x: &[f64], rows: &mut [f64]) {
        let n = self.system.states();
        let end = self.flow.value(self.flow.steps());
        for i in 0..n {
            rows[self.matching_row + i] += x[self.end_column + i] - end[i];
        }
        for path in &self.path {
            for (r, v) in rows[path.first_row..].iter_mut().zip(&path.values) {
                *r += v;
            }
        }
        for b in &self.bounds {
            rows[b.row] += self.flow.value(b.at)[b.state];
        }
        for (share, q) in self.shares.iter().zip(&end[n..]) {
            if let Some(row) = share.row {
                rows[row] += q;
            }
        }
    }

    /// Share of the cost.
    pub(crate) fn cost(&self) -> f64 {
        let end = self.flow.value(self.flow.steps());
        self.shares.iter().zip(&end[self.system.states()..]).map(|(s, q)| s.cost * q).sum()
    }

    pub(crate) fn add_gradient(&self, gradient: &mut [f64]) {
        let n = self.system.states();
        let rows = self.flow.sensitivity(self.flow.steps()).chunks_exact(self.columns.len());
        for (share, row) in self.shares.iter().zip(rows.skip(n)) {
            if share.cost != 0.0 {
                for (&c, v) in self.columns.iter().zip(row) {
                    gradient[c] += share.cost * v;
                }
            }
        }
    }

    /// `emit(row, column, value)` for all entries of the Jacobian, always in the same order.
    pub(crate) fn each_jacobian(&self, mut emit: impl FnMut(usize, usize, f64)) {
        let n = self.system.states();
        let mut row_of = |row: usize, sign: f64, values: &[f64]| {
            for (&c, v) in self.columns.iter().zip(values) {
                emit(row, c, sign * v);
            }
        };
        let width = self.columns.len();
        let end = self.flow.sensitivity(self.flow.steps());
        for (i, row) in end.chunks_exact(width).take(n).enumerate() {
            row_of(self.matching_row + i, -1.0, row);
        }
        for (share, row) in self.shares.iter().zip(end.chunks_exact(width).skip(n)) {
            if let Some(r) = share.row {
                row_of(r, 1.0, row);
            }
        }
        for path in &self.path {
            for (k, row) in path.rows.chunks_exact(width).enumerate() {
                row_of(path.first_row + k, 1.0, row);
            }
        }
        for b in &self.bounds {
            row_of(b.row, 1.0, &self.flow.sensitivity(b.at)[b.state * width..][..width]);
        }
        for i in 0..n {
            emit(self.matching_row + i, self.end_column + i, 1.0);
        }
    }

    /// Seeds of the adjoints at all points of the step grid: what the weighted rows and the weighted cost gain from a change there.
    fn seed(&mut self, factor: f64, multipliers: &[f64]) {
        let (n, outputs) = (self.system.states(), self.outputs());
        self.seeds.fill(0.0);
        let end = self.flow.steps() * outputs;
        for i in 0..n {
            self.seeds[end + i] = -multipliers[self.matching_row + i];
        }
        for (k, share) in self.shares.iter().enumerate() {
            self.seeds[end + n + k] = factor * share.cost + share.row.map_or(0.0, |r| multipliers[r]);
        }
        for b in &self.bounds {
            self.seeds[b.at * outputs + b.state] += multipliers[b.row];
        }
        for path in &mut self.path {
            for (weight, y) in path.weights.iter_mut().zip(&multipliers[path.first_row..]) {
                *weight = *y;
            }
            for ((r, c), v) in path.function.pattern().jacobian_entries().zip(&path.entries) {
                if c < n {
                    self.seeds[path.at * outputs + c] += path.weights[r] * v;
                }
            }
        }
    }

    /// Hessian of the weighted rows and cost by `v`, into the lower triangle of [`hessian`](Self::hessian), after
    /// [`differentiate`](Self::differentiate) at the same point.
    #[expect(clippy::expect_used, reason = "invariant: the flow was made for this system")]
    pub(crate) fn evaluate_hessian(&mut self, factor: f64, multipliers: &[f64]) {
        self.seed(factor, multipliers);
        let (n, width) = (self.system.states(), self.columns.len());
        self.hessian.fill(0.0);
        let w = &self.point[n..];
        self.flow.add_hessian(&mut self.system, w, &self.seeds, &mut self.hessian).expect(SIZES);
        let chain = &mut self.system.chain;
        for path in &self.path {
            chain.set(path.place);
            chain.clear();
            let function = path.function.as_ref();
            chain.add_local(function, TermKind::Plain, w, &path.inputs, &path.entries, &path.weights);
            chain.add_products(&self.flow.sensitivity(path.at)[..n * width], &mut self.hessian);
        }
    }

    /// `emit(i, j, value)` with `i >= j` for all entries of the Hessian, always in the same order.
    pub(crate) fn each_hessian(&self, mut emit: impl FnMut(usize, usize, f64)) {
        let width = self.columns.len();
        for (a, row) in self.hessian.chunks_exact(width).enumerate() {
            for (b, v) in row[..=a].iter().enumerate() {
                let (i, j) = (self.columns[a], self.columns[b]);
                emit(i.max(j), i.min(j), *v);
            }
        }
    }
}

/// Says whether one step integrates the square of a polynomial through so many points, a cost of effort, exactly. The methods have
/// negative weights: what they do not resolve can lower a cost without bound. Steps from point to point resolve any polynomial.
fn resolves(method: Method, points: usize) -> bool {
    let order = match method {
        Method::Dop853 => 8,
        Method::Dopri5 => 5,
    };
    2 * (points - 1) < order
}

impl PathRows {
    fn new(
        function: &Arc<dyn NodeFunction>,
        at: usize,
        place: f64,
        first_row: usize,
        columns: usize,
    ) -> Self {
        let outputs = function.outputs();
        Self {
            at,
            place,
            first_row,
            inputs: vec![0.0; function.inputs()],
            values: vec![0.0; outputs],
            entries: vec![0.0; function.pattern().jacobian_len()],
            weights: vec![0.0; outputs],
            rows: vec![0.0; outputs * columns],
            function: Arc::clone(function),
        }
    }
}
