//! Arcs of a phase between the corners of its control, cut into intervals.

use apsides_ocp::PhaseTrajectory;

use crate::optimality::PhaseConditions;

/// A jump of a control above this part of the range it has along the phase is a corner.
const JUMP: f64 = 0.02;
/// Rates that differ by less, relative to themselves and to the scale of the state over the phase, are the same.
const SAME_RATE: f64 = 1e-9;
/// Ranges below this part of the scale of a control are none.
const LEAST_RANGE: f64 = 1e-4;
/// Least number of intervals of a phase.
const INTERVALS: f64 = 40.0;
/// Intervals that an instant cuts are not shorter than this part of what they would be.
const SHORTEST: f64 = 0.2;
/// Gauss points of an interval.
pub(super) const STAGES: usize = 3;

/// An interval of the accessory problem: part of an interval of the control polynomial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    /// Interval of the control polynomial.
    pub(super) segment: usize,
    /// Index of the arc.
    pub(super) arc: usize,
    /// Start and end.
    pub(super) start: f64,
    pub(super) end: f64,
    /// Start and end of the arc.
    pub(super) arc_start: f64,
    pub(super) arc_end: f64,
}

impl Span {
    /// The part of this interval up to a time.
    pub(super) fn until(self, end: f64) -> Self {
        Self { end, ..self }
    }
}

/// Times at which the control jumps, between the ends of the phase; but for those at which it does since the equations jump at that time.
pub(crate) fn corners(conditions: &mut PhaseConditions<'_>) -> Vec<f64> {
    let nu = conditions.equations.nu;
    let breaks = conditions.found.control.breaks().to_vec();
    let ranges: Vec<f64> = (0..nu)
        .map(|j| {
            let values = || conditions.nodes.iter().map(|n| n.control[j]);
            let (least, largest) =
                values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            (largest - least).max(LEAST_RANGE * conditions.scaling.controls[j])
        })
        .collect();
    let mut before = vec![0.0; nu];
    let mut corners = Vec::new();
    let mut rates =
        [(); 2].map(|()| vec![0.0; conditions.equations.nx + conditions.equations.phase.integrals.len()]);
    for k in (1..breaks.len() - 1).filter(|k| !conditions.instants.contains(k)).collect::<Vec<_>>() {
        conditions.evaluate_within_bounds(k - 1, breaks[k]);
        before.copy_from_slice(&conditions.point.u);
        conditions.equations.rates(&mut rates[0]);
        conditions.evaluate_within_bounds(k, breaks[k]);
        conditions.equations.rates(&mut rates[1]);
        let jumps =
            before.iter().zip(&conditions.point.u).zip(&ranges).any(|((a, b), r)| (a - b).abs() > JUMP * r);
        if jumps && differ(conditions, &rates) {
            corners.push(breaks[k]);
        }
    }
    corners
}

/// True if rates of states or integrals differ: an angle that jumps by a full turn changes nothing.
fn differ(conditions: &PhaseConditions<'_>, [before, after]: &[Vec<f64>; 2]) -> bool {
    let scales = conditions.scaling.states.iter().chain(&conditions.scaling.integrals);
    let duration = conditions.found.final_time - conditions.found.initial_time;
    let mut all = before.iter().zip(after).zip(scales);
    let is_same = |((a, b), scale): ((&f64, &f64), &f64)| {
        (a - b).abs() * duration <= SAME_RATE * scale.max(duration * a.abs())
    };
    !all.all(is_same)
}

/// The corners, and the times at which the equations jump or have a kink, in increasing order.
pub(super) fn with_instants(conditions: &mut PhaseConditions<'_>) -> Vec<f64> {
    let mut times = corners(conditions);
    let breaks = conditions.found.control.breaks();
    times.extend(conditions.instants.iter().map(|k| breaks[*k]));
    times.sort_by(f64::total_cmp);
    times
}

/// The intervals of a phase with these corners, cut at some instants too, and `fineness` times as many of them as its nodes ask for.
pub(super) fn spans(
    found: &PhaseTrajectory,
    corners: &[f64],
    instants: &[f64],
    fineness: usize,
) -> Vec<Span> {
    let breaks = found.control.breaks();
    let longest = (found.final_time - found.initial_time) / INTERVALS;
    let mut spans = Vec::new();
    for (segment, ends) in breaks.windows(2).enumerate() {
        let arc = corners.iter().filter(|c| **c <= ends[0]).count();
        let arc_start = if arc == 0 { breaks[0] } else { corners[arc - 1] };
        let arc_end = corners.get(arc).copied().unwrap_or(breaks[breaks.len() - 1]);
        let nodes = found.control.segments()[segment].basis.nodes().len();
        let parts = nodes.div_ceil(STAGES).max(((ends[1] - ends[0]) / longest).ceil() as usize).max(1);
        let parts = fineness * parts;
        let at = |k: usize| {
            if k == parts { ends[1] } else { ends[0] + (ends[1] - ends[0]) * k as f64 / parts as f64 }
        };
        // An instant replaces a time next to it, so that few intervals are next to nothing.
        let least = SHORTEST * (ends[1] - ends[0]) / parts as f64;
        let inside: Vec<f64> = instants.iter().copied().filter(|i| ends[0] < *i && *i < ends[1]).collect();
        let is_apart = |t: &f64| ends.contains(t) || inside.iter().all(|i| (t - i).abs() > least);
        let mut times: Vec<f64> =
            (0..=parts).map(at).filter(is_apart).chain(inside.iter().copied()).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        spans.extend(times.windows(2).map(|w| Span {
            segment,
            arc,
            start: w[0],
            end: w[1],
            arc_start,
            arc_end,
        }));
    }
    spans
}
