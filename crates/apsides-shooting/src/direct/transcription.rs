//! The discretised problem: a sparse nonlinear program.
//!
//! Between the nodes of a phase the state follows from the node before by Runge-Kutta steps, the discrete map `phi`, and
//!
//! ```text
//! x_{k+1} - phi(x_k, c_k, p, t0, tf) = 0
//! ```
//!
//! Path constraints hold at their points, with the state of the steps there. All derivatives are those of the discrete map.

use std::sync::Arc;

use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling, Stages};
use apsides_ocp::{Bounds, EndpointTerm, Guess, Ocp, OcpError, Scaling, Sense};
use apsides_ode::Method;
use rayon::ThreadPool;
use rayon::iter::{IntoParallelRefMutIterator, ParallelIterator};

use super::layout::Layout;
use super::plan::PhasePlan;
use super::scales::nlp_scaling;
use super::settings::{MultipleShootingSettings, SegmentEnds};
use super::shot::{Share, Shot};
use crate::error::ShootingError;

/// What is known of the shots.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Known {
    Nothing,
    Values,
    Derivatives,
}

/// A problem with its segments, as a nonlinear program that [`apsides_nlp::InteriorPoint`] or any other solver can take.
///
/// The structure is found once; evaluations write into the caller's slices and, on one thread, allocate nothing.
pub(crate) struct Transcription {
    pub(crate) layout: Layout,
    pub(crate) sign: f64,
    /// Segments of all phases in order.
    pub(crate) shots: Vec<Shot>,
    endpoint_terms: Vec<EndpointTerm>,
    /// Columns and weights of the linear part of the cost, sign included.
    linear_cost: Vec<(usize, f64)>,
    /// Constant Jacobian entries: the durations and the lengths of segments.
    constant: Vec<(usize, usize, f64)>,
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
    pub(crate) row_lower: Vec<f64>,
    pub(crate) row_upper: Vec<f64>,
    pub(crate) start: Vec<f64>,
    pub(crate) scaling: NlpScaling,
    jacobian_pattern: Pattern,
    hessian_pattern: Pattern,
    /// Point of the last evaluation, and how far it went.
    evaluated_at: Vec<f64>,
    known: Known,
    pool: Option<Arc<ThreadPool>>,
}

impl Transcription {
    /// Discretises a problem.
    ///
    /// # Errors
    /// When plans or guess do not fit the problem.
    pub(crate) fn new(
        ocp: &Ocp,
        plans: &[PhasePlan],
        guess: &Guess,
        settings: &MultipleShootingSettings,
    ) -> Result<Self, ShootingError> {
        guess.check(ocp)?;
        if plans.len() != ocp.phases.len() {
            let place = format!("mesh of problem `{}`", ocp.name);
            let (expected, found) = (ocp.phases.len(), plans.len());
            return Err(OcpError::Dimension { place, what: "phases", expected, found }.into());
        }
        let layout = Layout::new(ocp, plans, settings)?;
        let sign = match ocp.objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        let start = starting_point(&layout, guess);
        let constant =
            durations(&layout).into_iter().chain(lengths(&layout, settings.segment_ends)).collect();
        let (lower, upper) = variable_bounds(ocp, &layout);
        let (row_lower, row_upper) = row_bounds(ocp, &layout);
        let mut transcription = Self {
            sign,
            shots: shots(ocp, &layout, sign, settings.method)?,
            endpoint_terms: EndpointTerm::all(ocp, &layout.endpoint_rows, |i| layout.endpoint_column(i)),
            linear_cost: (ocp.objective.linear.iter())
                .map(|&(input, w)| (layout.endpoint_column(input), sign * w))
                .collect(),
            constant,
            start: clamped(start, &lower, &upper),
            scaling: nlp_scaling(ocp, &layout, &Scaling::new(ocp, guess)),
            lower,
            upper,
            row_lower,
            row_upper,
            jacobian_pattern: Pattern::default(),
            hessian_pattern: Pattern::default(),
            evaluated_at: vec![f64::NAN; layout.variables],
            known: Known::Nothing,
            pool: None,
            layout,
        };
        transcription.find_patterns();
        transcription.complete_scales();
        Ok(transcription)
    }

