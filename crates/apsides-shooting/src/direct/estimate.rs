//! Deficits of a solution, segment by segment: accuracy of the steps, freedom of the controls, rows between the control points.
//!
//! Shooting makes the projection of `H_u` onto the control polynomials vanish, not `H_u` itself. With `r` the relative slope
//! `|H_u| u_scale / |H|` and `room` the relative distance to the bound that the slope pushes to, a richer control would gain about
//!
//! ```text
//! integral over the segment of |H| r min(r, room) dt
//! ```
//!
//! `|H|` being the largest term of the Hamiltonian along the phase and `u_scale` at least the largest control: of second order in the control error where the control is inside
//! its bounds, and what a control at the wrong bound loses. Relative to the objective this is the gain of the segment.

use apsides_basis::{Gauss, MAX_POINTS};
use apsides_nlp::SolveReport;
use apsides_ocp::{Bounds, Ocp, Phase, PhaseTrajectory};

use super::extraction::CheckedTrajectory;
use super::hamiltonian::Lagrangian;
use super::layout::{SegmentLayout, ShootingPhase};
use super::transcription::Transcription;
use crate::error::ShootingError;

/// The barrier of the interior-point method keeps controls away from their bounds at a loss of about the complementarity of the
/// segment; as much as this times it is not laid to the control polynomial, which is looked at between its points.
const BARRIER_SHARE: f64 = 4.0;
/// Points per segment at which the slope of the Hamiltonian is looked at, for each control point; bounds and rows at twice as many, for
/// each control or constraint point.
const SAMPLES_PER_POINT: usize = 3;

/// One segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SegmentEstimate {
    /// Error of the steps, relative to the scales of the states.
    pub(crate) integration: f64,
    /// The gain of a richer control, relative to the objective.
    pub(crate) gain: f64,
    /// Excess of bounds on states and of path rows without controls, relative to their scales.
    pub(crate) state_excess: f64,
    /// Excess of bounds on controls.
    pub(crate) control_excess: f64,
    /// Excess of inequality rows with controls.
    pub(crate) mixed_excess: f64,
    /// Excess of equality rows with controls.
    pub(crate) equality_excess: f64,
    /// True when a bound is active at some of the control points and not at others.
    pub(crate) junction: bool,
}

/// Estimates of all phases and segments.
pub(crate) fn estimate(
    nlp: &Transcription,
    ocp: &Ocp,
    report: &SolveReport,
    extracted: &CheckedTrajectory,
) -> Result<Vec<Vec<SegmentEstimate>>, ShootingError> {
    let trajectory = &extracted.trajectory;
    let objective = trajectory.objective.abs().max(nlp.scales.objective);
    let mut phases = Vec::with_capacity(ocp.phases.len());
    for (index, (phase, p)) in ocp.phases.iter().zip(&nlp.layout.phases).enumerate() {
        let weights = nlp.integral_weights(ocp, index, &report.constraint_multipliers);
        let t = &trajectory.phases[index];
        let mut estimator = Estimator {
            lagrangian: Lagrangian::new(phase, weights, &trajectory.parameters),
            control_scales: scales_at(p, &nlp.scales.variables, |s| s.control_columns[0], p.controls),
            state_scales: scales_at(p, &nlp.scales.variables, |s| s.state_column, p.states),
            row_scales: row_scales(phase, p, &nlp.scales.constraints),
            x: vec![0.0; p.states],
            u: vec![0.0; p.controls],
            costate: vec![0.0; p.states],
            multipliers: vec![0.0; phase.path_rows()],
            path: vec![0.0; phase.path_rows()],
            nlp,
            report,
            phase,
            p,
            t,
        };
        let relative = (t.final_time - t.initial_time) / objective;
        let estimates = estimator.segments(&extracted.errors[index], relative)?;
        phases.push(estimates);
    }
    Ok(phases)
}

fn scales_at(
    p: &ShootingPhase,
    scales: &[f64],
    column: impl Fn(&SegmentLayout) -> usize,
    count: usize,
) -> Vec<f64> {
    p.segments.first().map_or(Vec::new(), |s| scales[column(s)..][..count].to_vec())
}

fn row_scales(phase: &Phase, p: &ShootingPhase, scales: &[f64]) -> Vec<f64> {
    let Some(segment) = p.segments.first() else { return Vec::new() };
    let firsts = phase.path.iter().zip(&segment.path_rows);
    firsts.flat_map(|(c, &first)| scales[first..first + c.rows.len()].iter().copied()).collect()
}

