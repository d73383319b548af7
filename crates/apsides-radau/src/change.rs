//! Changes between what a quantity does: jumps and kinks, and when they are.

use apsides_ocp::ArcKind;

use crate::activity::{COLLAPSED, CROSSING, Class, NEAR, NodeSample, OSCILLATION, Run};
use crate::quantity::{Quantity, QuantityKind};

/// Distances beyond a node, in halves of that to the node before, within which a kink is looked for.
const REACH: usize = 8;

/// Steps in which a zero of a switching function is looked for along an interval.
const STEPS: usize = 40;

/// Nodes whose polynomial shows a switching function.
const LEAST_NODES: usize = 3;

/// Multiples of what is near a bound from which on a control is away from it.
const CLEAR: f64 = 10.0;

/// A switching function of the wrong sign, relative to its largest value, that is none of rounding; certificates allow less.
const EVIDENT: f64 = 1e-5;

/// Part of its largest value of the wrong sign below which a switching function vanishes at a node.
const VANISHING: f64 = 1e-6;

/// Part of its largest value along an arc from which on a quantity does not vanish at the end of the arc.
const APART: f64 = 1e-3;

/// A change of class.
pub(crate) struct Change {
    pub(crate) quantity: usize,
    /// Normalised times of the last node before and of the first one after.
    pub(crate) gap: (f64, f64),
    /// Estimate, later the break.
    pub(crate) at: f64,
    pub(crate) from: Class,
    pub(crate) to: Class,
    pub(crate) kind: ChangeKind,
    /// Normalised time of the break of the mesh that it belongs to already.
    pub(crate) known: Option<f64>,
    /// True at a kink where nodes that are held at the bound are pushed away from it: it is not in its place.
    pub(crate) is_pushed: bool,
    /// True where a control leaves a bound that it is held at, or comes to it, without a jump.
    pub(crate) is_continuous: bool,
    /// True where the quantity meets a bound with a jump, or leaves it.
    pub(crate) jumps: bool,
    /// Where it meets a bound without a jump that it is pushed against up to the end of the arc there.
    pub(crate) corner: Option<f64>,
    /// Where a row without controls meets its bound that is clear of it at the node beside the change still, and the place of that node.
    pub(crate) beyond_node: Option<BeyondNode>,
    /// Indices of the last node before and of the first one after.
    pub(crate) nodes: (usize, usize),
    /// Where the switching function changes its sign shortly before and after a break that stands at another zero of it.
    pub(crate) zeros: [Option<f64>; 2],
}