    /// Lets the threads of a pool integrate the segments; the numbers are the same for any number of them.
    pub(crate) fn with_pool(self, pool: Option<Arc<ThreadPool>>) -> Self {
        Self { pool, ..self }
    }

    fn find_patterns(&mut self) {
        let y = vec![0.0; self.layout.constraints];
        let mut jacobian: Vec<_> = self.constant.iter().map(|&(r, c, _)| (r, c)).collect();
        let mut hessian = Vec::new();
        for s in &self.shots {
            s.each_jacobian(|r, c, _| jacobian.push((r, c)));
            s.each_hessian(|i, j, _| hessian.push((i, j)));
        }
        for t in &mut self.endpoint_terms {
            t.each_jacobian(|r, c, _| jacobian.push((r, c)));
            t.each_hessian(1.0, &y, |i, j, _| hessian.push((i, j)));
        }
        self.jacobian_pattern = Pattern::from_pairs(jacobian);
        self.hessian_pattern = Pattern::from_pairs(hessian);
    }

    /// Makes all that is needed known at `x`.
    fn evaluate(&mut self, x: &[f64], needed: Known) {
        let same = self.evaluated_at == x;
        if same && self.known >= needed {
            return;
        }
        if needed == Known::Derivatives {
            each_shot(self.pool.as_deref(), &mut self.shots, |s| s.differentiate(x));
            self.endpoint_terms.iter_mut().for_each(|t| t.refresh(x));
        } else {
            each_shot(self.pool.as_deref(), &mut self.shots, |s| s.run(x));
        }
        self.evaluated_at.copy_from_slice(x);
        self.known = needed;
    }

    /// Evaluates with first derivatives, for what is read from the shots.
    pub(crate) fn refresh(&mut self, x: &[f64]) {
        self.evaluate(x, Known::Derivatives);
    }
}

/// Each on its own, on the threads of the pool if there is one.
fn each_shot(pool: Option<&ThreadPool>, shots: &mut [Shot], work: impl Fn(&mut Shot) + Send + Sync) {
    match pool {
        Some(pool) => pool.install(|| shots.par_iter_mut().for_each(work)),
        None => shots.iter_mut().for_each(work),
    }
}

impl Nlp for Transcription {
    fn variables(&self) -> usize {
        self.layout.variables
    }

    fn constraints(&self) -> usize {
        self.layout.constraints
    }

    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }

    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.row_lower);
        upper.copy_from_slice(&self.row_upper);
    }

    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }

    fn jacobian_pattern(&self) -> Pattern {
        self.jacobian_pattern.clone()
    }

    fn hessian_pattern(&self) -> Pattern {
        self.hessian_pattern.clone()
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.evaluate(x, Known::Values);
        let linear: f64 = self.linear_cost.iter().map(|&(c, w)| w * x[c]).sum();
        let segments: f64 = self.shots.iter().map(Shot::cost).sum();
        let ends: f64 =
            self.endpoint_terms.iter_mut().filter(|t| t.has_cost()).map(|t| t.add_values(x, &mut [])).sum();
        linear + segments + ends
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.evaluate(x, Known::Derivatives);
        gradient.fill(0.0);
        for &(c, w) in &self.linear_cost {
            gradient[c] += w;
        }
        for s in &self.shots {
            s.add_gradient(gradient);
        }
        for t in &self.endpoint_terms {
            t.add_gradient(gradient);
        }
    }

    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        self.evaluate(x, Known::Values);
        values.fill(0.0);
        for &(r, c, v) in &self.constant {
            values[r] += v * x[c];
        }
        for s in &self.shots {
            s.add_values(x, values);
        }
        for t in self.endpoint_terms.iter_mut().filter(|t| !t.has_cost()) {
            t.add_values(x, values);
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.evaluate(x, Known::Derivatives);
        let mut next = values.iter_mut();
        let mut push = |v| {
            // As many as in the pattern.
            if let Some(entry) = next.next() {
                *entry = v;
            }
        };
        self.constant.iter().for_each(|&(_, _, v)| push(v));
        for s in &self.shots {
            s.each_jacobian(|_, _, v| push(v));
        }
        for t in &self.endpoint_terms {
            t.each_jacobian(|_, _, v| push(v));
        }
    }

    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        self.evaluate(x, Known::Derivatives);
        let work = |s: &mut Shot| s.evaluate_hessian(objective_factor, multipliers);
        each_shot(self.pool.as_deref(), &mut self.shots, work);
        let mut next = values.iter_mut();
        let mut push = |v| {
            if let Some(entry) = next.next() {
                *entry = v;
            }
        };
        for s in &self.shots {
            s.each_hessian(|_, _, v| push(v));
        }
        for t in &mut self.endpoint_terms {
            t.each_hessian(objective_factor, multipliers, |_, _, v| push(v));
        }
    }

    fn scaling(&self) -> Option<NlpScaling> {
        Some(self.scaling.clone())
    }

    fn stages(&self) -> Option<Stages> {
        // Segment by segment: controls, state, matching conditions.
        let last = self.layout.last_stage;
        let mut variables = vec![last; self.layout.variables];
        let mut constraints = vec![last; self.layout.constraints];
        for p in &self.layout.phases {
            for s in &p.segments {
                variables[s.state_column..][..p.states].fill(s.stage + 2);
                constraints[s.matching_row..s.end_row].fill(s.stage + 3);
            }
            // Later segments first, so that a shared point belongs to the earlier one.
            for s in p.segments.iter().rev() {
                for &c in &s.control_columns {
                    variables[c..][..p.controls].fill(s.stage);
                }
            }
            for (s, time) in p.segments[1..].iter().zip(p.inner_times()) {
                variables[time] = s.stage + 2;
            }
            variables[p.end_column..][..p.states].fill(p.end_stage + 2);
        }
        Some(Stages { variables, constraints })
    }
}

