//! Activity of the bounds of controls and path constraint rows, node by node.
//!
//! At a node a bound is active when its multiplier, relative to the largest along the phase, exceeds the relative distance
//! to it: at a solution of the interior-point method one of the two is small. The multiplier of a control's bound per unit
//! of time is the switching function `dH/du`, so that its sign confirms the bound.

use std::ops::Range;

use apsides_nlp::{Nlp, SolveReport};
use apsides_ocp::{ArcKind, Bounds, PhaseTrajectory, Variable};

use crate::arc_rates;
use crate::bounds::LEAST_ARC;
use crate::layout::CollocationPhase;
use crate::quantity::{Quantity, QuantityKind};
use crate::transcription::Transcription;

/// Most nodes between opposite bounds that are one switch and no arc of its own.
pub(crate) const CROSSING: usize = 2;

/// A way from bound to bound that takes less than this part of the phase is one switch, whatever nodes there are along it.
pub(crate) const AT_ONCE: f64 = 1e-4;

/// Arcs and intervals shorter than this part of the phase have come to nothing.
pub(crate) const COLLAPSED: f64 = 10.0 * LEAST_ARC;

/// Active nodes with fewer inactive ones between them belong together.
pub(crate) const APART: usize = 4;

/// Part of the range of a quantity within which a bound can be active.
pub(crate) const NEAR: f64 = 1e-2;

/// Part of the range by which a row may leave its bound at one node or two between others that are active there.
const BETWEEN: f64 = 0.1;

/// Relative multipliers below are rounding: no evidence of a bound, nor against one that is held.
const NO_EVIDENCE: f64 = 1e-5;

/// Relative multipliers below are that of the average over the phase of this part of the objective's scale.
const LEAST_SLOPE: f64 = 1e-2;

/// A control whose second derivative of the Hamiltonian, times its range, is below this part of its largest first one jumps, as does one
/// that the Hamiltonian is concave in; others meet their bounds continuously. What a jump leaves of the stationarity is this part at most, as certificates allow.
const AFFINE: f64 = 1e-5;

/// Relative multipliers of a bound that is active at so few nodes that it may be an oscillation along a singular arc.
pub(crate) const OSCILLATION: f64 = 1e-2;

/// Relative multipliers of the wrong sign at the end of a phase from which on they are none of a break farther inside that is not yet exact.
const WRONG_AT_END: f64 = 1e-3;

/// So many runs in a row, each of at most so many nodes, are an oscillation.
const OSCILLATING: usize = 4;

const SHORT_RUN: usize = 4;

/// Part of its range within which a control is at its bound.
const AT_BOUND: f64 = 1e-5;

/// Excess of a bound that was left out, relative to the range, from which on it is not clear of it.
const VIOLATION: f64 = 1e-8;

/// Error of an interval from which on what happens there says nothing about contacts and junctions: the mesh is refined first.
pub(crate) const ROUGH: f64 = 1e-4;

/// The place of a quantity between its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    Lower,
    Between,
    Upper,
}

impl Class {
    pub(crate) fn course(self) -> Option<ArcKind> {
        match self {
            Self::Lower => Some(ArcKind::Lower),
            Self::Between => None,
            Self::Upper => Some(ArcKind::Upper),
        }
    }

    /// The bound that a course holds a quantity at, if it does.
    fn held_by(course: Option<ArcKind>) -> Option<Self> {
        match course {
            Some(ArcKind::Lower) => Some(Self::Lower),
            Some(ArcKind::Upper) => Some(Self::Upper),
            Some(ArcKind::Singular | ArcKind::Free) | None => None,
        }
    }

    pub(crate) fn opposite(self, other: Self) -> bool {
        matches!((self, other), (Self::Lower, Self::Upper) | (Self::Upper, Self::Lower))
    }
}

