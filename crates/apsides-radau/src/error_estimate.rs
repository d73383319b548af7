//! The distance of the polynomials from the equations of motion between the collocation points.
//!
//! In each interval of `N` points the state and control are interpolated to a Radau rule of `N + 1` points, the rates
//! there are integrated, and the result is compared with the interpolated state (Patterson, Hager, Rao 2015, eqs. 24 to 27,
//! doi 10.1002/oca.2114). Integrals are compared the same way: by the finer rule and by that of the collocation.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_basis::Lgr;
use apsides_ocp::curvature::share_of_integral;
use apsides_ocp::{Ocp, PhaseTrajectory, Scaling, Trajectory};

use crate::RadauError;
use crate::along::Along;
use crate::excess::{excesses, raise};
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
            excesses(phase, &scaling.phases[k], parameters, &trajectory.phases[k], settings.switches)?;
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

fn phase_errors(
    ocp: &Ocp,
    scaling: &Scaling,
    settings: &RadauSettings,
    trajectory: &Trajectory,
    k: usize,
) -> Result<Vec<f64>, RadauError> {
    let (phase, p) = (&ocp.phases[k], &trajectory.phases[k]);
    let mut fine = Along::new(phase, p, &trajectory.parameters, |k| Ok(finer_rule(p, k)?.support().to_vec()));
    let mut coarse = Along::new(phase, p, &trajectory.parameters, |k| Ok(rule(p, k)?.nodes().to_vec()));
    let size = state_sizes(&scaling.phases[k].states, p);
    let mut errors = vec![0.0_f64; p.mesh.intervals()];
    // Per integral and interval, by the finer rule and by that of the collocation.
    let mut integrals = vec![[const { Vec::new() }; 2]; phase.integrals.len()];
    let mut values = Vec::new();
    for (k, error) in errors.iter_mut().enumerate() {
        fine.go(k)?;
        let (finer, own) = (finer_rule(p, k)?, rule(p, k)?);
        values.resize(finer.points() * size.len(), 0.0);
        fine.values(phase.dynamics.as_ref(), &mut values);
        raise(error, state_error(&fine, &finer, &values, &size));
        if !phase.integrals.is_empty() {
            coarse.go(k)?;
        }
        for (q, [by_finer, by_own]) in phase.integrals.iter().zip(&mut integrals) {
            by_finer.push(integral(&mut fine, &finer, q.function.as_ref(), &mut values));
            by_own.push(integral(&mut coarse, &own, q.function.as_ref(), &mut values));
        }
    }
    for ((number, q), [fine, coarse]) in phase.integrals.iter().enumerate().zip(&integrals) {
        // What states and controls within the tolerance leave of a sum of squares is no error.
        let left = share_of_integral(ocp, trajectory, scaling, [k, number], settings.tolerance);
        let left = if left.is_finite() { left / settings.tolerance } else { 0.0 };
        let total = fine.iter().map(|v: &f64| v.abs()).sum::<f64>().max(q.variable.scale.unwrap_or(left));
        for ((error, a), b) in errors.iter_mut().zip(fine).zip(coarse) {
            raise(error, if total > 0.0 { (a - b).abs() / total } else { 0.0 });
        }
    }
    Ok(errors)
}

/// The rule of the collocation of interval `k`.
fn rule(p: &PhaseTrajectory, k: usize) -> Result<Arc<Lgr>, RadauError> {
    Ok(Lgr::shared(p.mesh.points()[k])?)
}

/// A rule with one point more.
fn finer_rule(p: &PhaseTrajectory, k: usize) -> Result<Arc<Lgr>, RadauError> {
    Ok(Lgr::shared((p.mesh.points()[k] + 1).min(apsides_basis::MAX_POINTS))?)
}

/// The largest distance of the states from the integrals of their rates `f`, at the support points of the finer rule.
fn state_error<P: Fn(usize) -> Result<Vec<f64>, RadauError>>(
    along: &Along<'_, P>,
    rule: &Lgr,
    f: &[f64],
    size: &[f64],
) -> f64 {
    let (m, nx) = (rule.points(), size.len());
    let (x0, later) = along.states().split_at(nx);
    let mut worst = 0.0_f64;
    for (row, x) in rule.integration().chunks_exact(m).zip(later.chunks_exact(nx.max(1))) {
        for s in 0..nx {
            let sum: f64 = row.iter().enumerate().map(|(l, a)| a * f[l * nx + s]).sum();
            raise(&mut worst, (x0[s] + along.half() * sum - x[s]).abs() / size[s]);
        }
    }
    worst
}

/// The integral of an interval by a rule whose nodes are the first points of `along`.
fn integral<P: Fn(usize) -> Result<Vec<f64>, RadauError>>(
    along: &mut Along<'_, P>,
    rule: &Lgr,
    function: &dyn NodeFunction,
    values: &mut Vec<f64>,
) -> f64 {
    values.resize(rule.points(), 0.0);
    along.values(function, values);
    rule.weights().iter().zip(&*values).map(|(w, g)| along.half() * w * g).sum()
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
