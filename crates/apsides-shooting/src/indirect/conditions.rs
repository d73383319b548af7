//! The necessary conditions as equations `F(z) = 0` in the unknowns of [`MultipointLayout`].
//!
//! With `Phibar = Phi + nu^T g` for end cost and endpoint constraints:
//!
//! ```text
//! y_{j+1} = flow of the canonical system from y_j,    g = 0
//! lambda(t0) = -dPhibar/dx0,   lambda(tf) = dPhibar/dxf,   H(t0) = dPhibar/dt0,   H(tf) = -dPhibar/dtf,   dPhibar/dp + sum of integrals of dH/dp = 0
//! ```
//!
//! for quantities that are free. One between bounds obeys either its condition or one of its bounds: see
//! [`Conditions::choose_at_solution`]. Everything is in units of its typical size.

use apsides_ocp::{Bounds, Ocp};
use nalgebra::{DMatrix, DVector};
use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};

use super::ends::Ends;
use super::flow::{EndPoint, Flow, FlowFailure, SegmentFlight};
use super::layout::{MultipointLayout, MultipointPhase};

/// A segment that could not be flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FailedSegment {
    /// Index of the phase.
    pub phase: usize,
    /// Index of the segment in the phase.
    pub segment: usize,
    /// The reason.
    pub reason: FlowFailure,
}

/// The condition that a quantity between bounds obeys.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Obeys {
    /// Its condition.
    Condition,
    /// A bound.
    Bound(f64),
}

/// Part of its size by which a quantity may be off a bound that it is said to be at.
const AT_BOUND: f64 = 1e-6;

impl Obeys {
    /// At a start: a bound where the value is there and the condition pushes it out.
    fn at_start(bounds: &Bounds, scale: f64, value: f64, condition: f64) -> Self {
        let near = |bound: f64| (value - bound).abs() <= AT_BOUND * scale;
        if bounds.is_fixed() || (near(bounds.lower) && condition > 0.0) {
            Self::Bound(bounds.lower)
        } else if near(bounds.upper) && condition < 0.0 {
            Self::Bound(bounds.upper)
        } else {
            Self::Condition
        }
    }

    /// Says whether its bound is to be given up, since the condition pushes inwards.
    fn pushes_inwards(self, bounds: &Bounds, condition: f64) -> bool {
        match self {
            Self::Bound(b) if !bounds.is_fixed() => {
                if b == bounds.lower {
                    condition < 0.0
                } else {
                    condition > 0.0
                }
            }
            _ => false,
        }
    }

    /// The bound that a value exceeds which obeys its condition, and by how much, in units of its size.
    fn exceeded(self, bounds: &Bounds, scale: f64, value: f64) -> Option<(f64, f64)> {
        let excess = bounds.excess(value) / scale;
        let bound = if value > bounds.upper { bounds.upper } else { bounds.lower };
        (self == Self::Condition && excess > AT_BOUND).then_some((bound, excess))
    }
}

/// One phase: what flies it, and what was found.
pub(super) struct PhaseFlight {
    pub(super) flow: Flow,
    pub(super) passages: Vec<SegmentFlight>,
    /// Rates and Hamiltonian at the last node.
    terminal: EndPoint,
    /// Where the control search starts, per segment.
    pub(super) controls: Vec<Vec<f64>>,
}

impl PhaseFlight {
    pub(super) fn new(flow: Flow, controls: Vec<Vec<f64>>) -> Self {
        let passages = vec![SegmentFlight::default(); controls.len()];
        Self { flow, passages, terminal: EndPoint::default(), controls }
    }

