//! Where controls and path constraints change between their bounds, and a mesh with breaks there.
//!
//! A break at a jump makes its time an unknown of the next mesh; what stands at a bound along a whole arc is held there. Where
//! a multiplier of the wrong sign shows up then, the arc is divided; arcs that come to nothing are dropped. A quantity that
//! meets its bound continuously does so at a kink, whose time has no effect of first or second order: its break does not move
//! by itself, the bounds are left out on the free side, and the next mesh has the break where the polynomial meets the bound.

use std::ops::Range;

use apsides_nlp::SolveReport;
pub use apsides_ocp::method::{Level, Switch};
use apsides_ocp::{
    ArcKind, Bounds, Break, Mesh, Ocp, Phase, PhaseArc, PhaseMesh, PhaseTrajectory, Trajectory,
};

use crate::RadauError;
use crate::activity::{
    AT_ONCE, CROSSING, Class, NodeSample, Solution, bound_all_along, boundary_runs, curvatures, keep_at_rest,
    pulses, rests, runs, samples, settle_beside, settle_inside,
};
use crate::breaks::{ArcBreak, Instants, with_breaks};
use crate::change::{Change, ChangeKind, changes};
use crate::crossed::leave_crossed;
use crate::determined::{are_bound, determined};
use crate::layout::CollocationPhase;
use crate::quantity::{Quantity, QuantityKind, quantities};
use crate::row_bends::row_bends;
use crate::settling::{Displaced, settle};
use crate::transcription::Transcription;

/// Part of an interval by which a break is off its place at most where the error of the interval is its own.
const MOVED: f64 = 1e-2;

/// The structure of one phase.
struct PhaseStructure<'a> {
    phase: &'a Phase,
    quantities: Vec<Quantity<'a>>,
    /// Per quantity, what it does first.
    first: Vec<Class>,
    /// Per quantity, the bound that it stays at from end to end of the phase and that a barrier keeps it away from.
    kept_away: Vec<Class>,
    changes: Vec<Change>,
    displaced: Vec<Displaced>,
    resting: Vec<Resting>,
    /// Per quantity, normalised times of nodes, and what its bound costs there.
    pushes: Vec<Vec<(f64, f64)>>,
}

/// A stretch along which controls at their bounds leave a row without controls at its own.
struct Resting {
    row: usize,
    controls: Vec<usize>,
    /// Normalised times of its first and last node.
    nodes: (f64, f64),
}

/// The knowledge of earlier meshes.
#[derive(Default)]
pub(crate) struct Known<'k> {
    /// Per phase, the breaks that the mesh has displaced.
    pub(crate) displaced: &'k [Vec<Displaced>],
    /// Phases and rows without controls that touch their bounds in instants alone.
    pub(crate) without_arcs: &'k [(usize, usize)],
}