fn shots(ocp: &Ocp, layout: &Layout, sign: f64, method: Method) -> Result<Vec<Shot>, ShootingError> {
    let mut shots = Vec::new();
    for (index, (phase, p)) in ocp.phases.iter().zip(&layout.phases).enumerate() {
        let weight = |integral: usize| {
            let weights = ocp.objective.integrals.iter().filter(|w| (w.0, w.1) == (index, integral));
            sign * weights.map(|w| w.2).sum::<f64>()
        };
        let shares = p.integral_rows.iter().enumerate();
        let shares: Vec<Share> = shares
            .map(|(integral, &row)| Share { integral, row, cost: weight(integral) })
            .filter(|s| s.row.is_some() || s.cost != 0.0)
            .collect();
        for k in 0..p.segments.len() {
            shots.push(Shot::new(phase, p, k, layout, &shares, method)?);
        }
    }
    Ok(shots)
}

fn durations(layout: &Layout) -> Vec<(usize, usize, f64)> {
    let rows = layout.phases.iter().filter_map(|p| p.duration_row.map(|r| (r, p)));
    rows.flat_map(|(r, p)| [(r, p.initial_time, -1.0), (r, p.final_time, 1.0)]).collect()
}

/// Of each segment with unknown ends, what its length exceeds the least one by.
fn lengths(layout: &Layout, ends: SegmentEnds) -> Vec<(usize, usize, f64)> {
    let least = match ends {
        SegmentEnds::Fixed => return Vec::new(),
        SegmentEnds::Free { least_length } => least_length,
    };
    let mut entries = Vec::new();
    for p in &layout.phases {
        for (k, s) in p.segments.iter().enumerate() {
            let Some(r) = s.length_row else { continue };
            let share = least * (p.fraction(k + 1) - p.fraction(k));
            entries.extend([(r, s.times.0, -1.0), (r, s.times.1, 1.0)]);
            entries.extend([(r, p.initial_time, share), (r, p.final_time, -share)]);
        }
    }
    entries
}