/// A bound that is met beyond a node.
#[derive(Clone, Copy)]
pub(crate) struct BeyondNode {
    pub(crate) node: f64,
    pub(crate) at: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChangeKind {
    /// The quantity jumps: the time can be an unknown.
    Jump,
    /// It meets its bound continuously: to first and second order the time does not matter, so that it follows from where the
    /// free side meets the bound.
    Kink,
    /// A row without controls meets its bound or leaves it, along which it stays for an arc: the time is an unknown, determined by the
    /// conditions of [`crate::junction`].
    Junction,
    /// The change is not clear yet.
    Unclear,
}

/// The changes of a quantity between its runs, in order. It is `steered` by a row without controls between these times, from the first to the
/// last node of each arc that the row stays at a bound along: there it is not at its own best.
pub(crate) fn changes(
    index: usize,
    q: &Quantity<'_>,
    samples: &[NodeSample],
    runs: &[Run],
    steered: &[(f64, f64)],
) -> Vec<Change> {
    let pairs = runs.windows(2);
    let mut changes: Vec<Change> =
        pairs.map(|pair| change(index, q, samples, [&pair[0], &pair[1]], steered)).collect();
    // What would come before the change that it follows, or beyond the ends of the phase, is not clear yet.
    let times: Vec<f64> = changes.iter().map(|c| c.at).collect();
    for (i, c) in changes.iter_mut().enumerate() {
        let low = if i == 0 { 0.0 } else { times[i - 1] } + COLLAPSED;
        let high = times.get(i + 1).copied().unwrap_or(1.0) - COLLAPSED;
        if !(low < c.at && c.at < high) {
            c.kind = ChangeKind::Unclear;
        }
    }
    changes
}

fn change(
    quantity: usize,
    q: &Quantity<'_>,
    samples: &[NodeSample],
    [a, b]: [&Run; 2],
    steered: &[(f64, f64)],
) -> Change {
    let (before, after) = (&samples[a.last], &samples[b.first]);
    let gap = (before.fraction, after.fraction);
    let crosses = a.class.opposite(b.class);
    let is_row = matches!(q.kind, QuantityKind::Row(_));
    let is_steered = steered.iter().any(|arc| arc.0 <= gap.1 && gap.0 <= arc.1);
    let is_apart = !is_steered && is_apart(samples, a, b);
    let jumps = is_apart || jumps(samples, a, b, is_steered);
    // From bound to bound across what is no minimum.
    let turns_over = crosses && before.is_concave && after.is_concave;
    let kind = if q.is_boundary() {
        if crosses { ChangeKind::Unclear } else { ChangeKind::Junction }
    } else if q.affine || turns_over || (is_row && (crosses || jumps)) {
        ChangeKind::Jump
    } else if !crosses && is_kink(a, b) && !jumps {
        ChangeKind::Kink
    } else {
        ChangeKind::Unclear
    };
    let middle = 0.5 * (before.fraction + after.fraction);
    let at = match kind {
        _ if a.is_pulse || b.is_pulse => pulse_end(samples, a, b),
        _ if crosses => crossing(before, after),
        ChangeKind::Kink => meeting(samples, a, b).or_else(|| let_go(samples, a, b)).unwrap_or(middle),
        _ => middle,
    };
    let zeros = if q.affine && kind == ChangeKind::Jump {
        match beyond_singular(samples, a, b) {
            Some(at) => [Some(at), None],
            None => zeros_beside(samples, a, b),
        }
    } else {
        [None; 2]
    };
    let is_corner = !crosses && is_kink(a, b) && !jumps && is_pushed_to_edge(samples, a, b);
    let corner = if is_corner { meeting(samples, a, b) } else { None };
    let is_continuous = !is_apart && is_continuous(samples, a, b);
    let is_pushed = kind == ChangeKind::Kink
        && (is_pushed(&samples[a.first..=a.last]) || is_pushed(&samples[b.first..=b.last]));
    let beyond_node = if kind == ChangeKind::Junction { beyond_node(samples, a, b) } else { None };
    Change {
        quantity,
        gap,
        at,
        from: a.class,
        to: b.class,
        kind,
        known: None,
        is_pushed,
        is_continuous,
        jumps,
        corner,
        beyond_node,
        nodes: (a.last, b.first),
        zeros,
    }
}

/// The place within a change at which a row meets its bound, on the line through the two nodes beside the change at which it is away from it, if
/// the nearer one is clear of the bound.
fn beyond_node(samples: &[NodeSample], a: &Run, b: &Run) -> Option<BeyondNode> {
    let between_first = a.class == Class::Between;
    let (run, bound) = if between_first { (a, b.class) } else { (b, a.class) };
    let (near, next) = if between_first { (a.last, a.last.checked_sub(1)?) } else { (b.first, b.first + 1) };
    if !(run.first..=run.last).contains(&next) {
        return None;
    }
    let distance =
        |i: usize| if bound == Class::Lower { samples[i].above_lower } else { samples[i].below_upper };
    let (node, other) = (samples[near].fraction, samples[next].fraction);
    let at = node + (node - other) * distance(near) / (distance(next) - distance(near));
    let is_inside = samples[a.last].fraction < at && at < samples[b.first].fraction;
    (distance(near) > NEAR && distance(near) < distance(next) && is_inside).then_some(BeyondNode { node, at })
}

/// True when nodes that are held at a bound have multipliers of the wrong sign.
fn is_pushed(samples: &[NodeSample]) -> bool {
    samples.iter().any(|s| match s.course {
        Some(ArcKind::Lower) => s.slope < -EVIDENT,
        Some(ArcKind::Upper) => s.slope > EVIDENT,
        _ => false,
    })
}

/// True when a quantity that is held at a bound on one side of a break is there on the other side too. The break is the first node after it.
fn is_continuous(samples: &[NodeSample], a: &Run, b: &Run) -> bool {
    let (near, beyond, bound) =
        if a.class == Class::Between { (a.last, b.first, b.class) } else { (b.first, a.last, a.class) };
    let is_held = matches!(samples[beyond].course, Some(ArcKind::Lower | ArcKind::Upper));
    let interval = samples[near].interval;
    let nodes: Vec<&NodeSample> = samples.iter().filter(|s| s.interval == interval).collect();
    let distance = |s: &NodeSample| if bound == Class::Lower { s.above_lower } else { s.below_upper };
    is_held && through(&nodes, distance, samples[b.first].fraction).abs() < NEAR
}

/// The zeros beside a jump, in the runs before and after it that are at a bound: where the control is between its bounds, the mesh may still hold
/// it at one, and a zero there belongs to neither end of the arc.
fn zeros_beside(samples: &[NodeSample], a: &Run, b: &Run) -> [Option<f64>; 2] {
    let (before, after) = (samples[a.last].fraction, samples[b.first].fraction);
    let zero = |run: &Run, node, towards| {
        if run.class == Class::Between { None } else { zero_beside(samples, node, towards) }
    };
    [zero(a, a.last, after), zero(b, b.first, before)]
}

/// A zero of the switching function within the interval of a node that is held at a bound, if the function has the wrong sign from there on
/// towards the end of the interval on the side of `towards`. A break is stationary at each zero; where the function touches zero
/// it is no minimum.
fn zero_beside(samples: &[NodeSample], node: usize, towards: f64) -> Option<f64> {
    let sign = match samples[node].course {
        Some(ArcKind::Lower) => 1.0,
        Some(ArcKind::Upper) => -1.0,
        _ => return None,
    };
    let nodes: Vec<&NodeSample> = samples.iter().filter(|s| s.interval == samples[node].interval).collect();
    let (first, last) = (nodes.first()?.fraction, nodes.last()?.fraction);
    if nodes.len() < LEAST_NODES || first >= last {
        return None;
    }
    let value = |f: f64| sign * through(&nodes, |s| s.slope, f);
    // The interval goes on beyond its last node by about the last distance between two.
    let (near, far) = if towards > samples[node].fraction {
        (towards.min(2.0 * last - nodes[nodes.len() - 2].fraction), first)
    } else {
        (first, last)
    };
    let at = |k: usize| near + (far - near) * k as f64 / STEPS as f64;
    let wrong = (0..=STEPS).take_while(|k| value(at(*k)) < 0.0 || *k == 0).last()?;
    let depth = (0..=wrong).map(|k| -value(at(k))).fold(0.0, f64::max);
    // At the far end of the interval there can be another break, which stands at a zero but for rounding.
    let ends_at_zero = value(far).abs() < VANISHING * depth;
    if wrong == 0 || wrong == STEPS || ends_at_zero || depth < EVIDENT {
        return None;
    }
    let (mut inside, mut outside) = (at(wrong), at(wrong + 1));
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if value(middle) < 0.0 { inside = middle } else { outside = middle }
    }
    Some(outside)
}

