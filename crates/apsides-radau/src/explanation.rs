//! Reasons that a problem has no feasible trajectory, in the words and units of its statement.
//!
//! The equations of motion stay hard; the requirements (see [`Requirement`]) are relaxed as little as possible, first all
//! together, which names the few that conflict, then those that take part one at a time, which says what each must become.

use std::fmt;

use apsides_nlp::{NlpError, Observer, Side, Status};
use apsides_ocp::effective_controls::within_effect;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory, Unmet};

use crate::RadauError;
use crate::least_relaxation::{Relaxed, Relaxer};
use crate::relaxation::{Requirement, outward, short};
use crate::settings::RadauSettings;
use crate::solver::{MeshRecord, Radau};
use crate::start_residuals::StartResiduals;
use crate::starts::easier;
use crate::state_bounds::without_arcs;
use crate::transcription::Transcription;

/// A requirement that cannot be met together with the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Conflict {
    /// The requirement.
    pub requirement: Requirement,
    /// By how much it is violated where all requirements give way as little as possible, in its unit; positive.
    pub amount: f64,
    /// When it is violated most, for one that holds along a phase, in the phase's unit of time.
    pub at: Option<f64>,
    /// Unit of `at`.
    pub time_unit: String,
}

/// A requirement whose relaxation alone restores feasibility, on a mesh at least.
#[derive(Clone, Debug, PartialEq)]
pub struct Remedy {
    /// The requirement; its bound now is `requirement.limit`.
    pub requirement: Requirement,
    /// The nearest bound with which the relaxed problem has a motion on its mesh, in its unit.
    pub to: f64,
    /// The bound that is shown to be enough, by a motion that is accurate between the points too: the nearest one, or a hundredth of the relaxation
    /// beyond. None where nothing shows it.
    pub shown_with: Option<f64>,
}

/// The requirements that conflict, and what helps.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The end of the relaxation of all requirements together; without success the lists are empty.
    pub status: Status,
    /// The conflict, largest relative amount first. Relaxing all of them by their amounts restores feasibility. None: all
    /// requirements are met to the resolution.
    pub conflicts: Vec<Conflict>,
    /// Relaxations that each restore feasibility alone: those that are shown to be enough, then those of a mesh alone; smallest relative change
    /// first, fixed end values last.
    pub remedies: Vec<Remedy>,
    /// A conflict below this size, relative to the scales of its quantities, would not have been seen: the accuracy of the relaxation and
    /// the error of its mesh between the points.
    pub resolution: f64,
    /// The number of starts from which no motion misses the requirements by less. A conflict is local: one that was found from a single start
    /// may be that of a bad one.
    pub starts: usize,
    /// A trajectory that meets all requirements to the resolution, where none conflict.
    pub feasible: Option<Trajectory>,
    /// Every mesh of the relaxations.
    pub meshes: Vec<MeshRecord>,
}

impl Explanation {
    /// True if requirements conflict, and relaxations from several starts agree on the least amounts.
    #[must_use]
    pub fn is_certain(&self) -> bool {
        self.status.is_success() && !self.conflicts.is_empty() && self.starts > 1
    }
}

/// Largest relative amount by which a requirement may be missed where a feasible trajectory is claimed: the excess that the method itself
/// allows between the points of a mesh.
const FEASIBLE: f64 = 5e-7;
/// A residual below this part of its scale is rounding.
const ROUNDING: f64 = 1e-12;
/// A relaxation is a lower one if its weighted amounts are below this part of another's.
const LOWER: f64 = 0.99;
/// Times that a relaxation of all requirements is looked for from one that is lower.
const MOST_LOWER: usize = 3;
/// Starts that agree on the least amounts, after which no more are tried.
const AGREED: usize = 3;
/// Part of a change that the rounding of a limit may hide.
const LOST: f64 = 0.1;
/// Part of a relaxation by which more is asked for where its own motion does not show that it is enough.
const MARGIN: f64 = 1e-2;
/// Error of a motion that shows it, relative to the margin, and at most.
const SMALL: f64 = 0.1;
const MOST_ERROR: f64 = 1e-4;
/// Error of a motion above which it is no start of a solve that may show it.
const MOST_ERROR_OF_A_START: f64 = 1e-2;
/// Iterations of that solve on each mesh, and refinements of its mesh.
const MOST_ITERATIONS: usize = 100;
const MOST_REFINEMENTS: usize = 8;
/// Work of all such solves, in iterations on the first mesh of the explanation: what takes more is not shown.
const MOST_WORK: usize = 600;
/// Requirements tried alone besides those that conflict.
const MOST_OTHERS: usize = 5;

