//! Solve, estimate, refine, until the error between the points meets the tolerance.

use std::ops::ControlFlow;
use std::time::Instant;

use apsides_nlp::{NlpSettings, Observer, Status};
use apsides_ocp::explicit_time::divided_mesh;
use apsides_ocp::passed_features::{Among, passed_unseen};
use apsides_ocp::{ArcKind, Guess, Mesh, Ocp, PhaseMesh, Scaling, Trajectory, Unmet};
use apsides_transcription::Workers;

use crate::RadauError;
use crate::blur::is_blurred;
use crate::costate_error::{CostateMeshes, CostateRemedy, TELLING};
use crate::crossing::{with_forced, with_times};
use crate::events::{Events, FoundEvents};
use crate::joints::Joints;
use crate::lower_hamiltonian::{Better, with_lower_hamiltonian};
use crate::mesh_solve::{MeshSolve, total_points};
use crate::progress::Progress;
use crate::refinement::refine;
use crate::saddle::beyond_saddle;
use crate::scales::{ScaleWarning, scale_warnings};
use crate::settings::RadauSettings;
use crate::solved::{Solved, is_lower};
use crate::solver::{MeshRecord, RadauSolution, may_go_on};
use crate::state_bounds::{StateRows, without_arcs};
use crate::transcription::Transcription;

/// Ends of intervals are at least this part of the phase apart.
const LEAST_APART: f64 = 1e-9;

/// Most meshes that are solved again since single nodes are caught at controls that are no minimum.
const MOST_CAUGHT: usize = 3;

/// Most meshes that are solved again since quantities are much smaller than their scales.
const MOST_RESCALED: usize = 3;

/// Iterations of a solve that starts from the mesh before; with breaks, and without.
const MOST_ITERATIONS_WITH_BREAKS: usize = 200;
const MOST_ITERATIONS_LATER: usize = 1000;

/// Iterations on a first mesh across kinks, before one with interval ends there is tried.
const MOST_ITERATIONS_WITH_KINKS: usize = 300;

/// A mesh for the sake of the bounds on controls alone gains where it brings their excess below this part of what it was.
const LEAST_GAIN: f64 = 0.5;

/// Meshes in a row for the sake of the bounds on controls alone that may gain nothing: a turn of a control that is much shorter than its
/// interval shows only when the intervals have come down to its length.
const MOST_WITHOUT_GAIN: usize = 2;

/// Excess of a state, or of a row without controls, relative to its scale, that is none of a mesh with breaks close to their places, and the
/// part of it that the mesh before has at most.
const ASTRAY: f64 = 1e-2;
const WORSE: f64 = 10.0;

/// Change of the objective, relative to its scale, that is none of a mesh with breaks close to their places, and the least one in units of the
/// error of the mesh before.
const FAR: f64 = 1e-3;
const FAR_BEYOND_ERROR: f64 = 100.0;

/// Factor on the tolerance of a solve where the error hangs above that of the mesh: where bounds are hardly worth anything, what the barrier
/// leaves of controls beside them is an error that no mesh lowers.
const MORE_EXACT: f64 = 0.1;

/// A first solve that takes no more iterations started at a stationary point, where the accuracy of the mesh says little: the barrier
/// parameter alone takes as many.
const AT_ONCE: usize = 2;

/// The beginning of a solve, or what it goes on with.
#[derive(Clone)]
pub(crate) struct Attempt {
    pub(crate) guess: Guess,
    pub(crate) mesh: Mesh,
    /// The meshes before.
    pub(crate) meshes: Vec<MeshRecord>,
    /// Number of meshes that led nowhere.
    pub(crate) spent: usize,
    pub(crate) warnings: Vec<ScaleWarning>,
    /// True if bounds of states may become rows.
    pub(crate) follows_states: bool,
    /// Most iterations on the first mesh.
    pub(crate) most_iterations: usize,
}

