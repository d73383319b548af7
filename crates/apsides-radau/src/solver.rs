//! Solve, estimate, refine, until the error between the points meets the tolerance.

use std::time::{Duration, Instant};

use apsides_nlp::{Observer, SolveReport, Status};
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Mesh, Ocp, PhaseMesh, Scaling, Trajectory, Unmet};
use apsides_transcription::Workers;

use crate::RadauError;
use crate::boundary_arcs::with_long_intervals;
use crate::breaks::{Instants, with_instants};
use crate::contact::{Contacts, SolvedMesh};
use crate::costate_error::CostateMeshes;
use crate::crossing::{Crossings, with_forced};
use crate::error_estimate::estimate;
use crate::lower_hamiltonian::with_lower_hamiltonian;
use crate::progress::Progress;
use crate::redundant::Irredundant;
use crate::refinement::refine;
use crate::saddle::{Watch, beyond_saddle};
use crate::scales::{ScaleWarning, scale_warnings};
pub use crate::settings::RadauSettings;
use crate::state_bounds::{StateRows, without_arcs};
use crate::switches::{Structure, Switch};
use crate::transcription::Transcription;

/// Most changes of the structure of switches in a solve: what has not settled then is left to refinement.
const MOST_REVISIONS: usize = 8;

/// Most meshes that are solved again since single nodes are caught at controls that are no minimum.
const MOST_CAUGHT: usize = 3;

/// Most meshes that are solved again since quantities are much smaller than their scales.
const MOST_RESCALED: usize = 3;

/// Least fall of the objective from better controls, relative.
const LEAST_FALL: f64 = 1e-10;

/// Iterations of a solve with breaks, unless it is the first.
const MOST_ITERATIONS_WITH_BREAKS: usize = 200;

/// Iterations on a first mesh across kinks, before one with interval ends there is tried.
const MOST_ITERATIONS_WITH_KINKS: usize = 300;

/// A mesh for the sake of the bounds on controls alone must bring their excess below this part of what it was.
const LEAST_GAIN: f64 = 0.5;

/// The method: hp Legendre-Gauss-Radau collocation.
#[derive(Clone, Debug, Default)]
pub struct Radau {
    /// Settings.
    pub settings: RadauSettings,
}

/// One mesh of a solve.
#[derive(Clone, Debug)]
pub struct MeshRecord {
    /// Intervals of all phases.
    pub intervals: usize,
    /// Collocation points of all phases.
    pub points: usize,
    /// Largest estimated relative error.
    pub error: f64,
    /// Size of the discretised problem, and the work of the interior-point method.
    pub counters: Counters,
    /// Wall-clock time of the mesh: transcription, solve, estimate.
    pub time: Duration,
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct RadauSolution {
    /// The trajectory on the last mesh that was solved, with its error estimate; that of the first mesh when none was.
    pub trajectory: Trajectory,
    /// The status of the last solve: without success when a later mesh than that of the trajectory could not be solved.
    pub status: Status,
    /// True if the error estimate meets the tolerance.
    pub accurate: bool,
    /// True if refinement ended because the last meshes gained nothing.
    pub stalled: bool,
    /// Every mesh.
    pub meshes: Vec<MeshRecord>,
    /// The constraint that could not be met, when the last solve did not succeed.
    pub unmet: Option<Unmet>,
    /// Scales that do not fit, on the first mesh.
    pub warnings: Vec<ScaleWarning>,
    /// Switches along the trajectory.
    pub switches: Vec<Switch>,
    /// Report of the solve that gave the trajectory.
    pub report: SolveReport,
}

/// The beginning of a solve, or what it goes on with.
#[derive(Clone)]
struct Attempt {
    guess: Guess,
    mesh: Mesh,
    /// The meshes before.
    meshes: Vec<MeshRecord>,
    /// Number of meshes that led nowhere.
    spent: usize,
    warnings: Vec<ScaleWarning>,
    /// True if bounds of states may become rows.
    follows_states: bool,
    /// Most iterations on the first mesh.
    most_iterations: usize,
}

/// The end of an attempt.
enum Ending {
    Solution(Box<RadauSolution>),
    /// States are at bounds: the problem with rows for them, what to go on with, and what is solved so far.
    AtStateBounds(Box<StateRows>, Box<Attempt>, Box<Solved>),
}

/// A mesh that was solved.
struct Solved {
    trajectory: Trajectory,
    report: SolveReport,
    switches: Vec<Switch>,
    accurate: bool,
    stalled: bool,
    /// Nothing is left but the accuracy of the costates.
    finished: bool,
    /// The next mesh without any breaks, should those of the next one lead nowhere.
    plain: Mesh,
}

impl Radau {
    /// Solves from the mesh of the settings.
    ///
    /// # Errors
    /// When the request is ill-posed. Not converging is a status of the solution.
    pub fn solve(&self, ocp: &Ocp, guess: &Guess) -> Result<RadauSolution, RadauError> {
        self.solve_on(ocp, guess, self.uniform_mesh(ocp)?, &mut ())
    }

