//! From the decision vector and its multipliers to a trajectory with costates.
//!
//! With `y` the multipliers of the matching conditions of the node `k + 1`, the costate there is `-y`. Along the segment before it
//! the costate follows from `lambda' = -dL/dx`, integrated backwards; a path multiplier per unit time is that of the row divided by
//! the quadrature weight of its point, that of a state bound likewise. So the jumps of the costate of the discrete problem
//! are spread over the time that each point stands for; the share of the segment before a node is taken from its end. States are
//! those of an integration with step control. Both are polynomials through as many Chebyshev points as they need.

use std::cell::RefCell;
use std::sync::Arc;

use apsides_basis::{Barycentric, chebyshev_lobatto};
use apsides_nlp::SolveReport;
use apsides_ocp::{Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};
use apsides_ode::{FnSystem, Integrator, OdeSettings, OdeSystem, SmoothSystem, Status, Tolerance};

use super::hamiltonian::Lagrangian;
use super::layout::{SegmentLayout, ShootingPhase};
use super::shot::Shot;
use super::transcription::Transcription;
use crate::error::ShootingError;

/// Chebyshev points that are tried, each twice as fine as the one before.
const POINTS: [usize; 4] = [9, 17, 33, 65];
/// Entries of [`POINTS`] that one integration tries: the coarsest, and the points that it is sampled at, which hold those of all before.
const SAMPLED: [(usize, usize); 2] = [(0, 2), (2, 3)];
/// The integrations here are so much more accurate than the steps of the segments need to be.
const MARGIN: f64 = 1e-2;
/// Longest step of an integration along [-1, 1].
const LONGEST_STEP: f64 = 0.5;
/// Least relative tolerance of an integration.
const LEAST_TOLERANCE: f64 = 1e-14;

/// Chebyshev points with their interpolation, one per entry of [`POINTS`].
pub(crate) type Grids = Vec<Arc<Barycentric>>;

/// A trajectory and, per phase and segment, the largest error of the steps relative to the scale of its state.
pub(crate) struct CheckedTrajectory {
    pub(crate) trajectory: Trajectory,
    pub(crate) errors: Vec<Vec<f64>>,
}

/// The trajectory of a point and its multipliers; of the start of the solve where the point is no trajectory.
pub(crate) fn extract(
    nlp: &mut Transcription,
    ocp: &Ocp,
    report: &SolveReport,
    tolerance: f64,
) -> Result<CheckedTrajectory, ShootingError> {
    let x = nlp.usable_point(report).to_vec();
    nlp.refresh(&x);
    let grids = POINTS
        .iter()
        .map(|n| Ok(Arc::new(Barycentric::new(&chebyshev_lobatto(*n)?)?)))
        .collect::<Result<Grids, ShootingError>>()?;
    let parameters = &x[nlp.layout.parameter_columns()];
    let (mut phases, mut errors, mut first) = (Vec::new(), Vec::new(), 0);
    for (index, phase) in ocp.phases.iter().enumerate() {
        let weights = nlp.integral_weights(ocp, index, &report.constraint_multipliers);
        let p = &nlp.layout.phases[index];
        let shots = &mut nlp.discretisation.all[first..first + p.segments.len()];
        first += p.segments.len();
        let extraction = Extraction {
            lagrangian: RefCell::new(Lagrangian::new(phase, weights, parameters)),
            scales: (p.segments.first()).map_or(&[], |s| &nlp.scales.variables[s.state_column..][..p.states]),
            y: &report.constraint_multipliers,
            report,
            x: &x,
            grids: &grids,
            tolerance: (MARGIN * tolerance).max(LEAST_TOLERANCE),
            phase,
            p,
        };
        let (trajectory, phase_errors) = extraction.phase(shots)?;
        phases.push(trajectory);
        errors.push(phase_errors);
    }
    Ok(CheckedTrajectory { trajectory: nlp.joined(ocp, report, &x, phases), errors })
}

struct Extraction<'a> {
    phase: &'a Phase,
    p: &'a ShootingPhase,
    x: &'a [f64],
    y: &'a [f64],
    report: &'a SolveReport,
    scales: &'a [f64],
    grids: &'a Grids,
    tolerance: f64,
    lagrangian: RefCell<Lagrangian<'a>>,
}