/// The end of an attempt.
pub(crate) enum Ending {
    Solution(Box<RadauSolution>),
    /// States are at bounds: the problem with rows for them, what to go on with, and what is solved so far.
    AtStateBounds(Box<StateRows>, Box<Attempt>, Box<Solved>),
}

/// Better controls at single nodes, from which a mesh is solved again.
struct Catches {
    left: usize,
    /// The objective at caught controls, while the mesh is solved from better ones.
    caught_at: Option<f64>,
    /// True until a solve from better controls has ended.
    is_under_way: bool,
}

/// An attempt on its way from mesh to mesh.
pub(crate) struct MeshSequence<'a> {
    settings: &'a RadauSettings,
    ocp: &'a Ocp,
    workers: Workers,
    /// The next guess and mesh, and what the attempt has so far.
    attempt: Attempt,
    last: Option<Solved>,
    /// The solution before a mesh with breaks that led nowhere, or an accurate one that was followed up.
    before_failure: Option<Solved>,
    events: Events,
    joints: Joints,
    /// A first mesh with an interval end at each kink: Newton's method can fail to settle on one side of a kink.
    forced: Option<Mesh>,
    before_contacts: Option<(Guess, Mesh)>,
    is_settled: bool,
    catches: Catches,
    /// Solves of a mesh in scales of its solution that are left.
    may_rescale: usize,
    looked_beyond: bool,
    costates: CostateMeshes,
    /// True for a solve that ends with Newton's method on the active set, whatever lies at bounds.
    is_exact: bool,
    /// True while a mesh is solved again for its exact solution.
    is_repeated: bool,
    progress: Progress,
    /// Excess of the bounds on controls on the last mesh that met the tolerance.
    excess: f64,
    /// Meshes since then that did not lower it.
    without_gain: usize,
}

impl<'a> MeshSequence<'a> {
    pub(crate) fn new(settings: &'a RadauSettings, ocp: &'a Ocp, mut attempt: Attempt) -> Self {
        let crossings = |mesh: &Mesh| mesh.phases.iter().map(|p| p.crossings().len()).sum::<usize>();
        let with_times = |mesh: &Mesh, all| with_times(ocp, &attempt.guess, mesh, all).ok();
        let (certain, all) = (with_times(&attempt.mesh, false), with_times(&attempt.mesh, true));
        // The end of a phase that stops at one kink that it does not pass leaves it at once.
        let is_one = |(certain, all): (&Mesh, &Mesh)| crossings(all) <= crossings(certain) + 1;
        let first =
            if certain.as_ref().zip(all.as_ref()).is_some_and(is_one) { all.clone() } else { certain };
        let at_states = with_forced(ocp, &attempt.guess, first.as_ref().unwrap_or(&attempt.mesh)).ok();
        if let Some(mesh) = first.filter(|_| settings.switches) {
            attempt.mesh = mesh;
        }
        let mut forced = [at_states, all].into_iter().flatten();
        let forced = forced.find(|m| settings.switches && *m != attempt.mesh);
        Self {
            settings,
            ocp,
            workers: Workers::new(settings.threads),
            attempt,
            last: None,
            before_failure: None,
            events: Events::new(settings.switches),
            joints: Joints::new(ocp),
            forced,
            before_contacts: None,
            is_settled: false,
            catches: Catches {
                left: if settings.switches { MOST_CAUGHT } else { 0 },
                caught_at: None,
                is_under_way: false,
            },
            may_rescale: MOST_RESCALED,
            looked_beyond: settings.nlp.max_saddle_escapes == 0,
            costates: CostateMeshes::default(),
            is_exact: false,
            is_repeated: false,
            progress: Progress::new(),
            excess: f64::INFINITY,
            without_gain: 0,
        }
    }