    /// The uniform mesh of the settings.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn uniform_mesh(&self, ocp: &Ocp) -> Result<Mesh, RadauError> {
        self.settings.check()?;
        Ok(Mesh::uniform(ocp, self.settings.intervals, self.settings.points)?)
    }

    /// Solves from a given mesh; the observer sees every iteration and can stop the solve.
    ///
    /// A guess made of an earlier trajectory with costates starts the interior-point method close to its multipliers.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn solve_on(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        self.settings.check()?;
        let guess = guess.clone().off_stationary_integrals(ocp);
        let Some(irredundant) = Irredundant::of(ocp) else {
            return self.solve_with_starts(ocp, &guess, &mesh, observer);
        };
        let mesh = irredundant.as_meant(mesh);
        let mut solution = self.solve_with_starts(&irredundant.ocp, &guess, &mesh, observer)?;
        solution.trajectory = irredundant.as_posed(solution.trajectory);
        Ok(solution)
    }

    /// Solves from one guess, with at most so many iterations on the first mesh.
    pub(crate) fn solve_from_guess(
        &self,
        ocp: &Ocp,
        guess: Guess,
        mesh: Mesh,
        most_iterations: usize,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let follows_states = self.settings.switches;
        let (meshes, warnings) = (Vec::new(), Vec::new());
        let mut attempt =
            Attempt { guess, mesh, meshes, spent: 0, warnings, follows_states, most_iterations };
        let mut with_rows: Option<(StateRows, Attempt)> = None;
        let mut inaccurate: Option<RadauSolution> = None;
        let mut reached: Option<Solved> = None;
        loop {
            let posed = with_rows.as_ref().map_or(ocp, |(rows, _)| &rows.ocp);
            match (self.attempt(posed, attempt, observer)?, with_rows.take()) {
                (Ending::AtStateBounds(rows, next, solved), _) => {
                    attempt = (*next).clone();
                    with_rows = Some((*rows, *next));
                    reached = Some(*solved);
                }
                (Ending::Solution(mut solution), None) => {
                    let error = |s: &RadauSolution| s.meshes.last().map_or(f64::NAN, |m| m.error);
                    let is_better = |s: &RadauSolution| s.status.is_success() && error(s) < error(&solution);
                    if let Some(other) = inaccurate.take().filter(|s| !solution.accurate && is_better(s)) {
                        *solution = RadauSolution { meshes: solution.meshes, ..other };
                    }
                    return Ok(*solution);
                }
                (Ending::Solution(mut solution), Some((rows, before))) => {
                    solution.trajectory = rows.as_posed(solution.trajectory);
                    let is_solved = solution.status.is_success() && solution.accurate;
                    let has_any = solution.report.status.is_success();
                    if let Some(solved) = reached.take().filter(|_| !has_any && !may_go_on(solution.status)) {
                        let RadauSolution { status, meshes, warnings, .. } = *solution;
                        return Ok(solved.into_solution(status, None, meshes, warnings));
                    }
                    if is_solved || !may_go_on(solution.status) {
                        return Ok(*solution);
                    }
                    // The bounds as they were posed may do better.
                    let spent = solution.meshes.len() - before.meshes.len();
                    attempt = Attempt { meshes: solution.meshes.clone(), spent, ..before };
                    inaccurate = Some(*solution);
                }
            }
        }
    }

    /// Solves from mesh to mesh, until the error meets the tolerance or states turn out to be at bounds that can be rows.
    fn attempt(
        &self,
        ocp: &Ocp,
        attempt: Attempt,
        observer: &mut dyn Observer,
    ) -> Result<Ending, RadauError> {
        let Attempt { mut guess, mut mesh, mut meshes, spent, mut warnings, follows_states, most_iterations } =
            attempt;
        let mut last: Option<Solved> = None;
        let mut excess = f64::INFINITY;
        let mut progress = Progress::new();
        let mut costates = CostateMeshes::default();
        let mut looked_beyond = self.settings.nlp.max_saddle_escapes == 0;
        let mut revisions = if self.settings.switches { MOST_REVISIONS } else { 0 };
        let mut contacts = Contacts::new(self.settings.switches);
        let mut crossings = Crossings::new(self.settings.switches);
        // Newton's method can fail to settle on one side of a kink.
        let mut forced =
            with_forced(ocp, &guess, &mesh).ok().filter(|m| self.settings.switches && *m != mesh);
        let mut before_contacts: Option<(Guess, Mesh)> = None;
        // The objective at caught controls, while the mesh is solved from better ones.
        let mut caught_at: Option<f64> = None;
        let mut left_caught = false;
        let mut is_settled = false;
        let mut may_catch = if self.settings.switches { MOST_CAUGHT } else { 0 };
        let mut may_rescale = MOST_RESCALED;
        let workers = Workers::new(self.settings.threads);
        loop {
            let begin = Instant::now();
            let mut nlp = Transcription::new(ocp, &mesh, &guess)?.with_workers(&workers);
            if meshes.is_empty() {
                warnings = scale_warnings(&mut nlp, ocp);
            }
            let mut settings = self.settings.nlp.clone();
            settings.max_saddle_escapes = 0;
            if last.is_none() {
                settings.max_iterations = settings.max_iterations.min(most_iterations);
            }
            if has_arcs(&mesh) && last.is_some() {
                settings.max_iterations = settings.max_iterations.min(MOST_ITERATIONS_WITH_BREAKS);
            }
            if forced.is_some() {
                settings.max_iterations = settings.max_iterations.min(MOST_ITERATIONS_WITH_KINKS);
            }
            if is_settled {
                settings.polish = settings.polish.max(1.0);
            }
            let mut watch = Watch::new(observer);
            let report = nlp.solve(ocp, &guess, &settings, &mut watch)?;
            let in_doubt = watch.is_in_doubt();
            let mut trajectory = nlp.trajectory(ocp, &report)?;
            let scaling = Scaling::new(ocp, &guess);
            let estimate = estimate(ocp, &scaling, &self.settings, &mut trajectory)?;
            let (error, controls) = (estimate.error, estimate.controls);
            meshes.push(MeshRecord {
                intervals: mesh.phases.iter().map(PhaseMesh::intervals).sum(),
                points: total_points(&mesh),
                error,
                counters: Counters::of(nlp.layout.variables, nlp.layout.constraints, &report),
                time: begin.elapsed(),
            });
            let points = total_points(&mesh);
            let status = report.status;
            let out_of_meshes = meshes.len() - spent > self.settings.max_refinements;
            if let Some(forced) =
                forced.take().filter(|_| !status.is_success() && may_go_on(status) && !out_of_meshes)
            {
                mesh = forced;
                continue;
            }
            // Breaks in the wrong places can make a problem infeasible, or hard.
            let misled = !status.is_success() && may_go_on(status);
            let may_lead_back = has_arcs(&mesh) || std::mem::take(&mut left_caught);
            if let Some(solved) = last.as_ref().filter(|_| misled && may_lead_back && !out_of_meshes) {
                (guess, mesh) = (Guess::earlier(&solved.trajectory), solved.plain.clone());
                (revisions, may_catch) = (0, 0);
                contacts.give_up();
                crossings.give_up();
                continue;
            }
            if !status.is_success() {
                let unmet = nlp.unmet(ocp, &report);
                return Ok(match last {
                    // Meshes for the sake of the costates alone.
                    Some(solved) if solved.finished && may_go_on(status) => {
                        let status = solved.report.status;
                        solved.into_ending(status, None, meshes, warnings)
                    }
                    Some(solved) => solved.into_ending(status, unmet, meshes, warnings),
                    None => {
                        Solved::first(trajectory, report, mesh).into_ending(status, unmet, meshes, warnings)
                    }
                });
            }
            // Bounds far apart hid the sizes of what lies between them.
            let earlier = Guess::earlier(&trajectory);
            if may_rescale > 0
                && !out_of_meshes
                && scaling.is_coarse_beside(ocp, &Scaling::new(ocp, &earlier))
            {
                may_rescale -= 1;
                guess = earlier;
                continue;
            }
            if error <= self.settings.tolerance && in_doubt && !looked_beyond {
                looked_beyond = true;
                let solved = (&trajectory, &report);
                let (beyond, counters) =
                    beyond_saddle(ocp, &mesh, solved, &self.settings.nlp, &workers, observer)?;
                if let Some(record) = meshes.last_mut() {
                    record.counters.iterations += counters.iterations;
                    record.counters.factorisations += counters.factorisations;
                }
                if let Some((trajectory, report)) = beyond {
                    if !report.status.is_success() {
                        let solved = Solved::first(trajectory, report, mesh);
                        let status = solved.report.status;
                        return Ok(solved.into_ending(status, None, meshes, warnings));
                    }
                    guess = Guess::earlier(&trajectory);
                    continue;
                }
            }
            if follows_states
                && !out_of_meshes
                && let Some(rows) = StateRows::of(ocp, &nlp, &report, &trajectory, &scaling)
            {
                let guess = Guess::earlier(&trajectory);
                let solved = Solved::first(trajectory, report, mesh.clone());
                let mesh = without_arcs(mesh);
                let next = Attempt {
                    guess,
                    mesh,
                    meshes,
                    spent,
                    warnings,
                    follows_states: false,
                    most_iterations: usize::MAX,
                };
                return Ok(Ending::AtStateBounds(Box::new(rows), Box::new(next), Box::new(solved)));
            }
            let gains_nothing = caught_at.take().is_some_and(|b| !is_lower(ocp, trajectory.objective, b));
            if let Some(solved) = last.as_ref().filter(|_| gains_nothing) {
                // The other controls cost as much.
                may_catch = 0;
                guess = Guess::earlier(&solved.trajectory);
                continue;
            }
            if may_catch > 0
                && !out_of_meshes
                && let Some(better) = with_lower_hamiltonian(ocp, &trajectory)
            {
                may_catch -= 1;
                left_caught = true;
                caught_at = better.costs_less.then_some(trajectory.objective);
                let plain = without_arcs(mesh.clone());
                guess = Guess::earlier(&better.trajectory);
                last = Some(Solved::first(trajectory, report, plain));
                continue;
            }
            let found = Structure::of(ocp, &mut nlp, &report, &trajectory);
            let in_bounds = controls <= self.settings.tolerance;
            let solved = SolvedMesh {
                ocp,
                report: &report,
                trajectory: &trajectory,
                beside_touch: &estimate.beside_touch,
                settings: &self.settings,
                structure: &found,
            };
            let touching = contacts.step(&solved, &mut nlp);
            if touching.settled {
                estimate.add_beside_touch(&mut trajectory);
            }
            let switches_settled = revisions == 0 || found.is_that_of(&trajectory, in_bounds);
            let passages = crossings.step(ocp, &trajectory);
            let settled = switches_settled && touching.settled && passages.settled;
            // Before, the exact active set of a mesh would hide the arcs of the solution.
            is_settled = settled;
            let accurate = error <= self.settings.tolerance;
            // Worth meshes of their own as long as they help.
            let within = in_bounds || controls > LEAST_GAIN * excess;
            if accurate && settled {
                excess = controls;
            }
            let finished = accurate && settled && within;
            let wants_costates = finished && costates.want(ocp, &scaling, &self.settings, &mut trajectory)?;
            let plain = refine(ocp, &trajectory, &self.settings)?;
            let phases = touching.touch_points.iter().zip(&passages.phases);
            let instants: Vec<Instants> =
                phases.map(|(t, c)| Instants { touch_points: t.clone(), crossings: c.clone() }).collect();
            // Breaks that make no mesh are left out.
            let next = if revisions == 0 {
                let spared = passages.spared(trajectory.clone());
                let refined = refine(ocp, &touching.spared(spared), &self.settings)?;
                with_instants(&refined, &instants).unwrap_or_else(|_| plain.clone())
            } else {
                revisions -= usize::from(!switches_settled);
                let spared = passages.spared(found.spared(&trajectory));
                let refined = refine(ocp, &touching.spared(spared), &self.settings)?;
                let placed = found.mesh(&refined, &instants);
                match placed {
                    Ok(mesh) if !switches_settled => {
                        with_long_intervals(ocp, &mesh, self.settings.max_points)?
                    }
                    placed => placed.unwrap_or_else(|_| plain.clone()),
                }
            };
            let size = total_points(&next);
            guess = Guess::earlier(&touching.start(trajectory.clone())?);
            let switches = found.switches(ocp, &trajectory);
            let plain = Mesh { phases: plain.phases.into_iter().map(PhaseMesh::without_arcs).collect() };
            let stalled = progress.has_stalled(error, trajectory.objective, points) && !accurate;
            let solved = Solved { trajectory, report, switches, accurate, stalled, finished, plain };
            if stalled
                || (finished && !wants_costates)
                || out_of_meshes
                || size > self.settings.max_total_points
            {
                return Ok(solved.into_ending(status, None, meshes, warnings));
            }
            if touching.has_new() && before_contacts.is_none() {
                before_contacts = Some((Guess::earlier(&solved.trajectory), solved.plain.clone()));
            }
            last = Some(solved);
            mesh = next;
            // What was refined for contacts that are none is of no use.
            if let Some(earlier) = before_contacts.take_if(|_| touching.refuted) {
                (guess, mesh) = earlier;
            }
        }
    }
}