    /// Flies the segments, each from its node or, in a `chain`, from the end of the one before; the first without an end fails.
    fn fly(
        &mut self,
        p: &MultipointPhase,
        z: &[f64],
        parameters: &[f64],
        task: Task,
    ) -> Result<(), (usize, FlowFailure)> {
        for segment in 0..p.segments() {
            let node = p.node(segment);
            let (flown, ahead) = self.passages.split_at_mut(segment);
            let start = match flown.last() {
                Some(before) if task.chain => &before.end[..2 * p.states],
                _ => &z[node..node + 2 * p.states],
            };
            let (times, control) = (p.segment_times(z, segment), &mut self.controls[segment]);
            self.flow
                .pass(parameters, times, start, control, task.slopes == Slopes::New, &mut ahead[0])
                .map_err(|reason| (segment, reason))?;
        }
        if task.chain {
            // The last node is the end of the last segment.
            self.terminal.clone_from(&self.passages[p.segments() - 1].last);
            return Ok(());
        }
        let node = p.node(p.segments());
        let h = self.flow.hamiltonian.get_mut();
        let mut y = vec![0.0; h.dimension()];
        y[..2 * p.states].copy_from_slice(&z[node..node + 2 * p.states]);
        h.end_point(z[p.final_time], &y, parameters, &mut self.terminal);
        Ok(())
    }
}

/// The sensitivities that a flight is to leave.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Slopes {
    /// None: only values are wanted.
    Unwanted,
    /// Its own.
    New,
    /// Those of the flight before from the same point, by a rougher integration.
    Kept,
}

/// The flight that is wanted.
#[derive(Clone, Copy)]
struct Task {
    slopes: Slopes,
    chain: bool,
}

/// The equations with storage for one point.
pub(super) struct Conditions {
    pub(super) layout: MultipointLayout,
    pub(super) ends: Ends,
    pub(super) phases: Vec<PhaseFlight>,
    /// True when phases are flown side by side.
    pub(super) parallel: bool,
    /// Per unknown that bounds may hold, and per row in place of its multiplier.
    obeys: Vec<Obeys>,
    /// By how much each unknown, and each row in place of its multiplier, was beyond its bound when it was made to obey it.
    beyond: Vec<f64>,
    /// Part of these distances that is still allowed.
    pub(super) allowance: f64,
    parameters: Vec<f64>,
    multipliers: Vec<f64>,
}

impl Conditions {
    pub(super) fn new(ocp: &Ocp, layout: MultipointLayout, phases: Vec<PhaseFlight>, parallel: bool) -> Self {
        Self {
            ends: Ends::new(ocp, &layout),
            phases,
            parallel,
            parameters: vec![0.0; layout.parameters],
            multipliers: vec![0.0; layout.rows.len()],
            obeys: vec![Obeys::Condition; layout.unknowns],
            beyond: vec![0.0; layout.unknowns],
            allowance: 0.0,
            layout,
        }
    }

    /// Flies all segments from the unknowns `z`.
    ///
    /// # Errors
    /// The first segment without an end.
    pub(super) fn fly(&mut self, z: &[f64], slopes: Slopes) -> Result<(), FailedSegment> {
        self.run(z, Task { slopes, chain: false })
    }

    /// Flies each phase with sensitivities from its first node on and makes the ends of the segments its nodes.
    ///
    /// # Errors
    /// The first segment without an end.
    pub(super) fn fly_through(&mut self, z: &mut [f64]) -> Result<(), FailedSegment> {
        self.run(z, Task { slopes: Slopes::New, chain: true })?;
        for (p, flight) in self.layout.phases.iter().zip(&self.phases) {
            for (segment, passage) in flight.passages.iter().enumerate() {
                let next = p.node(segment + 1);
                z[next..next + 2 * p.states].copy_from_slice(&passage.end[..2 * p.states]);
            }
        }
        self.ends.evaluate(z, &self.multipliers, true);
        Ok(())
    }

    /// Relative tolerance of the integration from now on.
    pub(super) fn set_tolerance(&mut self, tolerance: f64) {
        self.phases.iter_mut().for_each(|p| p.flow.set_tolerance(tolerance));
    }

