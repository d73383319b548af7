//! The mesh to be solved next: an earlier one with breaks between arcs, and interval ends at contacts and crossings.

use apsides_ocp::{Break, Crossing, Mesh, PhaseArc, PhaseMesh, TouchPoint};

use crate::RadauError;
use crate::activity::COLLAPSED;

/// An interval beside a new break shorter than this part of its neighbour becomes part of it.
const SHORT: f64 = 0.25;

/// A break between two arcs.
pub(crate) struct ArcBreak {
    /// Normalised time.
    pub(crate) at: f64,
    /// True when its time can be an unknown.
    pub(crate) free: bool,
    /// True where a row meets its bound tangentially.
    pub(crate) is_tangent: bool,
    /// Time of the break of the mesh that it belongs to already.
    pub(crate) known: Option<f64>,
}

/// A touch point of a mesh to be.
#[derive(Clone, Copy)]
pub(crate) struct Touch {
    /// Normalised time.
    pub(crate) at: f64,
    /// The touch point; its index of an end is not yet known.
    pub(crate) point: TouchPoint,
}

/// A crossing of a mesh to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Passage {
    /// Normalised time.
    pub(crate) at: f64,
    /// Index among the kinks of the phase.
    pub(crate) kink: usize,
    /// True where it is passed upwards.
    pub(crate) rising: bool,
}

/// Instants of one phase at which the next mesh has an interval end of free time.
#[derive(Default)]
pub(crate) struct Instants {
    pub(crate) touch_points: Vec<Touch>,
    pub(crate) crossings: Vec<Passage>,
}

/// The mesh with other instants.
pub(crate) fn with_instants(mesh: &Mesh, instants: &[Instants]) -> Result<Mesh, RadauError> {
    let phases = mesh.phases.iter().zip(instants).map(|(mesh, instants)| {
        let breaks = mesh.breaks().iter().map(|b| {
            let at = mesh.fractions()[b.end];
            ArcBreak { at, free: b.free, is_tangent: b.is_tangent, known: Some(at) }
        });
        with_breaks(mesh, &breaks.collect::<Vec<_>>(), mesh.arcs().to_vec(), instants)
    });
    Ok(Mesh { phases: phases.collect::<Result<_, _>>()? })
}

/// The mesh with these breaks and instants. Intervals that a new one leaves too short become part of their neighbours.
pub(crate) fn with_breaks(
    mesh: &PhaseMesh,
    found: &[ArcBreak],
    arcs: Vec<PhaseArc>,
    instants: &Instants,
) -> Result<PhaseMesh, RadauError> {
    let Instants { touch_points, crossings } = instants;
    let fixed = touch_points.iter().map(|t| t.at).chain(crossings.iter().map(|c| c.at));
    let breaks: Vec<f64> = found.iter().map(|b| b.at).chain(fixed).collect();
    let mut ends = mesh.fractions().to_vec();
    let mut points = mesh.points().to_vec();
    for &f in &breaks {
        let k = ends.partition_point(|e| *e < f);
        if ends[k] != f {
            ends.insert(k, f);
            points.insert(k, points[k - 1]);
        }
    }
    // An end that a touch point or a crossing has left is of no use.
    let left = mesh.touch_points().iter().map(|t| t.end).chain(mesh.crossings().iter().map(|c| c.end));
    let mut left_alone: Vec<f64> = left.map(|end| mesh.fractions()[end]).collect();
    // So are those within an arc that has come to nothing.
    for arc in (0..mesh.arcs().len()).map(|k| mesh.arc_intervals(k)) {
        let ends = &mesh.fractions()[arc.start..=arc.end];
        if ends[ends.len() - 1] - ends[0] <= COLLAPSED {
            left_alone.extend(&ends[1..ends.len() - 1]);
        }
    }
    let of_breaks = mesh.breaks().iter().map(|b| mesh.fractions()[b.end]);
    let old: Vec<f64> = of_breaks.chain(left_alone.iter().copied()).collect();
    let new = |f: f64| breaks.contains(&f) && !old.contains(&f);
    let mut k = 1;
    while k + 1 < ends.len() {
        let (left, right) = (ends[k] - ends[k - 1], ends[k + 1] - ends[k]);
        let beside_new =
            (new(ends[k - 1]) && left < SHORT * right) || (new(ends[k + 1]) && right < SHORT * left);
        let collapsed = old.contains(&ends[k]) && left.min(right) <= COLLAPSED;
        if !breaks.contains(&ends[k]) && (beside_new || collapsed || left_alone.contains(&ends[k])) {
            ends.remove(k);
            let n = points.remove(k);
            points[k - 1] = points[k - 1].max(n);
        } else {
            k += 1;
        }
    }
    let index = |f: f64| ends.partition_point(|e| *e < f);
    let at =
        found.iter().map(|b| Break { end: index(b.at), free: b.free, is_tangent: b.is_tangent }).collect();
    let mut touch_points: Vec<TouchPoint> =
        touch_points.iter().map(|t| TouchPoint { end: index(t.at), ..t.point }).collect();
    touch_points.sort_by_key(|t| (t.end, t.row));
    let mut crossings: Vec<Crossing> =
        crossings.iter().map(|c| Crossing { end: index(c.at), kink: c.kink, rising: c.rising }).collect();
    crossings.sort_by_key(|c| c.end);
    let mesh = PhaseMesh::new(ends, points)?.with_arcs(at, arcs)?;
    Ok(mesh.with_touch_points(touch_points)?.with_crossings(crossings)?)
}