/// The structure that was found on a mesh.
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
        known: &Known<'_>,
    ) -> Self {
        let curvatures = curvatures(nlp, report);
        let row_bends = row_bends(ocp, nlp, report);
        let objective = nlp.scales.objective.abs();
        let solution = Solution { report, curvatures: &curvatures, row_bends: &row_bends, objective };
        let phases = ocp.phases.iter().zip(&nlp.layout.phases).zip(&trajectory.phases).enumerate();
        let phases = phases.map(|(k, ((phase, p), t))| {
            let displaced = known.displaced.get(k).map_or(&[][..], Vec::as_slice);
            let mut quantities = quantities(phase);
            let is_without = |q: &Quantity<'_>| {
                q.is_boundary()
                    && known.without_arcs.iter().any(|&(at, row)| at == k && q.kind == QuantityKind::Row(row))
            };
            quantities.retain(|q| !is_without(q));
            phase_structure((phase, quantities), p, t, &solution, displaced)
        });
        Self { phases: phases.collect() }
    }

    /// Per phase, the breaks that the next mesh has displaced.
    pub(crate) fn displaced(&self) -> Vec<Vec<Displaced>> {
        self.phases.iter().map(|found| found.displaced.clone()).collect()
    }

    /// Every switch, in the order of the phases and of time.
    pub(crate) fn switches(&self, ocp: &Ocp, trajectory: &Trajectory) -> Vec<Switch> {
        let mut switches = Vec::new();
        for ((found, phase), t) in self.phases.iter().zip(&ocp.phases).zip(&trajectory.phases) {
            let instants =
                found.changes.iter().filter(|c| matches!(c.kind, ChangeKind::Jump | ChangeKind::Junction));
            for c in instants {
                let v = found.quantities[c.quantity].variable;
                switches.push(Switch {
                    phase: phase.name.clone(),
                    name: v.name.clone(),
                    unit: v.unit.clone(),
                    time: t.time_at(c.at),
                    time_unit: phase.time_unit.clone(),
                    located: c.known.is_some(),
                    from: level(c.from, &v.bounds),
                    to: level(c.to, &v.bounds),
                });
            }
        }
        switches
    }

    /// Says whether path constraint rows without controls stay at their bounds along arcs.
    pub(crate) fn has_arcs(&self) -> bool {
        self.phases.iter().any(|found| found.of_kind(ChangeKind::Junction).next().is_some())
    }

    /// Says whether a path constraint row without controls stays at its bounds along arcs.
    pub(crate) fn has_arcs_along(&self, phase: usize, row: usize) -> bool {
        let found = &self.phases[phase];
        let is_row = |c: &Change| found.quantities[c.quantity].kind == QuantityKind::Row(row);
        found.of_kind(ChangeKind::Junction).any(is_row)
    }

    /// Says whether controls at their bounds leave a row without controls at its own at a normalised time: whatever pushes it there is no contact.
    pub(crate) fn rests_at(&self, phase: usize, row: usize, at: f64) -> bool {
        let mut resting = self.phases[phase].resting.iter();
        resting.any(|stretch| stretch.row == row && (stretch.nodes.0..=stretch.nodes.1).contains(&at))
    }

    /// Says whether the mesh of the trajectory has exactly the breaks and arcs that were found; kinks may stand beside their breaks
    /// if the polynomials are `within` their bounds.
    pub(crate) fn is_that_of(&self, trajectory: &Trajectory, within: bool) -> bool {
        self.phases.iter().zip(&trajectory.phases).all(|(found, t)| {
            let breaks = found.breaks();
            breaks.iter().all(|b| b.known.is_some_and(|f| f == b.at || within && !found.is_pushed(b.at)))
                && found.has_the_arcs_of(&breaks, &t.mesh)
        })
    }

    /// The farthest that a kink moves, where the mesh of the trajectory has the breaks and arcs that were found but for the places of kinks.
    pub(crate) fn move_of_kinks(&self, trajectory: &Trajectory) -> Option<f64> {
        let phases = self.phases.iter().zip(&trajectory.phases);
        let moves = phases.map(|(found, t)| {
            let breaks = found.breaks();
            let moves = breaks.iter().map(|b| b.known.map(|f| (f - b.at).abs()));
            let farthest = moves.collect::<Option<Vec<f64>>>()?.into_iter().fold(0.0, f64::max);
            found.has_the_arcs_of(&breaks, &t.mesh).then_some(farthest)
        });
        Some(moves.collect::<Option<Vec<f64>>>()?.into_iter().fold(0.0, f64::max))
    }

    /// The trajectory without the errors of intervals that hold a switch which is no break yet, or a kink away from an interval
    /// end: refining them says nothing. The error is the interval's own where the quantity is held all along, and where its break moves by
    /// little.
    pub(crate) fn spared(&self, trajectory: &Trajectory) -> Trajectory {
        let mut trajectory = trajectory.clone();
        for (found, t) in self.phases.iter().zip(&mut trajectory.phases) {
            let ends = t.mesh.fractions();
            let is_new = |c: &&Change| c.kind != ChangeKind::Unclear && c.known != Some(c.at);
            let new = found.changes.iter().filter(is_new);
            let breaks: Vec<f64> = t.mesh.breaks().iter().map(|b| ends[b.end]).collect();
            for (c, k) in new.flat_map(|c| (0..t.mesh.intervals()).map(move |k| (c, k))) {
                let (start, end) = (ends[k], ends[k + 1]);
                let has_break = c.known.is_some() || breaks.iter().any(|f| (c.gap.0..=c.gap.1).contains(f));
                let depth = (c.at - start).min(end - c.at);
                let is_inside = !has_break || depth > MOVED * (end - start);
                let kind = found.quantities[c.quantity].kind;
                let is_held = is_held(kind, &t.mesh, k);
                // Beside an arc of the same row a coarse interval shows another one where there is none.
                let mut beside =
                    [k.checked_sub(1), Some(k + 1).filter(|k| *k < t.mesh.intervals())].into_iter().flatten();
                let is_beside =
                    c.kind == ChangeKind::Junction && beside.any(|k| self::is_held(kind, &t.mesh, k));
                if c.gap.0 < end && c.gap.1 > start && is_inside && !is_held && !is_beside {
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

impl PhaseStructure<'_> {
    fn of_kind(&self, kind: ChangeKind) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(move |c| c.kind == kind)
    }

    /// The breaks in order of time.
    fn breaks(&self) -> Vec<ArcBreak> {
        let mut breaks: Vec<ArcBreak> = Vec::new();
        for c in self.changes.iter().filter(|c| c.kind != ChangeKind::Unclear) {
            let free = matches!(c.kind, ChangeKind::Jump | ChangeKind::Junction);
            match breaks.last_mut().filter(|b| c.at <= b.at) {
                Some(b) => b.free |= free,
                None => {
                    let is_tangent = self.is_tangent(c.at);
                    breaks.push(ArcBreak { at: c.at, free, is_tangent, known: c.known });
                }
            }
        }
        breaks
    }

    /// Says whether a mesh has as many breaks of the same kinds, and the same arcs between them.
    fn has_the_arcs_of(&self, breaks: &[ArcBreak], mesh: &PhaseMesh) -> bool {
        let is_alike = |(a, b): (&ArcBreak, &Break)| a.free == b.free && a.is_tangent == b.is_tangent;
        breaks.len() == mesh.breaks().len()
            && breaks.iter().zip(mesh.breaks()).all(is_alike)
            && self.arcs(breaks) == mesh.arcs()
    }

    /// Says whether a kink at a break is not in its place.
    fn is_pushed(&self, at: f64) -> bool {
        self.of_kind(ChangeKind::Kink).any(|c| c.at == at && c.is_pushed)
    }

    /// Says whether a row meets its bound at a break where a control leaves its own, or comes to it, without a jump.
    fn is_tangent(&self, at: f64) -> bool {
        let mut here = self.changes.iter().filter(|c| c.kind != ChangeKind::Unclear && c.at == at);
        here.clone().any(|c| c.kind == ChangeKind::Junction)
            && here.any(|c| c.kind != ChangeKind::Junction && c.is_continuous)
    }

    /// The courses of all quantities along the arcs between the breaks.
    fn arcs(&self, breaks: &[ArcBreak]) -> Vec<PhaseArc> {
        let count = |controls: bool| {
            let index = |q: &Quantity<'_>| match q.kind {
                QuantityKind::Control(c) if controls => c + 1,
                QuantityKind::Row(r) if !controls => r + 1,
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
            let ends = &breaks[k.saturating_sub(1)..(k + 1).min(breaks.len())];
            let boundary = self.quantities.iter().zip(&class).filter(|(q, _)| q.is_boundary());
            let is_along_bound = boundary.into_iter().any(|(_, class)| *class != Class::Between);
            let start = if k == 0 { 0.0 } else { breaks[k - 1].at };
            let push = |quantity: usize| mean_between(&self.pushes[quantity], start, end);
            let following = determined(self.phase, &self.quantities, &class, &whole, push);
            for (index, ((q, class), whole)) in self.quantities.iter().zip(&class).zip(whole).enumerate() {
                let has_kink = self.of_kind(ChangeKind::Kink).any(|c| c.quantity == index);
                let between = match (q.affine, has_kink) {
                    // Along a bound the row determines the control, also where it is at its own bound at an end of the arc.
                    (true, _) if is_along_bound => ends.iter().any(|b| b.is_tangent).then_some(ArcKind::Free),
                    (true, _) => Some(ArcKind::Singular),
                    (false, true) => Some(ArcKind::Free),
                    (false, false) => None,
                };
                let follows = following.iter().find(|d| q.kind == QuantityKind::Control(d.control));
                let course = match follows {
                    Some(d) if d.by_what_is_held => Some(ArcKind::Free),
                    Some(_) => class.course(),
                    None => class.course().or(between),
                };
                let course = course.filter(|_| whole);
                match q.kind {
                    QuantityKind::Control(c) => arc.controls[c] = course,
                    QuantityKind::Row(r) => arc.rows[r] = course,
                    QuantityKind::State(_) => {}
                }
            }
            if arc.controls.iter().chain(&arc.rows).all(Option::is_none) {
                arc = PhaseArc::default();
            }
            arcs.push(arc);
        }
        if breaks.is_empty() {
            // A bound active all along needs no holding, unless a barrier keeps the control away from it.
            let mut arc = PhaseArc { controls: vec![None; count(true)], rows: Vec::new() };
            for (q, class) in self.quantities.iter().zip(&self.kept_away) {
                if let (QuantityKind::Control(c), Some(course)) = (q.kind, class.course()) {
                    arc.controls[c] = Some(course);
                }
            }
            let is_empty = arc.controls.iter().all(Option::is_none);
            arcs = vec![if is_empty { PhaseArc::default() } else { arc }];
        }
        arcs
    }
}

fn phase_structure<'a>(
    (phase, mut quantities): (&'a Phase, Vec<Quantity<'a>>),
    p: &CollocationPhase,
    t: &PhaseTrajectory,
    solution: &Solution<'_>,
    displaced: &[Displaced],
) -> PhaseStructure<'a> {
    let first = vec![Class::Between; quantities.len()];
    let away = first.clone();
    let mut found = PhaseStructure {
        phase,
        quantities: Vec::new(),
        first,
        kept_away: away,
        changes: Vec::new(),
        displaced: Vec::new(),
        resting: Vec::new(),
        pushes: vec![Vec::new(); quantities.len()],
    };
    // Where rows meet their bounds controls may oscillate for a few nodes.
    let mut gaps: Vec<(f64, f64)> = Vec::new();
    // Controls that alone hold a row along an arc at its bound, and the first and last node of the arc.
    let mut held: Vec<(usize, f64, f64)> = Vec::new();
    let arcs: Vec<Range<usize>> = (0..t.mesh.arcs().len()).map(|k| t.mesh.arc_intervals(k)).collect();
    for (k, q) in quantities.iter_mut().enumerate().rev() {
        let (mut samples, affine) = samples(q, p, t, solution);
        settle_inside(q, &mut samples, &held);
        if let QuantityKind::Control(control) = q.kind {
            let own = found.resting.iter().filter(|stretch| stretch.controls.contains(&control));
            keep_at_rest(&mut samples, &own.map(|stretch| stretch.nodes).collect::<Vec<_>>(), &arcs);
        }
        q.affine = affine;
        found.pushes[k] = samples.iter().map(|s| (s.fraction, s.push)).collect();
        let mut runs = if q.is_boundary() { boundary_runs(&samples) } else { runs(&samples) };
        if q.affine {
            leave_crossed(&samples, &mut runs);
            settle_beside(&samples, &mut runs, &gaps);
            pulses(&samples, &mut runs);
            found.kept_away[k] = bound_all_along(&samples, &runs);
        }
        found.first[k] = runs.first().map_or(Class::Between, |r| r.class);
        let is_moved_by = |control: usize| q.kind.is_moved_by(phase, control);
        let steered: Vec<(f64, f64)> = held.iter().filter(|h| is_moved_by(h.0)).map(|h| (h.1, h.2)).collect();
        let changes = changes(k, q, &samples, &runs, &steered);
        if q.is_boundary() {
            gaps.extend(changes.iter().map(|c| c.gap));
            if let QuantityKind::Row(row) = q.kind {
                let controls: Vec<usize> = q.held_by.iter().map(|(c, _)| *c).collect();
                // Where a row touches its bound in an instant nodes close by are as close: in a corner, as of the first order, or on a parabola.
                let most = if q.order == 1 { 1 } else { CROSSING };
                let lasts = |nodes: &&[NodeSample]| {
                    nodes.len() > most && nodes[nodes.len() - 1].fraction - nodes[0].fraction > AT_ONCE
                };
                found.resting.extend(rests(&samples).filter(lasts).map(|nodes| Resting {
                    row,
                    controls: controls.clone(),
                    nodes: (nodes[0].fraction, nodes[nodes.len() - 1].fraction),
                }));
            }
            if let [(control, _)] = q.held_by[..] {
                let arcs = runs.iter().filter(|r| r.class != Class::Between);
                held.extend(arcs.map(|r| (control, samples[r.first].fraction, samples[r.last].fraction)));
            }
        }
        found.changes.extend(changes);
    }
    found.changes.sort_by(|a, b| a.at.total_cmp(&b.at));
    let are_bound = |a: usize, b: usize| are_bound(phase, &quantities, a, b);
    let share_a_control =
        |a: usize, b: usize| a != b && quantities[a].kind.shares_a_control(phase, quantities[b].kind);
    found.displaced = settle(&mut found.changes, &t.mesh, displaced, are_bound, share_a_control);
    found.quantities = quantities;
    found
}

