//! Bounds of states, at which a solution stays or that it touches, as path constraints of the same problem.
//!
//! The multiplier of a bound of a state is a density along arcs and an impulse where the state touches it, as that of a path constraint
//! without controls. So the arcs and contacts of both are found and followed in the same way. The end of a phase is no collocation point: what
//! is at a bound there, or beyond, becomes a constraint of the end. So does the bound of a state that cannot come back from it.

use apsides_ad::{FormulaBuilder, formula_node};
use apsides_nlp::SolveReport;
use apsides_ocp::{
    Bounds, Mesh, Ocp, PathConstraint, PathEnd, PathEnds, Phase, PhaseMesh, Scaling, Trajectory, Variable,
};

use crate::activity::{Class, OSCILLATION, Solution, samples};
use crate::junction::order_of;
use crate::monotone::{bound_at_ends, trends};
use crate::quantity::{Quantity, QuantityKind};
use crate::transcription::Transcription;

/// A row closer to a bound than this part of its scale is at it at the end of its phase.
const AT_END: f64 = 1e-6;

/// Change of the objective, relative to its scale, by a bound that moved by the whole range of its state: with less the state is close to the
/// bound by itself, as beside a fixed start there, and the multipliers are those of the barrier.
const LEAST_PRESSURE: f64 = 1e-4;

/// A problem with bounds of some of its states as path constraints.
pub(crate) struct StateRows {
    pub(crate) ocp: Ocp,
    /// Per phase, the number of rows of the problem as it was posed.
    stated_rows: Vec<usize>,
    ends: PathEnds,
}

impl StateRows {
    /// The problem with rows for the states that are at a bound between the ends of their phase; none if there are none.
    pub(crate) fn of(
        ocp: &Ocp,
        nlp: &Transcription,
        report: &SolveReport,
        trajectory: &Trajectory,
        scaling: &Scaling,
    ) -> Option<Self> {
        let solution =
            Solution { report, curvatures: &[], row_bends: &[], objective: nlp.scales.objective.abs() };
        let mut with_rows = ocp.clone();
        let mut any = false;
        for (k, phase) in ocp.phases.iter().enumerate() {
            let (p, t) = (&nlp.layout.phases[k], &trajectory.phases[k]);
            let scales = &scaling.phases[k].states;
            let is_met = |s: &usize| {
                let variable = &phase.states[*s].variable;
                let Some(q) = Quantity::new(QuantityKind::State(*s), variable, false) else { return false };
                // Without a control near by it can be met in instants alone.
                let q = match order_of(phase, vec![*s]) {
                    Some(order) => q.held_by(phase, order),
                    None => q,
                };
                let (samples, _) = samples(&q, p, t, &solution);
                let inner = samples.get(..samples.len().saturating_sub(1)).unwrap_or_default();
                let mut at_bound = inner.iter().filter(|s| is_stated(variable, s.class));
                let multiplier =
                    |column: usize| report.lower_multipliers[column] + report.upper_multipliers[column];
                let pressed: f64 = at_bound.clone().map(|n| multiplier(p.state_column(n.node) + s)).sum();
                pressed * q.range(p, report) >= LEAST_PRESSURE * solution.objective
                    && at_bound.any(|s| s.slope.abs() >= OSCILLATION)
            };
            let met: Vec<usize> = (0..phase.states.len()).filter(is_met).collect();
            if met.is_empty() {
                continue;
            }
            any = true;
            let trends = trends(ocp, phase);
            let (at_ends, along): (Vec<usize>, Vec<usize>) =
                met.into_iter().partition(|s| trends[*s].is_some());
            for s in at_ends {
                let state = &mut with_rows.phases[k].states[s];
                trends[s].into_iter().for_each(|trend| bound_at_ends(state, trend, scales[s]));
            }
            add_rows(&mut with_rows.phases[k], &along, scales);
        }
        let stated_rows = ocp.phases.iter().map(Phase::path_rows).collect();
        let at_ends = rows_at_ends(ocp, trajectory, scaling);
        any |= !at_ends.is_empty();
        let ends = PathEnds::new(&with_rows, &at_ends);
        any.then(|| Self { ocp: ends.ocp.clone(), stated_rows, ends })
    }

