//! Intervals along arcs at the bound of a path constraint without controls.
//!
//! Along such an arc the equations of motion and the constraint are differential-algebraic equations of an index above one, whose
//! multiplier is a high derivative of what is solved for: in many short intervals it is as wrong as the inverse of a power of their length is
//! large, and so are the costates (Hairer, Wanner, Solving Ordinary Differential Equations II, section VI.1). Few intervals of
//! many points keep both, with the rate of the constraint in its place ([`crate::arc_rates`]) or not. Beside the arc the solution is smooth up to
//! the junction, once that is an interval end.

use apsides_ocp::{ArcKind, Break, Crossing, Mesh, Ocp, Phase, PhaseMesh, TouchPoint, Trajectory};

use crate::RadauError;
use crate::joints::is_at_joint;
use crate::junction::order;

/// Least points of an interval there, as far as there are as many.
pub(crate) const POINTS: usize = 10;

/// Points until which the intervals of an arc are joined that is to have the fewest intervals, with the points of the finest of them.
const WHOLE: usize = usize::MAX;

/// Least order of a row of such an arc.
const LEAST_ORDER: usize = 2;

/// Per interval, true along an arc that holds a row without controls at a bound, along the arcs before and after it, and beside a
/// touch point.
pub(crate) fn beside_bounds(phase: &Phase, mesh: &PhaseMesh) -> Vec<bool> {
    let beside = arcs_beside_bounds(phase, mesh);
    let touches = |k: usize| mesh.touch_points().iter().any(|t| t.end == k || t.end == k + 1);
    arc_of_intervals(mesh).enumerate().map(|(k, arc)| beside[arc] || touches(k)).collect()
}

/// Per arc, true for those that hold such a row, and for those before and after them.
fn arcs_beside_bounds(phase: &Phase, mesh: &PhaseMesh) -> Vec<bool> {
    let arcs = mesh.arcs().len();
    let at_bound: Vec<bool> = (0..arcs).map(|k| is_at_bound(phase, mesh, k)).collect();
    (0..arcs).map(|k| at_bound[k.saturating_sub(1)..(k + 2).min(arcs)].contains(&true)).collect()
}

fn is_at_bound(phase: &Phase, mesh: &PhaseMesh, arc: usize) -> bool {
    let rows = &mesh.arcs()[arc].rows;
    let held = |k: &usize| is_held(mesh, arc, *k);
    (0..rows.len()).filter(held).any(|k| order(phase, k).is_some_and(|o| o.order >= LEAST_ORDER))
}

fn is_held(mesh: &PhaseMesh, arc: usize, row: usize) -> bool {
    matches!(mesh.arcs()[arc].rows.get(row), Some(Some(ArcKind::Lower | ArcKind::Upper)))
}

/// Says whether an interval is one of an arc that holds a row without controls at a bound whose first rate has a control: the index is then
/// so low that short intervals do no harm to the multiplier.
pub(crate) fn holds_with_first_rate(phase: &Phase, mesh: &PhaseMesh, interval: usize, row: usize) -> bool {
    let arc = arc_of_intervals(mesh).nth(interval);
    arc.is_some_and(|arc| is_held(mesh, arc, row)) && order(phase, row).is_some_and(|o| o.order < LEAST_ORDER)
}

/// The arc of each interval.
fn arc_of_intervals(mesh: &PhaseMesh) -> impl Iterator<Item = usize> {
    (0..mesh.intervals()).map(|k| mesh.breaks().iter().take_while(|b| b.end <= k).count())
}

/// The mesh with as many points in fewer intervals along such arcs, and along the arcs that they follow or are followed by. An arc that the
/// trajectory before does not have begins as one interval, with the points of its finest: the many that found it are of no use along it, and
/// leave the control that holds the row ill-determined.
pub(crate) fn with_long_intervals(
    ocp: &Ocp,
    mesh: &Mesh,
    before: &Trajectory,
    joints: &[Vec<f64>],
    most: usize,
) -> Result<Mesh, RadauError> {
    let phases = ocp.phases.iter().zip(&mesh.phases).zip(&before.phases).zip(joints);
    let phases = phases.map(|(((phase, mesh), before), joints)| {
        let beside = arcs_beside_bounds(phase, mesh);
        if !beside.contains(&true) {
            return Ok(mesh.clone());
        }
        let until = beside.iter().enumerate().map(|(arc, beside)| match beside {
            false => 0,
            true if is_at_bound(phase, mesh, arc) && is_new(mesh, &before.mesh, arc) => WHOLE,
            true => POINTS.min(most),
        });
        joined(mesh, &until.collect::<Vec<_>>(), joints, most)
    });
    Ok(Mesh { phases: phases.collect::<Result<_, _>>()? })
}

