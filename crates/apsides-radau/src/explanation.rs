//! Reasons that a problem has no feasible trajectory, in the words and units of its statement.
//!
//! The equations of motion stay hard; the requirements (see [`Requirement`]) are relaxed as little as possible, first all
//! together, which names the few that conflict, then those that take part one at a time, which says what each must become.

use std::fmt;

use apsides_nlp::{Nlp, NlpError, Requirement as NlpRequirement, Side, Status, relax};
use apsides_ocp::{Guess, Mesh, Ocp, PhaseMesh, Scaling, Trajectory, Unmet};

use crate::RadauError;
use crate::error_estimate::estimate;
use crate::refinement::refine;
use crate::relaxation::{Item, Requirement, items, outward, short};
use crate::settings::RadauSettings;
use crate::solver::Radau;
use crate::transcription::{Transcription, with_movable_bounds};

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

/// A requirement whose relaxation alone restores feasibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Remedy {
    /// The requirement; its bound now is `requirement.limit`.
    pub requirement: Requirement,
    /// The bound nearest to that with which the problem is feasible, in its unit.
    pub to: f64,
}

/// The requirements that conflict, and what helps.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The end of the relaxation of all requirements together; without success the lists are empty.
    pub status: Status,
    /// The conflict, largest relative amount first. Relaxing all of them by their amounts restores feasibility. None: a
    /// feasible trajectory exists.
    pub conflicts: Vec<Conflict>,
    /// Each of these relaxations alone restores feasibility; smallest relative change first, fixed end values last.
    pub remedies: Vec<Remedy>,
}

/// Tolerance of the solves. A relaxation leaves most of a trajectory open: to a smaller one the method moves along what is
/// open for a hundred iterations, with the amounts unchanged to nine digits.
const TOLERANCE: f64 = 1e-6;
/// Largest product of a distance and its multiplier: amounts give way by the sum over all limits.
const COMPLEMENTARITY: f64 = 1e-8;
/// Iterations of each of the solves.
const MAX_ITERATIONS: usize = 300;
/// Most meshes of each of the solves.
const MAX_MESHES: usize = 5;
/// Most collocation points of each of the solves: an explanation is worth seconds.
const MAX_TOTAL_POINTS: usize = 2000;
/// Error between the points at which amounts are exact enough.
const MESH_TOLERANCE: f64 = 1e-6;
/// The meshes also end when the weighted amounts have settled to `SETTLED`, relative, over two meshes, or over three where
/// the error between the points is above `COARSE_MESH_TOLERANCE`: what a relaxation leaves open, such as a control far
/// from the conflict, may stay rough on every mesh.
const COARSE_MESH_TOLERANCE: f64 = 1e-2;
const SETTLED: f64 = 5e-5;
/// A residual below this part of its scale is rounding.
const ROUNDING: f64 = 1e-12;
/// Requirements tried alone besides those that conflict.
const MOST_OTHERS: usize = 5;

impl Radau {
    /// Explains why no feasible trajectory was found, beginning from a guess, such as the best trajectory reached.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn explain(&self, ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Explanation, RadauError> {
        let (relaxer, mesh) = self.relaxer(ocp, mesh)?;
        let all = relaxer.relax(guess, &mesh, None)?;
        let mut explanation =
            Explanation { status: all.result.report.status, conflicts: Vec::new(), remedies: Vec::new() };
        if !all.result.is_success() {
            return Ok(explanation);
        }
        for g in all.result.conflicts(&all.limits()) {
            explanation.conflicts.extend(all.conflict(ocp, g));
        }
        if explanation.conflicts.is_empty() {
            return Ok(explanation);
        }
        let mut remedies = Vec::new();
        for g in all.result.candidates(&all.limits(), MOST_OTHERS) {
            let Some(requirement) = &all.items[g].requirement else { continue };
            let alone = match relaxer.relax(&all.guess, &all.mesh, Some(g)) {
                Ok(alone) => alone,
                // Another requirement contradicts this one as bounds on the same quantity.
                Err(RadauError::Nlp(NlpError::Bounds { .. })) => continue,
                Err(e) => return Err(e),
            };
            if alone.result.is_success() {
                let amount = alone.result.amounts[g];
                let to = requirement.relaxed(amount);
                let limits = &all.items[g].limits;
                remedies.push((
                    amount * limits.weight / limits.unit,
                    Remedy { requirement: requirement.clone(), to },
                ));
            }
        }
        remedies.sort_by(|a, b| a.0.total_cmp(&b.0));
        explanation.remedies = remedies.into_iter().map(|(_, r)| r).collect();
        Ok(explanation)
    }

    /// A trajectory that meets all requirements, next to a guess: none where none is found, or requirements conflict.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn feasible(&self, ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Option<Trajectory>, RadauError> {
        let (relaxer, mesh) = self.relaxer(ocp, mesh)?;
        let all = relaxer.relax(guess, &mesh, None)?;
        let is_met = all.result.is_success() && all.result.conflicts(&all.limits()).is_empty();
        Ok(if is_met { Some(all.nlp.trajectory(ocp, &all.result.report)?) } else { None })
    }

    /// Relaxes the requirements of a problem; with the mesh to begin on.
    fn relaxer<'a>(&self, ocp: &'a Ocp, mesh: &Mesh) -> Result<(Relaxer<'a>, Mesh), RadauError> {
        self.settings.check()?;
        let mut settings = RadauSettings {
            tolerance: MESH_TOLERANCE.max(self.settings.tolerance),
            switches: false,
            ..self.settings.clone()
        };
        settings.nlp.tolerance = settings.nlp.tolerance.max(TOLERANCE);
        settings.nlp.complementarity_tolerance = settings.nlp.complementarity_tolerance.min(COMPLEMENTARITY);
        settings.nlp.max_iterations = settings.nlp.max_iterations.min(MAX_ITERATIONS);
        // What is held along an arc says nothing about a relaxed problem.
        let mesh = Mesh { phases: mesh.phases.iter().cloned().map(PhaseMesh::without_arcs).collect() };
        Ok((Relaxer { ocp, settings }, mesh))
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
        let (mut x, m) = (vec![0.0; nlp.variables()], nlp.constraints());
        nlp.initial_point(&mut x);
        let (mut values, mut lower, mut upper) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        nlp.constraint_values(&x, &mut values);
        nlp.constraint_bounds(&mut lower, &mut upper);
        let units = nlp.scaling().map_or_else(|| vec![1.0; m], |s| s.constraints);
        let mut rows: Vec<(f64, usize, f64)> = (0..m)
            .map(|r| {
                let amount = (values[r] - upper[r]).max(0.0) - (lower[r] - values[r]).max(0.0);
                // What cannot be evaluated comes first.
                let amount = if values[r].is_finite() { amount } else { f64::NAN };
                let size = if amount.is_nan() { f64::INFINITY } else { amount.abs() / units[r] };
                (size, r, amount)
            })
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

struct Relaxer<'a> {
    ocp: &'a Ocp,
    settings: RadauSettings,
}

