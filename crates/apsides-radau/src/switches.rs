//! Where controls and path constraints change between their bounds, and a mesh with breaks there.
//!
//! At a node a bound is active when its multiplier, relative to the largest along the phase, exceeds the relative distance
//! to it: at a solution of the interior-point method one of the two is small. The multiplier of a control's bound per unit
//! of time is the switching function `dH/du`, so that its sign confirms the bound and its zero between two nodes is the
//! estimate of a switching time. A break there makes the time an unknown of the next mesh, and what is active along a whole
//! arc is held at its bound; where a multiplier of the wrong sign shows up then, the arc is divided.

use std::fmt;

use apsides_nlp::{Nlp, SolveReport};
use apsides_ocp::{Bounds, Break, Course, Mesh, Ocp, Phase, PhaseArc, PhaseMesh, PhaseTrajectory, Trajectory};

use crate::RadauError;
use crate::layout::PhaseLayout;
use crate::transcription::{LEAST_ARC, Transcription};

/// Part of the range of a quantity within which a bound can be active.
const NEAR: f64 = 1e-2;
/// Relative multipliers below are rounding: no evidence of a bound, nor against one that is held.
const NO_EVIDENCE: f64 = 1e-5;
/// Relative multipliers below are that of the average over the phase of this part of the objective's scale.
const LEAST_SLOPE: f64 = 1e-2;
/// A control whose second derivative of the Hamiltonian, times its range, is below this part of its largest first one jumps;
/// others meet their bounds continuously.
const AFFINE: f64 = 1e-6;
/// Relative multipliers of a bound that is active at so few nodes that it may be an oscillation along a singular arc.
const OSCILLATION: f64 = 1e-2;
/// So many runs in a row, each of at most so many nodes, are an oscillation.
const OSCILLATING: usize = 4;
const SHORT_RUN: usize = 4;
/// Most nodes between opposite bounds that are one switch and no arc of its own.
const CROSSING: usize = 2;
/// Breaks of different quantities closer than this part of the phase are one.
const SAME: f64 = 1e-4;
/// Arcs and intervals shorter than this part of the phase have come to nothing.
const COLLAPSED: f64 = 10.0 * LEAST_ARC;
/// A kink closer than this part of the phase to a break of the mesh is there.
const KINK_SETTLED: f64 = 1e-9;
/// A kink within this part of the phase of a break that is not free is the same one, moved.
const KINK_NEAR: f64 = 0.02;
/// Excess of a bound that was left out, relative to the range, from which on it is not clear of it.
const VIOLATION: f64 = 1e-8;
/// Distances beyond a node, in halves of that to the node before, within which a kink is looked for.
const REACH: usize = 8;
/// An interval beside a new break shorter than this part of its neighbour becomes part of it.
const SHORT: f64 = 0.25;

/// What a control or path constraint does along an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// At its lower bound, of this value.
    Lower(f64),
    /// Between its bounds.
    Between,
    /// At its upper bound, of this value.
    Upper(f64),
}

/// A jump of a control or path constraint between a bound and another value.
#[derive(Clone, Debug, PartialEq)]
pub struct Switch {
    /// Name of the phase.
    pub phase: String,
    /// Name of the control or path constraint row.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// When, in the phase's unit of time.
    pub time: f64,
    /// Unit of `time`.
    pub time_unit: String,
    /// Whether the time was an unknown of the last mesh: it is then as exact as the solution, else an estimate between two
    /// nodes.
    pub located: bool,
    /// Before.
    pub from: Level,
    /// After.
    pub to: Level,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lower(v) | Self::Upper(v) => write!(f, "{v}"),
            Self::Between => f.write_str("between"),
        }
    }
}

impl fmt::Display for Switch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { phase, name, unit, time, time_unit, from, to, .. } = self;
        write!(f, "phase `{phase}`, {name}: {from} -> {to} {unit} at t = {time:.6} {time_unit}")
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Lower,
    Between,
    Upper,
}

impl Class {
    fn course(self) -> Option<Course> {
        match self {
            Self::Lower => Some(Course::Lower),
            Self::Between => None,
            Self::Upper => Some(Course::Upper),
        }
    }

    fn opposite(self, other: Self) -> bool {
        matches!((self, other), (Self::Lower, Self::Upper) | (Self::Upper, Self::Lower))
    }