/// Says whether an arc has an end at which the mesh before has no break.
fn is_new(mesh: &PhaseMesh, before: &PhaseMesh, arc: usize) -> bool {
    let arc = mesh.arc_intervals(arc);
    let inner = [arc.start, arc.end].into_iter().filter(|end| (1..mesh.intervals()).contains(end));
    let has = |f: f64| before.breaks().iter().any(|b| before.fractions()[b.end] == f);
    inner.map(|end| mesh.fractions()[end]).any(|f| !has(f))
}

/// The mesh with the intervals of each arc joined until they have so many points, `most` at most, or are [`WHOLE`], not across joints of tables.
fn joined(mesh: &PhaseMesh, until: &[usize], joints: &[f64], most: usize) -> Result<PhaseMesh, RadauError> {
    let fixed = |end: usize| {
        is_at_joint(mesh.fractions(), end, joints)
            || mesh.breaks().iter().any(|b| b.end == end)
            || mesh.touch_points().iter().any(|t| t.end == end)
            || mesh.crossings().iter().any(|c| c.end == end)
    };
    let (mut ends, mut points) = (vec![0.0], Vec::<usize>::new());
    // The new index of each end that is kept.
    let mut index = vec![0; mesh.intervals() + 1];
    for (k, (&n, arc)) in mesh.points().iter().zip(arc_of_intervals(mesh)).enumerate() {
        // Ends of arcs are breaks.
        match points.last_mut().filter(|last| **last < until[arc] && !fixed(k)) {
            Some(last) => {
                *last = if until[arc] == WHOLE { n.max(*last) } else { (*last + n).min(most) };
                ends.pop();
            }
            None => points.push(n),
        }
        ends.push(mesh.fractions()[k + 1]);
        index[k + 1] = points.len();
    }
    let breaks = mesh.breaks().iter().map(|b| Break { end: index[b.end], ..*b }).collect();
    let touch_points = mesh.touch_points().iter().map(|t| TouchPoint { end: index[t.end], ..*t }).collect();
    let crossings = mesh.crossings().iter().map(|c| Crossing { end: index[c.end], ..*c }).collect();
    let mesh = PhaseMesh::new(ends, points)?.with_arcs(breaks, mesh.arcs().to_vec())?;
    Ok(mesh.with_touch_points(touch_points)?.with_crossings(crossings)?)
}

#[cfg(test)]
mod tests {
    use apsides_ocp::PhaseArc;

    use super::*;

    #[test]
    fn intervals_of_an_arc_are_joined_between_what_is_fixed() {
        let fractions = vec![0.0, 0.25, 0.375, 0.5, 0.625, 0.75, 1.0];
        let break_at = |end| Break { end, free: true, is_tangent: false };
        let mesh = PhaseMesh::new(fractions, vec![4, 5, 7, 6, 12, 5]).unwrap();
        let mesh = mesh.with_arcs(vec![break_at(1), break_at(5)], vec![PhaseArc::default(); 3]).unwrap();
        let with = |until, joints: &[f64]| joined(&mesh, &[0, until, 0], joints, 14).unwrap();
        // One interval with as many points as the finest of what it is made of, and the ends of its breaks.
        let whole = with(WHOLE, &[]);
        assert_eq!((whole.fractions(), whole.points()), (&[0.0, 0.25, 0.75, 1.0][..], &[4, 12, 5][..]));
        assert_eq!(whole.breaks().iter().map(|b| b.end).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(with(WHOLE, &[0.5]).fractions(), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(with(POINTS, &[]).points(), [4, 12, 14, 5]);
        assert_eq!(with(0, &[]).points(), mesh.points());
        // An arc is new until both of its ends are breaks.
        assert!(!is_new(&mesh, &mesh, 1) && !is_new(&mesh, &mesh, 0));
        let other = PhaseMesh::new(vec![0.0, 0.25, 1.0], vec![4, 5]).unwrap();
        let other = other.with_arcs(vec![break_at(1)], vec![PhaseArc::default(); 2]).unwrap();
        assert!(is_new(&mesh, &other, 1) && !is_new(&mesh, &other, 0));
    }
}
