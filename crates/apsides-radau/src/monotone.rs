//! Bounds of states that only grow or only fall, such as the mass of a vehicle.
//!
//! Such a state keeps its lower bound along a phase if it does at one end. Stated along the phase all the same, the bound is active at every
//! point after the state has come to it, while nothing happens: its multipliers are not unique, and the controls there seem to follow from
//! it. Then it is better stated for that end.

use apsides_ocp::{Bounds, Ocp, Phase, State, Variable};

/// Part of the size of a state by which its bound along a phase is moved away: the equations of motion may have no values far beyond it.
const ROOM: f64 = 0.2;

/// The way of a state whatever the controls do between their bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trend {
    /// It never falls.
    Grows,
    /// It never grows.
    Falls,
}

/// The ways of the states of a phase; none for those that may go both.
pub(crate) fn trends(ocp: &Ocp, phase: &Phase) -> Vec<Option<Trend>> {
    let unknown = vec![None; phase.states.len()];
    let Ok(motion) = phase.dynamics.formula() else { return unknown };
    let variables = phase.states.iter().map(|s| &s.variable).chain(&phase.controls);
    let range = |v: &Variable| [v.bounds.lower, v.bounds.upper];
    let mut inputs: Vec<[f64; 2]> = variables.map(range).collect();
    if motion.inputs() > inputs.len() + 1 {
        inputs.extend(ocp.parameters.iter().map(range));
    }
    inputs.push([phase.initial_time.lower, phase.final_time.upper]);
    if inputs.len() != motion.inputs() {
        return unknown;
    }
    let trend = |[least, largest]: [f64; 2]| match (least >= 0.0, largest <= 0.0) {
        (true, _) => Some(Trend::Grows),
        (_, true) => Some(Trend::Falls),
        _ => None,
    };
    motion.enclosure(&inputs).into_iter().map(trend).collect()
}

/// States the bounds of a state along a phase for the ends that are closest to them; its size stays.
pub(crate) fn bound_at_ends(state: &mut State, trend: Trend, scale: f64) {
    let along = state.variable.bounds;
    let (at_lower, at_upper) = match trend {
        Trend::Falls => (&mut state.terminal, &mut state.initial),
        Trend::Grows => (&mut state.initial, &mut state.terminal),
    };
    *at_lower = at_lower.intersect(&Bounds::at_least(along.lower));
    *at_upper = at_upper.intersect(&Bounds::at_most(along.upper));
    let room = ROOM * scale;
    state.variable.bounds = Bounds::new(along.lower - room, along.upper + room);
    state.variable.scale = Some(scale);
}