    fn level(self, bounds: &Bounds) -> Level {
        match self {
            Self::Lower => Level::Lower(bounds.lower),
            Self::Between => Level::Between,
            Self::Upper => Level::Upper(bounds.upper),
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Control(usize),
    Row(usize),
}

/// A control or path constraint row with bounds between which it can move.
struct Quantity<'a> {
    kind: Kind,
    variable: &'a apsides_ocp::Variable,
    range: f64,
    /// Whether it is a control that the Hamiltonian is linear in.
    affine: bool,
}

#[derive(Clone, Copy)]
struct Sample {
    fraction: f64,
    /// Part of the phase that the node stands for.
    width: f64,
    interval: usize,
    /// Relative to the range, above the lower bound.
    above_lower: f64,
    /// Relative to the range, below the upper bound.
    below_upper: f64,
    /// Relative multiplier: positive where the lower bound would be active.
    slope: f64,
    class: Class,
    course: Option<Course>,
}

/// Consecutive nodes of one class, by index into the samples.
#[derive(Clone)]
struct Run {
    class: Class,
    first: usize,
    last: usize,
    /// Too short for nodes at the bound: those in it stand between.
    is_pulse: bool,
}

/// A change of class.
struct Change {
    quantity: usize,
    /// Normalised times of the last node before and of the first one after.
    gap: (f64, f64),
    /// Estimate, later the break.
    at: f64,
    from: Class,
    to: Class,
    kind: ChangeKind,
    /// Normalised time of the break of the mesh that it belongs to already.
    known: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ChangeKind {
    /// The quantity jumps: the time can be an unknown.
    Jump,
    /// It meets its bound continuously: to first and second order the time does not matter, so that it follows from where the
    /// free side meets the bound.
    Kink,
    /// What happens there is not clear yet.
    Unclear,
}

/// A break of a structure.
struct Found {
    at: f64,
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

/// A solved program.
struct Solution<'a> {
    report: &'a SolveReport,
    /// Diagonal of the Hessian of the Lagrangian.
    curvatures: &'a [f64],
    /// Scale of the objective.
    objective: f64,
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

    /// The refined mesh with the breaks and arcs that were found.
    pub(crate) fn mesh(&self, refined: &Mesh) -> Result<Mesh, RadauError> {
        let phases = self.phases.iter().zip(&refined.phases).map(|(found, mesh)| {
            let breaks = found.breaks();
            let arcs = found.arcs(&breaks);
            with_breaks(mesh, &breaks, arcs)
        });
        Ok(Mesh { phases: phases.collect::<Result<_, _>>()? })
    }
}

impl PhaseStructure<'_> {
    fn of_kind(&self, kind: ChangeKind) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(move |c| c.kind == kind)
    }

    /// Breaks in order.
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

    /// What is held between the breaks.
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
                    (true, _) => Some(Course::Singular),
                    (false, true) => Some(Course::Free),
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

fn quantities<'a>(phase: &'a Phase) -> Vec<Quantity<'a>> {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let usable = |v: &apsides_ocp::Variable| v.bounds != Bounds::FREE && !v.bounds.is_fixed();
    let range = |v: &apsides_ocp::Variable| {
        let width = v.bounds.upper - v.bounds.lower;
        if width.is_finite() { width } else { v.size().unwrap_or(1.0) }
    };
    let mut all = Vec::new();
    for (c, v) in phase.controls.iter().enumerate().filter(|(_, v)| usable(v)) {
        all.push(Quantity { kind: Kind::Control(c), variable: v, range: range(v), affine: false });
    }
    let mut index = 0;
    for path in &phase.path {
        let pattern = path.function.pattern();
        for (k, v) in path.rows.iter().enumerate() {
            let columns = &pattern.columns[pattern.row_offsets[k]..pattern.row_offsets[k + 1]];
            // Without a control in it a row cannot jump.
            if usable(v) && columns.iter().any(|c| (nx..nx + nu).contains(c)) {
                all.push(Quantity { kind: Kind::Row(index), variable: v, range: range(v), affine: false });
            }
            index += 1;
        }
    }
    all
}

