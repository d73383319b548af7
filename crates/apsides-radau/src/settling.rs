//! The breaks of the mesh that changes belong to, and what changes together.

use apsides_ocp::PhaseMesh;

use crate::activity::{COLLAPSED, CROSSING, Class};
use crate::change::{BeyondNode, Change, ChangeKind};

/// Breaks of different quantities closer than this part of the phase are one.
const SAME: f64 = 1e-4;

/// Where one of two controls that a row binds leaves its bound and the other one comes to its own within this part of the phase, the arc between is a
/// jump of both: along a singular arc as short the cost does not tell.
const BOUND: f64 = 1e-3;

/// A kink closer than this part of the phase to a break of the mesh is there.
pub(crate) const KINK_SETTLED: f64 = 1e-9;

/// A kink within this part of the phase of a break that is not free is the same one, moved.
const KINK_NEAR: f64 = 0.02;

/// Part of the way from a break to another zero within which both are where they were before.
const CAME_BACK: f64 = 0.2;

/// A break that the next mesh has at another zero of its switching function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Displaced {
    quantity: usize,
    /// Where it stood, and where it was put.
    from: f64,
    to: f64,
}

/// Gives every change the break that it belongs to, or joins it with others close by. Takes the breaks that the last mesh had displaced, and
/// returns those that the next one has.
pub(crate) fn settle(
    changes: &mut Vec<Change>,
    mesh: &PhaseMesh,
    before: &[Displaced],
    are_bound: impl Fn(usize, usize) -> bool,
    share_a_control: impl Fn(usize, usize) -> bool,
) -> Vec<Displaced> {
    let times = |free: bool| -> Vec<f64> {
        mesh.breaks().iter().filter(|b| b.free == free).map(|b| mesh.fractions()[b.end]).collect()
    };
    let nearest = |times: &[f64], c: &Change, low: f64, high: f64| -> Option<f64> {
        let inside = times.iter().copied().filter(|f| (low..=high).contains(f));
        inside.min_by(|a, b| (a - c.at).abs().total_cmp(&(b - c.at).abs()))
    };
    let (free, pinned) = (times(true), times(false));
    at_turns(changes, share_a_control);
    for c in changes.iter_mut() {
        match c.kind {
            // Nearest to the estimate of those between the two nodes.
            ChangeKind::Jump | ChangeKind::Junction => {
                c.known = nearest(&free, c, c.gap.0, c.gap.1);
                c.at = c.known.unwrap_or(c.at);
            }
            ChangeKind::Kink => {
                c.known = nearest(&pinned, c, c.at - KINK_NEAR, c.at + KINK_NEAR);
                c.at = c.known.filter(|f| (f - c.at).abs() < KINK_SETTLED).unwrap_or(c.at);
            }
            ChangeKind::Unclear => {}
        }
    }
    beyond_nodes(changes);
    let displaced = at_other_zeros(changes, before);
    at_jumps_of_others(changes);
    changes.sort_by(|a, b| a.at.total_cmp(&b.at));
    for i in 1..changes.len() {
        let (before, rest) = changes.split_at_mut(i);
        let c = &mut rest[0];
        let clear = |c: &Change| c.kind != ChangeKind::Unclear;
        let Some(last) = before.iter().rposition(clear).filter(|_| clear(c)) else { continue };
        let at = before[last].at;
        let same_quantity = before.iter().any(|b| clear(b) && b.quantity == c.quantity && b.at == at);
        let last = &mut before[last];
        let jumps = c.kind == ChangeKind::Jump && last.kind == ChangeKind::Jump;
        // A control that jumps where a row meets its bound does so there.
        let meets = [c.kind, last.kind].contains(&ChangeKind::Junction) && c.kind != last.kind;
        // Where one of two controls that a row binds leaves its bound as the other one comes to its own, the arc between is a jump of both.
        let is_between = last.to == Class::Between && c.from == Class::Between && c.at - last.at < BOUND;
        let is_one =
            c.known.is_none() && c.at - last.at < SAME || is_between && are_bound(last.quantity, c.quantity);
        // Two kinks, or a jump and a kink, are kept apart as far as an arc between them can last.
        let same = if jumps { is_one } else { c.at - last.at < COLLAPSED }
            || meets && c.known.is_none() && c.gap.0 <= last.gap.1;
        if same && !same_quantity && c.known.is_some() && last.kind == ChangeKind::Kink && last.is_continuous
        {
            // Where a row meets its bound its condition tells the time better.
            (last.at, last.known) = (c.at, c.known);
        } else if same && !same_quantity {
            (c.at, c.known) = (last.at, last.known);
        }
    }
    displaced
}

/// Rows that are clear of their bounds at a break still meet them beyond it; what else stands at the break goes with them.
fn beyond_nodes(changes: &mut [Change]) {
    let beyond: Vec<BeyondNode> = changes.iter().filter_map(|c| c.beyond_node).collect();
    for BeyondNode { node, at } in beyond {
        for c in changes.iter_mut().filter(|c| c.known == Some(node)) {
            (c.at, c.known) = (at, None);
        }
    }
}