    /// The trajectory as one of the problem as it was posed: without what the rows of states have.
    pub(crate) fn as_posed(&self, trajectory: Trajectory) -> Trajectory {
        let mut trajectory = self.ends.as_posed(trajectory);
        for ((t, phase), &rows) in trajectory.phases.iter_mut().zip(&self.ocp.phases).zip(&self.stated_rows) {
            if phase.path_rows() == rows {
                continue;
            }
            t.contacts.retain(|c| c.row < rows);
            t.mesh = t.mesh.clone().without_arcs();
            let stated = t.path_multipliers.take().filter(|_| rows > 0);
            t.path_multipliers =
                stated.map(|m| m.map_nodes(rows, |all, first| first.copy_from_slice(&all[..rows])));
        }
        trajectory
    }
}

/// The rows without controls that are at a bound at the end of their phase, or beyond, which the states there do not imply.
fn rows_at_ends(ocp: &Ocp, trajectory: &Trajectory, scaling: &Scaling) -> Vec<PathEnd> {
    let mut found = Vec::new();
    for (k, (phase, t)) in ocp.phases.iter().zip(&trajectory.phases).enumerate() {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let mut row = 0;
        for path in &phase.path {
            let pattern = path.function.pattern();
            let mut z = vec![0.0; path.function.inputs()];
            let time = z.len() - 1;
            z[..nx].copy_from_slice(&t.final_state());
            z[nx + nu..time].copy_from_slice(&trajectory.parameters[..time - nx - nu]);
            z[time] = t.final_time;
            let mut values = vec![0.0; path.function.outputs()];
            path.function.value(&z, &mut values);
            for (output, variable) in path.rows.iter().enumerate() {
                let columns = &pattern.columns[pattern.row_offsets[output]..pattern.row_offsets[output + 1]];
                let has_control = columns.iter().any(|c| (nx..nx + nu).contains(c));
                let is_fixed = |c: &usize| match phase.states.get(*c) {
                    Some(state) => state.terminal.is_fixed(),
                    None => *c == time && phase.final_time.is_fixed(),
                };
                let scale = variable.size().unwrap_or(scaling.phases[k].path[row]);
                let is_met = variable.bounds.excess(values[output]) >= -AT_END * scale;
                if !has_control && is_met && !columns.iter().all(is_fixed) {
                    found.push(PathEnd { phase: k, row, is_final: true });
                }
                row += 1;
            }
        }
    }
    found
}

/// A mesh whose phases with rows of states have no arcs.
pub(crate) fn without_arcs(mesh: Mesh) -> Mesh {
    Mesh { phases: mesh.phases.into_iter().map(PhaseMesh::without_arcs).collect() }
}

/// Says whether a state is at a bound that is no guard.
fn is_stated(variable: &Variable, class: Class) -> bool {
    match class {
        Class::Lower => !variable.guards[0],
        Class::Upper => !variable.guards[1],
        Class::Between => false,
    }
}

/// Turns the bounds of states along a phase into rows; those at the ends stay.
fn add_rows(phase: &mut Phase, states: &[usize], scales: &[f64]) {
    if states.is_empty() {
        return;
    }
    let mut builder = FormulaBuilder::new(phase.states.len() + phase.controls.len() + 1);
    let outputs: Vec<_> = states.iter().map(|s| builder.input(*s)).collect();
    let Ok(formula) = builder.formula(&outputs) else { return };
    let mut rows = Vec::new();
    for &s in states {
        let state = &mut phase.states[s];
        let along = std::mem::replace(&mut state.variable.bounds, Bounds::FREE);
        state.variable.scale = Some(scales[s]);
        (state.initial, state.terminal) = (state.initial.intersect(&along), state.terminal.intersect(&along));
        rows.push(Variable { bounds: along, ..state.variable.clone() });
    }
    phase.path.push(PathConstraint { rows, function: formula_node(formula) });
}
