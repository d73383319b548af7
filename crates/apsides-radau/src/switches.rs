//! Where controls and path constraints change between their bounds, and a mesh with breaks there.
//!
//! A break at a jump makes its time an unknown of the next mesh; what stands at a bound along a whole arc is held there. Where
//! a multiplier of the wrong sign shows up then, the arc is divided; arcs that come to nothing are dropped. A quantity that
//! meets its bound continuously does so at a kink, whose time has no effect of first or second order: its break does not move
//! by itself, the bounds are left out on the free side, and the next mesh has the break where the polynomial meets the bound.

use apsides_nlp::SolveReport;
pub use apsides_ocp::method::{Level, Switch};
use apsides_ocp::{
    ArcKind, Break, Crossing, Mesh, Ocp, Phase, PhaseArc, PhaseMesh, PhaseTrajectory, TouchPoint, Trajectory,
};

use crate::RadauError;
use crate::activity::{
    COLLAPSED, Class, Kind, Quantity, Solution, curvatures, pulses, quantities, runs, samples,
};
use crate::change::{Change, ChangeKind, changes, settle};
use crate::contact::Touch;
use crate::crossing::Passage;
use crate::layout::PhaseLayout;
use crate::transcription::Transcription;

/// An interval beside a new break shorter than this part of its neighbour becomes part of it.
const SHORT: f64 = 0.25;

/// A break of a structure.
struct Found {
    /// Normalised time.
    at: f64,
    /// Whether its time can be an unknown.
    free: bool,
    /// Time of the break of the mesh that it belongs to already.
    known: Option<f64>,
}

/// The structure of one phase.
struct PhaseStructure<'a> {
    quantities: Vec<Quantity<'a>>,
    /// Per quantity, what it does first.
    first: Vec<Class>,
    changes: Vec<Change>,
}

/// What was found on a mesh.
pub(crate) struct Structure<'a> {
    phases: Vec<PhaseStructure<'a>>,
}

impl<'a> Structure<'a> {
    /// Finds the switches of a solution.
    pub(crate) fn of(
        ocp: &'a Ocp,
        nlp: &mut Transcription,
        report: &SolveReport,
        trajectory: &Trajectory,
    ) -> Self {
        let curvatures = curvatures(nlp, report);
        let solution = Solution { report, curvatures: &curvatures, objective: nlp.scaling.objective.abs() };
        let phases = ocp.phases.iter().zip(&nlp.layout.phases).zip(&trajectory.phases);
        Self { phases: phases.map(|((phase, p), t)| phase_structure(phase, p, t, &solution)).collect() }
    }

    /// Every switch, in the order of the phases and of time.
    pub(crate) fn switches(&self, ocp: &Ocp, trajectory: &Trajectory) -> Vec<Switch> {
        let mut switches = Vec::new();
        for ((found, phase), t) in self.phases.iter().zip(&ocp.phases).zip(&trajectory.phases) {
            for c in found.of_kind(ChangeKind::Jump) {
                let v = found.quantities[c.quantity].variable;
                switches.push(Switch {
                    phase: phase.name.clone(),
                    name: v.name.clone(),
                    unit: v.unit.clone(),
                    time: t.time_at(c.at),
                    time_unit: phase.time_unit.clone(),
                    located: c.known.is_some(),
                    from: c.from.level(&v.bounds),
                    to: c.to.level(&v.bounds),
                });
            }
        }
        switches
    }

    /// Whether the mesh of the trajectory has exactly the breaks and arcs that were found; kinks may stand beside their breaks
    /// if the polynomials are `within` their bounds.
    pub(crate) fn is_that_of(&self, trajectory: &Trajectory, within: bool) -> bool {
        self.phases.iter().zip(&trajectory.phases).all(|(found, t)| {
            let breaks = found.breaks();
            breaks.iter().all(|b| b.known.is_some_and(|f| f == b.at || within))
                && breaks.len() == t.mesh.breaks().len()
                && breaks.iter().zip(t.mesh.breaks()).all(|(a, b)| a.free == b.free)
                && found.arcs(&breaks) == t.mesh.arcs()
        })
    }

    /// The trajectory without the errors of intervals that hold a switch which is no break yet, or a kink away from an interval
    /// end: refining them says nothing.
    pub(crate) fn spared(&self, trajectory: &Trajectory) -> Trajectory {
        let mut trajectory = trajectory.clone();
        for (found, t) in self.phases.iter().zip(&mut trajectory.phases) {
            let ends = t.mesh.fractions();
            let is_new = |c: &&Change| c.kind != ChangeKind::Unclear && c.known != Some(c.at);
            let new = found.changes.iter().filter(is_new);
            for (c, k) in new.flat_map(|c| (0..t.mesh.intervals()).map(move |k| (c, k))) {
                let (start, end) = (ends[k], ends[k + 1]);
                if c.gap.0 < end && c.gap.1 > start {
                    t.interval_errors[k] = 0.0;
                }
            }
        }
        trajectory
    }

    /// The refined mesh with the breaks and arcs that were found, and with instants.
    pub(crate) fn mesh(&self, refined: &Mesh, instants: &[Instants]) -> Result<Mesh, RadauError> {
        let phases = self.phases.iter().zip(&refined.phases).zip(instants);
        let phases = phases.map(|((found, mesh), instants)| {
            let breaks = found.breaks();
            let arcs = found.arcs(&breaks);
            with_breaks(mesh, &breaks, arcs, instants)
        });
        Ok(Mesh { phases: phases.collect::<Result<_, _>>()? })
    }
}