/// A quantity at a node.
#[derive(Clone, Copy)]
pub(crate) struct NodeSample {
    /// Index of the node.
    pub(crate) node: usize,
    /// Normalised time.
    pub(crate) fraction: f64,
    /// Part of the phase that the node stands for.
    pub(crate) width: f64,
    pub(crate) interval: usize,
    /// Relative to the range, above the lower bound.
    pub(crate) above_lower: f64,
    /// Relative to the range, below the upper bound.
    pub(crate) below_upper: f64,
    /// Relative multiplier: positive where the lower bound would be active.
    pub(crate) slope: f64,
    /// The multiplier itself, per unit of time and for the whole range: what the bound costs.
    pub(crate) push: f64,
    /// True for a control that the Hamiltonian is linear or concave in here: between its bounds it has no minimum. So for a row that is held.
    pub(crate) is_concave: bool,
    pub(crate) class: Class,
    pub(crate) course: Option<ArcKind>,
    /// True for a row without controls at its bound that controls at their own leave there: nothing has to hold it.
    pub(crate) rests: bool,
}

impl NodeSample {
    /// True where the mesh holds the quantity at a bound.
    pub(crate) fn is_held(&self) -> bool {
        Class::held_by(self.course).is_some()
    }
}

/// Consecutive nodes of one class, by index into the samples.
#[derive(Clone)]
pub(crate) struct Run {
    pub(crate) class: Class,
    pub(crate) first: usize,
    pub(crate) last: usize,
    /// Too short for nodes at the bound: those in it stand between.
    pub(crate) is_pulse: bool,
}

/// A solved program.
pub(crate) struct Solution<'a> {
    pub(crate) report: &'a SolveReport,
    /// Diagonal of the Hessian of the Lagrangian.
    pub(crate) curvatures: &'a [f64],
    /// Curvatures of [`crate::row_bends`].
    pub(crate) row_bends: &'a [f64],
    /// Scale of the objective.
    pub(crate) objective: f64,
}

/// Diagonal of the Hessian of the Lagrangian.
pub(crate) fn curvatures(nlp: &mut Transcription, report: &SolveReport) -> Vec<f64> {
    let pattern = nlp.hessian_pattern();
    let mut entries = vec![0.0; pattern.len()];
    nlp.hessian(&report.x, 1.0, &report.constraint_multipliers, &mut entries);
    let mut diagonal = vec![0.0; report.x.len()];
    for ((&r, &c), v) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
        if r == c {
            diagonal[c] += v;
        }
    }
    diagonal
}

