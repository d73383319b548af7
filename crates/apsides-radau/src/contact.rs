//! Contacts: path constraint rows without controls that touch their bounds in one instant.
//!
//! There the multiplier of the row is an impulse and the costates jump, which no polynomial follows. Where one or two nodes carry the
//! multiplier of a row, the next mesh has an interval end at their centroid, which is that of the impulse, and the row is held
//! at its bound there; its bounds are left out beside it, so that the solution is smooth on both sides. The time of this end is an
//! unknown, the rate of the row vanishes there ([`crate::rate_term`]). Where that leads to a multiplier of the wrong sign or to an
//! excess beside the contact, as on an arc, refinement goes on without the contact.

use apsides_nlp::SolveReport;
use apsides_ocp::{
    ArcKind, Contact, Ocp, Phase, PhaseTrajectory, PiecewisePolynomial, TouchPoint, Trajectory,
};

use crate::RadauError;
use crate::activity::{APART, COLLAPSED, CROSSING, Class, NodeSample, ROUGH, Solution, samples};
use crate::breaks::Touch;
use crate::junction::{depends_on_time, order};
use crate::layout::CollocationPhase;
use crate::quantity::{Quantity, QuantityKind, rows_without_controls};
use crate::settings::RadauSettings;
use crate::switches::Structure;
use crate::transcription::Transcription;

/// Most meshes for the sake of contacts.
const MOST_MOVES: usize = 10;

/// So many contacts that were none: no more are looked for.
const MOST_REFUTED: usize = 2;

/// The nodes that were no contact are looked at again when they are closer than this part of what they were.
const CLOSER: f64 = 0.25;

/// An excess beside a contact counts from this multiple of the error of the intervals there on.
const CLEAR: f64 = 10.0;

/// Nodes with less than this part of the multiplier of a contact are not active: what they have is that of the barrier.
const WEAK: f64 = 0.02;

/// Multipliers of the wrong sign, times the scale of the row and relative to that of the objective, from which on there is no
/// contact.
const WRONG_SIGN: f64 = 1e-6;

/// Relative multipliers below are no evidence of a contact.
const NO_EVIDENCE: f64 = 1e-5;

/// A contact on the mesh to be solved next.
#[derive(Clone, Copy)]
struct Tracked {
    phase: usize,
    touch: Touch,
    /// Distance of the nodes around it when it was found.
    gap: f64,
}

/// A place that was taken for a contact and is none.
struct Refuted {
    phase: usize,
    row: usize,
    at: f64,
    gap: f64,
}

/// The contacts of a solve from mesh to mesh.
pub(crate) struct Contacts {
    tracked: Vec<Tracked>,
    refuted: Vec<Refuted>,
    /// Phases and rows with contacts that arcs have become.
    from_arcs: Vec<(usize, usize)>,
    /// Phases and rows whose arcs were none.
    no_arcs: Vec<(usize, usize)>,
    moves: usize,
}

/// The contacts of the next mesh.
pub(crate) struct NextContacts {
    /// True when the contacts of the mesh are those of the trajectory and stand where they should.
    pub(crate) settled: bool,
    /// Per phase, in order.
    pub(crate) touch_points: Vec<Vec<Touch>>,
    /// True when all contacts of the mesh were none.
    pub(crate) refuted: bool,
    /// Phase and interval of errors that come from a contact in the wrong place.
    spared: Vec<(usize, usize)>,
    /// Impulses of new contacts, and the nodes that they were spread over.
    new: Vec<New>,
}

struct New {
    phase: usize,
    contact: Contact,
    /// Interval and index within it.
    nodes: Vec<(usize, usize)>,
}

/// A mesh that was solved.
pub(crate) struct SolvedMesh<'a> {
    pub(crate) ocp: &'a Ocp,
    pub(crate) report: &'a SolveReport,
    pub(crate) trajectory: &'a Trajectory,
    /// Per phase and interval, the excess of rows beside touch points, relative as the error of the mesh.
    pub(crate) beside_touch: &'a [Vec<f64>],
    pub(crate) settings: &'a RadauSettings,
    /// Arcs along bounds are no contacts.
    pub(crate) structure: &'a Structure<'a>,
}

