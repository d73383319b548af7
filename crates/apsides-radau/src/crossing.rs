//! Crossings: instants at which a state passes a value where the equations have a kink.
//!
//! A polynomial across a kink converges slowly and makes the mesh fine there. An interval end at the kink restores the order; its time is an
//! unknown, and the state has its value there. Where the rates are continuous, the costates are too. Where they jump, the node at the interval
//! end belongs to what is behind it, and the multiplier of the value is the jump of the costate.

use apsides_ocp::explicit_time::behind;
use apsides_ocp::{Guess, Kink, Mesh, Ocp, Phase, PhaseGuess, PhaseTrajectory, Trajectory};

use crate::RadauError;
use crate::activity::COLLAPSED;
use crate::breaks::{Instants, Passage, with_instants};

/// Most meshes for the sake of crossings.
const MOST_MOVES: usize = 6;

/// Halvings of an interval of time between two samples: to rounding.
const HALVINGS: usize = 60;

/// The crossings of a solve from mesh to mesh.
pub(crate) struct Crossings {
    moves: usize,
}

impl Crossings {
    pub(crate) fn new(enabled: bool) -> Self {
        Self { moves: if enabled { MOST_MOVES } else { 0 } }
    }

    /// Looks for no more crossings.
    pub(crate) fn give_up(&mut self) {
        self.moves = 0;
    }

    /// The crossings of the trajectory, compared with those of its mesh.
    pub(crate) fn step(&mut self, ocp: &Ocp, trajectory: &Trajectory) -> Passages {
        let of_mesh = |t: &PhaseTrajectory| -> Vec<Passage> {
            let passage = |c: &apsides_ocp::Crossing| Passage {
                at: t.mesh.fractions()[c.end],
                kink: c.kink,
                rising: c.rising,
            };
            t.mesh.crossings().iter().map(passage).collect()
        };
        let old: Vec<_> = trajectory.phases.iter().map(of_mesh).collect();
        if self.moves == 0 {
            return Passages { phases: old, settled: true, new: Vec::new() };
        }
        let phases = ocp.phases.iter().zip(&trajectory.phases);
        let found: Vec<_> = phases.map(|(phase, t)| passages(phase, t)).collect();
        let settled = found == old;
        self.moves -= usize::from(!settled);
        let mut new = Vec::new();
        for (phase, ((found, old), t)) in found.iter().zip(&old).zip(&trajectory.phases).enumerate() {
            let interval = |p: &Passage| t.mesh.fractions().partition_point(|f| *f <= p.at) - 1;
            new.extend(found.iter().filter(|p| !old.contains(p)).map(|p| (phase, interval(p))));
        }
        Passages { phases: found, settled, new }
    }
}

/// The crossings of a trajectory.
pub(crate) struct Passages {
    /// Per phase, in order.
    pub(crate) phases: Vec<Vec<Passage>>,
    /// True when the mesh has exactly these.
    pub(crate) settled: bool,
    /// Phase and interval of those that the mesh has not.
    new: Vec<(usize, usize)>,
}

impl Passages {
    /// The trajectory without the errors of intervals with a kink inside: refining them says nothing.
    pub(crate) fn spared(&self, mut trajectory: Trajectory) -> Trajectory {
        for &(phase, interval) in &self.new {
            trajectory.phases[phase].interval_errors[interval] = 0.0;
        }
        trajectory
    }
}

