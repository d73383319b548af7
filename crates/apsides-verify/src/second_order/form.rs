//! The second variation of the whole problem: the phases joined by what depends on their ends.

use apsides_ocp::{EndpointInput, Ocp, Trajectory};
use nalgebra::DMatrix;

use super::activity::{Activity, Space};
use super::arcs::{self, Span};
use super::constant;
use super::contacts;
use super::control_scales;
use super::interval::{self, End, Instant, Interval, Rule};
use super::kinks::{self, Kinks, Passage};
use super::needle;
use super::stage::{Coordinates, Row};
use super::sweep::{ROW_SHIFT, Sizes, Swept, ZERO, sweep};
use crate::VerifySettings;
use crate::boundary::row_scale;
use crate::ends::{EndGradient, EndScales, Ends, is_duration_at_bound};
use crate::equations::sign;
use crate::optimality::{Among, Lengths, PhaseConditions, parameter_slopes};
use crate::worst::relative;

/// Eigenvalues this close to the shift of rows, relative, are those of rows that depend on others.
const DEPENDENT: f64 = 1e-2;

/// Part of another size below which a size is none.
const NOTHING: f64 = 1e-9;
/// Part of the second derivatives below which a Hamiltonian is one of rest, whose least size is rounding of the objective.
const AT_REST: f64 = 1e-8;
/// Part of the Hamiltonian below which the second derivatives have a size of their own.
const LITTLE: f64 = 1e-3;

/// One phase of the form.
pub(super) struct PhaseForm {
    pub(super) intervals: Vec<Interval>,
    pub(super) spans: Vec<Span>,
    pub(super) sizes: Sizes,
    pub(super) duration: f64,
    /// Largest term of the Hamiltonian times the duration, relative to the size of the form.
    share: f64,
    /// The stand of the integrals to their bounds.
    integrals: Vec<Activity>,
    /// End of an interval and curvature of a contact there, over `[x, xi_a, xi_b, p]`.
    contacts: Vec<(usize, DMatrix<f64>)>,
    /// Indices, among the times, of corners that do not move since the equations jump at that time.
    pub(super) held: Vec<usize>,
    /// The reason why the form is not that of the phase, if it is not.
    pub(super) remark: Option<String>,
}

/// The second variation of a problem, in scaled quantities.
pub(super) struct Form {
    pub(super) phases: Vec<PhaseForm>,
    /// The form is divided by this.
    pub(super) size: f64,
    /// Index of the first quantity of each phase: states at its start, at its end, times, multipliers of the end, of integrals.
    offsets: Vec<usize>,
    parameters_at: usize,
    total: usize,
    /// The stand of the end quantities to their bounds; by global index.
    activities: Vec<Activity>,
    /// Hessian of end cost and constraints.
    ends: Vec<(usize, usize, f64)>,
    rows: Vec<(Vec<(usize, f64)>, Activity)>,
}

/// The sign of the form on a space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Inertia {
    /// Number of negative directions.
    pub(super) negative: isize,
    pub(super) singular: bool,
}

impl Inertia {
    pub(super) fn is_positive(self) -> bool {
        self.negative <= 0 && !self.singular
    }
}