    /// Solves from mesh to mesh, until the error meets the tolerance or states turn out to be at bounds that can be rows.
    pub(crate) fn run(mut self, observer: &mut dyn Observer) -> Result<Ending, RadauError> {
        loop {
            let solve = match (self.solve(observer), self.last.take()) {
                (Ok(solve), last) => {
                    self.last = last;
                    solve
                }
                // A mesh that makes no program takes nothing from the one before it.
                (Err(_), Some(solved)) => {
                    let (status, stalled) = (solved.report.status, !solved.accurate);
                    return Ok(self.ending(Solved { stalled, ..solved }, status, None));
                }
                (Err(error), None) => return Err(error),
            };
            if let ControlFlow::Break(ending) = self.follow(solve, observer)? {
                return Ok(ending);
            }
        }
    }

    /// Solves the mesh.
    fn solve(&mut self, observer: &mut dyn Observer) -> Result<MeshSolve, RadauError> {
        let begin = Instant::now();
        let nlp_settings = self.nlp_settings();
        self.is_exact = self.is_settled;
        let Attempt { guess, mesh, meshes, warnings, .. } = &mut self.attempt;
        if let Some(divided) = divided_mesh(self.ocp, guess, mesh)? {
            *mesh = divided;
        }
        let mut nlp = Transcription::new(self.ocp, mesh, guess)?.with_workers(&self.workers);
        if meshes.is_empty() {
            *warnings = scale_warnings(&mut nlp, self.ocp);
        }
        let solve = MeshSolve::new(self.ocp, nlp, guess, self.settings, &nlp_settings, observer)?;
        let mut record = solve.record(mesh, begin.elapsed());
        if let Some(first) = self.is_repeated.then(|| meshes.pop()).flatten() {
            record.add_work_of(&first);
        }
        meshes.push(record);
        Ok(solve)
    }

    fn nlp_settings(&self) -> NlpSettings {
        let mut settings = self.settings.nlp.clone();
        settings.max_saddle_escapes = 0;
        if self.last.is_none() {
            settings.max_iterations = settings.max_iterations.min(self.attempt.most_iterations);
        }
        if self.last.is_some() {
            let has_arcs = has_arcs(&self.attempt.mesh);
            let most = if has_arcs { MOST_ITERATIONS_WITH_BREAKS } else { MOST_ITERATIONS_LATER };
            settings.max_iterations = settings.max_iterations.min(most);
        }
        if self.forced.is_some() {
            settings.max_iterations = settings.max_iterations.min(MOST_ITERATIONS_WITH_KINKS);
        }
        if self.is_settled {
            settings.polish = settings.polish.max(1.0);
            settings.polish_by_course |= self.last.as_ref().is_some_and(|last| last.error <= TELLING);
        }
        if self.progress.hangs_above(self.settings.tolerance) {
            settings.tolerance *= MORE_EXACT;
        }
        settings
    }

    fn is_out_of_meshes(&self) -> bool {
        self.attempt.meshes.len() - self.attempt.spent > self.settings.max_refinements
    }

    /// Decides what follows on a mesh: another solve, or the end.
    fn follow(
        &mut self,
        solve: MeshSolve,
        observer: &mut dyn Observer,
    ) -> Result<ControlFlow<Ending>, RadauError> {
        let forced = self.forced.take();
        // Breaks in the wrong places can make a problem infeasible, or hard.
        let may_lead_back = has_arcs(&self.attempt.mesh) || std::mem::take(&mut self.catches.is_under_way);
        if !solve.status().is_success() || self.is_astray(&solve) {
            return Ok(self.follow_failure(solve, forced, may_lead_back));
        }
        if self.rescale(&solve) {
            return Ok(ControlFlow::Continue(()));
        }
        if let Some(flow) = self.look_beyond(&solve, observer)? {
            return Ok(flow);
        }
        if let Some(rows) = self.rows_of_states(&solve) {
            return Ok(ControlFlow::Break(self.end_at_state_bounds(rows, solve)));
        }
        if self.leave_equal_controls(&solve) {
            return Ok(ControlFlow::Continue(()));
        }
        if let Some(better) = self.better_controls(&solve) {
            self.catch(&better, solve);
            return Ok(ControlFlow::Continue(()));
        }
        self.refine(solve)
    }