/// A quantity at the nodes of a phase, arcs that have come to nothing left out, and whether it is a control that the Hamiltonian is
/// linear in.
pub(crate) fn samples(
    q: &Quantity<'_>,
    p: &CollocationPhase,
    t: &PhaseTrajectory,
    solution: &Solution<'_>,
) -> (Vec<NodeSample>, bool) {
    let report = solution.report;
    let duration = t.final_time - t.initial_time;
    let Bounds { lower, upper } = q.variable.bounds;
    let range = q.range(p, report);
    let mut samples: Vec<NodeSample> = Vec::new();
    let mut bends = Vec::new();
    let collapsed: Vec<bool> =
        (0..p.arcs.len()).map(|k| is_collapsed(p.arc_duration(k, &report.x), t)).collect();
    for (node, n) in p.nodes.iter().enumerate() {
        let arc = p.arc_of(node);
        if collapsed[arc] {
            continue;
        }
        let seconds = n.weight * p.arc_duration(arc, &report.x);
        let holds = &p.mesh.arcs()[arc];
        let value = q.value(p, node, report);
        let (multiplier, hold) = match q.kind {
            QuantityKind::Control(c) => {
                let column = p.control_column(node) + c;
                let multiplier = report.lower_multipliers[column] - report.upper_multipliers[column];
                bends.push(solution.curvatures[column] * range.powi(2) / seconds);
                (multiplier, holds.controls.get(c))
            }
            QuantityKind::Row(r) => {
                let row = p.path_row(node) + r;
                let is_left_out = p.is_beside_junction(node, r);
                let hold = if is_left_out { Some(&Some(ArcKind::Free)) } else { holds.rows.get(r) };
                let bend = solution.row_bends.get(row).filter(|b| !b.is_nan()).copied().unwrap_or(0.0);
                bends.push(bend * range.powi(2) / seconds);
                let multiplier = match p.rate_arc_at(node, r) {
                    Some(_) => {
                        seconds * arc_rates::density(p, &report.x, &report.constraint_multipliers, node, r)
                    }
                    None => report.constraint_multipliers[row],
                };
                (-multiplier, hold)
            }
            // The multiplier there is that of the start of the phase.
            QuantityKind::State(_) if node == 0 => continue,
            QuantityKind::State(s) => {
                let column = p.state_column(node) + s;
                (report.lower_multipliers[column] - report.upper_multipliers[column], None)
            }
        };
        samples.push(NodeSample {
            node,
            fraction: (p.time(node, &report.x) - t.initial_time) / (t.final_time - t.initial_time),
            width: seconds / duration,
            interval: n.interval,
            above_lower: (value - lower) / range,
            below_upper: (upper - value) / range,
            slope: multiplier * range / seconds,
            push: (multiplier * range / seconds).abs(),
            is_concave: false,
            class: Class::Between,
            course: hold.copied().flatten(),
            rests: false,
        });
    }
    let least = LEAST_SLOPE * solution.objective / duration;
    let largest = samples.iter().fold(least, |m, s| m.max(s.slope.abs()));
    for (s, bend) in samples.iter_mut().zip(&bends) {
        s.is_concave = *bend <= AFFINE * largest;
    }
    let affine = bends.iter().all(|bend| *bend <= AFFINE * largest);
    let is_regular = q.is_boundary() || matches!(q.kind, QuantityKind::Control(_)) && !affine;
    for s in &mut samples {
        s.slope = if largest > 0.0 { s.slope / largest } else { 0.0 };
        s.class = class(s, is_regular || matches!(q.kind, QuantityKind::Row(_)) && !s.is_concave);
        let is_left_out = |r: usize| p.is_beside_junction(s.node, r);
        if matches!(q.kind, QuantityKind::Row(r) if is_left_out(r)) && t.interval_errors[s.interval] > ROUGH {
            s.class = Class::Between;
        }
        // What controls at their bounds leave where it is needs nothing to hold it.
        if q.is_boundary()
            && !q.held_by.iter().any(|(c, v)| is_between(report.x[p.control_column(s.node) + c], v))
        {
            s.class = Class::Between;
            s.rests = s.above_lower.min(s.below_upper) < AT_BOUND;
        }
    }
    keep_ends(&mut samples);
    (samples, affine && matches!(q.kind, QuantityKind::Control(_)))
}

/// Says whether a control is away from its bounds.
pub(crate) fn is_between(value: f64, variable: &Variable) -> bool {
    let Bounds { lower, upper } = variable.bounds;
    let width = upper - lower;
    let room = AT_BOUND * if width.is_finite() { width } else { variable.size().unwrap_or(1.0) };
    lower + room < value && value < upper - room
}

/// A multiplier of the wrong sign at the very ends of what is held says that it is not yet exact, since the break stands at
/// the best place.
fn keep_ends(samples: &mut [NodeSample]) {
    let mut start = 0;
    while start < samples.len() {
        let course = samples[start].course;
        let end = (start..samples.len()).find(|&i| samples[i].course != course).unwrap_or(samples.len());
        if let Some(own) = Class::held_by(course) {
            let wrong = |s: &&NodeSample| s.class != own;
            let tail = samples[start..end].iter().rev().take_while(wrong).count();
            let head = samples[start..end].iter().take_while(wrong).count();
            // At the ends of the phase there is no break, and what is evident is no error.
            let is_evident = |nodes: &[NodeSample]| nodes.iter().any(|s| s.slope.abs() > WRONG_AT_END);
            let (first, last) = (start + head, end - tail);
            if tail <= CROSSING && (end < samples.len() || !is_evident(&samples[last..end])) {
                samples[last..end].iter_mut().for_each(|s| s.class = own);
            }
            if head <= CROSSING && (start > 0 || !is_evident(&samples[start..first])) {
                samples[start..first].iter_mut().for_each(|s| s.class = own);
            }
        }
        start = end;
    }
}