impl PhaseForm {
    fn new(
        conditions: &mut PhaseConditions<'_>,
        is_first: bool,
        parameters: &[f64],
        rule: &Rule,
        fineness: usize,
    ) -> Option<Self> {
        let found = conditions.found;
        let duration = found.final_time - found.initial_time;
        conditions.control_scales = control_scales::of(conditions);
        let breaks = found.control.breaks();
        let corners = match conditions.among {
            Among::All => arcs::with_instants(conditions),
            Among::Constant(_) => breaks[1..breaks.len() - 1].to_vec(),
        };
        let is_instant = |t: &f64| conditions.instants.iter().any(|k| breaks[*k] == *t);
        let held = match conditions.among {
            Among::All => (0..corners.len()).filter(|k| is_instant(&corners[*k])).map(|k| k + 1).collect(),
            Among::Constant(_) => Vec::new(),
        };
        let phase = conditions.equations.phase;
        let moves = !corners.is_empty() || !phase.initial_time.is_fixed() || !phase.final_time.is_fixed();
        let Kinks { passages, remark } = kinks::find(conditions, is_first, moves);
        let touches = if conditions.among == Among::All { conditions.touches.clone() } else { Vec::new() };
        let instants = passages.iter().map(|p| p.time).chain(touches.iter().map(|t| t.time));
        let instants: Vec<f64> = instants.collect();
        let mut spans = arcs::spans(found, &corners, &instants, fineness);
        let intervals = spans.iter().map(|span| Interval::new(conditions, parameters, rule, *span, duration));
        let mut intervals = intervals.collect::<Option<Vec<_>>>()?;
        for passage in &passages {
            add_passage(conditions, parameters, &mut intervals, passage, duration);
        }
        for touch in &touches {
            let at = intervals.partition_point(|i| i.span.end <= touch.time);
            let beside = intervals.get(at.saturating_sub(1))?;
            let needle = needle::interval(conditions, parameters, touch, beside, duration);
            spans.insert(at, needle.span);
            intervals.insert(at, needle);
        }
        if let Among::Constant(lengths) = conditions.among {
            intervals = constant::joined(&intervals, conditions, lengths);
            spans = intervals.iter().map(|i| i.span).collect();
        }
        let times = if conditions.among == Among::Constant(Lengths::Given) { 2 } else { corners.len() + 2 };
        let sizes = Sizes {
            states: conditions.equations.nx,
            integrals: conditions.equations.phase.integrals.len(),
            times,
            parameters: conditions.equations.np,
        };
        let contacts = contacts::of(conditions, parameters, &spans, duration);
        let integrals = integrals(conditions);
        let share = conditions.hamiltonian_size * duration;
        let mut form =
            Self { intervals, spans, sizes, duration, share, integrals, contacts: Vec::new(), held, remark };
        for (end, hessian, row) in contacts {
            form.contacts.push((end, hessian));
            // The state at the end of an interval is a step of its start.
            if let Some(interval) = form.intervals.get_mut(end.saturating_sub(1)) {
                interval.add_end_row(&row, Activity::Strong);
            }
        }
        form.add_entries(conditions, parameters);
        Some(form)
    }

    /// Where a state comes to a bound at which it stays, it is there at the start already: the stages of the rule alone would let it be
    /// beside the bound by turns.
    fn add_entries(&mut self, conditions: &mut PhaseConditions<'_>, parameters: &[f64]) {
        let s = self.sizes;
        for k in 1..self.intervals.len() {
            let (before, after) = self.intervals.split_at_mut(k);
            let (before, after) = (&mut before[k - 1], &after[0]);
            for i in 0..s.states {
                if before.at_bounds[i] == Activity::Free && after.at_bounds[i] != Activity::Free {
                    let mut row = vec![0.0; s.states + 2 + s.parameters];
                    row[i] = 1.0;
                    before.add_end_row(&row, after.at_bounds[i]);
                    if let Some(rate) = interval::rate_row(conditions, parameters, before.span, i) {
                        before.add_end_row(&rate, after.at_bounds[i]);
                    }
                }
            }
        }
    }

    /// Places of `w` without the state: multipliers of the end, of integrals, times.
    fn swept(&self, size: f64, space: Space, shift: f64) -> Swept {
        sweep(&self.intervals, self.sizes, size, space, shift * self.share, &self.contacts)
    }

    /// The number of negative directions among changes that leave the initial state as `fixed` says, and everything from the end of
    /// `intervals` on.
    pub(super) fn truncated(
        &self,
        intervals: &[Interval],
        size: f64,
        shift: f64,
        fixed: &[bool],
        times: &[bool],
    ) -> Inertia {
        let swept = sweep(intervals, self.sizes, size, Space::Necessary, shift, &self.contacts);
        let s = self.sizes;
        let mut keep: Vec<usize> = (0..s.states).filter(|i| !fixed[*i]).collect();
        let primal = keep.len();
        keep.extend(s.end_at()..s.end_at() + s.states);
        keep.extend(
            (0..s.integrals)
                .filter(|q| self.integrals[*q].is_fixed_in(Space::Necessary))
                .map(|q| s.integrals_at() + q),
        );
        let duals = keep.len() - primal;
        let reached = intervals.last().map_or(0, |i| i.span.arc);
        // Corners before the end of the last interval.
        keep.extend((0..=reached).filter(|k| !times[*k]).map(|k| s.times_at() + k));
        let n = keep.len();
        let mut matrix = DMatrix::from_fn(n, n, |i, j| swept.value[(keep[i], keep[j])]);
        let is_dual: Vec<bool> = (0..n).map(|i| (primal..primal + duals).contains(&i)).collect();
        for i in (0..n).filter(|i| !is_dual[*i]) {
            matrix[(i, i)] -= shift;
        }
        let rows = swept.rows.iter().map(|row| keep.iter().map(|k| row[*k]).collect());
        let rows: Vec<Vec<f64>> = rows.collect();
        let counted = swept.negative - (duals + rows.len()) as isize;
        inertia(&with_multipliers(matrix, &is_dual, &rows), counted, swept.singular)
    }
}