/// The mesh with other instants.
pub(crate) fn with_instants(mesh: &Mesh, instants: &[Instants]) -> Result<Mesh, RadauError> {
    let phases = mesh.phases.iter().zip(instants).map(|(mesh, instants)| {
        let breaks = mesh.breaks().iter().map(|b| {
            let at = mesh.fractions()[b.end];
            Found { at, free: b.free, known: Some(at) }
        });
        with_breaks(mesh, &breaks.collect::<Vec<_>>(), mesh.arcs().to_vec(), instants)
    });
    Ok(Mesh { phases: phases.collect::<Result<_, _>>()? })
}

impl PhaseStructure<'_> {
    fn of_kind(&self, kind: ChangeKind) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(move |c| c.kind == kind)
    }

    /// The breaks in order of time.
    fn breaks(&self) -> Vec<Found> {
        let mut breaks: Vec<Found> = Vec::new();
        for c in self.changes.iter().filter(|c| c.kind != ChangeKind::Unclear) {
            let free = c.kind == ChangeKind::Jump;
            match breaks.last_mut().filter(|b| c.at <= b.at) {
                Some(b) => b.free |= free,
                None => breaks.push(Found { at: c.at, free, known: c.known }),
            }
        }
        breaks
    }

    /// What is known of the arcs between the breaks.
    fn arcs(&self, breaks: &[Found]) -> Vec<PhaseArc> {
        let count = |controls: bool| {
            let index = |q: &Quantity<'_>| match q.kind {
                Kind::Control(c) if controls => c + 1,
                Kind::Row(r) if !controls => r + 1,
                _ => 0,
            };
            self.quantities.iter().map(index).max().unwrap_or(0)
        };
        let mut class = self.first.clone();
        let mut arcs = Vec::new();
        for k in 0..=breaks.len() {
            if k > 0 {
                let here = |c: &&Change| c.kind != ChangeKind::Unclear && c.at == breaks[k - 1].at;
                for c in self.changes.iter().filter(here) {
                    class[c.quantity] = c.to;
                }
            }
            let mut arc = PhaseArc { controls: vec![None; count(true)], rows: vec![None; count(false)] };
            let end = breaks.get(k).map_or(f64::INFINITY, |b| b.at);
            let mut whole = vec![true; class.len()];
            for c in self.of_kind(ChangeKind::Unclear).filter(|c| c.at < end) {
                if k == 0 || c.at > breaks[k - 1].at {
                    (whole[c.quantity], class[c.quantity]) = (false, c.to);
                }
            }
            for (index, ((q, class), whole)) in self.quantities.iter().zip(&class).zip(whole).enumerate() {
                let has_kink = self.of_kind(ChangeKind::Kink).any(|c| c.quantity == index);
                let between = match (q.affine, has_kink) {
                    (true, _) => Some(ArcKind::Singular),
                    (false, true) => Some(ArcKind::Free),
                    (false, false) => None,
                };
                let course = class.course().or(between).filter(|_| whole);
                match q.kind {
                    Kind::Control(c) => arc.controls[c] = course,
                    Kind::Row(r) => arc.rows[r] = course,
                }
            }
            if arc.controls.iter().chain(&arc.rows).all(Option::is_none) {
                arc = PhaseArc::default();
            }
            arcs.push(arc);
        }
        if breaks.is_empty() {
            // A bound active all along needs no holding.
            arcs = vec![PhaseArc::default()];
        }
        arcs
    }
}

fn phase_structure<'a>(
    phase: &'a Phase,
    p: &PhaseLayout,
    t: &PhaseTrajectory,
    solution: &Solution<'_>,
) -> PhaseStructure<'a> {
    let mut quantities = quantities(phase);
    let mut found = PhaseStructure { quantities: Vec::new(), first: Vec::new(), changes: Vec::new() };
    for (k, q) in quantities.iter_mut().enumerate() {
        let (samples, affine) = samples(q, p, t, solution);
        q.affine = affine;
        let mut runs = runs(&samples);
        if q.affine {
            pulses(&samples, &mut runs);
        }
        found.first.push(runs.first().map_or(Class::Between, |r| r.class));
        found.changes.extend(changes(k, q, &samples, &runs));
    }
    found.quantities = quantities;
    found.changes.sort_by(|a, b| a.at.total_cmp(&b.at));
    settle(&mut found.changes, &t.mesh);
    found
}

/// Instants of one phase at which the next mesh has an interval end of free time.
#[derive(Default)]
pub(crate) struct Instants {
    pub(crate) touch_points: Vec<Touch>,
    pub(crate) crossings: Vec<Passage>,
}

/// The mesh with these breaks and instants. Intervals that a new one leaves too short become part of their neighbours.
fn with_breaks(
    mesh: &PhaseMesh,
    found: &[Found],
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
    let left_alone: Vec<f64> = left.map(|end| mesh.fractions()[end]).collect();
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
    let at = found.iter().map(|b| Break { end: index(b.at), free: b.free }).collect();
    let mut touch_points: Vec<TouchPoint> =
        touch_points.iter().map(|t| TouchPoint { end: index(t.at), ..t.point }).collect();
    touch_points.sort_by_key(|t| (t.end, t.row));
    let mut crossings: Vec<Crossing> =
        crossings.iter().map(|c| Crossing { end: index(c.at), kink: c.kink }).collect();
    crossings.sort_by_key(|c| c.end);
    let mesh = PhaseMesh::new(ends, points)?.with_arcs(at, arcs)?;
    Ok(mesh.with_touch_points(touch_points)?.with_crossings(crossings)?)
}