    fn run(&mut self, z: &[f64], task: Task) -> Result<(), FailedSegment> {
        let MultipointLayout { first_parameter, parameters, first_multiplier, .. } = self.layout;
        self.parameters.copy_from_slice(&z[first_parameter..first_parameter + parameters]);
        self.multipliers.copy_from_slice(&z[first_multiplier..]);
        let (layout, parameters) = (&self.layout, &self.parameters[..]);
        let fly = |(k, flight): (usize, &mut PhaseFlight)| {
            let flown = flight.fly(&layout.phases[k], z, parameters, task);
            flown.map_err(|(segment, reason)| FailedSegment { phase: k, segment, reason })
        };
        if self.parallel && self.phases.len() > 1 {
            let all: Vec<_> = self.phases.par_iter_mut().enumerate().map(fly).collect();
            all.into_iter().collect::<Result<(), _>>()?;
        } else {
            self.phases.iter_mut().enumerate().try_for_each(fly)?;
        }
        self.ends.evaluate(z, &self.multipliers, task.slopes != Slopes::Unwanted);
        Ok(())
    }

    /// `G` of an end state, time or parameter: zero where nothing holds it.
    fn condition(&self, z: &[f64], unknown: usize) -> f64 {
        let mut g = self.ends.gradient[unknown];
        for (k, p) in self.layout.phases.iter().enumerate() {
            let (first, last, n) = (p.node(0), p.node(p.segments()), p.states);
            if (first..first + n).contains(&unknown) {
                return g + z[unknown + n];
            }
            if (last..last + n).contains(&unknown) {
                return g - z[unknown + n];
            }
            if unknown == p.initial_time {
                return g - self.phases[k].passages[0].first.hamiltonian;
            }
            if unknown == p.final_time {
                return g + self.phases[k].terminal.hamiltonian;
            }
            // Only parameters remain, to which every phase contributes.
            if unknown >= self.layout.first_parameter {
                let parameter = unknown - self.layout.first_parameter;
                let per_phase = self.phases[k].passages.iter().filter_map(|s| s.end.get(2 * n + parameter));
                g += per_phase.sum::<f64>();
            }
        }
        g
    }

    /// Derivatives of `G` (see [`condition`](Self::condition)) as `(unknown, value)`.
    fn each_condition_slope(&self, unknown: usize, mut emit: impl FnMut(usize, f64)) {
        for &(_, j, v) in self.ends.curvature.iter().filter(|(i, ..)| *i == unknown) {
            emit(j, v);
        }
        for &(row, _, v) in self.ends.slopes.iter().filter(|(_, i, _)| *i == unknown) {
            emit(self.layout.first_multiplier + row, v);
        }
        let first_parameter = self.layout.first_parameter;
        for (k, p) in self.layout.phases.iter().enumerate() {
            let (first, last, n) = (p.node(0), p.node(p.segments()), p.states);
            let mut hamiltonian = |sign: f64, node: usize, time: usize, at: &EndPoint| {
                for i in 0..n {
                    emit(node + i, -sign * at.rates[n + i]);
                    emit(node + n + i, sign * at.rates[i]);
                }
                emit(time, sign * at.time_slope);
                for (index, slope) in at.rates[2 * n..].iter().enumerate() {
                    emit(first_parameter + index, sign * slope);
                }
            };
            if (first..first + n).contains(&unknown) {
                return emit(unknown + n, 1.0);
            }
            if (last..last + n).contains(&unknown) {
                return emit(unknown + n, -1.0);
            }
            if unknown == p.initial_time {
                return hamiltonian(-1.0, first, unknown, &self.phases[k].passages[0].first);
            }
            if unknown == p.final_time {
                return hamiltonian(1.0, last, unknown, &self.phases[k].terminal);
            }
            if unknown >= first_parameter {
                let parameter = unknown - first_parameter;
                for segment in 0..p.segments() {
                    self.each_flow_slope(k, segment, 2 * n + parameter, &mut emit);
                }
            }
        }
    }