/// A relaxation on the mesh that it needed.
struct Relaxed {
    nlp: Transcription,
    items: Vec<Item>,
    result: apsides_nlp::Relaxation,
    guess: Guess,
    mesh: Mesh,
}

impl Relaxer<'_> {
    /// Relaxes one item, or all that can be.
    fn relax(&self, guess: &Guess, mesh: &Mesh, only: Option<usize>) -> Result<Relaxed, RadauError> {
        let (mut guess, mut mesh) = (guess.clone(), mesh.clone());
        let mut rounds = 0;
        let (mut earlier, mut agreements) = (f64::INFINITY, 0);
        loop {
            rounds += 1;
            let mut nlp = with_movable_bounds(self.ocp, &mesh, &guess)?;
            let items = items(self.ocp, &nlp);
            let limits: Vec<NlpRequirement> = items.iter().map(|i| i.limits.clone()).collect();
            let elastic: Vec<usize> = match only {
                Some(g) => vec![g],
                None => (0..items.len()).filter(|&g| items[g].requirement.is_some()).collect(),
            };
            let mut start = vec![0.0; nlp.variables()];
            nlp.initial_point(&mut start);
            let result = relax(&mut nlp, &limits, &elastic, &start, &self.settings.nlp)?;
            if !result.is_success() {
                return Ok(Relaxed { nlp, items, result, guess, mesh });
            }
            let mut trajectory = nlp.trajectory(self.ocp, &result.report)?;
            let scaling = Scaling::new(self.ocp, &guess);
            let error = estimate(self.ocp, &scaling, &self.settings, &mut trajectory)?.error;
            let next = refine(self.ocp, &trajectory, &self.settings)?;
            guess = Guess::earlier(&trajectory);
            let found = result.report.objective;
            agreements = if (found - earlier).abs() <= SETTLED * found.abs() { agreements + 1 } else { 0 };
            earlier = found;
            let settled = agreements >= if error <= COARSE_MESH_TOLERANCE { 1 } else { 2 };
            let points: usize = next.phases.iter().map(PhaseMesh::total_points).sum();
            let last = rounds >= MAX_MESHES.min(self.settings.max_refinements + 1)
                || points > MAX_TOTAL_POINTS.min(self.settings.max_total_points);
            if error <= self.settings.tolerance || settled || last {
                return Ok(Relaxed { nlp, items, result, guess, mesh });
            }
            mesh = next;
        }
    }
}

impl Relaxed {
    fn limits(&self) -> Vec<NlpRequirement> {
        self.items.iter().map(|i| i.limits.clone()).collect()
    }

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
        let (from, to) = (short(r.limit), outward(self.to, r.side));
        write!(f, "{} is {change} from {from} to {to} {}", r.quantity(), r.unit)?;
        r.stated_by.as_ref().map_or(Ok(()), |name| write!(f, " (`{name}`)"))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.status.is_success() {
            return write!(f, "the conflict could not be isolated: {}", self.status);
        }
        if self.conflicts.is_empty() {
            return f.write_str("a feasible trajectory exists; a better guess may find it");
        }
        let list = |items: Vec<String>, joint: &str| items.join(joint);
        f.write_str(&list(self.conflicts.iter().map(Conflict::to_string).collect(), "; "))?;
        if self.remedies.is_empty() {
            return f.write_str("; no single relaxation restores feasibility, these together do");
        }
        let remedies = list(self.remedies.iter().map(Remedy::to_string).collect(), ", or if ");
        write!(f, "; feasible if {remedies}")
    }
}