/// The first mesh with a crossing of each kink that a state has to pass, since its ends are on both sides. Kinks of one state only, which
/// are passed in order.
pub(crate) fn with_forced(ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Mesh, RadauError> {
    let phases = ocp.phases.iter().zip(&guess.phases).zip(&mesh.phases);
    let instants = phases.map(|((phase, guess), mesh)| {
        let crossings = if mesh.has_arcs() { Vec::new() } else { forced(phase, guess) };
        Instants { crossings, ..Instants::default() }
    });
    with_instants(mesh, &instants.collect::<Vec<_>>())
}

fn forced(phase: &Phase, guess: &PhaseGuess) -> Vec<Passage> {
    let of_state = |(index, kink): (usize, &Kink)| match *kink {
        Kink::State { state, value } => Some((index, state, value)),
        Kink::Time(_) => None,
    };
    let of_states = || phase.kinks.iter().enumerate().filter_map(of_state);
    let Some(first) = of_states().map(|(_, state, _)| state).min() else { return Vec::new() };
    let (start, end) = (phase.states[first].initial, phase.states[first].terminal);
    let mut x = vec![0.0; phase.states.len()];
    let mut above = |value: f64, at: f64| {
        guess.state(at, &mut x);
        x[first] - value
    };
    let mut found = Vec::new();
    for (index, _, value) in of_states().filter(|(_, state, _)| *state == first) {
        let falls = start.lower > value && end.upper < value;
        let rises = start.upper < value && end.lower > value;
        let first = above(value, 0.0);
        if (falls || rises) && first * above(value, 1.0) < 0.0 {
            let at = zero(&mut |at| above(value, at), 0.0, 1.0, first);
            found.push(Passage { at, kink: index, rising: rises });
        }
    }
    ordered(found)
}

/// The passage of the time over a kink, where it is well within a phase whose ends move.
fn at_time(phase: &Phase, kink: usize, [start, end]: [f64; 2]) -> Option<Passage> {
    let Kink::Time(value) = phase.kinks[kink] else { return None };
    let at = (behind(value) - start) / (end - start);
    (!phase.has_fixed_times() && at > COLLAPSED && at < 1.0 - COLLAPSED).then_some(Passage {
        at,
        kink,
        rising: true,
    })
}

/// The mesh with an interval end at each kink of the time within the phases of a guess: at `all`, or at those that the phases cannot end
/// before. An end that stands where no solution comes to keeps the end of the phase from going back.
pub(crate) fn with_times(ocp: &Ocp, guess: &Guess, mesh: &Mesh, all: bool) -> Result<Mesh, RadauError> {
    let phases = ocp.phases.iter().zip(&guess.phases).zip(&mesh.phases);
    let instants = phases.map(|((phase, guess), mesh)| {
        let times = [guess.initial_time, guess.final_time];
        let kinks = if mesh.has_arcs() { 0..0 } else { 0..phase.kinks.len() };
        let (_, end) = phase.time_bounds();
        let is_passed = |k: &usize| matches!(phase.kinks[*k], Kink::Time(value) if all || value < end.lower);
        Instants {
            crossings: ordered(kinks.filter(is_passed).filter_map(|k| at_time(phase, k, times)).collect()),
            ..Instants::default()
        }
    });
    let instants: Vec<_> = instants.collect();
    if instants.iter().all(|i| i.crossings.is_empty()) {
        return Ok(mesh.clone());
    }
    with_instants(mesh, &instants)
}

/// In order of time, one at a time.
fn ordered(mut passages: Vec<Passage>) -> Vec<Passage> {
    passages.sort_by(|a, b| a.at.total_cmp(&b.at));
    passages.dedup_by(|a, b| b.at + COLLAPSED >= a.at);
    passages
}

/// The passages of states over kinks; a crossing of the mesh keeps its place.
fn passages(phase: &Phase, t: &PhaseTrajectory) -> Vec<Passage> {
    let (mut found, mut x): (Vec<Passage>, _) = (Vec::new(), vec![0.0; phase.states.len()]);
    if phase.kinks.is_empty() {
        return found;
    }
    for (kink, k) in phase.kinks.iter().enumerate() {
        let known: Vec<f64> =
            t.mesh.crossings().iter().filter(|c| c.kink == kink).map(|c| t.mesh.fractions()[c.end]).collect();
        let Kink::State { state, value } = *k else {
            let passage = at_time(phase, kink, [t.initial_time, t.final_time]);
            // A crossing of the mesh has this time already.
            found.extend(passage.map(|p| Passage { at: known.first().copied().unwrap_or(p.at), ..p }));
            continue;
        };
        let mut above = |at: f64| {
            t.state.evaluate(t.time_at(at), &mut x);
            x[state] - value
        };
        let mut before: Option<(f64, f64)> = None;
        for at in samples(t).filter(|at| !known.contains(at)) {
            let value = above(at);
            let Some((start, first)) = before.replace((at, value)) else { continue };
            if first * value >= 0.0 {
                continue;
            }
            let here = known.iter().copied().find(|f| (start..at).contains(f));
            let at = here.unwrap_or_else(|| zero(&mut above, start, at, first));
            found.push(Passage { at, kink, rising: first < 0.0 });
        }
    }
    ordered(found)
}

/// Interval ends and places between them, of the phase.
fn samples(t: &PhaseTrajectory) -> impl Iterator<Item = f64> + '_ {
    let intervals = t.mesh.fractions().windows(2).zip(t.mesh.points());
    let inside = intervals.flat_map(|(w, &n)| {
        let (start, width, parts) = (w[0], w[1] - w[0], n + 1);
        (0..parts).map(move |k| start + width * k as f64 / parts as f64)
    });
    inside.chain([1.0])
}

fn zero(above: &mut impl FnMut(f64) -> f64, start: f64, end: f64, first: f64) -> f64 {
    let (mut low, mut high) = (start, end);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if above(middle) * first > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