/// An arc that has come to nothing.
fn is_collapsed(arc: f64, t: &PhaseTrajectory) -> bool {
    arc <= COLLAPSED * (t.final_time - t.initial_time)
}

/// The class that a sample shows; a control that meets its bounds continuously does not change over to the other one.
fn class(s: &NodeSample, is_regular: bool) -> Class {
    match s.course {
        Some(ArcKind::Lower) if s.slope >= -NO_EVIDENCE => Class::Lower,
        Some(ArcKind::Upper) if s.slope <= NO_EVIDENCE => Class::Upper,
        // Pushed away from the bound: the other one, if there is one.
        Some(ArcKind::Lower) if s.below_upper.is_finite() && !is_regular => Class::Upper,
        Some(ArcKind::Upper) if s.above_lower.is_finite() && !is_regular => Class::Lower,
        Some(ArcKind::Lower | ArcKind::Upper) => Class::Between,
        Some(ArcKind::Free) if s.above_lower < -VIOLATION => Class::Lower,
        Some(ArcKind::Free) if s.below_upper < -VIOLATION => Class::Upper,
        Some(ArcKind::Free) => Class::Between,
        _ if s.above_lower < NEAR && s.slope > s.above_lower => Class::Lower,
        _ if s.below_upper < NEAR && -s.slope > s.below_upper => Class::Upper,
        _ => Class::Between,
    }
}

/// Runs of a quantity, without those of too few nodes or too little evidence.
pub(crate) fn runs(samples: &[NodeSample]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (i, s) in samples.iter().enumerate() {
        match runs.last_mut() {
            Some(r) if r.class == s.class => r.last = i,
            _ => runs.push(Run { class: s.class, first: i, last: i, is_pulse: false }),
        }
    }
    // Bounds without evidence are none, unless held or met by what had left them out.
    for r in &mut runs {
        let seen = &samples[r.first..=r.last];
        let evidence = seen.iter().fold(0.0_f64, |m, s| m.max(s.slope.abs()));
        let few = r.last - r.first < CROSSING;
        let known = seen.iter().any(|s| s.course.is_some_and(|course| course != ArcKind::Singular));
        if !known && evidence < if few { OSCILLATION } else { NO_EVIDENCE } {
            r.class = Class::Between;
        }
    }
    joined(&mut runs);
    oscillations(&mut runs);
    // The few nodes of a crossing belong to neither side; nor do those of an interval as short as the place of a switch is known.
    let mut k = 1;
    while k + 1 < runs.len() {
        let (a, b) = (runs[k - 1].class, runs[k + 1].class);
        let is_crossing = runs[k].class == Class::Between && a.opposite(b);
        let lasts = samples[runs[k].last].fraction - samples[runs[k].first].fraction;
        if is_crossing && (runs[k].last - runs[k].first < CROSSING || lasts < AT_ONCE) {
            runs.remove(k);
        } else {
            k += 1;
        }
    }
    runs
}