impl Radau {
    /// Explains why no feasible trajectory was found, beginning from a guess, such as the best trajectory reached.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn explain(&self, ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Explanation, RadauError> {
        self.explain_from(ocp, guess, mesh, &[], &mut ())
    }

    /// The same, and looks from further guesses whether requirements can be missed by less; the least amounts are explained. The observer may end the
    /// work, with what was found until then.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn explain_from(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: &Mesh,
        further: &[Guess],
        observer: &mut dyn Observer,
    ) -> Result<Explanation, RadauError> {
        let within = within_effect(ocp);
        let ocp = within.as_ref().unwrap_or(ocp);
        let mut relaxer = Relaxer::new(ocp, &self.settings)?;
        let mut all = relaxer.relax(guess, &without_arcs(mesh.clone()), None, observer)?;
        let mut meshes = all.meshes.clone();
        let mut starts = least(&relaxer, &mut all, further, &mut meshes, observer)?;
        if all.meets_all() {
            // A conflict may be smaller than these amounts are exact.
            let exact = Relaxer::exact(ocp, &self.settings)?;
            let closer = exact.relax(&all.guess, &all.mesh, None, observer)?;
            meshes.extend(closer.meshes.iter().cloned());
            if closer.result.is_success() {
                (relaxer, all) = (exact, closer);
                starts = least(&relaxer, &mut all, further, &mut meshes, observer)?;
            }
        }
        let ways = least_way(&relaxer, &mut all, &mut meshes, observer)?;
        let mut explanation = Explanation {
            status: all.result.report.status,
            conflicts: Vec::new(),
            remedies: Vec::new(),
            resolution: all.resolution(),
            starts,
            feasible: None,
            meshes: Vec::new(),
        };
        if all.result.is_success() {
            for g in all.result.conflicts(&all.limits()) {
                explanation.conflicts.extend(all.conflict(ocp, g));
            }
        }
        if !explanation.conflicts.is_empty() {
            let mut work = 0;
            for way in ways {
                let shown_with = self.shown_with(ocp, &relaxer, &way, &mut work, &mut meshes, observer)?;
                explanation.remedies.push(Remedy { shown_with, ..way.remedy });
            }
            explanation.remedies.sort_by_key(|remedy| remedy.shown_with.is_none());
        } else if all.result.is_success() {
            explanation.feasible = Some(all.nlp.trajectory(relaxer.ocp(), &all.result.report)?);
        }
        explanation.meshes = meshes;
        Ok(explanation)
    }

    /// The bound of a way out that is shown to be enough: the nearest one by its motion, where that is accurate between the points too, else one a
    /// little beyond, by a motion whose error is small beside that or by a solve. On a coarse mesh a motion leaps over walls, and gains by errors.
    fn shown_with(
        &self,
        ocp: &Ocp,
        relaxer: &Relaxer<'_>,
        WayOut { remedy: Remedy { requirement, to, .. }, motion }: &WayOut,
        work: &mut usize,
        meshes: &mut Vec<MeshRecord>,
        observer: &mut dyn Observer,
    ) -> Result<Option<f64>, RadauError> {
        if motion.error() <= relaxer.tolerance() {
            return Ok(Some(*to));
        }
        let beyond = to + MARGIN * (to - requirement.limit);
        // An error that is small beside the margin.
        let tolerance = (SMALL * MARGIN * motion.largest()).min(MOST_ERROR).max(self.settings.tolerance);
        if motion.error() <= tolerance {
            return Ok(Some(beyond));
        }
        let most = MOST_WORK * meshes.first().map_or(0, |m| m.points);
        if motion.error() > MOST_ERROR_OF_A_START || *work > most {
            return Ok(None);
        }
        let guess = Guess::along(&motion.nlp.trajectory(relaxer.ocp(), &motion.result.report)?)?;
        let mut relaxed = ocp.clone();
        requirement.restate(&mut relaxed, beyond);
        let Some(relaxed) = easier(&relaxed, &guess) else { return Ok(None) };
        let mut settings = RadauSettings { tolerance, ..self.settings.clone() };
        settings.max_refinements = settings.max_refinements.min(MOST_REFINEMENTS);
        settings.nlp.max_iterations = settings.nlp.max_iterations.min(MOST_ITERATIONS);
        let radau = Self { settings };
        let found =
            radau.solve_from_guess(&relaxed, guess, motion.mesh.clone(), MOST_ITERATIONS, observer)?;
        *work += found.meshes.iter().map(|m| m.counters.iterations * m.points).sum::<usize>();
        meshes.extend(found.meshes.iter().cloned());
        Ok((found.status.is_success() && found.accurate).then_some(beyond))
    }

    /// The largest residuals of a guess on a mesh before the first iteration: one per constraint, relative to its scale
    /// the largest first, at most `most`.
    ///
    /// # Errors
    /// When guess or mesh do not fit the problem.
    pub fn guess_residuals(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: &Mesh,
        most: usize,
    ) -> Result<Vec<Unmet>, RadauError> {
        let mut nlp = Transcription::new(ocp, mesh, guess)?;
        let StartResiduals { x, rows } = StartResiduals::of(&mut nlp);
        let mut rows: Vec<(f64, usize, f64)> = (rows.into_iter().enumerate())
            .map(|(r, (size, amount))| (size, r, amount))
            .filter(|(size, ..)| *size > ROUNDING)
            .collect();
        rows.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut worst: Vec<Unmet> = Vec::new();
        for (_, r, amount) in rows {
            if worst.len() >= most {
                break;
            }
            let Some(origin) = nlp.row_origin(ocp, r, &x) else { continue };
            if !worst.iter().any(|u| u.origin.phase == origin.phase && u.origin.name == origin.name) {
                worst.push(Unmet { origin, amount });
            }
        }
        Ok(worst)
    }
}