struct Estimator<'a> {
    lagrangian: Lagrangian<'a>,
    nlp: &'a Transcription,
    report: &'a SolveReport,
    phase: &'a Phase,
    p: &'a ShootingPhase,
    t: &'a PhaseTrajectory,
    state_scales: Vec<f64>,
    control_scales: Vec<f64>,
    row_scales: Vec<f64>,
    x: Vec<f64>,
    u: Vec<f64>,
    costate: Vec<f64>,
    multipliers: Vec<f64>,
    path: Vec<f64>,
}

impl Estimator<'_> {
    fn segments(&mut self, errors: &[f64], relative: f64) -> Result<Vec<SegmentEstimate>, ShootingError> {
        let size = self.hamiltonian_size();
        self.widen_control_scales();
        let mut estimates = Vec::with_capacity(errors.len());
        for (k, &integration) in errors.iter().enumerate() {
            let mut estimate = SegmentEstimate { integration, ..SegmentEstimate::default() };
            self.look_between(k, &mut estimate);
            if size > 0.0 {
                let held_back = self.look_at_bounds(k, size, &mut estimate);
                let gain = self.gain(k, size)? - BARRIER_SHARE * held_back;
                estimate.gain = (relative * size * gain).max(0.0);
            }
            estimates.push(estimate);
        }
        Ok(estimates)
    }

    /// Goes to a place of a segment, from 0 to 1; returns the time.
    fn go_to(&mut self, k: usize, place: f64) -> f64 {
        let time = self.t.time_at(self.start(k) + place * self.width(k));
        self.t.state.evaluate_in(k, time, &mut self.x);
        self.t.control.evaluate_in(k, time, &mut self.u);
        time
    }

    /// Start and width of a segment as fractions of the phase.
    fn start(&self, k: usize) -> f64 {
        self.t.mesh.fractions()[k]
    }

    fn width(&self, k: usize) -> f64 {
        self.t.mesh.fractions()[k + 1] - self.start(k)
    }

    fn differentiate(&mut self, k: usize, place: f64) {
        let time = self.go_to(k, place);
        if let Some(costate) = &self.t.costate {
            costate.evaluate_in(k, time, &mut self.costate);
        }
        if let Some(multipliers) = &self.t.path_multipliers {
            multipliers.evaluate_in(k, time, &mut self.multipliers);
        }
        self.lagrangian.differentiate(time, &self.x, &self.u, &self.costate, &self.multipliers);
    }

    fn hamiltonian_size(&mut self) -> f64 {
        let mut size = 0.0_f64;
        for k in 0..self.p.segments.len() {
            for point in 0..self.p.segments[k].controls.count() {
                self.differentiate(k, self.p.segments[k].controls.place(point));
                size = size.max(self.lagrangian.largest_term);
            }
        }
        size
    }

    /// A control without bounds may be far from what its guess was.
    fn widen_control_scales(&mut self) {
        for segment in self.t.control.segments() {
            for point in segment.values.chunks(self.control_scales.len().max(1)) {
                for (scale, value) in self.control_scales.iter_mut().zip(point) {
                    *scale = scale.max(value.abs());
                }
            }
        }
    }

    /// Integral of `r min(r, room)` over a segment, on the normalised time of the phase.
    fn gain(&mut self, k: usize, size: f64) -> Result<f64, ShootingError> {
        if self.p.controls == 0 {
            return Ok(0.0);
        }
        let points = (SAMPLES_PER_POINT * self.p.segments[k].controls.count()).min(MAX_POINTS);
        let rule = Gauss::shared(points)?;
        let mut sum = 0.0;
        for (tau, weight) in rule.nodes().iter().zip(rule.weights()) {
            self.differentiate(k, 0.5 * (tau + 1.0));
            let slopes = &self.lagrangian.gradient[self.p.states..];
            let controls = self.phase.controls.iter().zip(slopes).zip(&self.u).zip(&self.control_scales);
            let density: f64 = controls
                .map(|(((control, slope), value), scale)| {
                    let slope = slope * scale / size;
                    slope.abs() * slope.abs().min(room(&control.bounds, *value, slope) / scale)
                })
                .sum();
            sum += 0.5 * weight * density;
        }
        Ok(self.width(k) * sum)
    }

    /// Finds junctions and returns what the barrier holds back, in the measure of [`gain`](Self::gain): of the slope `z` that a
    /// multiplier stands for, `z min(z, room)`.
    fn look_at_bounds(&self, k: usize, size: f64, estimate: &mut SegmentEstimate) -> f64 {
        let (p, nlp, report, phase) = (self.p, self.nlp, self.report, self.phase);
        let segment = &p.segments[k];
        let (duration, width) = (self.t.final_time - self.t.initial_time, self.width(k));
        let mut held_back = 0.0;
        let mut active = vec![0; p.controls + phase.path_rows()];
        // `[(multiplier, distance); 2]` of the sides of a quantity; whether one is active.
        let mut consider = |weight: f64, scale: f64, sides: [(f64, f64); 2]| {
            let weight = weight * width;
            let mut is_active = false;
            for (multiplier, distance) in sides.into_iter().filter(|(_, d)| d.is_finite()) {
                let slope = multiplier.max(0.0) * scale / (weight * duration * size);
                let room = distance.max(0.0) / scale;
                held_back += weight * slope * slope.min(room);
                is_active |= slope > room;
            }
            is_active
        };
        let variable = |column: usize| {
            let x = report.x[column];
            let lower = (report.lower_multipliers[column], x - nlp.variable_limits.lower[column]);
            [lower, (report.upper_multipliers[column], nlp.variable_limits.upper[column] - x)]
        };
        let row = |row: usize| {
            let (y, value) = (report.constraint_multipliers[row], report.constraint_values[row]);
            [(-y, value - nlp.row_limits.lower[row]), (y, nlp.row_limits.upper[row] - value)]
        };
        for (point, &column) in segment.control_columns.iter().enumerate() {
            let weight = segment.controls.weight(point);
            for c in 0..p.controls {
                active[c] += usize::from(consider(weight, self.control_scales[c], variable(column + c)));
            }
        }
        for point in 0..segment.rows.count() {
            let weight = segment.rows.weight(point);
            let firsts = &segment.path_rows[point * phase.path.len()..];
            let constraints = phase.path.iter().zip(firsts);
            let rows = constraints.flat_map(|(c, &first)| c.rows.iter().zip(first..));
            for (k, (_, r)) in rows.enumerate().filter(|(_, (v, _))| !v.bounds.is_fixed()) {
                active[p.controls + k] += usize::from(consider(weight, self.row_scales[k], row(r)));
            }
        }
        for &(point, state, r) in &segment.bound_rows {
            consider(segment.rows.weight(point), self.state_scales[state], row(r));
        }
        for node in [k, k + 1].into_iter().filter(|node| (1..p.segments.len()).contains(node)) {
            let point = if node == k { 0 } else { segment.rows.count() - 1 };
            for (state, scale) in self.state_scales.iter().enumerate() {
                consider(segment.rows.weight(point), *scale, variable(p.state_column(node) + state));
            }
        }
        let (of_controls, of_rows) = active.split_at(p.controls);
        estimate.junction = of_controls.iter().any(|count| (1..segment.controls.count()).contains(count))
            || of_rows.iter().any(|count| (1..segment.rows.count()).contains(count));
        held_back
    }

    fn look_between(&mut self, k: usize, estimate: &mut SegmentEstimate) {
        let points = self.p.segments[k].controls.count().max(self.p.segments[k].rows.count());
        let samples = 2 * SAMPLES_PER_POINT * points;
        let phase = self.phase;
        let (nx, nu) = (self.p.states, self.p.controls);
        for sample in 0..=samples {
            let time = self.go_to(k, sample as f64 / samples as f64);
            for ((state, x), scale) in phase.states.iter().zip(&self.x).zip(&self.state_scales) {
                worsen(&mut estimate.state_excess, state.variable.bounds.excess(*x) / scale);
            }
            for ((control, u), scale) in phase.controls.iter().zip(&self.u).zip(&self.control_scales) {
                worsen(&mut estimate.control_excess, control.bounds.excess(*u) / scale);
            }
            self.lagrangian.path(time, &self.x, &self.u, &mut self.path);
            let mut first = 0;
            for c in &phase.path {
                let with_controls = c.function.pattern().columns.iter().any(|c| (nx..nx + nu).contains(c));
                for (row, value) in c.rows.iter().zip(&self.path[first..]) {
                    let excess = row.bounds.excess(*value) / self.row_scales[first];
                    first += 1;
                    let kind = match (with_controls, row.bounds.is_fixed()) {
                        (false, _) => &mut estimate.state_excess,
                        (true, false) => &mut estimate.mixed_excess,
                        (true, true) => &mut estimate.equality_excess,
                    };
                    worsen(kind, excess);
                }
            }
        }
    }
}

fn worsen(worst: &mut f64, excess: f64) {
    if excess > *worst || excess.is_nan() {
        *worst = excess;
    }
}

/// Distance to the bound that the slope pushes to; a bound that is overstepped is the subject of other estimates.
fn room(bounds: &Bounds, value: f64, slope: f64) -> f64 {
    let value = bounds.clamp(value);
    if slope > 0.0 { value - bounds.lower } else { bounds.upper - value }
}