/// A few nodes between the bounds, before or after what stands at one, are a pulse to the other one that no node resolves.
pub(crate) fn pulses(samples: &[NodeSample], runs: &mut Vec<Run>) {
    settle_all_along(samples, runs);
    for k in 0..runs.len() {
        let neighbours =
            [k.checked_sub(1), Some(k + 1)].map(|i| i.and_then(|i| runs.get(i)).map(|r| r.class));
        let other = match neighbours {
            [Some(Class::Lower), Some(Class::Lower)]
            | [Some(Class::Lower), None]
            | [None, Some(Class::Lower)] => Class::Upper,
            [Some(Class::Upper), Some(Class::Upper)]
            | [Some(Class::Upper), None]
            | [None, Some(Class::Upper)] => Class::Lower,
            _ => continue,
        };
        let r = &mut runs[k];
        let bounded = samples[r.first].above_lower.is_finite() && samples[r.first].below_upper.is_finite();
        if r.class == Class::Between && r.last - r.first < CROSSING && bounded {
            (r.class, r.is_pulse) = (other, true);
        }
    }
}

/// A control whose nodes are all close to one bound, and pushed towards it, is there all along: where the switching function is small the
/// barrier keeps some of them away from it.
fn settle_all_along(samples: &[NodeSample], runs: &mut Vec<Run>) {
    let Some(class) = runs.iter().map(|r| r.class).find(|c| *c != Class::Between) else { return };
    let is_at = |s: &NodeSample| match class {
        Class::Lower => s.above_lower < NEAR && s.slope >= -NO_EVIDENCE,
        _ => s.below_upper < NEAR && s.slope <= NO_EVIDENCE,
    };
    if samples.iter().all(is_at) {
        runs.iter_mut().for_each(|r| r.class = class);
        joined(runs);
    }
}

/// The bound that a control stays at all along, where the mesh holds it there, or where a small switching function lets the barrier keep it
/// visibly away; else between.
pub(crate) fn bound_all_along(samples: &[NodeSample], runs: &[Run]) -> Class {
    let [run] = runs else { return Class::Between };
    let distance = |s: &NodeSample| match run.class {
        Class::Lower => s.above_lower,
        Class::Between => 0.0,
        Class::Upper => s.below_upper,
    };
    let is_away = samples.iter().any(|s| s.is_held() || distance(s) > AT_BOUND);
    if is_away { run.class } else { Class::Between }
}

/// Runs of a row without controls: what stays close to a bound between two nodes that are active there is an arc. A coarse mesh lets the
/// row leave the bound between them, where that gains from the error of the rule. An arc may last to the end of the phase, which is no node:
/// a constraint of the end holds the row there.
pub(crate) fn boundary_runs(samples: &[NodeSample]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut classes: Vec<Class> = samples.iter().map(|s| s.class).collect();
    let at_bound = |i: usize| classes[i] != Class::Between;
    let active: Vec<usize> = (0..samples.len()).filter(|i| at_bound(*i)).collect();
    let close = |class: Class, nodes: std::ops::Range<usize>| {
        let room = if nodes.len() <= CROSSING { BETWEEN } else { NEAR };
        samples[nodes]
            .iter()
            .all(|s| (if class == Class::Lower { s.above_lower } else { s.below_upper }) < room)
    };
    let is_coarse = samples.iter().all(|s| s.course.is_none());
    let joins: Vec<(usize, usize)> = (active.windows(2))
        .filter(|w| is_coarse && classes[w[0]] == classes[w[1]] && close(classes[w[0]], w[0] + 1..w[1]))
        .map(|w| (w[0], w[1]))
        .collect();
    for (a, b) in joins {
        let class = classes[a];
        classes[a..b].fill(class);
    }
    keep_held(samples, &mut classes);
    for (i, class) in classes.into_iter().enumerate() {
        match runs.last_mut() {
            Some(r) if r.class == class => r.last = i,
            _ => runs.push(Run { class, first: i, last: i, is_pulse: false }),
        }
    }
    for r in &mut runs {
        let seen = &samples[r.first..=r.last];
        let is_held = seen.iter().any(|s| matches!(s.course, Some(ArcKind::Lower | ArcKind::Upper)));
        let evidence = seen.iter().fold(0.0_f64, |m, s| m.max(s.slope.abs()));
        // One or two nodes close to each other are a contact.
        let nodes = active.iter().filter(|i| (r.first..=r.last).contains(i)).count();
        let is_arc = (nodes > CROSSING || r.last - r.first > APART) && evidence >= OSCILLATION;
        if !is_held && !is_arc {
            r.class = Class::Between;
        }
    }
    joined(&mut runs);
    runs
}

