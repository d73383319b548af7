//! The distance of the polynomials from the equations of motion between the collocation points.
//!
//! In each interval of `N` points the state and control are interpolated to a Radau rule of `N + 1` points, the rates
//! there are integrated, and the result is compared with the interpolated state (Patterson, Hager, Rao 2015, eqs. 24 to 27,
//! doi 10.1002/oca.2114). Integrals are compared the same way: by the finer rule and by that of the collocation.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_basis::Lgr;
use apsides_ocp::curvature::share_of_integral;
use apsides_ocp::{Ocp, PathConstraint, Phase, PhaseScaling, PhaseTrajectory, Scaling, Trajectory};

use crate::RadauError;
use crate::settings::RadauSettings;

/// Largest estimated errors of a trajectory, relative; both are compared with the mesh tolerance.
pub(crate) struct Estimate {
    /// The error of states and integrals, and the excess of their bounds.
    pub(crate) error: f64,
    /// Excess of bounds on controls and of path constraints with controls; zero where switches are not located.
    pub(crate) controls: f64,
    /// The excess of bounds on states and of path constraints without controls, relative to their scales.
    pub(crate) beyond: f64,
    /// Per phase and interval, the excess of rows beside their touch points; part of `error`, not of the errors of the intervals.
    pub(crate) beside_touch: Vec<Vec<f64>>,
}

impl Estimate {
    /// Adds the excess beside touch points to the errors of the intervals: they stand where they should.
    pub(crate) fn add_beside_touch(&self, trajectory: &mut Trajectory) {
        for (t, excesses) in trajectory.phases.iter_mut().zip(&self.beside_touch) {
            t.interval_errors.iter_mut().zip(excesses).for_each(|(error, excess)| raise(error, *excess));
        }
    }
}

/// Writes the estimated relative error of every interval into the trajectory and returns the largest.
///
/// Differences are relative to the largest value of each state in its phase, where that is above its scale.
pub(crate) fn estimate(
    ocp: &Ocp,
    scaling: &Scaling,
    settings: &RadauSettings,
    trajectory: &mut Trajectory,
) -> Result<Estimate, RadauError> {
    let mut largest = Estimate { error: 0.0, controls: 0.0, beyond: 0.0, beside_touch: Vec::new() };
    for (k, phase) in ocp.phases.iter().enumerate() {
        let parameters = &trajectory.parameters;
        let mut errors = phase_errors(ocp, scaling, settings, trajectory, k)?;
        // One number per interval: an excess at its tolerance counts as much as an error at its own.
        let weight = settings.tolerance / settings.path_tolerance;
        let excesses =
            excesses(phase, &scaling.phases[k], parameters, &trajectory.phases[k], settings.switches);
        largest.beside_touch.push(excesses.iter().map(|e| weight * e.beside_touch).collect());
        for (error, excess) in errors.iter_mut().zip(excesses) {
            raise(error, weight * excess.of_states);
            raise(&mut largest.beyond, excess.of_states);
            raise(&mut largest.error, error.max(weight * excess.beside_touch));
            raise(error, weight * excess.of_controls);
            raise(&mut largest.controls, weight * excess.of_controls);
        }
        trajectory.phases[k].interval_errors = errors;
    }
    Ok(largest)
}

/// The functions of one phase along its polynomials.
struct Along<'a> {
    phase: &'a Phase,
    trajectory: &'a PhaseTrajectory,
    parameters: &'a [f64],
    inputs: Vec<f64>,
}

impl<'a> Along<'a> {
    fn new(phase: &'a Phase, trajectory: &'a PhaseTrajectory, parameters: &'a [f64]) -> Self {
        let inputs = vec![0.0; phase.states.len() + phase.controls.len() + parameters.len() + 1];
        Self { phase, trajectory, parameters, inputs }
    }

    /// Value of a function at time `t` of interval `k`.
    fn value(&mut self, function: &dyn NodeFunction, k: usize, t: f64, out: &mut [f64]) {
        let inputs = &mut self.inputs[..function.inputs()];
        let (x, rest) = inputs.split_at_mut(self.phase.states.len());
        let (u, rest) = rest.split_at_mut(self.phase.controls.len());
        self.trajectory.state.evaluate_in(k, t, x);
        self.trajectory.control.evaluate_in(k, t, u);
        // What is left are all parameters or none, then the time.
        let count = rest.len() - 1;
        rest[..count].copy_from_slice(&self.parameters[..count]);
        rest[count] = t;
        function.value(inputs, out);
    }
}