/// Diagonal of the Hessian of the Lagrangian.
fn curvatures(nlp: &mut Transcription, report: &SolveReport) -> Vec<f64> {
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
        q.affine = affine && matches!(q.kind, Kind::Control(_));
        let mut runs = runs(&samples);
        if q.affine {
            pulses(&samples, &mut runs);
        }
        found.first.push(runs.first().map_or(Class::Between, |r| r.class));
        for pair in runs.windows(2) {
            let (a, b) = (&samples[pair[0].last], &samples[pair[1].first]);
            let crosses = pair[0].class.opposite(pair[1].class);
            let kind = match q.kind {
                _ if !crosses && is_kink(&pair[0], &pair[1]) && !q.affine && !jumps(&samples, &pair[0], &pair[1]) => {
                    ChangeKind::Kink
                }
                Kind::Control(_) if affine => ChangeKind::Jump,
                Kind::Row(_) if crosses || jumps(&samples, &pair[0], &pair[1]) => ChangeKind::Jump,
                _ => ChangeKind::Unclear,
            };
            found.changes.push(Change {
                quantity: k,
                gap: (a.fraction, b.fraction),
                at: match (crosses, kind) {
                    (true, _) if pair[1].is_pulse || pair[0].is_pulse => pulse_end(&samples, &pair[0], &pair[1]),
                    (true, _) => crossing(a, b),
                    (false, ChangeKind::Kink) => meeting(&samples, &pair[0], &pair[1]),
                    (false, _) => 0.5 * (a.fraction + b.fraction),
                },
                from: pair[0].class,
                to: pair[1].class,
                kind,
                known: None,
            });
        }
        // Kinks in another order than their nodes, or beyond the ends of the phase, are not clear yet.
        let own = found.changes.len() + 1 - runs.len().max(1);
        let times: Vec<f64> = found.changes[own..].iter().map(|c| c.at).collect();
        for (i, c) in found.changes[own..].iter_mut().enumerate() {
            let low = if i == 0 { 0.0 } else { times[i - 1] } + COLLAPSED;
            let high = times.get(i + 1).copied().unwrap_or(1.0) - COLLAPSED;
            if c.kind == ChangeKind::Kink && !(low < c.at && c.at < high) {
                c.kind = ChangeKind::Unclear;
            }
        }
    }
    if std::env::var("DBG").is_ok() {
        let times: Vec<f64> = t.mesh.breaks().iter().map(|b| t.mesh.fractions()[b.end]).collect();
        eprintln!("breaks {times:?} arcs {:?}", t.mesh.arcs());
        for q in quantities.iter() {
            let (s, affine) = samples(q, p, t, solution); eprintln!("affine {affine}");
            let r = runs(&s);
            eprintln!("  largest {:e} least {:e}", 0.0, LEAST_SLOPE * solution.objective / (t.final_time-t.initial_time));
            eprintln!("  {} runs {:?}", q.variable.name, r.iter().map(|r| (r.class, s[r.first].fraction, s[r.last].fraction)).collect::<Vec<_>>());
            if std::env::var("DBG").unwrap() == "2" { for s in &s { eprintln!("     {:.6} lo {:.3e} up {:.3e} s {:.3e} {:?}", s.fraction, s.above_lower, s.below_upper, s.slope, s.class); } }
        }
        for k in 0..t.mesh.intervals() { if t.interval_errors[k] > 1e-8 { eprintln!("  bad interval {:.6} {:.6} n {} err {:.2e}", t.mesh.fractions()[k], t.mesh.fractions()[k+1], t.mesh.points()[k], t.interval_errors[k]); } }
        for c in &found.changes { eprintln!("  change {} gap {:?} at {} {:?}->{:?} {:?} {:?}", c.quantity, c.gap, c.at, c.from, c.to, c.kind, c.known); }
    }
    found.quantities = quantities;
    found.changes.sort_by(|a, b| a.at.total_cmp(&b.at));
    settle(&mut found.changes, &t.mesh);
    found
}

/// Whether there are nodes enough on both sides of a change for a kink.
fn is_kink(a: &Run, b: &Run) -> bool {
    let (between, bound) = if a.class == Class::Between { (a, b) } else { (b, a) };
    bound.last - bound.first >= CROSSING && between.last - between.first > CROSSING
}