/// Goes to lower amounts from further starts; returns the number of starts from which there are none below those.
fn least(
    relaxer: &Relaxer<'_>,
    all: &mut Relaxed,
    further: &[Guess],
    meshes: &mut Vec<MeshRecord>,
    observer: &mut dyn Observer,
) -> Result<usize, RadauError> {
    let screen = relaxer.on_one_mesh();
    let mut starts = usize::from(all.result.is_success());
    for start in further {
        if starts == 0 || starts >= AGREED || all.meets_all() {
            break;
        }
        let screened = screen.relax(start, &all.mesh, None, observer)?;
        meshes.extend(screened.meshes.iter().cloned());
        if !screened.result.is_success() {
            continue;
        }
        let mut lower = screened;
        if lower.total() < LOWER * all.total() {
            // On one mesh alone a motion may miss by less than it does between the points.
            lower = relaxer.relax(&lower.guess, &all.mesh, None, observer)?;
            meshes.extend(lower.meshes.iter().cloned());
            if !lower.result.is_success() {
                continue;
            }
        }
        // Motions from the starts before miss them by more, or this one does: both agree that none misses them by less.
        starts += 1;
        if lower.total() < LOWER * all.total() {
            *all = lower;
        }
    }
    Ok(starts)
}

/// Goes to lower amounts from the requirement that needs least alone, while it needs less than all together: those are not the least ones then.
fn least_way(
    relaxer: &Relaxer<'_>,
    all: &mut Relaxed,
    meshes: &mut Vec<MeshRecord>,
    observer: &mut dyn Observer,
) -> Result<Vec<WayOut>, RadauError> {
    let mut ways = Vec::new();
    for _ in 0..MOST_LOWER {
        if all.meets_all() || !all.result.is_success() {
            break;
        }
        ways = ways_out(relaxer, all, meshes, observer)?;
        let Some(lower) = ways.first().filter(|way| way.motion.total() < LOWER * all.total()) else { break };
        let again = relaxer.relax(&lower.motion.guess, &lower.motion.mesh, None, observer)?;
        meshes.extend(again.meshes.iter().cloned());
        if !again.result.is_success() || again.total() >= LOWER * all.total() {
            break;
        }
        *all = again;
    }
    Ok(ways)
}

/// One requirement whose relaxation alone restores feasibility, and the motion that this allows.
struct WayOut {
    remedy: Remedy,
    motion: Relaxed,
}