/// The mean of the values at nodes between two times; zero if there are none.
fn mean_between(nodes: &[(f64, f64)], start: f64, end: f64) -> f64 {
    let inside = nodes.iter().filter(|(at, _)| (start..end).contains(at));
    let (sum, count) = inside.fold((0.0, 0_usize), |(sum, count), (_, value)| (sum + value, count + 1));
    sum / count.max(1) as f64
}

/// True if the mesh holds a quantity at a bound along an interval.
fn is_held(kind: QuantityKind, mesh: &PhaseMesh, interval: usize) -> bool {
    let arc = (0..mesh.arcs().len()).find(|k| mesh.arc_intervals(*k).contains(&interval));
    let course = arc.map(|k| &mesh.arcs()[k]).and_then(|arc| match kind {
        QuantityKind::Control(c) => arc.controls.get(c).copied().flatten(),
        QuantityKind::Row(r) => arc.rows.get(r).copied().flatten(),
        QuantityKind::State(_) => None,
    });
    matches!(course, Some(ArcKind::Lower | ArcKind::Upper))
}

/// The level that a class stands for.
fn level(class: Class, bounds: &Bounds) -> Level {
    match class {
        Class::Lower => Level::Lower(bounds.lower),
        Class::Between => Level::Between,
        Class::Upper => Level::Upper(bounds.upper),
    }
}