    /// True where the arcs of a mesh along bounds of rows are not where they should be: its optimum is far beyond the bounds that it leaves out
    /// beside them, or far from that of the mesh before. Jumps of controls may come to their places from farther away.
    fn is_astray(&self, solve: &MeshSolve) -> bool {
        let Some(last) = self.last.as_ref().filter(|_| holds_rows(&self.attempt.mesh)) else { return false };
        let is_beyond = solve.estimate.beyond > ASTRAY.max(WORSE * last.beyond);
        let change = (solve.trajectory.objective - last.trajectory.objective).abs();
        let is_far = change > FAR.max(FAR_BEYOND_ERROR * last.error) * solve.nlp.scales.objective.abs();
        is_beyond || is_far
    }

    /// Tries the mesh with kinks, or the last one without breaks; else the attempt ends without success.
    fn follow_failure(
        &mut self,
        solve: MeshSolve,
        forced: Option<Mesh>,
        may_lead_back: bool,
    ) -> ControlFlow<Ending> {
        let status = solve.status();
        if may_go_on(status) && !self.is_out_of_meshes() && !self.is_repeated {
            if let Some(mesh) = forced {
                self.attempt.mesh = mesh;
                return ControlFlow::Continue(());
            }
            if let Some(solved) = self.last.as_ref().filter(|_| may_lead_back) {
                self.attempt.guess = Guess::earlier(&solved.trajectory);
                self.attempt.mesh = solved.plain.clone();
                if self.before_failure.as_ref().is_none_or(|before| !before.accurate) {
                    self.before_failure = Some(solved.clone());
                }
                self.catches.left = 0;
                self.events.give_up(solved.error);
                return ControlFlow::Continue(());
            }
        }
        let unmet = solve.nlp.unmet(self.ocp, &solve.report);
        match self.last.take() {
            // What is accurate stays so: this mesh was for the sake of the costates, or of events.
            Some(solved) if solved.accurate && may_go_on(status) => {
                let status = solved.report.status;
                self.end(solved, status, None)
            }
            Some(solved) => self.end(solved, status, unmet),
            None => {
                let solved = Solved::first(solve.trajectory, solve.report, self.attempt.mesh.clone());
                self.end(solved, status, unmet)
            }
        }
    }

    /// Solves the mesh again where bounds far apart hid the sizes of what lies between them.
    fn rescale(&mut self, solve: &MeshSolve) -> bool {
        let earlier = Guess::earlier(&solve.trajectory);
        let is_coarse = self.may_rescale > 0
            && !self.is_out_of_meshes()
            && solve.nlp.quantity_scales.is_coarse_beside(self.ocp, &Scaling::new(self.ocp, &earlier));
        if is_coarse {
            self.may_rescale -= 1;
            self.attempt.guess = earlier;
        }
        is_coarse
    }

    /// Looks once for a way out of a solution that may be no minimum; none where there is none.
    fn look_beyond(
        &mut self,
        solve: &MeshSolve,
        observer: &mut dyn Observer,
    ) -> Result<Option<ControlFlow<Ending>>, RadauError> {
        let at_rest = self.attempt.meshes.len() == 1 && solve.report.counters.iterations <= AT_ONCE;
        let is_asked = at_rest || solve.is_accurate(self.settings);
        if !is_asked || !solve.in_doubt || self.looked_beyond {
            return Ok(None);
        }
        self.looked_beyond = !at_rest;
        let solved = (&solve.trajectory, &solve.report);
        let mesh = &self.attempt.mesh;
        let (beyond, counters) =
            beyond_saddle(self.ocp, mesh, solved, &self.settings.nlp, &self.workers, observer)?;
        if let Some(record) = self.attempt.meshes.last_mut() {
            record.counters.iterations += counters.iterations;
            record.counters.factorisations += counters.factorisations;
        }
        let Some((trajectory, report)) = beyond else { return Ok(None) };
        if !report.status.is_success() {
            let status = report.status;
            let solved = Solved::first(trajectory, report, mesh.clone());
            return Ok(Some(self.end(solved, status, None)));
        }
        self.attempt.guess = Guess::earlier(&trajectory);
        Ok(Some(ControlFlow::Continue(())))
    }