/// The requirements that each restore feasibility alone, the least relaxation first.
fn ways_out(
    relaxer: &Relaxer<'_>,
    all: &Relaxed,
    meshes: &mut Vec<MeshRecord>,
    observer: &mut dyn Observer,
) -> Result<Vec<WayOut>, RadauError> {
    let screen = relaxer.on_one_mesh();
    let mut ways = Vec::new();
    for g in all.result.candidates(&all.limits(), MOST_OTHERS) {
        let Some(requirement) = &all.items[g].requirement else { continue };
        // One that has no solution takes many iterations to say so.
        let screened = match screen.relax(&all.first.0, &all.first.1, Some(g), observer) {
            Ok(screened) => screened,
            // Another requirement contradicts this one as bounds on the same quantity.
            Err(RadauError::Nlp(NlpError::Bounds { .. })) => continue,
            Err(e) => return Err(e),
        };
        meshes.extend(screened.meshes);
        if !screened.result.is_success() {
            continue;
        }
        let alone = relaxer.relax(&screened.guess, &all.mesh, Some(g), observer)?;
        meshes.extend(alone.meshes.iter().cloned());
        if alone.result.is_success() {
            let to = requirement.relaxed(alone.result.amounts[g]);
            ways.push(WayOut {
                remedy: Remedy { requirement: requirement.clone(), to, shown_with: None },
                motion: alone,
            });
        }
    }
    ways.sort_by(|a, b| a.motion.total().total_cmp(&b.motion.total()));
    Ok(ways)
}

impl Relaxed {
    fn conflict(&self, ocp: &Ocp, g: usize) -> Option<Conflict> {
        let item = &self.items[g];
        let requirement = item.requirement.clone()?;
        let report = &self.result.report;
        let phase = item.instants.first().and_then(|&(k, _)| ocp.phases.get(k));
        Some(Conflict {
            requirement,
            amount: self.result.amounts[g],
            at: item.worst_instant(&self.nlp, &report.x, &report.constraint_values),
            time_unit: phase.map_or_else(String::new, |p| p.time_unit.clone()),
        })
    }
}

impl fmt::Display for Conflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let r = &self.requirement;
        let verb = match (r.fixed, r.side) {
            (true, _) => "missed by",
            (_, Side::Lower) => "short by",
            (_, Side::Upper) => "exceeded by",
        };
        write!(f, "{r}: {verb} {} {}", short(self.amount), r.unit)?;
        if let Some(t) = self.at {
            write!(f, " at t = {t:.3} {}", self.time_unit)?;
        }
        r.stated_by.as_ref().map_or(Ok(()), |name| write!(f, " (`{name}`)"))
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let r = &self.requirement;
        let change = if r.side == Side::Lower { "lowered" } else { "raised" };
        let to = outward(self.to, r.limit, r.side);
        // A change in later digits is shown in all of them.
        let is_lost = (short(r.limit) - r.limit).abs() > LOST * (to - r.limit).abs();
        let from = if is_lost { r.limit } else { short(r.limit) };
        write!(f, "{} is {change} from {from} to {to} {}", r.quantity(), r.unit)?;
        r.stated_by.as_ref().map_or(Ok(()), |name| write!(f, " (`{name}`)"))?;
        let beyond = self.shown_with.filter(|shown| *shown != self.to);
        beyond.map_or(Ok(()), |b| write!(f, ", shown with {} {}", outward(b, r.limit, r.side), r.unit))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.status.is_success() {
            return write!(f, "the conflict could not be isolated: {}", self.status);
        }
        if self.conflicts.is_empty() && self.resolution <= FEASIBLE {
            return f.write_str("a feasible trajectory exists; a better guess may find it");
        }
        if self.conflicts.is_empty() {
            return write!(
                f,
                "no conflict above {:.0e} of the scales of its quantities is left, but no trajectory is shown to meet all \
                 requirements; a better guess may find one",
                self.resolution
            );
        }
        let list = |items: Vec<String>, joint: &str| items.join(joint);
        f.write_str(&list(self.conflicts.iter().map(Conflict::to_string).collect(), "; "))?;
        if self.remedies.is_empty() {
            return f.write_str("; no single relaxation was found that restores feasibility");
        }
        let (shown, estimated): (Vec<&Remedy>, Vec<&Remedy>) =
            self.remedies.iter().partition(|r| r.shown_with.is_some());
        let any_of =
            |remedies: Vec<&Remedy>| list(remedies.iter().map(ToString::to_string).collect(), ", or if ");
        if !shown.is_empty() {
            write!(f, "; feasible if {}", any_of(shown))?;
        }
        if !estimated.is_empty() {
            write!(
                f,
                "; by the estimate of a mesh, which may not be enough, feasible if {}",
                any_of(estimated)
            )?;
        }
        Ok(())
    }
}