/// A few nodes along an arc with multipliers of the wrong sign are an error of the mesh; those of half of the arc say that it is none. Where
/// the nodes at its ends alone have the right one, they have the impulses of contacts.
fn keep_held(samples: &[NodeSample], classes: &mut [Class]) {
    let mut start = 0;
    while start < samples.len() {
        let course = samples[start].course;
        let end = (start..samples.len()).find(|&i| samples[i].course != course).unwrap_or(samples.len());
        let own = Class::held_by(course).unwrap_or(Class::Between);
        let arc = &mut classes[start..end];
        let wrong = arc.iter().filter(|c| **c != own).count();
        if own != Class::Between && 2 * wrong < arc.len() {
            arc.fill(own);
        } else if own != Class::Between && arc.len() > 2 * CROSSING {
            let inner = CROSSING..arc.len() - CROSSING;
            if arc[inner].iter().all(|c| *c != own) {
                arc.fill(Class::Between);
            }
        }
        start = end;
    }
}

/// Within an arc along which a row stays at its bound the control that holds it there is between its own, whatever a coarse mesh shows.
pub(crate) fn settle_inside(q: &Quantity<'_>, samples: &mut [NodeSample], held: &[(usize, f64, f64)]) {
    for &(_, first, last) in held.iter().filter(|h| q.kind == QuantityKind::Control(h.0)) {
        let inside = samples.iter_mut().filter(|s| first < s.fraction && s.fraction < last);
        inside.filter(|s| !s.is_held()).for_each(|s| s.class = Class::Between);
    }
}

/// The nodes of each stretch along which a row without controls rests at a bound.
pub(crate) fn rests(samples: &[NodeSample]) -> impl Iterator<Item = &[NodeSample]> {
    samples.chunk_by(|a, b| a.rests == b.rests).filter(|nodes| nodes[0].rests)
}

/// Where a row that a control moves rests at a bound along a whole arc, what pushes the control against its own is shared with that of the row in
/// any way: the sign of what is left to a control that is held there says nothing. A row that rests along a part of the arc leaves its bound there.
pub(crate) fn keep_at_rest(samples: &mut [NodeSample], rests: &[(f64, f64)], arcs: &[Range<usize>]) {
    let is_inside = |s: &NodeSample| rests.iter().any(|(first, last)| (*first..=*last).contains(&s.fraction));
    for arc in arcs {
        let first = samples.partition_point(|s| s.interval < arc.start);
        let last = samples.partition_point(|s| s.interval < arc.end);
        let along = &mut samples[first..last];
        if !along.iter().all(is_inside) {
            continue;
        }
        for s in along {
            if let Some(own) = Class::held_by(s.course) {
                (s.class, s.slope) = (own, 0.0);
            }
        }
    }
}

/// Leaves out runs of a few nodes between others where a row without controls meets its bound or leaves it.
pub(crate) fn settle_beside(samples: &[NodeSample], runs: &mut Vec<Run>, gaps: &[(f64, f64)]) {
    let mut k = 1;
    while k + 1 < runs.len() {
        let nodes = &samples[runs[k].first..=runs[k].last];
        let is_beside = |s: &NodeSample| gaps.iter().any(|g| (g.0..=g.1).contains(&s.fraction));
        let is_known = nodes.iter().any(NodeSample::is_held);
        if nodes.len() <= CROSSING && !is_known && nodes.iter().any(is_beside) {
            runs.remove(k);
        } else {
            k += 1;
        }
    }
    joined(runs);
}