    /// Derivatives of a component of the end of a segment with respect to the unknowns.
    fn each_flow_slope(
        &self,
        phase: usize,
        segment: usize,
        component: usize,
        emit: &mut impl FnMut(usize, f64),
    ) {
        let (p, passage) = (&self.layout.phases[phase], &self.phases[phase].passages[segment]);
        let n = passage.end.len();
        let np = n - 2 * p.states;
        if component >= n {
            return;
        }
        let width = n + np;
        let row = &passage.moved[component * width..(component + 1) * width];
        let node = p.node(segment);
        for c in 0..2 * p.states {
            emit(node + c, row[c]);
        }
        for c in 0..np {
            emit(self.layout.first_parameter + c, row[n + c]);
        }
        // d end / d t_b = F_b, d end / d t_a = -Phi F_a.
        let at_end = passage.last.rates[component];
        let at_start: f64 = -row[..n].iter().zip(&passage.first.rates).map(|(a, b)| a * b).sum::<f64>();
        let (a, b) = (p.fractions[segment], p.fractions[segment + 1]);
        emit(p.initial_time, (1.0 - a) * at_start + (1.0 - b) * at_end);
        emit(p.final_time, a * at_start + b * at_end);
    }

    /// Quantities that bounds may hold, with the row of their equation.
    fn held(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let phases = self.layout.phases.iter().flat_map(|p| {
            let (first, last, n) = (p.node(0), p.node(p.segments()), p.states);
            let initial = (0..n).map(move |i| (first + i, first + i));
            let terminal = (0..n).map(move |i| (last + n + i, last + i));
            initial.chain(terminal).chain([(p.initial_time, p.initial_time), (p.final_time, p.final_time)])
        });
        let first = self.layout.first_parameter;
        phases.chain((first..first + self.layout.parameters).map(|i| (i, i)))
    }

    /// Quantities that bounds may hold, as their place among the unknowns (that of the multiplier for a row): bounds, size, value and
    /// condition.
    fn bounded(&self, z: &[f64]) -> Vec<(usize, Bounds, f64, f64, f64)> {
        let layout = &self.layout;
        let end =
            |(_, u): (usize, usize)| (u, layout.bounds[u], layout.scales[u], z[u], self.condition(z, u));
        let row = |k: usize| {
            let (place, r) = (layout.first_multiplier + k, layout.rows[k]);
            (place, r.bounds, r.scale, self.ends.rows[k], -z[place])
        };
        self.held().map(end).chain((0..layout.rows.len()).map(row)).collect()
    }

    /// At a start, after [`fly`](Self::fly): holds the quantities that are at a bound and pushed out by their condition.
    pub(super) fn choose_at_start(&mut self, z: &[f64]) {
        for (place, bounds, scale, value, condition) in self.bounded(z) {
            self.obeys[place] = Obeys::at_start(&bounds, scale, value, condition);
        }
    }

    /// At a solution: releases the quantities that are pushed inwards, else holds the one that exceeds its bound most. Whether anything
    /// changed.
    pub(super) fn choose_at_solution(&mut self, z: &[f64]) -> bool {
        self.beyond.fill(0.0);
        let bounded = self.bounded(z);
        let mut changed = false;
        for &(place, bounds, _, _, condition) in &bounded {
            if self.obeys[place].pushes_inwards(&bounds, condition) {
                self.obeys[place] = Obeys::Condition;
                changed = true;
            }
        }
        if changed {
            return true;
        }
        let excess = |&(place, bounds, scale, value, _): &(usize, Bounds, f64, f64, f64)| {
            let (bound, excess) = self.obeys[place].exceeded(&bounds, scale, value)?;
            Some((place, bound, value, excess))
        };
        let worst = bounded.iter().filter_map(excess).max_by(|a, b| a.3.total_cmp(&b.3));
        if let Some((place, bound, value, _)) = worst {
            self.obeys[place] = Obeys::Bound(bound);
            self.beyond[place] = value - bound;
        }
        worst.is_some()
    }

    /// `F(z)` after [`fly`](Self::fly).
    pub(super) fn residual(&self, z: &[f64], out: &mut DVector<f64>) {
        let (scales, objective) = (&self.layout.scales, self.layout.objective);
        for (row, unknown) in self.held() {
            let scale = scales[unknown];
            out[row] = match self.obeys[unknown] {
                Obeys::Bound(b) => (z[unknown] - b - self.allowance * self.beyond[unknown]) / scale,
                Obeys::Condition => self.condition(z, unknown) * scale / objective,
            };
        }
        for (k, p) in self.layout.phases.iter().enumerate() {
            for segment in 0..p.segments() {
                let (next, row) = (p.node(segment + 1), p.node(segment) + p.states);
                for c in 0..2 * p.states {
                    out[row + c] = (self.phases[k].passages[segment].end[c] - z[next + c]) / scales[next + c];
                }
            }
        }
        for (k, r) in self.layout.rows.iter().enumerate() {
            let row = self.layout.first_multiplier + k;
            out[row] = match self.obeys[row] {
                Obeys::Bound(b) => (self.ends.rows[k] - b - self.allowance * self.beyond[row]) / r.scale,
                Obeys::Condition => -z[row] / scales[row],
            };
        }
    }

