//! The worth of what a trajectory misses: to first order the objective gains by each miss times its multiplier.
//!
//! ```text
//! sum over phases | lambda(tf) . (flown - stated)(tf) - lambda(t0) . (flown - stated)(t0) |      equations of motion
//! + sum over jumps |lambda . jump|                                                               of what is flown in pieces
//! + sum over fixed ends |lambda . miss| + integral of |mu . excess| dt + |nu . excess|           ends, path, integrals, constraints
//! ```
//!
//! It is small wherever multipliers are. Where a constraint can only just be met they grow without bound, and what a tolerance allows moves the
//! objective by more than its own tolerance (D. G. Luenberger, Y. Ye, Linear and Nonlinear Programming, Springer 2008, section 11.7: sensitivity).

use apsides_ocp::{Ocp, Trajectory};

use super::{KIND, NO_OBJECTIVE, PhaseConditions};
use crate::Check;
use crate::boundary::Boundary;
use crate::ends::Ends;
use crate::simulation::Flight;
use crate::worst::violation;

/// Samples over each node of an interval at which excesses of path constraints are looked at.
const SAMPLES_PER_NODE: usize = 4;

/// Name of the check.
const WORTH: &str = "worth of what is missed";

/// A part of the worth, and its place in words.
type Worth = (f64, String);

/// The check of a trajectory with its multipliers, stated or found, and of the flights made from it.
pub(crate) fn check(
    boundary: &Boundary<'_>,
    trajectory: &Trajectory,
    conditions: &mut [PhaseConditions<'_>],
) -> Check {
    let Boundary { ocp, flights, settings, .. } = boundary;
    let mut parts: Vec<Worth> = Vec::new();
    for (phase, flight) in conditions.iter_mut().zip(*flights) {
        phase.worth_of_ends(flight, &mut parts);
        phase.worth_of_path(&mut parts);
    }
    worth_of_constraints(
        ocp,
        &Ends::of(trajectory),
        trajectory.constraint_multipliers.as_deref(),
        &mut parts,
    );
    let total: f64 = parts.iter().map(|(worth, _)| worth).sum();
    let largest = parts.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let at = largest.filter(|(worth, _)| *worth != 0.0).map(|(_, place)| format!("most of it by {place}"));
    let unit = ocp.objective.unit.clone();
    let limit = boundary.objective_limit(settings.worth_tolerance).max(NO_OBJECTIVE);
    Check::new(WORTH, KIND, total, limit, unit, at.unwrap_or_else(|| "nothing is missed".into()))
}

fn worth_of_constraints(ocp: &Ocp, ends: &Ends, multipliers: Option<&[Vec<f64>]>, parts: &mut Vec<Worth>) {
    for (c, multipliers) in ocp.constraints.iter().zip(multipliers.into_iter().flatten()) {
        let values = ends.evaluate(c.function.as_ref(), &c.inputs);
        for ((row, value), multiplier) in c.rows.iter().zip(&values).zip(multipliers) {
            let worth = (multiplier * violation(row.bounds.excess(*value))).abs();
            parts.push((worth, format!("`{}`", row.name)));
        }
    }
}

impl PhaseConditions<'_> {
    fn worth_of_ends(&self, flight: &Flight, parts: &mut Vec<Worth>) {
        let phase = self.equations.phase;
        let stated = [self.found.state_at(self.found.initial_time), self.found.final_state()];
        let flown = [&flight.initial_state, &flight.final_state];
        let mut costates = [vec![0.0; self.equations.nx], vec![0.0; self.equations.nx]];
        self.costate.evaluate(self.found.initial_time, &mut costates[0]);
        self.costate.evaluate(self.found.final_time, &mut costates[1]);
        let (mut of_motion, mut of_pieces) = (0.0, 0.0);
        for (i, state) in phase.states.iter().enumerate() {
            let drift = [0, 1].map(|end| costates[end][i] * (flown[end][i] - stated[end][i]));
            of_motion += drift[1] - drift[0];
            for (end, bounds) in [&state.initial, &state.terminal].into_iter().enumerate() {
                let worth = (costates[end][i] * violation(bounds.excess(stated[end][i]))).abs();
                let which = ["initial", "final"][end];
                parts.push((worth, format!("the {which} {} of phase `{}`", state.variable.name, phase.name)));
            }
        }
        // That at the end counts with the motion.
        for restart in flight.restarts.iter().filter(|restart| restart.time < self.found.final_time) {
            let costate = &mut costates[0];
            self.costate.evaluate(restart.time, costate);
            let worth: f64 = costate.iter().zip(&restart.jump).map(|(costate, jump)| costate * jump).sum();
            of_pieces += worth.abs();
        }
        parts.push((
            of_motion.abs() + of_pieces,
            format!("the equations of motion of phase `{}`", phase.name),
        ));
        let multipliers = self.found.integral_multipliers.iter().flatten();
        for ((integral, value), multiplier) in phase.integrals.iter().zip(&flight.integrals).zip(multipliers)
        {
            let variable = &integral.variable;
            let worth = (multiplier * violation(variable.bounds.excess(*value))).abs();
            parts.push((worth, format!("{} of phase `{}`", variable.name, phase.name)));
        }
    }

    fn worth_of_path(&mut self, parts: &mut Vec<Worth>) {
        let phase = self.equations.phase;
        let rows: Vec<_> = phase.path.iter().flat_map(|p| &p.rows).collect();
        if rows.is_empty() || self.found.path_multipliers.is_none() {
            return;
        }
        let mut values = vec![0.0; rows.len()];
        let mut before: Option<(usize, f64, Vec<f64>)> = None;
        let mut worths = vec![0.0; rows.len()];
        for (segment, time) in self.sample_times(SAMPLES_PER_NODE) {
            self.evaluate_within_bounds(segment, time);
            self.equations.path(&mut values);
            let rates: Vec<f64> = (rows.iter().zip(&values).zip(&self.point.multipliers))
                .map(|((row, value), multiplier)| (multiplier * violation(row.bounds.excess(*value))).abs())
                .collect();
            if let Some((_, start, earlier)) = before.filter(|(of, ..)| *of == segment) {
                for ((worth, a), b) in worths.iter_mut().zip(&earlier).zip(&rates) {
                    *worth += 0.5 * (time - start) * (a + b);
                }
            }
            before = Some((segment, time, rates));
        }
        parts.extend(
            rows.iter()
                .zip(worths)
                .map(|(row, worth)| (worth, format!("`{}` along phase `{}`", row.name, phase.name))),
        );
    }
}