/// Gives every change the break that it belongs to, or joins it with others close by.
fn settle(changes: &mut [Change], mesh: &PhaseMesh) {
    let times = |free: bool| -> Vec<f64> {
        mesh.breaks().iter().filter(|b| b.free == free).map(|b| mesh.fractions()[b.end]).collect()
    };
    let nearest = |times: &[f64], c: &Change, low: f64, high: f64| -> Option<f64> {
        let inside = times.iter().copied().filter(|f| (low..=high).contains(f));
        inside.min_by(|a, b| (a - c.at).abs().total_cmp(&(b - c.at).abs()))
    };
    let (free, pinned) = (times(true), times(false));
    for c in changes.iter_mut() {
        match c.kind {
            // Nearest to the estimate of those between the two nodes.
            ChangeKind::Jump => {
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
    changes.sort_by(|a, b| a.at.total_cmp(&b.at));
    for i in 1..changes.len() {
        let (before, rest) = changes.split_at_mut(i);
        let c = &mut rest[0];
        let jump = |c: &Change| c.kind == ChangeKind::Jump;
        let Some(last) = before.iter().rev().find(|b| jump(b)).filter(|_| jump(c)) else { continue };
        let same_quantity = before.iter().any(|b| jump(b) && b.quantity == c.quantity && b.at == last.at);
        if c.at - last.at < SAME && !same_quantity && c.known.is_none() {
            (c.at, c.known) = (last.at, last.known);
        }
    }
}

fn samples(
    q: &Quantity<'_>,
    p: &PhaseLayout,
    t: &PhaseTrajectory,
    solution: &Solution<'_>,
) -> (Vec<Sample>, bool) {
    let report = solution.report;
    let duration = t.final_time - t.initial_time;
    let Bounds { lower, upper } = q.variable.bounds;
    let mut samples: Vec<Sample> = Vec::new();
    let mut curvature = 0.0_f64;
    let collapsed: Vec<bool> =
        (0..p.arcs.len()).map(|k| is_collapsed(p.arc_duration(k, &report.x), t)).collect();
    for (node, n) in p.nodes.iter().enumerate() {
        let arc = p.arc_of(node);
        if collapsed[arc] {
            continue;
        }
        let seconds = n.weight * p.arc_duration(arc, &report.x);
        let holds = &p.mesh.arcs()[arc];
        let (value, multiplier, hold) = match q.kind {
            Kind::Control(c) => {
                let column = p.control_column(node) + c;
                let multiplier = report.lower_multipliers[column] - report.upper_multipliers[column];
                curvature = curvature.max(solution.curvatures[column].abs() * q.range.powi(2) / seconds);
                (report.x[column], multiplier, holds.controls.get(c))
            }
            Kind::Row(r) => {
                let row = p.path_row(node) + r;
                (report.constraint_values[row], -report.constraint_multipliers[row], holds.rows.get(r))
            }
        };
        samples.push(Sample {
            fraction: (p.time(node, &report.x) - t.initial_time) / (t.final_time - t.initial_time),
            width: seconds / duration,
            interval: n.interval,
            above_lower: (value - lower) / q.range,
            below_upper: (upper - value) / q.range,
            slope: multiplier * q.range / seconds,
            class: Class::Between,
            course: hold.copied().flatten(),
        });
    }
    let least = LEAST_SLOPE * solution.objective / duration;
    let largest = samples.iter().fold(least, |m, s| m.max(s.slope.abs()));
    let affine = curvature <= AFFINE * largest;
    if std::env::var("DBG").is_ok() { eprintln!("largest {largest:e} least {least:e}"); }
    let is_regular = matches!(q.kind, Kind::Control(_)) && !affine;
    for s in &mut samples {
        s.slope = if largest > 0.0 { s.slope / largest } else { 0.0 };
        s.class = class(s, is_regular);
    }
    keep_ends(&mut samples);
    (samples, affine)
}

/// A multiplier of the wrong sign at the very ends of what is held says that it is not yet exact, since the break stands at
/// the best place.
fn keep_ends(samples: &mut [Sample]) {
    let held_class = |course: Course| match course {
        Course::Lower => Some(Class::Lower),
        Course::Upper => Some(Class::Upper),
        Course::Singular | Course::Free => None,
    };
    let mut start = 0;
    while start < samples.len() {
        let course = samples[start].course;
        let end = (start..samples.len()).find(|&i| samples[i].course != course).unwrap_or(samples.len());
        if let Some(own) = course.and_then(held_class) {
            let wrong = |s: &&Sample| s.class != own;
            let tail = samples[start..end].iter().rev().take_while(wrong).count();
            let head = samples[start..end].iter().take_while(wrong).count();
            if tail <= CROSSING {
                samples[end - tail..end].iter_mut().for_each(|s| s.class = own);
            }
            if head <= CROSSING {
                samples[start..start + head].iter_mut().for_each(|s| s.class = own);
            }
        }
        start = end;
    }
}

/// An arc that has come to nothing.
fn is_collapsed(arc: f64, t: &PhaseTrajectory) -> bool {
    arc <= COLLAPSED * (t.final_time - t.initial_time)
}

/// What a sample says; a control that meets its bounds continuously does not change over to the other one.
fn class(s: &Sample, is_regular: bool) -> Class {
    match s.course {
        Some(Course::Lower) if s.slope >= -NO_EVIDENCE => Class::Lower,
        Some(Course::Upper) if s.slope <= NO_EVIDENCE => Class::Upper,
        // Pushed away from the bound: the other one, if there is one.
        Some(Course::Lower) if s.below_upper.is_finite() && !is_regular => Class::Upper,
        Some(Course::Upper) if s.above_lower.is_finite() && !is_regular => Class::Lower,
        Some(Course::Lower | Course::Upper) => Class::Between,
        Some(Course::Free) if s.above_lower < -VIOLATION => Class::Lower,
        Some(Course::Free) if s.below_upper < -VIOLATION => Class::Upper,
        Some(Course::Free) => Class::Between,
        _ if s.above_lower < NEAR && s.slope > s.above_lower => Class::Lower,
        _ if s.below_upper < NEAR && -s.slope > s.below_upper => Class::Upper,
        _ => Class::Between,
    }
}

fn runs(samples: &[Sample]) -> Vec<Run> {
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
        let known = seen.iter().any(|s| s.course.is_some_and(|course| course != Course::Singular));
        if !known && evidence < if few { OSCILLATION } else { NO_EVIDENCE } {
            r.class = Class::Between;
        }
    }
    joined(&mut runs);
    oscillations(&mut runs);
    // The few nodes of a crossing belong to neither side.
    let mut k = 1;
    while k + 1 < runs.len() {
        let (a, b) = (runs[k - 1].class, runs[k + 1].class);
        if runs[k].class == Class::Between && a.opposite(b) && runs[k].last - runs[k].first < CROSSING {
            runs.remove(k);
        } else {
            k += 1;
        }
    }
    runs
}

/// A few nodes between the bounds, before or after what stands at one, are a pulse to the other one that no node resolves.
fn pulses(samples: &[Sample], runs: &mut [Run]) {
    for k in 0..runs.len() {
        let neighbours = [k.checked_sub(1), Some(k + 1)].map(|i| i.and_then(|i| runs.get(i)).map(|r| r.class));
        let other = match neighbours {
            [Some(Class::Lower), Some(Class::Lower)] | [Some(Class::Lower), None] | [None, Some(Class::Lower)] => Class::Upper,
            [Some(Class::Upper), Some(Class::Upper)] | [Some(Class::Upper), None] | [None, Some(Class::Upper)] => Class::Lower,
            _ => continue,
        };
        let r = &mut runs[k];
        let bounded = samples[r.first].above_lower.is_finite() && samples[r.first].below_upper.is_finite();
        if r.class == Class::Between && r.last - r.first < CROSSING && bounded {
            (r.class, r.is_pulse) = (other, true);
        }
    }
}

/// End of a pulse that has the same area as the nodes in it.
fn pulse_end(samples: &[Sample], a: &Run, b: &Run) -> f64 {
    let pulse = if a.is_pulse { a } else { b };
    let nodes = &samples[pulse.first..=pulse.last];
    let height = |s: &Sample| if pulse.class == Class::Upper { s.above_lower } else { s.below_upper };
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

/// Whether a quantity between its bounds in one of two runs meets the bound of the other with a jump: its course on, from the
/// two nodes before the last, misses the bound.
fn jumps(samples: &[Sample], a: &Run, b: &Run) -> bool {
    let (between, bound, near, step) = if a.class == Class::Between {
        (a, b, a.last, usize::wrapping_sub as fn(usize, usize) -> usize)
    } else {
        (b, a, b.first, usize::wrapping_add as fn(usize, usize) -> usize)
    };
    if between.last - between.first < CROSSING + 1 {
        return false;
    }
    let distance = |i: usize| {
        let s = &samples[i];
        if bound.class == Class::Lower { s.above_lower } else { s.below_upper }
    };
    let (i, j) = (step(near, 1), step(near, 2));
    let edge = 0.5 * (samples[a.last].fraction + samples[b.first].fraction);
    let (fi, fj) = (samples[i].fraction, samples[j].fraction);
    let ahead = distance(i) + (distance(i) - distance(j)) * (edge - fi) / (fi - fj);
    distance(i) > 2.0 * NEAR && ahead > 0.5 * distance(i)
}

/// Where the distance to the bound of one of two runs vanishes, from its polynomial beside the change: through the nodes of the
/// nearest interval where none of them is at the bound, or all have left their bounds out, else through the nearest nodes.
fn meeting(samples: &[Sample], a: &Run, b: &Run) -> f64 {
    let between_first = a.class == Class::Between;
    let bound = if between_first { b.class } else { a.class };
    let distance = |s: &Sample| if bound == Class::Lower { s.above_lower } else { s.below_upper };
    let (near, far) = if between_first { (a.last, b.first) } else { (b.first, a.last) };
    let all: Vec<&Sample> = samples.iter().filter(|s| s.interval == samples[near].interval).collect();
    let clean = |s: &&Sample| s.course == Some(Course::Free) || (s.course.is_none() && s.class == Class::Between);
    let nodes: Vec<&Sample> = if all.len() > 2 && all.iter().all(clean) {
        all
    } else {
        let run = if between_first { a } else { b };
        let free = samples[run.first..=run.last].iter();
        let free = free.filter(|s| !matches!(s.course, Some(Course::Lower | Course::Upper)));
        if between_first { free.rev().take(3).collect() } else { free.take(3).collect() }
    };
    let value = |f: f64| -> f64 {
        let basis = |i: usize| -> f64 {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, s)| (f - s.fraction) / (nodes[i].fraction - s.fraction)).product()
        };
        nodes.iter().enumerate().map(|(i, s)| distance(s) * basis(i)).sum()
    };
    let (mut inside, far) = (samples[near].fraction, samples[far].fraction);
    let mut outside = inside;
    // The bound is met between the two nodes, or a little beyond.
    for k in 0..REACH {
        outside = far + 0.5 * k as f64 * (far - samples[near].fraction);
        if value(outside) < 0.0 {
            break;
        }
        inside = outside;
    }
    if !(value(inside) >= 0.0 && value(outside) < 0.0) {
        return 0.5 * (samples[near].fraction + far);
    }
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if value(middle) > 0.0 { inside = middle } else { outside = middle }
    }
    outside
}