impl Solved {
    /// The solution of a solve that was not followed up.
    fn first(trajectory: Trajectory, report: SolveReport, mesh: Mesh) -> Self {
        let (accurate, stalled, finished) = (false, false, false);
        Self { trajectory, report, switches: Vec::new(), accurate, stalled, finished, plain: mesh }
    }

    fn into_ending(
        self,
        status: Status,
        unmet: Option<Unmet>,
        meshes: Vec<MeshRecord>,
        warnings: Vec<ScaleWarning>,
    ) -> Ending {
        Ending::Solution(Box::new(self.into_solution(status, unmet, meshes, warnings)))
    }

    fn into_solution(
        self,
        status: Status,
        unmet: Option<Unmet>,
        meshes: Vec<MeshRecord>,
        warnings: Vec<ScaleWarning>,
    ) -> RadauSolution {
        let Self { trajectory, report, switches, accurate, stalled, .. } = self;
        RadauSolution { trajectory, status, accurate, stalled, meshes, unmet, warnings, switches, report }
    }
}

fn total_points(mesh: &Mesh) -> usize {
    mesh.phases.iter().map(PhaseMesh::total_points).sum()
}

fn has_arcs(mesh: &Mesh) -> bool {
    mesh.phases.iter().any(PhaseMesh::has_arcs)
}

/// True if an objective is better than another one by more than rounding.
fn is_lower(ocp: &Ocp, objective: f64, other: f64) -> bool {
    ocp.objective.sense.sign() * (other - objective) > LEAST_FALL * other.abs().max(objective.abs())
}

/// True if the solve ended for a reason that another mesh may not have.
pub(crate) fn may_go_on(status: Status) -> bool {
    !matches!(status, Status::Interrupted | Status::TimeLimit)
}