/// The end of an arc at a bound that goes on beyond its break, into a singular arc beside it: there the control is still at the bound at first, so
/// that the Hamiltonian is continuous at the break wherever it stands. Whole intervals at the bound belong to it; the part of the next one
/// that does follows from the mean of the control. Where the control jumps off the bound at an interval end, the arc is singular from there on.
fn beyond_singular(samples: &[NodeSample], a: &Run, b: &Run) -> Option<f64> {
    let is_singular = |s: &&NodeSample| s.course == Some(ArcKind::Singular);
    // The nodes of the singular arc from the break on.
    let (bound, near, edge, sign, arc) = match (a.class, b.class) {
        (Class::Between, bound) => {
            let next = a.last + samples[a.last..].iter().take_while(is_singular).count();
            let arc: Vec<&NodeSample> = samples[..next].iter().rev().take_while(is_singular).collect();
            (bound, a.last, samples.get(next)?.fraction, -1.0, arc)
        }
        (bound, Class::Between) => {
            let first = b.first - samples[..b.first].iter().rev().take_while(is_singular).count();
            let arc: Vec<&NodeSample> = samples[first..].iter().take_while(is_singular).collect();
            (bound, b.first, samples[first].fraction, 1.0, arc)
        }
        _ => return None,
    };
    let distance = |s: &NodeSample| if bound == Class::Lower { s.above_lower } else { s.below_upper };
    if !(distance(&samples[near]) < NEAR && samples[near].slope.abs() > EVIDENT) {
        return None;
    }
    let mut at_bound = 0.0;
    for nodes in arc.chunk_by(|a, b| a.interval == b.interval) {
        let far = nodes.last()?;
        if nodes.iter().all(|s| distance(s) < NEAR) {
            at_bound += nodes.iter().map(|s| s.width).sum::<f64>();
            continue;
        }
        let vanishes = nodes.iter().all(|s| s.slope.abs() < EVIDENT);
        let is_jump = vanishes && distance(nodes[0]) > CLEAR * NEAR;
        let leaves = distance(far) > CLEAR * NEAR;
        let is_partly = distance(nodes[0]) < NEAR && leaves && nodes.len() >= LEAST_NODES;
        if is_partly {
            at_bound += nodes.iter().map(|s| s.width * (1.0 - distance(s) / distance(far))).sum::<f64>();
        }
        return ((is_partly || is_jump) && at_bound > 0.0).then_some(edge + sign * at_bound);
    }
    None
}