/// Zero of the switching function between two nodes.
fn crossing(a: &Sample, b: &Sample) -> f64 {
    let share = if a.slope * b.slope < 0.0 { a.slope / (a.slope - b.slope) } else { 0.5 };
    a.fraction + share.clamp(0.01, 0.99) * (b.fraction - a.fraction)
}

/// The mesh with these breaks. Intervals that a new break leaves too short become part of their neighbours.
fn with_breaks(mesh: &PhaseMesh, found: &[Found], arcs: Vec<PhaseArc>) -> Result<PhaseMesh, RadauError> {
    let breaks: Vec<f64> = found.iter().map(|b| b.at).collect();
    let mut ends = mesh.fractions().to_vec();
    let mut points = mesh.points().to_vec();
    for &f in &breaks {
        let k = ends.partition_point(|e| *e < f);
        if ends[k] != f {
            ends.insert(k, f);
            points.insert(k, points[k - 1]);
        }
    }
    let old: Vec<f64> = mesh.breaks().iter().map(|b| mesh.fractions()[b.end]).collect();
    let new = |f: f64| breaks.contains(&f) && !old.contains(&f);
    let mut k = 1;
    while k + 1 < ends.len() {
        let (left, right) = (ends[k] - ends[k - 1], ends[k + 1] - ends[k]);
        let beside_new =
            (new(ends[k - 1]) && left < SHORT * right) || (new(ends[k + 1]) && right < SHORT * left);
        let collapsed = old.contains(&ends[k]) && left.min(right) <= COLLAPSED;
        if !breaks.contains(&ends[k]) && (beside_new || collapsed) {
            ends.remove(k);
            let n = points.remove(k);
            points[k - 1] = points[k - 1].max(n);
        } else {
            k += 1;
        }
    }
    let index = |f: f64| ends.partition_point(|e| *e < f);
    let at = found.iter().map(|b| Break { end: index(b.at), free: b.free }).collect();
    Ok(PhaseMesh::new(ends, points)?.with_arcs(at, arcs)?)
}