impl Contacts {
    pub(crate) fn new(enabled: bool) -> Self {
        let moves = if enabled { MOST_MOVES } else { 0 };
        Self { tracked: Vec::new(), refuted: Vec::new(), from_arcs: Vec::new(), no_arcs: Vec::new(), moves }
    }

    /// Phases and rows that touch their bounds in instants alone.
    pub(crate) fn without_arcs(&self) -> &[(usize, usize)] {
        &self.no_arcs
    }

    /// Looks for no more contacts.
    pub(crate) fn give_up(&mut self) {
        *self = Self::new(false);
    }

    /// Compares the contacts of the mesh with the trajectory on it, and looks for new ones.
    pub(crate) fn step(&mut self, solved: &SolvedMesh<'_>, nlp: &mut Transcription) -> NextContacts {
        let &SolvedMesh { ocp, report, trajectory, .. } = solved;
        let mut next = NextContacts {
            settled: true,
            touch_points: vec![Vec::new(); ocp.phases.len()],
            refuted: false,
            spared: Vec::new(),
            new: Vec::new(),
        };
        if self.moves == 0 {
            return next;
        }
        let past = std::mem::take(&mut self.tracked);
        let mut placed = Vec::new();
        let solution =
            Solution { report, curvatures: &[], row_bends: &[], objective: nlp.scales.objective.abs() };
        for (k, (phase, t)) in ocp.phases.iter().zip(&trajectory.phases).enumerate() {
            for q in rows_without_controls(phase) {
                let p = &nlp.layout.phases[k];
                let Some(course) = RowCourse::new(phase, t, &q, (p, report)) else { continue };
                if solved.structure.has_arcs_along(k, course.row) {
                    continue;
                }
                let (samples, _) = samples(&q, p, t, &solution);
                let active = active_nodes(&samples, course.row, p, report);
                let past: Vec<&Tracked> =
                    past.iter().filter(|c| c.phase == k && c.touch.point.row == course.row).collect();
                let largest_wrong = WRONG_SIGN * solution.objective / course.scale;
                placed.extend(self.known(k, &past, &course, largest_wrong, solved));
                let from_arcs = self.left_of_arcs(k, (&course, solved.structure), &mut next);
                if !from_arcs && self.refuted.len() < MOST_REFUTED {
                    self.found(k, &samples, &active, (&course, solved.structure), p, &mut next);
                }
            }
        }
        let touch_points: usize = trajectory.phases.iter().map(|t| t.mesh.touch_points().len()).sum();
        next.settled &= placed.len() == touch_points;
        self.tracked.extend(placed);
        self.moves -= usize::from(!next.settled);
        if self.moves == 0 && !next.settled {
            self.tracked.clear();
        }
        next.refuted = touch_points > 0 && self.tracked.is_empty();
        self.tracked.sort_by(|a, b| a.touch.at.total_cmp(&b.touch.at));
        for c in &self.tracked {
            next.touch_points[c.phase].push(c.touch);
        }
        next
    }

    /// The contacts of a row that the mesh has, without those that are none.
    fn known(
        &mut self,
        phase: usize,
        past: &[&Tracked],
        course: &RowCourse<'_>,
        largest_wrong: f64,
        solved: &SolvedMesh<'_>,
    ) -> Vec<Tracked> {
        let (row, t) = (course.row, course.trajectory);
        let touch_points = t.mesh.touch_points().iter().filter(|c| c.row == row);
        let mut placed = Vec::new();
        for (k, &point) in touch_points.enumerate() {
            let TouchPoint { end, upper, .. } = point;
            let at = t.mesh.fractions()[end];
            let gap = past.get(k).map_or(f64::INFINITY, |c| c.gap);
            let contact = t.contacts.iter().find(|c| c.end == end && c.row == row);
            let impulse = contact.map_or(0.0, |c| c.multiplier);
            let is_wrong = if upper { -impulse } else { impulse } > largest_wrong;
            // Beyond the bound beside the place where the row stands still: an arc.
            let beside = [end - 1, end];
            let largest = |of: &[f64]| beside.iter().fold(0.0_f64, |m, k| m.max(of[*k]));
            let (excess, error) = (largest(&solved.beside_touch[phase]), largest(&t.interval_errors));
            let is_arc = error <= ROUGH && excess > solved.settings.tolerance.max(CLEAR * error);
            if is_wrong || is_arc {
                self.refuted.push(Refuted { phase, row, at, gap });
            } else {
                placed.push(Tracked { phase, touch: Touch { at, point }, gap });
            }
        }
        placed
    }