/// The polynomial through a quantity at nodes.
pub(crate) fn through(nodes: &[&NodeSample], quantity: impl Fn(&NodeSample) -> f64, at: f64) -> f64 {
    let basis = |i: usize| -> f64 {
        let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, s)| (at - s.fraction) / (nodes[i].fraction - s.fraction)).product()
    };
    nodes.iter().enumerate().map(|(i, s)| quantity(s) * basis(i)).sum()
}

/// True when there are nodes enough on both sides of a change for a kink.
fn is_kink(a: &Run, b: &Run) -> bool {
    let (between, bound) = if a.class == Class::Between { (a, b) } else { (b, a) };
    bound.last - bound.first >= CROSSING && between.last - between.first > CROSSING
}

/// End of a pulse that has the same area as the nodes in it.
fn pulse_end(samples: &[NodeSample], a: &Run, b: &Run) -> f64 {
    let pulse = if a.is_pulse { a } else { b };
    let nodes = &samples[pulse.first..=pulse.last];
    let height = |s: &NodeSample| if pulse.class == Class::Upper { s.above_lower } else { s.below_upper };
    let area: f64 = nodes.iter().map(|s| s.width * height(s)).sum();
    let total: f64 = nodes.iter().map(|s| s.width).sum();
    let (start, end) = match (pulse.first, pulse.last + 1 == samples.len()) {
        // At an end of the phase the pulse stands there.
        (0, _) => (0.0, area),
        (_, true) => (1.0 - area, 1.0),
        _ => {
            let middle = 0.5 * (nodes[0].fraction - 0.5 * nodes[0].width + nodes[nodes.len() - 1].fraction)
                + 0.25 * nodes[nodes.len() - 1].width;
            (middle - 0.5 * area.min(total), middle + 0.5 * area.min(total))
        }
    };
    if a.is_pulse { end } else { start }
}

/// True when a quantity between its bounds in one of two runs meets the bound of the other with a jump: its course on, from the
/// two nodes before the last, misses the bound. A jump by little is told by what pushes against the bound, where the quantity is at its best.
fn jumps(samples: &[NodeSample], a: &Run, b: &Run, is_steered: bool) -> bool {
    let (between, bound, near, step) = if a.class == Class::Between {
        (a, b, a.last, usize::wrapping_sub as fn(usize, usize) -> usize)
    } else {
        (b, a, b.first, usize::wrapping_add as fn(usize, usize) -> usize)
    };
    if between.last - between.first < CROSSING + 1 {
        return false;
    }
    let distance =
        |i: usize| if bound.class == Class::Lower { samples[i].above_lower } else { samples[i].below_upper };
    let (i, j) = (step(near, 1), step(near, 2));
    if !lasts(samples, distance, [i, j], edge(samples, a, b)) || distance(i) <= EVIDENT {
        return false;
    }
    if is_steered || distance(i) > 2.0 * NEAR {
        return distance(i) > 2.0 * NEAR;
    }
    is_pushed_to_edge(samples, a, b)
}

/// The place between the last node of a run and the first one of the next.
fn edge(samples: &[NodeSample], a: &Run, b: &Run) -> f64 {
    0.5 * (samples[a.last].fraction + samples[b.first].fraction)
}