/// Changes of a control whose switching function has other zeros beside a break. A break is stationary at each zero; where the function has
/// the wrong sign on one side, it belongs to the zero there, and where it has on both, the control switches at all three. What was put at that
/// zero and came back belongs to neither: between the two the control is at no bound.
fn at_other_zeros(changes: &mut Vec<Change>, before: &[Displaced]) -> Vec<Displaced> {
    let mut more = Vec::new();
    let mut displaced = Vec::new();
    for c in changes.iter_mut().filter(|c| c.known.is_some()) {
        match std::mem::take(&mut c.zeros) {
            [Some(before), Some(after)] => {
                let change = |at, known, from, to| Change {
                    at,
                    known,
                    from,
                    to,
                    gap: (before, after),
                    zeros: [None; 2],
                    ..*c
                };
                more.push(change(c.at, c.known, c.to, c.from));
                more.push(change(after, None, c.from, c.to));
                (c.at, c.known) = (before, None);
            }
            [Some(zero), None] | [None, Some(zero)] => {
                let came_back = |d: &&Displaced| {
                    let near = CAME_BACK * (d.from - d.to).abs();
                    d.quantity == c.quantity && (d.from - c.at).abs() < near && (d.to - zero).abs() < near
                };
                if !before.iter().any(|d| came_back(&d)) {
                    displaced.push(Displaced { quantity: c.quantity, from: c.at, to: zero });
                    (c.at, c.known) = (zero, None);
                    continue;
                }
                let (from, to) = (c.from, c.to);
                let classes = if zero < c.at { (from, Class::Between) } else { (Class::Between, to) };
                if zero < c.at {
                    c.from = Class::Between
                } else {
                    c.to = Class::Between
                }
                let gap = (zero.min(c.at), zero.max(c.at));
                let end = Change {
                    at: zero,
                    known: None,
                    from: classes.0,
                    to: classes.1,
                    gap,
                    zeros: [None; 2],
                    ..*c
                };
                more.push(end);
            }
            [None, None] => {}
        }
    }
    changes.extend(more);
    displaced
}

/// A control that jumps to a bound, or off it, does so where another quantity jumps between the same nodes.
fn at_jumps_of_others(changes: &mut [Change]) {
    let jumps: Vec<(usize, f64, Option<f64>)> = (changes.iter())
        .filter(|c| c.kind == ChangeKind::Jump)
        .map(|c| (c.quantity, c.at, c.known))
        .collect();
    for c in changes.iter_mut().filter(|c| c.kind == ChangeKind::Unclear && c.jumps) {
        let is_here = |at: f64| (c.gap.0..=c.gap.1).contains(&at);
        let mut here = jumps.iter().filter(|(quantity, at, _)| *quantity != c.quantity && is_here(*at));
        if let (Some((_, at, known)), None) = (here.next(), here.next()) {
            (c.kind, c.at, c.known) = (ChangeKind::Jump, *at, *known);
        }
    }
}

/// Two limits on the same control that take turns do so at one place: the control is pushed against one of them all the time. Where it goes on
/// without a jump the place is a corner, at which both meet; where it jumps, few nodes are at neither.
fn at_turns(changes: &mut [Change], share_a_control: impl Fn(usize, usize) -> bool) {
    for i in 0..changes.len() {
        let last = &changes[i];
        let mut others = changes.iter().enumerate();
        let found = others.find_map(|(j, next)| {
            let takes_over = last.to == Class::Between && next.from == Class::Between;
            let is_settled = [last.kind, next.kind].contains(&ChangeKind::Junction);
            let may_turn = takes_over && !is_settled && share_a_control(last.quantity, next.quantity);
            let turn = if may_turn { turn(last, next) } else { None };
            turn.map(|turn| (j, turn))
        });
        let Some((j, turn)) = found else { continue };
        for k in [i, j] {
            let c = &mut changes[k];
            match turn {
                Turn::Corner(at) => (c.kind, c.at) = (ChangeKind::Kink, at),
                Turn::Jump(gap) => {
                    (c.kind, c.gap, c.at) = (ChangeKind::Jump, gap, 0.5 * (gap.0 + gap.1));
                }
            }
        }
    }
}

/// The way in which one limit takes over from another.
enum Turn {
    /// Without a jump, at this place.
    Corner(f64),
    /// By a jump between these places.
    Jump((f64, f64)),
}

/// The turn of two limits the first of which is left as the second one is met, if it is one.
fn turn(last: &Change, next: &Change) -> Option<Turn> {
    if let Some((a, b)) = last.corner.zip(next.corner).filter(|(a, b)| (a - b).abs() < BOUND) {
        return Some(Turn::Corner(0.5 * (a + b)));
    }
    let are_in_order = last.nodes.0 <= next.nodes.0 && last.nodes.1 <= next.nodes.1;
    let are_close = next.nodes.0 < last.nodes.1 + CROSSING;
    (last.jumps && next.jumps && are_in_order && are_close).then_some(Turn::Jump((last.gap.0, next.gap.1)))
}
