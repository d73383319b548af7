//! The distance of the costates from their differential equation.
//!
//! States converge faster than costates: where they are accurate, the costates of a coarse mesh may still be wrong by more than a
//! test of optimality allows. Over each interval `lambda' = -dL/dx` is integrated by a Radau rule of one point more and compared with the
//! costate, as the equations of motion are in [`error_estimate`](crate::error_estimate) (Patterson, Hager, Rao 2015, doi
//! 10.1002/oca.2114). Intervals in which a bound on a state or a path constraint without controls is active are left out, since what the
//! bound adds to the costate is not a matter of more points, and those beside kinks. Along an arc that holds such a constraint at its bound from
//! end to end the multiplier is smooth; where it is of first order it is as accurate as the costates, so that its intervals count.

use std::ops::Range;

use apsides_basis::Lgr;
use apsides_ocp::curvature::rounding_of_costates;
use apsides_ocp::{
    LagrangianSlope, Ocp, Phase, PhaseMesh, PhaseScaling, PhaseTrajectory, Scaling, Trajectory,
};

use crate::RadauError;
use crate::boundary_arcs::holds_with_first_rate;
use crate::junction::{Junction, junctions, slopes_by_states};
use crate::settings::RadauSettings;

/// A state closer to its bound than this part of its scale is at it.
const AT_BOUND: f64 = 1e-6;
/// A multiplier whose integral over an interval is below this part of the largest costate is what a barrier leaves.
const PUSHES: f64 = 1e-6;

/// Most meshes of a solve for the sake of its costates.
const MOST_MESHES: usize = 3;
/// Part of the error that such a mesh must leave at most for another one.
const GAIN: f64 = 0.9;
/// Such meshes in a row that may not help: the ends of arcs along bounds move by more than the errors fall.
const MOST_WITHOUT_GAIN: usize = 1;
/// Part of the tolerance that an interval keeps when the mesh is refined: what one is rid of comes to stand in those before it.
const SHARE: f64 = 0.2;

/// Error of a mesh up to which its costates tell how many points they need.
pub(crate) const TELLING: f64 = 1e-2;

/// Meshes for the sake of the costates alone.
#[derive(Default)]
pub(crate) struct CostateMeshes {
    made: usize,
    /// Largest error of the last one.
    error: Option<f64>,
    /// Meshes in a row that did not help.
    without_gain: usize,
    /// Largest error of the last mesh for the sake of the states.
    foreseen: Option<f64>,
}

/// The remedy for inaccurate costates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CostateRemedy {
    /// They are accurate, or nothing helps.
    Nothing,
    /// The exact solution on the same mesh: what a barrier leaves at bounds that are close and not active is no error of the mesh.
    ExactSolution,
    /// Another mesh.
    Mesh,
}

impl CostateRemedy {
    /// This one, or else the exact solution if that is wanted.
    pub(crate) fn or_exact(self, is_wanted: bool) -> Self {
        if self == Self::Nothing && is_wanted { Self::ExactSolution } else { self }
    }
}

impl CostateMeshes {
    /// The remedy for costates of a solution, which is the exact one of its mesh or not; for another mesh the errors of the intervals with
    /// inaccurate costates are raised.
    pub(crate) fn remedy(
        &mut self,
        ocp: &Ocp,
        scaling: &Scaling,
        settings: &RadauSettings,
        is_exact: bool,
        trajectory: &mut Trajectory,
    ) -> Result<CostateRemedy, RadauError> {
        if self.made == MOST_MESHES && is_exact || settings.costate_tolerance.is_infinite() {
            return Ok(CostateRemedy::Nothing);
        }
        let errors = costate_errors(ocp, scaling, trajectory)?;
        let largest = largest_of(&errors);
        if largest <= settings.costate_tolerance {
            return Ok(CostateRemedy::Nothing);
        }
        if !is_exact {
            return Ok(CostateRemedy::ExactSolution);
        }
        let helped = self.error.is_none_or(|before| largest < GAIN * before);
        self.without_gain = if helped { 0 } else { self.without_gain + 1 };
        if self.made == MOST_MESHES || self.without_gain > MOST_WITHOUT_GAIN {
            return Ok(CostateRemedy::Nothing);
        }
        (self.error, self.made) = (Some(largest), self.made + 1);
        raise(trajectory, errors, settings.tolerance / (SHARE * settings.costate_tolerance));
        Ok(CostateRemedy::Mesh)
    }