    /// Contacts where arcs along the bound of a row have come to nothing: once for each row, since arcs come from contacts that were none. Of
    /// an arc between whose ends nothing presses the row to its bound there are contacts left, which a mesh without it shows; where controls at
    /// their own bounds leave it there, none. Returns true if there are any.
    fn left_of_arcs(
        &mut self,
        phase: usize,
        (course, structure): (&RowCourse<'_>, &Structure<'_>),
        next: &mut NextContacts,
    ) -> bool {
        let (mesh, row) = (&course.trajectory.mesh, course.row);
        let mut any = false;
        if self.from_arcs.contains(&(phase, row)) {
            return any;
        }
        for (k, arc) in mesh.arcs().iter().enumerate() {
            let upper = match arc.rows.get(row) {
                Some(Some(ArcKind::Upper)) => true,
                Some(Some(ArcKind::Lower)) => false,
                _ => continue,
            };
            let intervals = mesh.arc_intervals(k);
            let (start, end) = (mesh.fractions()[intervals.start], mesh.fractions()[intervals.end]);
            if structure.rests_at(phase, row, 0.5 * (start + end)) {
                continue;
            }
            self.from_arcs.push((phase, row));
            next.settled = false;
            next.spared.extend((intervals.start.saturating_sub(1)..=intervals.end).map(|k| (phase, k)));
            if end - start > COLLAPSED {
                self.no_arcs.push((phase, row));
                continue;
            }
            let touch = Touch { at: 0.5 * (start + end), point: TouchPoint { end: 0, row, upper } };
            self.tracked.push(Tracked { phase, touch, gap: COLLAPSED });
            any = true;
        }
        any
    }

    /// New contacts of a row: one or two nodes that have its multiplier, apart from others.
    fn found(
        &mut self,
        phase: usize,
        samples: &[NodeSample],
        active: &[Active],
        (course, structure): (&RowCourse<'_>, &Structure<'_>),
        p: &CollocationPhase,
        next: &mut NextContacts,
    ) {
        let (t, row) = (course.trajectory, course.row);
        let clusters = active.chunk_by(|a, b| b.index - a.index <= APART);
        for cluster in clusters.filter(|c| c.len() <= CROSSING && c.iter().all(|a| !a.is_touch)) {
            let (first, last) = (cluster[0], cluster[cluster.len() - 1]);
            // Beside a contact that the mesh has it belongs to that one.
            let is_known = t.mesh.touch_points().iter().any(|c| {
                let here = |a: Active| a.interval == c.end || a.interval + 1 == c.end;
                c.row == row && (here(first) || here(last))
            });
            if is_known || first.index == 0 || last.index + 1 == samples.len() || first.upper != last.upper {
                continue;
            }
            let (before, after) = (&samples[first.index - 1], &samples[last.index + 1]);
            let elsewhere = |k: &usize| k + 1 < before.interval || *k > after.interval + 1;
            let mut others = (0..t.mesh.intervals()).filter(elsewhere).map(|k| t.interval_errors[k]);
            if others.any(|e| e > ROUGH) {
                continue;
            }
            let (at, gap) = (centroid(cluster.iter()), after.fraction - before.fraction);
            let again = |r: &Refuted| {
                r.phase == phase && r.row == row && (r.at - at).abs() < r.gap && gap > CLOSER * r.gap
            };
            if !(COLLAPSED..1.0 - COLLAPSED).contains(&at)
                || self.refuted.iter().any(again)
                || structure.rests_at(phase, row, at)
            {
                continue;
            }
            next.settled = false;
            next.spared.extend((before.interval..=after.interval).map(|k| (phase, k)));
            let point = TouchPoint { end: 0, row, upper: first.upper };
            self.tracked.push(Tracked { phase, touch: Touch { at, point }, gap });
            let multiplier = cluster.iter().map(|a| a.multiplier).sum();
            let end = nearest(t.mesh.fractions(), at);
            let place =
                |a: &Active| (p.nodes[samples[a.index].node].interval, p.nodes[samples[a.index].node].local);
            let nodes = cluster.iter().map(place).collect();
            next.new.push(New { phase, contact: Contact { end, row, multiplier }, nodes });
        }
    }
}