/// Adds the curvature of a passage to the interval that ends there, or starts there where none ends; or a row that holds the argument of the
/// kink, as one at a bound without a multiplier that is surely not zero.
fn add_passage(
    conditions: &mut PhaseConditions<'_>,
    parameters: &[f64],
    intervals: &mut [Interval],
    passage: &Passage,
    duration: f64,
) {
    let ends = |i: &Interval| i.span.end == passage.time && i.span.segment <= passage.segment;
    let starts = |i: &Interval| i.span.start == passage.time && i.span.segment == passage.segment;
    let (k, end) = match intervals.iter().position(ends) {
        Some(k) => (k, End::Last),
        None => match intervals.iter().position(starts) {
            Some(k) => (k, End::Start),
            None => return,
        },
    };
    let (nx, nu) = (conditions.equations.nx, conditions.equations.nu);
    let span = intervals[k].span;
    let coordinates = Coordinates::new(conditions, parameters, span, passage.time, duration);
    let all = coordinates.gradient(0.0, &passage.gradient, false);
    let row: Vec<f64> =
        all.iter().enumerate().filter(|(i, _)| !(nx..nx + nu).contains(i)).map(|(_, g)| *g).collect();
    let gradient = intervals[k].over_v(end, &row);
    match passage.coefficient {
        Some(coefficient) => {
            let is_exact = passage.is_exact;
            intervals[k].instants.push(Instant { gradient, coefficient, is_exact });
        }
        None => intervals[k].rows.push(Row { gradient, activity: Activity::Weak }),
    }
}

/// The stand of each integral to its bounds.
fn integrals(conditions: &mut PhaseConditions<'_>) -> Vec<Activity> {
    let values = conditions.integrals();
    let found = conditions.found;
    let size = conditions.hamiltonian_size * (found.final_time - found.initial_time);
    let integrals = conditions.equations.phase.integrals.iter().enumerate().zip(&values);
    integrals
        .map(|((q, integral), value)| {
            let scale = row_scale(&integral.variable, conditions.scaling.integrals[q]);
            let multiplier = found.integral_multipliers.as_ref().map_or(0.0, |m| m[q]);
            Activity::new(relative(-multiplier * scale, size), *value, &integral.variable.bounds, scale)
        })
        .collect()
}