/// True where not less than half of a value at the first of two nodes is left at the edge, on the line through both.
fn lasts(samples: &[NodeSample], value: impl Fn(usize) -> f64, [i, j]: [usize; 2], edge: f64) -> bool {
    let (fi, fj) = (samples[i].fraction, samples[j].fraction);
    value(i) + (value(i) - value(j)) * (edge - fi) / (fi - fj) > 0.5 * value(i)
}

/// True where what pushes a quantity against the bound of one of two runs, the other of which is between the bounds, does not vanish at the edge
/// of that run. The node at the edge itself has a part of what is beyond.
fn is_pushed_to_edge(samples: &[NodeSample], a: &Run, b: &Run) -> bool {
    let bound = if a.class == Class::Between { b } else { a };
    if bound.last - bound.first <= CROSSING {
        return false;
    }
    let push = |i: usize| if bound.class == Class::Lower { samples[i].slope } else { -samples[i].slope };
    let nodes = if a.class == Class::Between { [b.first + 1, b.first + 2] } else { [a.last - 1, a.last - 2] };
    push(nodes[0]) > OSCILLATION && lasts(samples, push, nodes, edge(samples, a, b))
}

/// True where a quantity that is held at a bound is still pushed against it at the end of its arc, and is away from it on the other side. Where
/// it left the bound without a jump both would vanish there; of a break too early or too late one has the wrong sign.
fn is_apart(samples: &[NodeSample], a: &Run, b: &Run) -> bool {
    let (held, free, bound) = match (a.class, b.class) {
        (Class::Between, bound) if bound != Class::Between => (b.first, a.last, bound),
        (bound, Class::Between) if bound != Class::Between => (a.last, b.first, bound),
        _ => return false,
    };
    let is_held = matches!(samples[held].course, Some(ArcKind::Lower | ArcKind::Upper));
    let mut beside = samples.iter().filter(|s| s.interval == samples[free].interval);
    if !is_held || !beside.all(|s| s.class == Class::Between) {
        return false;
    }
    let sign = if bound == Class::Lower { 1.0 } else { -1.0 };
    let distance = |s: &NodeSample| if bound == Class::Lower { s.above_lower } else { s.below_upper };
    // The break is the first node after it.
    let edge = samples[b.first].fraction;
    let is_clear = |run: &Run, node: usize, quantity: &dyn Fn(&NodeSample) -> f64| {
        let nodes: Vec<&NodeSample> =
            samples.iter().filter(|s| s.interval == samples[node].interval).collect();
        let largest = samples[run.first..=run.last].iter().map(|s| quantity(s).abs()).fold(0.0, f64::max);
        nodes.len() >= LEAST_NODES && through(&nodes, quantity, edge) > (APART * largest).max(EVIDENT)
    };
    let (held_run, free_run) = if held == a.last { (a, b) } else { (b, a) };
    is_clear(held_run, held, &|s| sign * s.slope) && is_clear(free_run, free, &distance)
}

/// Where the distance to the bound of one of two runs vanishes, from its polynomial beside the change: through the nodes of the
/// nearest interval where none of them is at the bound, or all have left their bounds out, else through the nearest nodes; none where it does
/// not vanish near by.
fn meeting(samples: &[NodeSample], a: &Run, b: &Run) -> Option<f64> {
    let between_first = a.class == Class::Between;
    let bound = if between_first { b.class } else { a.class };
    let distance = |s: &NodeSample| if bound == Class::Lower { s.above_lower } else { s.below_upper };
    let (near, far) = if between_first { (a.last, b.first) } else { (b.first, a.last) };
    let all: Vec<&NodeSample> = samples.iter().filter(|s| s.interval == samples[near].interval).collect();
    let clean = |s: &&NodeSample| {
        s.course == Some(ArcKind::Free) || (s.course.is_none() && s.class == Class::Between)
    };
    let nodes: Vec<&NodeSample> = if all.len() > 2 && all.iter().all(clean) {
        all
    } else {
        let run = if between_first { a } else { b };
        let free = samples[run.first..=run.last].iter();
        let free = free.filter(|s| !matches!(s.course, Some(ArcKind::Lower | ArcKind::Upper)));
        if between_first { free.rev().take(3).collect() } else { free.take(3).collect() }
    };
    let value = |f: f64| through(&nodes, distance, f);
    let (mut inside, far) = (samples[near].fraction, samples[far].fraction);
    let mut outside = inside;
    if value(inside) < 0.0 {
        // The free side begins beyond the bound: it is met behind.
        let mut places: Vec<f64> = nodes.iter().map(|s| s.fraction).collect();
        places.sort_by(|x, y| (x - far).abs().total_cmp(&(y - far).abs()));
        let first = places.iter().position(|f| value(*f) >= 0.0)?;
        (inside, outside) = (places[first], if first == 0 { inside } else { places[first - 1] });
    } else {
        // The bound is met between the two nodes, or a little beyond.
        for k in 0..REACH {
            outside = far + 0.5 * k as f64 * (far - samples[near].fraction);
            if value(outside) < 0.0 {
                break;
            }
            inside = outside;
        }
    }
    if !(value(inside) >= 0.0 && value(outside) < 0.0) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if value(middle) > 0.0 { inside = middle } else { outside = middle }
    }
    Some(outside)
}