fn variable_bounds(ocp: &Ocp, layout: &Layout) -> (Vec<f64>, Vec<f64>) {
    let mut lower = vec![f64::NEG_INFINITY; layout.variables];
    let mut upper = vec![f64::INFINITY; layout.variables];
    let mut set = |column: usize, b: Bounds| {
        lower[column] = b.lower;
        upper[column] = b.upper;
    };
    for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
        for node in 0..=p.segments.len() {
            for (s, state) in phase.states.iter().enumerate() {
                let along = state.variable.bounds;
                let bounds = match node {
                    0 => along.intersect(&state.initial),
                    n if n == p.segments.len() => along.intersect(&state.terminal),
                    _ => along,
                };
                set(p.state_column(node) + s, bounds);
            }
        }
        for first in p.segments.iter().flat_map(|s| &s.control_columns) {
            for (c, control) in phase.controls.iter().enumerate() {
                set(first + c, control.bounds);
            }
        }
        let (start, end) = phase.time_bounds();
        set(p.initial_time, start);
        set(p.final_time, end);
    }
    for (k, v) in ocp.parameters.iter().enumerate() {
        set(layout.first_parameter + k, v.bounds);
    }
    (lower, upper)
}

fn row_bounds(ocp: &Ocp, layout: &Layout) -> (Vec<f64>, Vec<f64>) {
    let mut lower = vec![0.0; layout.constraints];
    let mut upper = vec![0.0; layout.constraints];
    let mut set = |row: usize, b: Bounds| {
        lower[row] = b.lower;
        upper[row] = b.upper;
    };
    for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
        for s in &p.segments {
            for rows in s.path_rows.chunks(phase.path.len().max(1)) {
                for (c, &first) in phase.path.iter().zip(rows) {
                    c.rows.iter().enumerate().for_each(|(k, row)| set(first + k, row.bounds));
                }
            }
            for &(_, state, row) in &s.bound_rows {
                set(row, phase.states[state].variable.bounds);
            }
            if let Some(r) = s.length_row {
                set(r, Bounds::at_least(0.0));
            }
        }
        for (q, row) in phase.integrals.iter().zip(&p.integral_rows) {
            if let Some(r) = row {
                set(*r, q.variable.bounds);
            }
        }
        if let Some(r) = p.duration_row {
            set(r, phase.duration);
        }
    }
    for (c, &first) in ocp.constraints.iter().zip(&layout.endpoint_rows) {
        for (k, row) in c.rows.iter().enumerate() {
            set(first + k, row.bounds);
        }
    }
    (lower, upper)
}

fn starting_point(layout: &Layout, guess: &Guess) -> Vec<f64> {
    let mut x = vec![0.0; layout.variables];
    for (p, g) in layout.phases.iter().zip(&guess.phases) {
        for node in 0..=p.segments.len() {
            g.state(p.fraction(node), &mut x[p.state_column(node)..][..p.states]);
        }
        for (k, s) in p.segments.iter().enumerate() {
            for (j, &c) in s.control_columns.iter().enumerate() {
                let fraction = p.fraction_in(k, s.controls.place(j));
                control_inside(g, p.fraction(k), p.fraction(k + 1), fraction, &mut x[c..][..p.controls]);
            }
        }
        for (k, time) in p.inner_times().enumerate() {
            let fraction = p.fraction(k + 1);
            x[time] = (1.0 - fraction) * g.initial_time + fraction * g.final_time;
        }
        x[p.initial_time] = g.initial_time;
        x[p.final_time] = g.final_time;
    }
    x[layout.first_parameter..].copy_from_slice(&guess.parameters);
    x
}

/// Control of the guess, at the ends of a segment as it is inside: an earlier trajectory may jump there.
fn control_inside(guess: &apsides_ocp::PhaseGuess, start: f64, end: f64, fraction: f64, out: &mut [f64]) {
    let Some(earlier) = guess.as_trajectory() else { return guess.control(fraction, out) };
    let middle = earlier.time_at(0.5 * (start + end));
    let (breaks, time) = (earlier.control.breaks(), earlier.time_at(fraction));
    let piece = earlier.control.segment_at(middle);
    // A segment within a piece, up to rounding.
    let slack = 1e-9 * (breaks[breaks.len() - 1] - breaks[0]);
    if earlier.time_at(start) >= breaks[piece] - slack && earlier.time_at(end) <= breaks[piece + 1] + slack {
        earlier.control.evaluate_in(piece, time, out);
    } else {
        guess.control(fraction, out);
    }
}

fn clamped(mut x: Vec<f64>, lower: &[f64], upper: &[f64]) -> Vec<f64> {
    for ((v, l), u) in x.iter_mut().zip(lower).zip(upper) {
        *v = v.max(*l).min(*u);
    }
    x
}

#[cfg(test)]
mod tests;