impl Form {
    pub(super) fn new(
        ocp: &Ocp,
        trajectory: &Trajectory,
        scales: &EndScales<'_>,
        parameters: &[f64],
        conditions: &mut [PhaseConditions<'_>],
        settings: &VerifySettings,
        fineness: usize,
    ) -> Option<Self> {
        let rule = Rule::new()?;
        let phases: Option<Vec<_>> = (conditions.iter_mut().enumerate())
            .map(|(k, c)| PhaseForm::new(c, k == 0, parameters, &rule, fineness))
            .collect();
        let mut phases = phases?;
        let mut offsets = Vec::new();
        let mut total = 0;
        for phase in &phases {
            offsets.push(total);
            total += 3 * phase.sizes.states + phase.sizes.integrals + phase.sizes.times;
        }
        let parameters_at = total;
        total += parameters.len();
        let by_rate = phases.iter().map(|p| p.share).fold(0.0, f64::max);
        let density = |i: &Interval| i.curvature.amax() / i.weights.iter().sum::<f64>();
        let largest = phases.iter().flat_map(|p| &p.intervals).map(density).fold(0.0, f64::max);
        // Large terms without curvature, or next to no Hamiltonian, say nothing about the size of the second variation.
        let is_curved = largest > NOTHING * by_rate;
        let size = if (is_curved && largest < LITTLE * by_rate) || by_rate <= AT_REST * largest {
            let factor = if by_rate > 0.0 { largest / by_rate } else { 0.0 };
            phases.iter_mut().for_each(|p| p.share *= factor);
            largest
        } else {
            by_rate
        };
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        for phase in &mut phases {
            // A phase without a Hamiltonian of its own is measured as the largest.
            phase.share = if phase.share > 1e-9 * size { phase.share / size } else { 1.0 };
        }
        let activities = vec![Activity::Free; total];
        let mut form = Self {
            phases,
            size,
            offsets,
            parameters_at,
            total,
            activities,
            ends: Vec::new(),
            rows: Vec::new(),
        };
        form.classify(ocp, trajectory, scales, conditions);
        form.add_ends(ocp, trajectory, scales, conditions, settings);
        Some(form)
    }

    fn index(&self, input: EndpointInput) -> usize {
        let times = |phase: usize| self.offsets[phase] + 2 * self.phases[phase].sizes.states;
        match input {
            EndpointInput::InitialState { phase, state } => self.offsets[phase] + state,
            EndpointInput::FinalState { phase, state } => {
                self.offsets[phase] + self.phases[phase].sizes.states + state
            }
            EndpointInput::InitialTime { phase } => times(phase),
            EndpointInput::FinalTime { phase } => times(phase) + self.phases[phase].sizes.times - 1,
            EndpointInput::Parameter { index } => self.parameters_at + index,
        }
    }

    fn scale(&self, input: EndpointInput, scales: &EndScales<'_>) -> f64 {
        match input {
            EndpointInput::InitialTime { phase } | EndpointInput::FinalTime { phase } => {
                self.phases[phase].duration
            }
            _ => scales.scale(input),
        }
    }

    /// Classifies the end quantities by their bounds.
    fn classify(
        &mut self,
        ocp: &Ocp,
        trajectory: &Trajectory,
        scales: &EndScales<'_>,
        conditions: &mut [PhaseConditions<'_>],
    ) {
        let ends = Ends::of(trajectory);
        let mut gradient = EndGradient::of_cost(ocp, &ends);
        gradient.add_constraints(ocp, &ends, trajectory.constraint_multipliers.as_ref());
        let costate_size = conditions.iter().fold(0.0, |m: f64, c| m.max(c.costate_size));
        for (k, c) in conditions.iter_mut().enumerate() {
            let [first, last] = c.end_hamiltonians();
            let phase = &ocp.phases[k];
            let nx = phase.states.len();
            let (mut start, mut end) = (vec![0.0; nx], vec![0.0; nx]);
            c.costate.evaluate(c.found.initial_time, &mut start);
            c.costate.evaluate(c.found.final_time, &mut end);
            let size = costate_size;
            let mut quantities = Vec::new();
            for (i, state) in phase.states.iter().enumerate() {
                let both = [
                    (EndpointInput::InitialState { phase: k, state: i }, start[i], state.initial),
                    (EndpointInput::FinalState { phase: k, state: i }, -end[i], state.terminal),
                ];
                quantities
                    .extend(both.map(|(q, inner, b)| (q, inner, b.intersect(&state.variable.bounds), size)));
            }
            let rate = scales.scale(EndpointInput::FinalTime { phase: k }) * c.hamiltonian_size;
            quantities.push((EndpointInput::InitialTime { phase: k }, -first, phase.initial_time, rate));
            quantities.push((EndpointInput::FinalTime { phase: k }, last, phase.final_time, rate));
            for (input, inner, bounds, size) in quantities {
                let scale = scales.scale(input);
                let slope =
                    gradient.value(input).map_or(0.0, |outer| relative((inner + outer) * scale, size));
                let index = self.index(input);
                self.activities[index] = Activity::new(slope, ends.value(input), &bounds, scale);
            }
        }
        let (slopes, sizes) = parameter_slopes(ocp.parameters.len(), conditions);
        for (i, p) in ocp.parameters.iter().enumerate() {
            let input = EndpointInput::Parameter { index: i };
            let scale = scales.scale(input);
            let slope = gradient.value(input).map_or(0.0, |outer| {
                relative((slopes[i] + outer) * scale, (scale * sizes[i].max(outer.abs())).max(costate_size))
            });
            let activity = Activity::new(slope, trajectory.parameters[i], &p.bounds, scale);
            self.activities[self.parameters_at + i] = activity;
        }
    }

    /// Hessian of end cost and constraints, and the rows of active constraints.
    fn add_ends(
        &mut self,
        ocp: &Ocp,
        trajectory: &Trajectory,
        scales: &EndScales<'_>,
        conditions: &[PhaseConditions<'_>],
        settings: &VerifySettings,
    ) {
        let ends = Ends::of(trajectory);
        let sign = sign(ocp);
        let mut hessian = Vec::new();
        for (inputs, f) in &ocp.objective.functions {
            hessian.extend(ends.hessian(f.as_ref(), inputs, &[sign]));
        }
        let costate_size = conditions.iter().fold(0.0, |m: f64, c| m.max(c.costate_size));
        for (k, c) in ocp.constraints.iter().enumerate() {
            let sizes = scales.row_scales(k, &ends);
            let values = ends.evaluate(c.function.as_ref(), &c.inputs);
            let mut rows = vec![Vec::new(); c.rows.len()];
            for (row, input, v) in ends.jacobian(c.function.as_ref(), &c.inputs) {
                rows[row].push((self.index(input), v * self.scale(input, scales) / sizes[row]));
            }
            let multipliers = trajectory.constraint_multipliers.as_ref().map(|m| &m[k]);
            if let Some(m) = multipliers {
                hessian.extend(ends.hessian(c.function.as_ref(), &c.inputs, m));
            }
            for (r, row) in rows.into_iter().enumerate() {
                let slope = multipliers.map_or(0.0, |m| relative(-m[r] * sizes[r], costate_size));
                let activity = Activity::new(slope, values[r], &c.rows[r].bounds, sizes[r]);
                self.rows.push((row, activity));
            }
        }
        for (a, b, v) in hessian {
            let v = v * self.scale(a, scales) * self.scale(b, scales) / self.size;
            self.ends.push((self.index(a), self.index(b), v));
        }
        for (k, phase) in ocp.phases.iter().enumerate() {
            let duration = self.phases[k].duration;
            let initial = self.index(EndpointInput::InitialTime { phase: k });
            let last = self.index(EndpointInput::FinalTime { phase: k });
            let activity = if phase.duration.is_fixed() {
                Activity::Strong
            } else if is_duration_at_bound(phase, duration, duration, settings) {
                Activity::Weak
            } else {
                Activity::Free
            };
            self.rows.push((vec![(initial, -1.0), (last, 1.0)], activity));
            let held = self.phases[k].held.iter().map(|at| (vec![(initial + at, 1.0)], Activity::Strong));
            self.rows.extend(held);
        }
    }

    /// The sign of the form less `shift` times the square norm of controls, free ends, corners and parameters.
    pub(super) fn inertia(&self, space: Space, shift: f64) -> Inertia {
        let mut matrix = DMatrix::zeros(self.total, self.total);
        let (mut negative, mut singular) = (0, false);
        let mut dual = vec![false; self.total];
        let mut absent = vec![false; self.total];
        let mut left: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut weights = vec![1.0; self.total];
        for (k, phase) in self.phases.iter().enumerate() {
            let s = phase.sizes;
            weights[self.offsets[k]..][..3 * s.states + s.integrals + s.times].fill(phase.share);
            let swept = phase.swept(self.size, space, shift);
            negative += swept.negative;
            singular |= swept.singular;
            let first = self.offsets[k];
            let (end, times) = (first + s.states, first + 2 * s.states);
            let (multipliers, integrals) = (times + s.times, times + s.times + s.states);
            let at = |i: usize| match i {
                i if i < s.states => first + i,
                i if i < s.integrals_at() => multipliers + i - s.end_at(),
                i if i < s.times_at() => integrals + i - s.integrals_at(),
                i if i < s.parameters_at() => times + i - s.times_at(),
                i => self.parameters_at + i - s.parameters_at(),
            };
            for i in 0..s.value() {
                for j in 0..s.value() {
                    matrix[(at(i), at(j))] += swept.value[(i, j)];
                }
            }
            left.extend(
                swept
                    .rows
                    .iter()
                    .map(|row| row.iter().enumerate().map(|(i, v)| (at(i), *v)).collect::<Vec<_>>()),
            );
            for i in 0..s.states {
                matrix[(multipliers + i, end + i)] -= 1.0;
                matrix[(end + i, multipliers + i)] -= 1.0;
                dual[multipliers + i] = true;
            }
            for q in 0..s.integrals {
                dual[integrals + q] = true;
                // A multiplier of a bound that is not active is none.
                absent[integrals + q] = !phase.integrals[q].is_fixed_in(space);
            }
        }
        for &(i, j, v) in &self.ends {
            matrix[(i, j)] += v;
            if i != j {
                matrix[(j, i)] += v;
            }
        }
        let keep: Vec<usize> = (0..self.total)
            .filter(|i| if dual[*i] { !absent[*i] } else { !self.activities[*i].is_fixed_in(space) })
            .collect();
        let n = keep.len();
        let mut position = vec![None; self.total];
        for (i, k) in keep.iter().enumerate() {
            position[*k] = Some(i);
        }
        let active = self.rows.iter().filter(|(_, a)| a.is_fixed_in(space)).map(|(row, _)| row);
        let rows = active.chain(&left).map(|row| {
            let mut full = vec![0.0; n];
            for &(index, v) in row {
                if let Some(i) = position[index] {
                    full[i] += v;
                }
            }
            full
        });
        let mut rows: Vec<Vec<f64>> = rows.collect();
        let mut form = DMatrix::zeros(n, n);
        let mut duals = rows.len();
        for i in 0..n {
            for j in 0..n {
                form[(i, j)] = matrix[(keep[i], keep[j])];
            }
            if dual[keep[i]] {
                duals += 1;
            } else {
                form[(i, i)] -= shift * weights[keep[i]];
            }
        }
        let is_dual: Vec<bool> = keep.iter().map(|k| dual[*k]).collect();
        scale(&mut form, &mut rows);
        inertia(&with_multipliers(form, &is_dual, &rows), negative - duals as isize, singular)
    }

    pub(super) fn activity(&self, input: EndpointInput) -> Activity {
        self.activities[self.index(input)]
    }

    /// Least eigenvalue of `H_uu`, relative to the size of the form, and the time of it.
    pub(super) fn legendre(&self, phase: usize) -> (f64, f64) {
        let intervals = self.phases[phase].intervals.iter();
        let (least, at) = intervals.fold((f64::INFINITY, f64::NAN), |(least, at), i| {
            if i.legendre < least { (i.legendre, i.span.start) } else { (least, at) }
        });
        (least / (self.size * self.phases[phase].share), at)
    }

    /// Says whether that is below a limit in every interval of a phase.
    pub(super) fn is_singular_throughout(&self, phase: usize, limit: f64) -> bool {
        let limit = limit * self.size * self.phases[phase].share;
        self.phases[phase].intervals.iter().all(|interval| interval.legendre < limit)
    }
}

/// A matrix bordered by rows of unit length, with the pivots of multipliers: those of rows, and those within it that `is_dual` marks.
fn with_multipliers(matrix: DMatrix<f64>, is_dual: &[bool], rows: &[Vec<f64>]) -> DMatrix<f64> {
    let n = matrix.nrows();
    let mut bordered = matrix.resize(n + rows.len(), n + rows.len(), 0.0);
    for i in (0..n).filter(|i| is_dual[*i]) {
        bordered[(i, i)] -= ROW_SHIFT;
    }
    for (r, row) in rows.iter().enumerate() {
        let norm = row.iter().map(|v| v * v).sum::<f64>().sqrt();
        let factor = if norm > 0.0 { 1.0 / norm } else { 0.0 };
        for (i, v) in row.iter().enumerate() {
            bordered[(n + r, i)] = factor * v;
            bordered[(i, n + r)] = factor * v;
        }
        bordered[(n + r, n + r)] = -ROW_SHIFT;
    }
    bordered
}

/// Brings entries above one down to it by other units of what they belong to, in the rows too. The signs stay (J. J. Sylvester's law of inertia), and
/// a small one is no rounding of large entries elsewhere, as those of a long coast.
fn scale(matrix: &mut DMatrix<f64>, rows: &mut [Vec<f64>]) {
    let largest = |i: usize| matrix.row(i).iter().fold(1.0_f64, |m, v| m.max(v.abs()));
    let factors: Vec<f64> = (0..matrix.nrows()).map(|i| largest(i).sqrt().recip()).collect();
    for (i, f) in factors.iter().enumerate() {
        matrix.row_mut(i).scale_mut(*f);
        matrix.column_mut(i).scale_mut(*f);
        rows.iter_mut().for_each(|row| row[i] *= f);
    }
}

/// Adds the signs of a full matrix to what the sweeps counted.
fn inertia(matrix: &DMatrix<f64>, counted: isize, singular: bool) -> Inertia {
    if matrix.nrows() == 0 {
        return Inertia { negative: counted, singular };
    }
    if matrix.iter().any(|v| !v.is_finite()) {
        return Inertia { negative: 0, singular: true };
    }
    let eigenvalues = matrix.clone().symmetric_eigenvalues();
    let largest = eigenvalues.amax();
    let negative = eigenvalues.iter().filter(|l| **l < 0.0).count() as isize;
    // Dependent rows have the shift alone, which is small beside large entries and no zero.
    let is_dependent = |l: f64| (l + ROW_SHIFT).abs() <= DEPENDENT * ROW_SHIFT;
    let zero = eigenvalues.iter().any(|l| l.abs() <= ZERO * largest && !is_dependent(*l));
    Inertia { negative: counted + negative, singular: singular || zero }
}