    /// `dF/dz` in units of the unknowns, after [`fly`](Self::fly) with sensitivities.
    pub(super) fn jacobian(&self, out: &mut DMatrix<f64>) {
        out.fill(0.0);
        let (scales, objective) = (&self.layout.scales, self.layout.objective);
        for (row, unknown) in self.held() {
            match self.obeys[unknown] {
                Obeys::Bound(_) => out[(row, unknown)] = 1.0,
                Obeys::Condition => self.each_condition_slope(unknown, |c, v| {
                    out[(row, c)] += v * scales[c] * scales[unknown] / objective;
                }),
            }
        }
        for (k, p) in self.layout.phases.iter().enumerate() {
            for segment in 0..p.segments() {
                let (next, row) = (p.node(segment + 1), p.node(segment) + p.states);
                for c in 0..2 * p.states {
                    let unit = scales[next + c];
                    self.each_flow_slope(k, segment, c, &mut |u, v| {
                        out[(row + c, u)] += v * scales[u] / unit
                    });
                    out[(row + c, next + c)] -= 1.0;
                }
            }
        }
        for (k, r) in self.layout.rows.iter().enumerate() {
            let row = self.layout.first_multiplier + k;
            match self.obeys[row] {
                Obeys::Bound(_) => {
                    for &(_, u, v) in self.ends.slopes.iter().filter(|(i, ..)| *i == k) {
                        out[(row, u)] += v * scales[u] / r.scale;
                    }
                }
                Obeys::Condition => out[(row, row)] = -1.0,
            }
        }
    }

    /// Multipliers of the endpoint constraints that fit the costates best, by least squares over the conditions of the free end
    /// states and times; those of inequalities that are not active are zero.
    pub(super) fn estimate_multipliers(&mut self, z: &mut [f64]) {
        let layout = &self.layout;
        let first = layout.first_multiplier;
        z[first..].fill(0.0);
        self.multipliers.fill(0.0);
        self.ends.evaluate(z, &self.multipliers, false);
        let layout = &self.layout;
        let free: Vec<usize> =
            self.held().map(|(_, u)| u).filter(|&u| !layout.bounds[u].is_fixed()).collect();
        let near = |k: usize| {
            let r = &layout.rows[k];
            r.bounds.excess(self.ends.rows[k]) > -1e-6 * r.scale
        };
        let rows: Vec<usize> = (0..layout.rows.len()).filter(|&k| near(k)).collect();
        if rows.is_empty() || free.is_empty() {
            self.ends.evaluate(z, &self.multipliers, true);
            return;
        }
        let mut matrix = DMatrix::<f64>::zeros(free.len(), rows.len());
        let mut right = DVector::<f64>::zeros(free.len());
        for (i, &u) in free.iter().enumerate() {
            let unit = layout.scales[u] / layout.objective;
            right[i] = -self.condition(z, u) * unit;
            for (j, &k) in rows.iter().enumerate() {
                let slope: f64 =
                    self.ends.slopes.iter().filter(|(r, c, _)| *r == k && *c == u).map(|(.., v)| v).sum();
                matrix[(i, j)] = slope * unit * layout.scales[first + k];
            }
        }
        if let Ok(found) = matrix.svd(true, true).solve(&right, 1e-10) {
            for (j, &k) in rows.iter().enumerate() {
                z[first + k] = found[j] * layout.scales[first + k];
            }
        }
        self.multipliers.copy_from_slice(&z[first..]);
        self.ends.evaluate(z, &self.multipliers, true);
    }
}