    /// The problem with rows for the states at bounds, if the attempt looks for them and there are any.
    fn rows_of_states(&self, solve: &MeshSolve) -> Option<StateRows> {
        if !self.attempt.follows_states || self.is_out_of_meshes() {
            return None;
        }
        StateRows::of(self.ocp, &solve.nlp, &solve.report, &solve.trajectory, &solve.nlp.quantity_scales)
    }

    fn end_at_state_bounds(&mut self, rows: StateRows, solve: MeshSolve) -> Ending {
        let mesh = self.attempt.mesh.clone();
        let next = Attempt {
            guess: Guess::earlier(&solve.trajectory),
            mesh: without_arcs(mesh.clone()),
            meshes: std::mem::take(&mut self.attempt.meshes),
            spent: self.attempt.spent,
            warnings: std::mem::take(&mut self.attempt.warnings),
            follows_states: false,
            most_iterations: usize::MAX,
        };
        let solved = Solved::first(solve.trajectory, solve.report, mesh);
        Ending::AtStateBounds(Box::new(rows), Box::new(next), Box::new(solved))
    }

    /// Goes back to the last solution where other controls cost as much.
    fn leave_equal_controls(&mut self, solve: &MeshSolve) -> bool {
        let caught_at = self.catches.caught_at.take();
        let gains_nothing = caught_at.is_some_and(|b| !is_lower(self.ocp, solve.trajectory.objective, b));
        let Some(solved) = self.last.as_ref().filter(|_| gains_nothing) else { return false };
        self.catches.left = 0;
        self.attempt.guess = Guess::earlier(&solved.trajectory);
        true
    }

    fn better_controls(&self, solve: &MeshSolve) -> Option<Better> {
        if self.catches.left == 0 || self.is_out_of_meshes() {
            return None;
        }
        with_lower_hamiltonian(self.ocp, &solve.trajectory)
    }

    /// Solves the mesh again from better controls.
    fn catch(&mut self, better: &Better, solve: MeshSolve) {
        self.catches = Catches {
            left: self.catches.left - 1,
            caught_at: better.costs_less.then_some(solve.trajectory.objective),
            is_under_way: true,
        };
        self.attempt.guess = Guess::earlier(&better.trajectory);
        let plain = without_arcs(self.attempt.mesh.clone());
        self.last = Some(Solved::first(solve.trajectory, solve.report, plain));
    }