fn phase_errors(
    ocp: &Ocp,
    scaling: &Scaling,
    settings: &RadauSettings,
    trajectory: &Trajectory,
    k: usize,
) -> Result<Vec<f64>, RadauError> {
    let (phase, p) = (&ocp.phases[k], &trajectory.phases[k]);
    let mut along = Along::new(phase, p, &trajectory.parameters);
    let size = state_sizes(&scaling.phases[k].states, p);
    let mut errors = vec![0.0_f64; p.mesh.intervals()];
    for (k, error) in errors.iter_mut().enumerate() {
        raise(error, state_error(&mut along, &size, k)?);
    }
    for (number, q) in phase.integrals.iter().enumerate() {
        let (fine, coarse) = quadratures(&mut along, q.function.as_ref())?;
        // What states and controls within the tolerance leave of a sum of squares is no error.
        let left = share_of_integral(ocp, trajectory, scaling, [k, number], settings.tolerance);
        let left = if left.is_finite() { left / settings.tolerance } else { 0.0 };
        let total = fine.iter().map(|v| v.abs()).sum::<f64>().max(q.variable.scale.unwrap_or(left));
        for ((error, a), b) in errors.iter_mut().zip(&fine).zip(&coarse) {
            raise(error, if total > 0.0 { (a - b).abs() / total } else { 0.0 });
        }
    }
    Ok(errors)
}

/// The larger of two errors; a NaN counts as largest.
fn raise(error: &mut f64, found: f64) {
    *error = if found <= *error { *error } else { found };
}

/// Largest excess of bounds and path rows in an interval, relative to their scales.
#[derive(Clone, Copy, Default)]
struct Excess {
    /// The error of states and of rows without controls.
    of_states: f64,
    /// The excess of rows in the two intervals beside their touch points, which a better place of these removes first.
    beside_touch: f64,
    /// The excess of bounds on controls and of path constraints with controls, equalities among them.
    of_controls: f64,
}

/// The excess in each interval half way between neighbouring nodes: there a polynomial strays farthest. That of controls is
/// looked at where switches are located, and at both ends of the interval too: the control has no node at the end, and along an arc
/// that has left its bounds out the node at the start may be beyond them.
fn excesses(
    phase: &Phase,
    scales: &PhaseScaling,
    parameters: &[f64],
    p: &PhaseTrajectory,
    with_controls: bool,
) -> Vec<Excess> {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let mut along = Along::new(phase, p, parameters);
    let (mut x, mut u) = (vec![0.0; nx], vec![0.0; nu]);
    let mut rows = vec![0.0; phase.path.iter().map(|c| c.rows.len()).max().unwrap_or(0)];
    let has_control =
        |c: &PathConstraint| c.function.pattern().columns.iter().any(|i| (nx..nx + nu).contains(i));
    let firsts = phase.path.iter().scan(0, |next, c| {
        let first = *next;
        *next += c.rows.len();
        Some((first, c))
    });
    let (with, without): (Vec<_>, Vec<_>) = firsts.partition(|(_, c)| has_control(c));
    let mut excesses = vec![Excess::default(); p.mesh.intervals()];
    for (k, found) in excesses.iter_mut().enumerate() {
        let is_beside_touch =
            |row: usize| p.mesh.touch_points().iter().any(|t| t.row == row && (t.end == k || t.end == k + 1));
        let mut of_rows =
            |constraints: &[(usize, &PathConstraint)], t: f64, found: &mut Excess, of_controls| {
                for (first, c) in constraints {
                    along.value(c.function.as_ref(), k, t, &mut rows[..c.rows.len()]);
                    for ((index, row), v) in (*first..).zip(&c.rows).zip(&rows) {
                        let excess = row.bounds.excess(*v) / row.size().unwrap_or(scales.path[index]);
                        match of_controls {
                            true => raise(&mut found.of_controls, excess),
                            false if is_beside_touch(index) => raise(&mut found.beside_touch, excess),
                            false => raise(&mut found.of_states, excess),
                        }
                    }
                }
            };
        let nodes: Vec<f64> = p.state.node_times(k).collect();
        let middles: Vec<f64> = nodes.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        for &t in &middles {
            p.state.evaluate_in(k, t, &mut x);
            for ((state, v), scale) in phase.states.iter().zip(&x).zip(&scales.states) {
                raise(&mut found.of_states, state.variable.bounds.excess(*v) / scale);
            }
            of_rows(&without, t, found, false);
        }
        if with_controls {
            for t in middles.into_iter().chain(nodes.first().copied()).chain(nodes.last().copied()) {
                p.control.evaluate_in(k, t, &mut u);
                for ((control, v), scale) in phase.controls.iter().zip(&u).zip(&scales.controls) {
                    raise(&mut found.of_controls, control.bounds.excess(*v) / scale);
                }
                of_rows(&with, t, found, true);
            }
        }
    }
    excesses
}