/// A node with a part of the multiplier of a row that counts.
#[derive(Clone, Copy)]
struct Active {
    /// Among the samples.
    index: usize,
    interval: usize,
    fraction: f64,
    multiplier: f64,
    upper: bool,
    is_touch: bool,
}

/// The active nodes of a row, without those that have little of the multiplier of the nodes around them.
fn active_nodes(
    samples: &[NodeSample],
    row: usize,
    p: &CollocationPhase,
    report: &SolveReport,
) -> Vec<Active> {
    let multiplier = |s: &NodeSample| report.constraint_multipliers[p.path_row(s.node) + row];
    let mut active = Vec::new();
    let mut first = 0;
    for run in samples.chunk_by(|a, b| a.class == b.class) {
        let largest = run.iter().fold(0.0_f64, |m, s| m.max(multiplier(s).abs()));
        let evident = run.iter().any(|s| s.slope.abs() > NO_EVIDENCE);
        for (s, index) in run.iter().zip(first..) {
            let is_strong = multiplier(s).abs() > WEAK * largest && evident;
            if s.class != Class::Between && is_strong {
                active.push(Active {
                    index,
                    interval: s.interval,
                    fraction: s.fraction,
                    multiplier: multiplier(s),
                    upper: s.class == Class::Upper,
                    is_touch: p.touch_at(s.node, row).is_some(),
                });
            }
        }
        first += run.len();
    }
    active
}

/// Normalised time of the impulse that the multipliers stand for.
fn centroid<'a>(active: impl Iterator<Item = &'a Active>) -> f64 {
    let (moment, sum) =
        active.fold((0.0, 0.0), |(m, s), a| (m + a.multiplier * a.fraction, s + a.multiplier));
    moment / sum
}

impl NextContacts {
    /// Says whether the next mesh has contacts that this one has not.
    pub(crate) fn has_new(&self) -> bool {
        !self.new.is_empty()
    }

    /// The trajectory without errors that a better place of the contacts removes.
    pub(crate) fn spared(&self, mut trajectory: Trajectory) -> Trajectory {
        for &(phase, interval) in &self.spared {
            if let Some(error) = trajectory.phases[phase].interval_errors.get_mut(interval) {
                *error = 0.0;
            }
        }
        trajectory
    }

    /// The trajectory with the impulses of new contacts instead of the multipliers at their nodes, to start from.
    ///
    /// # Errors
    /// None: the polynomials keep their sizes.
    pub(crate) fn start(&self, mut trajectory: Trajectory) -> Result<Trajectory, RadauError> {
        for new in &self.new {
            let t = &mut trajectory.phases[new.phase];
            t.contacts.push(new.contact);
            let Some(path) = &t.path_multipliers else { continue };
            let mut segments = path.segments().to_vec();
            for (interval, local) in &new.nodes {
                segments[*interval].values[local * path.dimension() + new.contact.row] = 0.0;
            }
            let path = PiecewisePolynomial::new(path.dimension(), path.breaks().to_vec(), segments)?;
            t.path_multipliers = Some(path);
        }
        Ok(trajectory)
    }
}

fn nearest(fractions: &[f64], at: f64) -> usize {
    let distance = |k: &usize| (fractions[*k] - at).abs();
    (0..fractions.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// A path constraint row of a phase.
struct RowCourse<'a> {
    trajectory: &'a PhaseTrajectory,
    /// Index among the rows of the phase.
    row: usize,
    scale: f64,
}

impl<'a> RowCourse<'a> {
    /// None for a row that depends on the time itself and whose first rate depends on a control: such a rate need not vanish where the row
    /// touches its bound.
    fn new(
        phase: &Phase,
        trajectory: &'a PhaseTrajectory,
        q: &Quantity<'_>,
        (p, report): (&CollocationPhase, &SolveReport),
    ) -> Option<Self> {
        let QuantityKind::Row(row) = q.kind else { return None };
        let has_corner = depends_on_time(phase, row) && order(phase, row).is_some_and(|o| o.order == 1);
        (!has_corner).then(|| Self {
            trajectory,
            row,
            scale: q.variable.size().unwrap_or_else(|| q.range(p, report)),
        })
    }
}