    /// Goes on to the next mesh, refined and with interval ends at events, unless nothing is left to do or no mesh would help.
    fn refine(&mut self, mut solve: MeshSolve) -> Result<ControlFlow<Ending>, RadauError> {
        let (ocp, settings) = (self.ocp, self.settings);
        let found = self.events.step(ocp, &mut solve, settings);
        self.is_settled = found.are_settled();
        let accurate = solve.is_accurate(settings);
        let finished = self.is_finished(&solve)?;
        // Limits that the trajectory passes between the points count when nothing else is left.
        let unseen =
            if finished { passed_unseen(ocp, &solve.trajectory, Among::PathConstraints) } else { Vec::new() };
        let is_blind = !all_empty(&unseen);
        let (accurate, finished) = (accurate && !is_blind, finished && !is_blind);
        let remedy = self.remedy_of_costates(&mut solve, finished)?;
        let wants_costates = remedy == CostateRemedy::Mesh;
        self.is_repeated = remedy == CostateRemedy::ExactSolution;
        let within = solve.is_in_bounds(settings);
        let MeshSolve { trajectory, report, estimate, .. } = solve;
        let joints = self.joints.along(&trajectory);
        let plain = refine(ocp, &trajectory, &joints, settings)?;
        let next = self.events.next_mesh(&found, ocp, (&trajectory, &estimate), &plain, &joints, settings)?;
        let next = with_ends(&trajectory, &unseen, next)?;
        let again = (Guess::earlier(&trajectory), trajectory.mesh());
        self.attempt.guess = Guess::earlier(&found.contacts.start(trajectory.clone())?);
        let switches = found.structure.switches(ocp, &trajectory);
        let plain = without_arcs(plain);
        let points = total_points(&self.attempt.mesh);
        let stalled = self.progress.has_stalled((estimate.error, accurate), trajectory.objective, points);
        let adrift = self.settings.bent_starts > 0 && self.progress.is_adrift() && self.takes_longer();
        let error = if is_blind { f64::INFINITY } else { estimate.error };
        let beyond = estimate.beyond;
        let has_its_arcs = found.has_arcs_found;
        let solved = Solved {
            trajectory,
            report,
            switches,
            error,
            beyond,
            accurate,
            within,
            has_its_arcs,
            stalled,
            adrift,
            plain,
        };
        if self.is_repeated {
            (self.attempt.guess, self.attempt.mesh) = again;
            self.last = Some(solved);
            return Ok(ControlFlow::Continue(()));
        }
        if stalled
            || adrift
            || (finished && !wants_costates)
            || self.is_out_of_meshes()
            || total_points(&next) > settings.max_total_points
        {
            let status = solved.report.status;
            return Ok(self.end(solved, status, None));
        }
        self.attempt.mesh = next;
        // Events can lead away from what is accurate already.
        let is_seen = || all_empty(&passed_unseen(ocp, &solved.trajectory, Among::PathConstraints));
        if solved.accurate && (finished || is_seen()) {
            let keeps = self.before_failure.take().filter(|before| before.is_preferred_to(&solved, self.ocp));
            self.before_failure = Some(keeps.unwrap_or_else(|| solved.clone()));
        }
        self.last = Some(solved);
        self.leave_refuted_contacts(&found);
        Ok(ControlFlow::Continue(()))
    }

    /// The remedy for the costates of a finished solution. The mesh that follows one that is not accurate is made for its costates, too, unless
    /// arcs lie along bounds of rows: the places of their ends say more of the costates than the points do.
    fn remedy_of_costates(
        &mut self,
        solve: &mut MeshSolve,
        finished: bool,
    ) -> Result<CostateRemedy, RadauError> {
        let (ocp, settings) = (self.ocp, self.settings);
        let (is_accurate, error) = (solve.is_accurate(settings), solve.estimate.error);
        let wants_exact = finished && !self.is_exact && settings.costate_tolerance.is_finite();
        let is_blurred = wants_exact && is_blurred(ocp, solve);
        let (scaling, trajectory) = (&solve.nlp.quantity_scales, &mut solve.trajectory);
        if finished {
            let remedy = self.costates.remedy(ocp, scaling, settings, self.is_exact, trajectory)?;
            return Ok(remedy.or_exact(is_blurred));
        }
        let are_telling = error <= TELLING && self.is_settled && !holds_rows(&self.attempt.mesh);
        if are_telling && !is_accurate {
            self.costates.foresee(ocp, scaling, settings, trajectory)?;
        }
        Ok(CostateRemedy::Nothing)
    }

    /// True if the last mesh took more iterations than the first one of the attempt: a flight that meshes come closer to takes fewer and fewer.
    fn takes_longer(&self) -> bool {
        let own = &self.attempt.meshes[self.attempt.spent.min(self.attempt.meshes.len())..];
        let [first, last] = [own.first(), own.last()].map(|m| m.map_or(0, |m| m.counters.iterations));
        last > first
    }