/// Where the multiplier of what is held at the bound of one of two runs vanishes, between nodes that are held: it is held too long.
fn let_go(samples: &[NodeSample], a: &Run, b: &Run) -> Option<f64> {
    let pushes = |s: &NodeSample| match s.course {
        Some(ArcKind::Lower) => Some(s.slope),
        Some(ArcKind::Upper) => Some(-s.slope),
        _ => None,
    };
    let pairs = samples[a.first..=b.last].windows(2);
    let zeros = pairs.filter_map(|w| {
        let (x, y) = (pushes(&w[0])?, pushes(&w[1])?);
        let leaves = if a.class == Class::Between { x < 0.0 && y >= 0.0 } else { x >= 0.0 && y < 0.0 };
        leaves.then(|| w[0].fraction + x / (x - y) * (w[1].fraction - w[0].fraction))
    });
    let edge = samples[b.first].fraction;
    zeros.min_by(|x, y| (x - edge).abs().total_cmp(&(y - edge).abs()))
}

/// Zero of the switching function between two nodes.
fn crossing(a: &NodeSample, b: &NodeSample) -> f64 {
    let share = if a.slope * b.slope < 0.0 { a.slope / (a.slope - b.slope) } else { 0.5 };
    a.fraction + share.clamp(0.01, 0.99) * (b.fraction - a.fraction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settling::KINK_SETTLED;

    /// Nodes of one interval at a lower bound, a tenth apart, with these values of the switching function.
    fn at_lower_bound(slopes: [f64; 4]) -> Vec<NodeSample> {
        let sample = |(node, slope): (usize, f64)| NodeSample {
            node,
            fraction: 0.1 * node as f64,
            width: 0.1,
            interval: 0,
            above_lower: 0.0,
            below_upper: 1.0,
            slope,
            push: slope.abs(),
            is_concave: true,
            class: Class::Lower,
            course: Some(ArcKind::Lower),
            rests: false,
        };
        slopes.into_iter().enumerate().map(sample).collect()
    }

    #[test]
    fn a_break_at_the_other_end_of_an_arc_is_no_zero_beside() {
        // A straight line of the wrong sign, from a break that stands at its zero but for rounding.
        for rounding in [-f64::EPSILON, 0.0, f64::EPSILON] {
            let samples = at_lower_bound([1e-3 * rounding, -1e-3, -2e-3, -3e-3]);
            assert_eq!(zero_beside(&samples, 3, 0.35), None, "{rounding:e}");
        }
        // A zero between the first two nodes is one.
        let zero = zero_beside(&at_lower_bound([5e-4, -5e-4, -1.5e-3, -2.5e-3]), 3, 0.35);
        assert!(zero.is_some_and(|zero| (zero - 0.05).abs() < KINK_SETTLED), "{zero:?}");
    }

    #[test]
    fn a_zero_within_an_arc_between_the_bounds_moves_none_of_its_ends() {
        let nodes = at_lower_bound([5e-4, -5e-4, -1.5e-3, -2.5e-3]);
        // The same nodes, and at an upper bound from there on.
        let mut samples = nodes.clone();
        samples.extend(nodes.iter().map(|s| NodeSample {
            fraction: s.fraction + 0.4,
            interval: 1,
            slope: -1e-3,
            class: Class::Upper,
            course: Some(ArcKind::Upper),
            ..*s
        }));
        let run = |class, first| Run { class, first, last: first + 3, is_pulse: false };
        let zeros = |class| zeros_beside(&samples, &run(class, 0), &run(Class::Upper, 4));
        let [before, after] = zeros(Class::Lower);
        assert!(before.is_some_and(|zero| (zero - 0.05).abs() < KINK_SETTLED) && after.is_none());
        assert_eq!(zeros(Class::Between), [None; 2]);
    }

    /// Nodes at a lower bound, then of singular intervals of a fiftieth of the phase each, with these distances from the bound.
    fn beside_singular(distances: &[f64]) -> Vec<NodeSample> {
        let mut samples = at_lower_bound([0.4, 0.3, 0.2, 0.1]);
        for (k, distance) in distances.iter().enumerate() {
            let mut node = at_lower_bound([if *distance < NEAR { 0.01 } else { 0.0 }; 4])[0];
            (node.node, node.fraction, node.interval) = (4 + k, 0.4 + 0.005 * k as f64, 1 + k / 4);
            (node.width, node.above_lower, node.below_upper) = (0.005, *distance, 1.0 - distance);
            (node.class, node.course) = (Class::Between, Some(ArcKind::Singular));
            samples.push(node);
        }
        samples
    }

    /// The end of the arc at the bound, seen from a node on.
    fn end_beside(distances: &[f64], first: usize) -> Option<f64> {
        let samples = beside_singular(distances);
        let run = |class, first, last| Run { class, first, last, is_pulse: false };
        let arcs = [run(Class::Lower, 0, first - 1), run(Class::Between, first, samples.len() - 1)];
        beyond_singular(&samples, &arcs[0], &arcs[1])
    }

    #[test]
    fn whole_intervals_of_a_singular_arc_at_a_bound_belong_to_the_arc_there() {
        const AT: [f64; 4] = [1e-3; 4];
        const AWAY: [f64; 80] = [0.5; 80];
        let is_at = |found: Option<f64>, end: f64| found.is_some_and(|f| (f - end).abs() < KINK_SETTLED);
        // A first node there that counts as one at the bound changes nothing.
        for first in [4, 5] {
            assert!(is_at(end_beside(&[&AT[..], &AWAY].concat(), first), 0.42));
            assert!(is_at(end_beside(&[&AT[..], &AT, &AWAY].concat(), first), 0.44));
        }
        // An interval that leaves the bound half-way.
        let leaving = [0.0, 0.25, 0.75, 1.0];
        assert!(is_at(end_beside(&leaving, 4), 0.41));
        assert!(is_at(end_beside(&[&AT[..], &leaving, &AWAY].concat(), 4), 0.43));
        // A control that leaves the bound slowly, or never, or was not there, shows no end.
        let slowly = [&AT[..], &[0.05; 80]].concat();
        for none in [slowly, AT.repeat(2), AWAY.to_vec()] {
            assert_eq!(end_beside(&none, 4), None);
        }
    }

    #[test]
    fn a_row_that_is_clear_of_its_bound_meets_it_beyond_the_node() {
        let mut samples = at_lower_bound([0.0; 4]);
        for (s, distance) in samples.iter_mut().zip([0.5, 0.3, 0.1, 0.0]) {
            s.above_lower = distance;
        }
        let run = |class, first, last| Run { class, first, last, is_pulse: false };
        let found = |samples: &[NodeSample]| {
            beyond_node(samples, &run(Class::Between, 0, 2), &run(Class::Lower, 3, 3))
        };
        let meets = found(&samples);
        let is_there = |b: BeyondNode| (b.node - 0.2).abs() + (b.at - 0.25).abs() < KINK_SETTLED;
        assert!(meets.is_some_and(is_there));
        // One that is there but for rounding, and one that does not come closer, meet it at the node or nowhere.
        samples[2].above_lower = 1e-12;
        assert!(found(&samples).is_none());
        (samples[1].above_lower, samples[2].above_lower) = (0.1, 0.1);
        assert!(found(&samples).is_none());
    }
}