/// A rule with one point more than the collocation of interval `k`.
fn finer_rule(p: &PhaseTrajectory, k: usize) -> Result<Arc<Lgr>, RadauError> {
    Ok(Lgr::shared((p.mesh.points()[k] + 1).min(apsides_basis::MAX_POINTS))?)
}

fn state_error(along: &mut Along<'_>, size: &[f64], k: usize) -> Result<f64, RadauError> {
    let p = along.trajectory;
    let nx = size.len();
    let rule = finer_rule(p, k)?;
    let m = rule.points();
    let (start, end) = (p.state.breaks()[k], p.state.breaks()[k + 1]);
    let half = 0.5 * (end - start);
    let time = |tau: f64| start + half * (tau + 1.0);
    let mut f = vec![0.0; m * nx];
    let dynamics = Arc::clone(&along.phase.dynamics);
    for (&tau, row) in rule.nodes().iter().zip(f.chunks_mut(nx)) {
        along.value(dynamics.as_ref(), k, time(tau), row);
    }
    let (mut x0, mut x) = (vec![0.0; nx], vec![0.0; nx]);
    p.state.evaluate_in(k, start, &mut x0);
    let mut worst = 0.0_f64;
    for (j, &tau) in rule.support()[1..].iter().enumerate() {
        p.state.evaluate_in(k, time(tau), &mut x);
        let row = &rule.integration()[j * m..(j + 1) * m];
        for s in 0..nx {
            let sum: f64 = row.iter().enumerate().map(|(l, a)| a * f[l * nx + s]).sum();
            let e = (x0[s] + half * sum - x[s]).abs() / size[s];
            worst = if e <= worst { worst } else { e };
        }
    }
    Ok(worst)
}

/// The integral of each interval by a finer rule and by the rule of the collocation.
fn quadratures(
    along: &mut Along<'_>,
    function: &dyn NodeFunction,
) -> Result<(Vec<f64>, Vec<f64>), RadauError> {
    let p = along.trajectory;
    let mut integrate = |rule: &Lgr, k: usize| {
        let (start, end) = (p.state.breaks()[k], p.state.breaks()[k + 1]);
        let half = 0.5 * (end - start);
        let mut g = [0.0];
        let mut sum = 0.0;
        for (tau, w) in rule.nodes().iter().zip(rule.weights()) {
            along.value(function, k, start + half * (tau + 1.0), &mut g);
            sum += half * w * g[0];
        }
        sum
    };
    let (mut fine, mut coarse) = (Vec::new(), Vec::new());
    for (k, &n) in p.mesh.points().iter().enumerate() {
        fine.push(integrate(finer_rule(p, k)?.as_ref(), k));
        coarse.push(integrate(Lgr::shared(n)?.as_ref(), k));
    }
    Ok((fine, coarse))
}

fn state_sizes(scales: &[f64], p: &PhaseTrajectory) -> Vec<f64> {
    let mut size = scales.to_vec();
    for segment in p.state.segments() {
        for row in segment.values.chunks(size.len()) {
            for (s, v) in size.iter_mut().zip(row) {
                *s = s.max(v.abs());
            }
        }
    }
    size
}