impl Extraction<'_> {
    fn phase(&self, shots: &mut [Shot]) -> Result<(PhaseTrajectory, Vec<f64>), ShootingError> {
        let Self { p, x, y, .. } = *self;
        let (t0, tf) = (x[p.ends.initial_time], x[p.ends.final_time]);
        let path_rows = self.phase.path_rows();
        let row_weights = self.row_weights();
        let (mut state, mut control, mut costate, mut path) = (vec![], vec![], vec![], vec![]);
        let mut errors = Vec::with_capacity(shots.len());
        for (k, (segment, shot)) in p.segments.iter().zip(shots).enumerate() {
            let columns = segment.control_columns.iter();
            let values = columns.flat_map(|&c| &x[c..c + p.controls]).copied().collect();
            let controls = Segment { basis: Arc::clone(&segment.controls.basis), values };
            let values = self.path_multipliers(segment, &row_weights);
            let multipliers = Segment { basis: Arc::clone(&segment.rows.basis), values };
            let (states, error) = self.states(k, shot)?;
            costate.push(self.costates(k, segment, &states, &controls, &multipliers)?);
            errors.push(error);
            state.push(states);
            control.push(controls);
            path.push(multipliers);
        }
        let breaks = p.node_times(x);
        let mesh = if p.inner_times().next().is_some() {
            let mut fractions: Vec<f64> = breaks.iter().map(|t| (t - t0) / (tf - t0)).collect();
            fractions[breaks.len() - 1] = 1.0;
            PhaseMesh::new(fractions, p.plan.mesh.points().to_vec())?
        } else {
            p.plan.mesh.clone()
        };
        let polynomial = |dimension, segments| PiecewisePolynomial::new(dimension, breaks.clone(), segments);
        let integral_multipliers = p.ends.integral_multipliers(y);
        let trajectory = PhaseTrajectory {
            name: self.phase.name.clone(),
            initial_time: t0,
            final_time: tf,
            mesh,
            state: polynomial(p.states, state)?,
            control: polynomial(p.controls, control)?,
            costate: Some(polynomial(p.states, costate)?),
            path_multipliers: if path_rows > 0 { Some(polynomial(path_rows, path)?) } else { None },
            contacts: Vec::new(),
            integral_multipliers: Some(integral_multipliers),
            interval_errors: errors.clone(),
        };
        Ok((trajectory, errors))
    }

    /// Time that each path row stands for, by its index: that of both segments where they share it.
    fn row_weights(&self) -> std::collections::BTreeMap<usize, f64> {
        let mut weights = std::collections::BTreeMap::new();
        for segment in &self.p.segments {
            for (index, row) in segment.path_rows.iter().enumerate() {
                let point = index / self.phase.path.len();
                *weights.entry(*row).or_insert(0.0) += segment.row_seconds(point, self.x);
            }
        }
        weights
    }

    /// Multipliers of all path rows per unit time, at their points.
    fn path_multipliers(
        &self,
        segment: &SegmentLayout,
        weights: &std::collections::BTreeMap<usize, f64>,
    ) -> Vec<f64> {
        let rows = segment.path_rows.chunks(self.phase.path.len().max(1));
        let constraints = rows.flat_map(|rows| self.phase.path.iter().zip(rows));
        constraints
            .flat_map(|(c, first)| {
                let seconds = weights[first];
                (0..c.rows.len()).map(move |k| self.y[first + k] / seconds)
            })
            .collect()
    }

    fn integrator(&self, scales: impl Iterator<Item = f64>) -> Result<Integrator, ShootingError> {
        let absolute = scales.map(|s| self.tolerance * s);
        let settings = OdeSettings {
            relative_tolerance: self.tolerance,
            absolute_tolerance: Tolerance::PerComponent(absolute.collect()),
            max_steps: 10_000,
            // Between the steps the order is lower by one.
            max_step: LONGEST_STEP,
            stiffness_interval: None,
            ..OdeSettings::default()
        };
        Ok(Integrator::new(self.p.states, settings)?)
    }

    /// States of a segment, and the error of its steps.
    fn states(&self, k: usize, shot: &mut Shot) -> Result<(Segment, f64), ShootingError> {
        let (p, x) = (self.p, self.x);
        let n = p.states;
        let (start, end) = (p.state_column(k), p.state_column(k + 1));
        let Shot { system, flow, point, .. } = shot;
        let w = &point[n..];
        let outputs = system.states() + system.quadratures();
        let scratch = RefCell::new((system, vec![0.0; outputs]));
        let rates = FnSystem::new(n, |tau: f64, x: &[f64], dx: &mut [f64]| {
            let (system, rates) = &mut *scratch.borrow_mut();
            system.rate(0.5 * (tau + 1.0), x, w, rates);
            dx.iter_mut().zip(&*rates).for_each(|(d, r)| *d = 0.5 * r);
        });
        let mut integrator = self.integrator(self.scales.iter().copied())?;
        let first = &x[start..start + n];
        let Some((basis, mut values)) = self.curve(&mut integrator, &rates, first, self.scales, false) else {
            let values = [first, &x[end..end + n]].concat();
            return Ok((Segment { basis: Arc::new(Barycentric::new(&[-1.0, 1.0])?), values }, f64::INFINITY));
        };
        let last = values.len() - n;
        let reached = flow.value(flow.steps());
        let misses = values[last..].iter().zip(reached).zip(self.scales);
        let error = misses.map(|((v, r), s)| (v - r).abs() / s).fold(0.0, f64::max);
        // The matching condition holds to the tolerance of the solver.
        values[last..].copy_from_slice(&x[end..end + n]);
        Ok((Segment { basis, values }, error))
    }

    /// Costates of a segment, from its end to its start.
    fn costates(
        &self,
        k: usize,
        segment: &SegmentLayout,
        states: &Segment,
        controls: &Segment,
        multipliers: &Segment,
    ) -> Result<Segment, ShootingError> {
        let (p, x) = (self.p, self.x);
        let n = p.states;
        let rows = self.phase.path_rows();
        let jump = self.share_of_jump(k, states, controls);
        let at_node = self.y[segment.matching_row..][..n].iter().zip(&jump);
        let lambda: Vec<f64> = at_node.map(|(y, jump)| -y - jump).collect();
        let bounds = self.bound_multipliers(k);
        let zeros = |length| vec![0.0; length];
        let scratch = RefCell::new((zeros(n), zeros(p.controls), zeros(rows), zeros(n)));
        let half = 0.5 * segment.length(x);
        let rates = FnSystem::new(n, |tau: f64, lambda: &[f64], rate: &mut [f64]| {
            let (x, u, mu, nu) = &mut *scratch.borrow_mut();
            states.basis.evaluate_all(&states.values, tau, x);
            controls.basis.evaluate_all(&controls.values, tau, u);
            multipliers.basis.evaluate_all(&multipliers.values, tau, mu);
            let t = segment.time(self.x, 0.5 * (tau + 1.0));
            let mut lagrangian = self.lagrangian.borrow_mut();
            lagrangian.differentiate(t, x, u, lambda, mu);
            segment.rows.basis.evaluate_all(&bounds, tau, nu);
            let gradient = lagrangian.gradient.iter().zip(&*nu);
            rate.iter_mut().zip(gradient).for_each(|(r, (g, nu))| *r = -half * (g + nu));
        });
        // Costates are compared in units of the largest of the phase times its state's scale.
        let nodes = p.segments.iter().flat_map(|s| self.y[s.matching_row..][..n].iter().zip(self.scales));
        let size = nodes.map(|(y, s)| (y * s).abs()).fold(0.0, f64::max);
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let scales: Vec<f64> = self.scales.iter().map(|s| size / s).collect();
        let mut integrator = self.integrator(scales.iter().copied())?;
        if let Some((basis, values)) = self.curve(&mut integrator, &rates, &lambda, &scales, true) {
            return Ok(Segment { basis, values });
        }
        let before = if k == 0 {
            lambda.clone()
        } else {
            self.y[p.segments[k - 1].matching_row..][..n].iter().map(|y| -y).collect()
        };
        Ok(Segment { basis: Arc::new(Barycentric::new(&[-1.0, 1.0])?), values: [before, lambda].concat() })
    }

    /// Time that the constraint point at the end of a segment stands for, and the one at the start of the next, where both have
    /// one.
    fn end_weights(&self, k: usize) -> Option<(f64, f64)> {
        let (segment, next) = (&self.p.segments[k], self.p.segments.get(k + 1)?);
        let both = segment.rows.count() > 1 && next.rows.count() > 1;
        both.then(|| (segment.row_seconds(segment.rows.count() - 1, self.x), next.row_seconds(0, self.x)))
    }

    /// Multipliers of the state bounds at the node after a segment.
    fn node_multipliers(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        let first = self.p.state_column(k + 1);
        let columns = first..first + self.p.states;
        columns.map(|c| self.report.upper_multipliers[c] - self.report.lower_multipliers[c])
    }

    /// Multipliers of the bounds on states per unit time at the constraint points of a segment, those of its inner nodes included.
    fn bound_multipliers(&self, k: usize) -> Vec<f64> {
        let (p, n) = (self.p, self.p.states);
        let segment = &p.segments[k];
        let mut values = vec![0.0; segment.rows.count() * n];
        for &(point, state, row) in &segment.bound_rows {
            values[point * n + state] = self.y[row] / segment.row_seconds(point, self.x);
        }
        let nodes = [(k.checked_sub(1), 0), (Some(k), segment.rows.count() - 1)];
        for (node, point) in nodes {
            let Some((node, (before, after))) = node.and_then(|node| Some((node, self.end_weights(node)?)))
            else {
                continue;
            };
            let seconds = before + after;
            for (value, z) in values[point * n..].iter_mut().zip(self.node_multipliers(node)) {
                *value = z / seconds;
            }
        }
        values
    }

    /// The contribution of rows and bounds at the end of a segment that belong to the node to the costate there, times the share of time
    /// that lies in the segment.
    fn share_of_jump(&self, k: usize, states: &Segment, controls: &Segment) -> Vec<f64> {
        let n = self.p.states;
        let Some((before, after)) = self.end_weights(k) else { return vec![0.0; n] };
        let share = before / (before + after);
        let mut jump: Vec<f64> = self.node_multipliers(k).map(|z| share * z).collect();
        let segment = &self.p.segments[k];
        let constraints = self.phase.path.len();
        let last = (segment.rows.count() - 1) * constraints;
        if (last..last + constraints).all(|index| segment.owns_path_row[index]) {
            return jump;
        }
        let mut multipliers = Vec::with_capacity(self.phase.path_rows());
        for (c, constraint) in self.phase.path.iter().enumerate() {
            let (first, own) = (segment.path_rows[last + c], segment.owns_path_row[last + c]);
            multipliers
                .extend((first..first + constraint.rows.len()).map(|r| if own { 0.0 } else { self.y[r] }));
        }
        let ends = |s: &Segment, count: usize| s.values[s.values.len() - count..].to_vec();
        let (x, u) = (ends(states, n), ends(controls, self.p.controls));
        let t = segment.time(self.x, 1.0);
        let mut lagrangian = self.lagrangian.borrow_mut();
        lagrangian.differentiate_path(t, &x, &u, &multipliers);
        jump.iter_mut().zip(&lagrangian.gradient).for_each(|(j, g)| *j += share * g);
        jump
    }

    /// The solution from one end of [-1, 1] to the other, by its values at as few Chebyshev points as it needs; none where it cannot be
    /// continued.
    fn curve<S: OdeSystem>(
        &self,
        integrator: &mut Integrator,
        system: &S,
        first: &[f64],
        scales: &[f64],
        backwards: bool,
    ) -> Option<(Arc<Barycentric>, Vec<f64>)> {
        let n = first.len();
        let mut found = None;
        let mut probe = vec![0.0; n];
        for (coarsest, finest) in SAMPLED {
            let nodes = self.grids[finest].nodes();
            let mut times = nodes.to_vec();
            if backwards {
                times.reverse();
            }
            let mut values = vec![0.0; nodes.len() * n];
            match integrator.sample(system, times[0], first, &times, &mut values) {
                Ok(s) if s.status == Status::Completed => {}
                _ => return None,
            }
            if backwards {
                let rows: Vec<f64> = values.chunks(n).rev().flatten().copied().collect();
                values = rows;
            }
            for (level, coarse) in self.grids.iter().enumerate().take(finest).skip(coarsest) {
                // Points of the level, and those half way between.
                let stride = 1 << (finest - level);
                let own: Vec<f64> = values.chunks(n).step_by(stride).flatten().copied().collect();
                let between = (stride / 2..nodes.len()).step_by(stride);
                let worst = between.fold(0.0_f64, |worst, k| {
                    coarse.evaluate_all(&own, nodes[k], &mut probe);
                    let misses = probe.iter().zip(&values[k * n..]).zip(scales);
                    misses.map(|((a, b), s)| (a - b).abs() / s).fold(worst, f64::max)
                });
                if worst <= self.tolerance / MARGIN {
                    return Some((Arc::clone(coarse), own));
                }
            }
            found = Some((Arc::clone(&self.grids[finest]), values));
        }
        found
    }
}