    /// Raises the errors of intervals whose costates are farther from their tolerance than the states from theirs, as long as that helps: the
    /// mesh that follows is made for both, where the states alone ask for it.
    pub(crate) fn foresee(
        &mut self,
        ocp: &Ocp,
        scaling: &Scaling,
        settings: &RadauSettings,
        trajectory: &mut Trajectory,
    ) -> Result<(), RadauError> {
        if settings.costate_tolerance.is_infinite() {
            return Ok(());
        }
        let errors = costate_errors(ocp, scaling, trajectory)?;
        let largest = largest_of(&errors);
        let helped = self.foreseen.is_none_or(|before| largest < GAIN * before);
        self.foreseen = Some(largest);
        if helped {
            raise(trajectory, errors, settings.tolerance / settings.costate_tolerance);
        }
        Ok(())
    }
}

fn largest_of(errors: &[Vec<f64>]) -> f64 {
    errors.iter().flatten().copied().fold(0.0, f64::max)
}

fn raise(trajectory: &mut Trajectory, errors: Vec<Vec<f64>>, weight: f64) {
    for (phase, errors) in trajectory.phases.iter_mut().zip(errors) {
        for (known, error) in phase.interval_errors.iter_mut().zip(errors) {
            *known = known.max(weight * error);
        }
    }
}

/// Per phase and interval, the largest relative error of the costates; zero where they are not known, or constrained.
fn costate_errors(
    ocp: &Ocp,
    scaling: &Scaling,
    trajectory: &Trajectory,
) -> Result<Vec<Vec<f64>>, RadauError> {
    let phases = ocp.phases.iter().zip(&trajectory.phases).zip(&scaling.phases).enumerate();
    let rounding = rounding_of_costates(ocp, trajectory, scaling);
    phases
        .map(|(k, ((phase, found), scaling))| {
            let lagrangian = LagrangianSlope::new(ocp, k, found, &trajectory.parameters);
            Slopes { phase, found, lagrangian, rounding }.errors(scaling, &trajectory.parameters)
        })
        .collect()
}

/// The intervals of the arc along a bound that begins or ends at a junction, and the one on the other side.
fn beside(mesh: &PhaseMesh, junction: &Junction) -> Range<usize> {
    let arc = mesh.breaks().iter().take_while(|b| b.end < junction.end).count();
    if junction.is_entry {
        junction.end - 1..mesh.arc_intervals(arc + 1).end
    } else {
        mesh.arc_intervals(arc).start..junction.end + 1
    }
}

/// The costates of a phase, and the slope that their differential equation has.
struct Slopes<'a> {
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    lagrangian: LagrangianSlope<'a>,
    /// Costates of this size, times the scales of their states, are rounding.
    rounding: f64,
}