/// Several short runs in a row are a singular arc where the control oscillates.
fn oscillations(runs: &mut Vec<Run>) {
    let short = |r: &Run| r.last - r.first < SHORT_RUN;
    let mut k = 0;
    while k < runs.len() {
        let count = runs[k..].iter().take_while(|r| short(r)).count();
        if count >= OSCILLATING {
            runs[k..k + count].iter_mut().for_each(|r| r.class = Class::Between);
        }
        k += count.max(1);
    }
    joined(runs);
}

fn joined(runs: &mut Vec<Run>) {
    runs.dedup_by(|b, a| {
        let same = a.class == b.class;
        if same {
            a.last = b.last;
        }
        same
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes a tenth apart of a quantity that the mesh holds at its lower bound, with these multipliers.
    fn held(slopes: &[f64]) -> Vec<NodeSample> {
        let sample = |(node, slope): (usize, &f64)| NodeSample {
            node,
            fraction: 0.1 * node as f64,
            width: 0.1,
            interval: [0, 0, 1, 1, 1, 2][node.min(5)],
            above_lower: 0.0,
            below_upper: 1.0,
            slope: *slope,
            push: slope.abs(),
            is_concave: true,
            class: if *slope < 0.0 { Class::Upper } else { Class::Lower },
            course: Some(ArcKind::Lower),
            rests: (2..5).contains(&node),
        };
        slopes.iter().enumerate().map(sample).collect()
    }

    fn classes(samples: &[NodeSample]) -> Vec<Class> {
        samples.iter().map(|s| s.class).collect()
    }

    #[test]
    fn signs_along_a_rest_say_nothing() {
        let samples = held(&[1.0, 1.0, -1.0, -1.0, -1.0, -1.0]);
        let stretches: Vec<(f64, f64)> =
            rests(&samples).map(|nodes| (nodes[0].fraction, nodes[nodes.len() - 1].fraction)).collect();
        assert_eq!(stretches, [(0.2, 0.4)]);
        let mut control = samples.clone();
        keep_at_rest(&mut control, &stretches, &[0..1, 1..2, 2..3]);
        assert_eq!(classes(&control)[..5], [Class::Lower; 5]);
        assert_eq!(control[5].class, Class::Upper);
        assert_eq!(control[3].slope, 0.0);
        // One that is longer than the rest keeps its signs.
        let mut control = samples.clone();
        keep_at_rest(&mut control, &stretches, &[0..1, 1..3]);
        assert_eq!(classes(&control), classes(&samples));
    }

    #[test]
    fn wrong_signs_at_the_ends_of_a_phase_count() {
        let mut samples = held(&[-1.0, 1.0, 1.0, 1.0, -1.0, 1.0]);
        samples[5].course = None;
        keep_ends(&mut samples);
        // The first node is at no break, the fifth is.
        assert_eq!(samples[0].class, Class::Upper);
        assert_eq!(classes(&samples)[1..], [Class::Lower; 5]);
    }

    #[test]
    fn a_short_way_from_bound_to_bound_is_one_switch_whatever_nodes_it_has() {
        let way = |lasts: f64| {
            let mut samples = held(&[1.0; 12]);
            for (k, s) in samples.iter_mut().enumerate() {
                s.course = None;
                (s.class, s.fraction) = match k {
                    0..4 => (Class::Lower, 0.1 * k as f64),
                    4..8 => (Class::Between, 0.5 + lasts * (k - 4) as f64 / 3.0),
                    _ => (Class::Upper, 0.6 + 0.04 * (k - 8) as f64),
                };
            }
            runs(&samples).iter().map(|r| r.class).collect::<Vec<_>>()
        };
        assert_eq!(way(0.5 * AT_ONCE), [Class::Lower, Class::Upper]);
        assert_eq!(way(2.0 * AT_ONCE), [Class::Lower, Class::Between, Class::Upper]);
    }
}