    /// True if nothing is left but the accuracy of the costates.
    fn is_finished(&mut self, solve: &MeshSolve) -> Result<bool, RadauError> {
        let controls = solve.estimate.controls;
        let is_done = solve.is_accurate(self.settings) && self.is_settled;
        if is_done {
            let gains = controls <= LEAST_GAIN * self.excess;
            self.without_gain = if gains { 0 } else { self.without_gain + 1 };
            self.excess = controls;
        }
        // Worth meshes of their own as long as they help.
        let within = solve.is_in_bounds(self.settings) || self.without_gain > MOST_WITHOUT_GAIN;
        if !(is_done && within) {
            return Ok(false);
        }
        // Free ends may have moved away from what the mesh sees of the time.
        let earlier = Guess::earlier(&solve.trajectory);
        Ok(divided_mesh(self.ocp, &earlier, &self.attempt.mesh)?.is_none())
    }

    /// Goes back to the mesh before the first contacts when all were none: what was refined for them is of no use.
    fn leave_refuted_contacts(&mut self, found: &FoundEvents<'_>) {
        if found.contacts.has_new() && self.before_contacts.is_none() {
            let before = self.last.as_ref().map(|s| (Guess::earlier(&s.trajectory), s.plain.clone()));
            self.before_contacts = before;
        }
        if let Some(earlier) = self.before_contacts.take_if(|_| found.contacts.refuted) {
            (self.attempt.guess, self.attempt.mesh) = earlier;
        }
    }

    /// Ends with a solution, or with a more accurate one before, if meshes without its breaks came to none that is accurate.
    fn end(&mut self, solved: Solved, status: Status, unmet: Option<Unmet>) -> ControlFlow<Ending> {
        ControlFlow::Break(self.ending(solved, status, unmet))
    }

    fn ending(&mut self, solved: Solved, status: Status, unmet: Option<Unmet>) -> Ending {
        let is_better = |before: &Solved| solved.is_left_for(before, status, self.ocp);
        let before = self.before_failure.take();
        let (solved, status, unmet) = match before.filter(is_better) {
            Some(before) => {
                let (status, stalled) = (before.report.status, !before.accurate);
                (Solved { stalled, ..before }, status, None)
            }
            None => (solved, status, unmet),
        };
        let meshes = std::mem::take(&mut self.attempt.meshes);
        let warnings = std::mem::take(&mut self.attempt.warnings);
        let solution = solved.into_solution(status, unmet, meshes, warnings);
        Ending::Solution(Box::new(solution))
    }
}

/// The next mesh with ends of intervals at these times of each phase of the last one.
fn with_ends(trajectory: &Trajectory, times: &[Vec<f64>], mut next: Mesh) -> Result<Mesh, RadauError> {
    for ((mesh, times), t) in next.phases.iter_mut().zip(times).zip(&trajectory.phases) {
        let mut places: Vec<f64> = times.iter().map(|at| t.fraction_at(*at)).collect();
        places.retain(|f| mesh.fractions().iter().all(|end| (end - f).abs() > LEAST_APART));
        places.dedup_by(|next, last| *next - *last <= LEAST_APART);
        *mesh = mesh.with_ends(&places)?;
    }
    Ok(next)
}

fn all_empty(times: &[Vec<f64>]) -> bool {
    times.iter().all(Vec::is_empty)
}

/// Says whether arcs hold rows at their bounds.
fn holds_rows(mesh: &Mesh) -> bool {
    let is_held = |kind: &Option<ArcKind>| matches!(kind, Some(ArcKind::Lower | ArcKind::Upper));
    mesh.phases.iter().flat_map(|p| p.arcs()).any(|arc| arc.rows.iter().any(is_held))
}

fn has_arcs(mesh: &Mesh) -> bool {
    mesh.phases.iter().any(PhaseMesh::has_arcs)
}