impl Slopes<'_> {
    fn errors(mut self, scaling: &PhaseScaling, parameters: &[f64]) -> Result<Vec<f64>, RadauError> {
        let intervals = self.found.mesh.intervals();
        let Some(costate) = &self.found.costate else { return Ok(vec![0.0; intervals]) };
        let nx = self.phase.states.len();
        let rows = costate.segments().iter().flat_map(|s| s.values.chunks(nx));
        let sizes = rows.flat_map(|row| row.iter().zip(&scaling.states).map(|(l, s)| (l * s).abs()));
        let largest = sizes.fold(self.rounding, f64::max);
        let mut errors = vec![0.0; intervals];
        if largest > 0.0 && largest.is_finite() {
            for (k, error) in errors.iter_mut().enumerate() {
                if !self.is_constrained(k, scaling, largest) {
                    *error = self.error(k, &scaling.states)? / largest;
                }
            }
            for junction in junctions(self.phase, &self.found.mesh) {
                let jump = self.jump(&junction, &scaling.states, parameters) / largest;
                // The time of a junction is as exact as the arc along the bound, and what is beside it.
                for k in beside(&self.found.mesh, &junction) {
                    errors[k] = errors[k].max(jump);
                }
            }
        }
        Ok(errors)
    }

    /// Returns true if a bound on a state or a path constraint without controls is active in interval `k`, ends of the phase apart, or a
    /// kink at its end;
    /// `size` is that of the costates, in the unit of the objective.
    fn is_constrained(&self, k: usize, scaling: &PhaseScaling, size: f64) -> bool {
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        // At a kink the slope is that of either side.
        if self.found.mesh.crossings().iter().any(|c| c.end == k || c.end == k + 1) {
            return true;
        }
        let breaks = self.found.state.breaks();
        let (first, last) = (breaks[0], breaks[breaks.len() - 1]);
        let mut x = vec![0.0; nx];
        for t in self.found.state.node_times(k).filter(|t| *t > first && *t < last) {
            self.found.state.evaluate_in(k, t, &mut x);
            let states = self.phase.states.iter().zip(&x).zip(&scaling.states);
            for ((state, value), scale) in states {
                let bounds = state.variable.bounds;
                if (bounds.upper - value).min(value - bounds.lower) <= AT_BOUND * scale {
                    return true;
                }
            }
        }
        let Some(path) = &self.found.path_multipliers else { return false };
        let duration = breaks[k + 1] - breaks[k];
        let mut row = 0..;
        let limits = self.phase.path.iter().flat_map(|c| {
            let with_control = c.function.pattern().columns.iter().any(|i| (nx..nx + nu).contains(i));
            let rows: Vec<f64> = (row.by_ref().take(c.rows.len()))
                .map(|row| {
                    let is_smooth =
                        with_control || holds_with_first_rate(self.phase, &self.found.mesh, k, row);
                    if is_smooth { f64::INFINITY } else { PUSHES * size / duration }
                })
                .collect();
            rows
        });
        let limits: Vec<f64> = limits.zip(&scaling.path).map(|(limit, scale)| limit / scale).collect();
        let values = path.segments()[k].values.chunks(limits.len().max(1));
        values.flat_map(|row| row.iter().zip(&limits)).any(|(m, limit)| m.abs() > *limit)
    }

    /// The largest jump of the costates at a junction without that of its contact, in the unit of the objective: at an optimum there is none.
    fn jump(&self, junction: &Junction, scales: &[f64], parameters: &[f64]) -> f64 {
        let Some(costate) = &self.found.costate else { return 0.0 };
        let (nx, end) = (scales.len(), junction.end);
        let time = costate.breaks()[end];
        let (mut before, mut after, mut state) = (vec![0.0; nx], vec![0.0; nx], vec![0.0; nx]);
        costate.evaluate_in(end - 1, time, &mut before);
        costate.evaluate_in(end, time, &mut after);
        self.found.state.evaluate_in(end, time, &mut state);
        let slopes = slopes_by_states(self.phase, junction.row, (&state, parameters, time));
        let contact = self.found.contacts.iter().find(|c| c.end == end && c.row == junction.row);
        let multiplier = contact.map_or(0.0, |c| c.multiplier);
        after.iter_mut().zip(slopes).for_each(|(l, slope)| *l += multiplier * slope);
        let jumps = before.iter().zip(&after).zip(scales).map(|((a, b), s)| ((a - b) * s).abs());
        jumps.fold(0.0, f64::max)
    }

    /// The largest difference in interval `k`, in the unit of the objective.
    fn error(&mut self, k: usize, scales: &[f64]) -> Result<f64, RadauError> {
        let Some(costate) = &self.found.costate else { return Ok(0.0) };
        let nx = scales.len();
        let rule = Lgr::shared((self.found.mesh.points()[k] + 1).min(apsides_basis::MAX_POINTS))?;
        let m = rule.points();
        let (start, end) = (costate.breaks()[k], costate.breaks()[k + 1]);
        let half = 0.5 * (end - start);
        let time = |tau: f64| start + half * (tau + 1.0);
        let mut slopes = vec![0.0; m * nx];
        for (&tau, slope) in rule.nodes().iter().zip(slopes.chunks_mut(nx)) {
            self.lagrangian.add(k, time(tau), slope);
        }
        let (mut first, mut stated) = (vec![0.0; nx], vec![0.0; nx]);
        costate.evaluate_in(k, start, &mut first);
        // Elsewhere the start of the next interval, so that the costate is one continuous solution.
        let jumps =
            k + 1 == self.found.mesh.intervals() || self.found.contacts.iter().any(|c| c.end == k + 1);
        let mut worst = 0.0_f64;
        for (j, &tau) in rule.support()[1..].iter().enumerate() {
            let own = tau < 1.0 || jumps;
            costate.evaluate_in(if own { k } else { k + 1 }, time(tau), &mut stated);
            let weights = &rule.integration()[j * m..(j + 1) * m];
            for s in 0..nx {
                let sum: f64 = weights.iter().enumerate().map(|(l, w)| w * slopes[l * nx + s]).sum();
                worst = worst.max(((first[s] - half * sum - stated[s]) * scales[s]).abs());
            }
        }
        Ok(worst)
    }
}
