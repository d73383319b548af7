//! The method: its settings, its solution, and what goes before the first mesh.

use std::time::Duration;

use apsides_nlp::{Observer, SolveReport, Status};
use apsides_ocp::effective_controls::{guess_within, within_effect};
use apsides_ocp::explicit_time::starting_behind_jumps;
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory, Turns, Unmet, WithoutKinks};

use crate::RadauError;
use crate::redundant::Irredundant;
use crate::scales::ScaleWarning;
pub use crate::settings::RadauSettings;
use crate::state_bounds::without_arcs;
use crate::switches::Switch;

/// Largest overlap of the parts of a magnitude of which a solution is one of the problem as it was posed.
const OVERLAP: f64 = 1e-6;

/// Meshes of a solve with angles that may turn on, beyond those of the one with angles that are stopped.
const MORE_MESHES: usize = 3;

/// The method: hp Legendre-Gauss-Radau collocation.
#[derive(Clone, Debug, Default)]
pub struct Radau {
    /// Settings.
    pub settings: RadauSettings,
}

/// One mesh of a solve.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshRecord {
    /// Intervals of all phases.
    pub intervals: usize,
    /// Collocation points of all phases.
    pub points: usize,
    /// Largest estimated relative error.
    pub error: f64,
    /// Objective, in its unit.
    pub objective: f64,
    /// Size of the discretised problem, and the work of the interior-point method.
    pub counters: Counters,
    /// Calls of the restoration phase, which moves towards the constraints without regard to the objective.
    pub restorations: usize,
    /// Wall-clock time of the mesh: transcription, solve, estimate.
    pub time: Duration,
}

impl MeshRecord {
    /// Takes the work of another solve to its own.
    pub(crate) fn add_work_of(&mut self, other: &Self) {
        self.counters.iterations += other.counters.iterations;
        self.counters.factorisations += other.counters.factorisations;
        self.time += other.time;
    }
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct RadauSolution {
    /// The trajectory on the last mesh that was solved, with its error estimate; that of the first mesh when none was. Where requirements
    /// conflict it is the motion that misses them by as little as possible, the equations of motion kept.
    pub trajectory: Trajectory,
    /// The status of the last solve: without success when a later mesh than that of the trajectory could not be solved.
    pub status: Status,
    /// True if the error estimate meets the tolerance.
    pub accurate: bool,
    /// True if refinement ended because the last meshes gained nothing.
    pub stalled: bool,
    /// True if refinement ended because no mesh came to carry the flight that the guess leads to.
    pub adrift: bool,
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

impl RadauSolution {
    /// The same after the meshes of an earlier attempt.
    fn after(self, mut earlier: Vec<MeshRecord>) -> Self {
        earlier.extend(self.meshes);
        Self { meshes: earlier, ..self }
    }
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
        guess.check(ocp)?;
        let solution = self.solve_from_bent_guesses(ocp, guess, mesh, observer)?;
        let stopped = Turns::of(ocp).filter(|turns| turns.are_stopped(&solution.trajectory));
        let Some(turns) = stopped.filter(|_| may_go_on(solution.status)) else { return Ok(solution) };
        self.turn_on(&turns, solution, observer)
    }

    /// Solves again from a solution with an angle at a bound past which it may turn on; the better one of the two.
    fn turn_on(
        &self,
        turns: &Turns,
        stopped: RadauSolution,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let from = Guess::earlier(&stopped.trajectory);
        let mesh = self.uniform_mesh(&turns.ocp)?;
        // What takes many more meshes than the angle that is stopped is led astray by it.
        let max_refinements = self.settings.max_refinements.min(stopped.meshes.len() + MORE_MESHES);
        let few = Self { settings: RadauSettings { max_refinements, ..self.settings.clone() } };
        let mut on = few.solve_from_bent_guesses(&turns.ocp, &from, mesh, observer)?;
        let sign = turns.ocp.objective.sense.sign();
        let [of_on, of_stopped] = [&on, &stopped].map(|s| sign * s.trajectory.objective);
        let is_better = on.status.is_success()
            && (!stopped.status.is_success() || (on.accurate, -of_on) >= (stopped.accurate, -of_stopped));
        if !is_better {
            let meshes = stopped.meshes.into_iter().chain(on.meshes).collect();
            return Ok(RadauSolution { meshes, ..stopped });
        }
        on.trajectory = turns.as_posed(&on.trajectory)?;
        Ok(on.after(stopped.meshes))
    }

    /// Solves with the angles between their bounds, from bent guesses where no mesh carries the flight that the guess leads to.
    fn solve_from_bent_guesses(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let most = self.settings.bent_starts;
        // From the last start refinement goes on whatever the error is.
        let solve = |number: usize, observer: &mut dyn Observer| {
            let settings = RadauSettings { bent_starts: most - number, ..self.settings.clone() };
            let start = if number == 0 { guess.clone() } else { guess.bent(ocp, number) };
            Self { settings }.solve_between_bounds(ocp, &start, mesh.clone(), observer)
        };
        let mut solution = solve(0, observer)?;
        for number in 1..=most {
            if !solution.adrift {
                break;
            }
            let next = solve(number, observer)?;
            solution = next.after(solution.meshes);
        }
        Ok(solution)
    }

    /// Solves with the angles between their bounds. Where a state may stay at the kink of a magnitude Newton's method turns back from either side:
    /// what is not solved is solved with the parts of these magnitudes.
    fn solve_between_bounds(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let behind = starting_behind_jumps(ocp, guess);
        let (ocp, guess) = behind.as_ref().map_or((ocp, guess), |(ocp, guess)| (ocp, guess));
        let within = within_effect(ocp);
        let ocp = within.as_ref().unwrap_or(ocp);
        let guess = if within.is_some() { guess_within(ocp, guess) } else { guess.clone() };
        let guess = guess.off_stationary_integrals(ocp);
        let solution = self.solve_without_kinks_of_controls(ocp, &guess, mesh.clone(), observer)?;
        if solution.status.is_success() || !may_go_on(solution.status) {
            return Ok(solution);
        }
        let Some(smooth) = WithoutKinks::of_states_too(ocp) else { return Ok(solution) };
        let start = smooth.guess(&guess);
        let mut by_parts = self.solve_irredundant(&smooth.ocp, &start, without_arcs(mesh), observer)?;
        if solves_as_posed(&smooth, &by_parts) {
            by_parts.trajectory = smooth.as_posed(by_parts.trajectory);
            return Ok(by_parts.after(solution.meshes));
        }
        // What was stopped was not finished.
        let status = if may_go_on(by_parts.status) { solution.status } else { by_parts.status };
        Ok(RadauSolution { status, ..solution.after(by_parts.meshes) })
    }

    /// Solves by the parts of magnitudes, directions and cosines of controls.
    fn solve_without_kinks_of_controls(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let Some(smooth) = WithoutKinks::of(ocp) else {
            return self.solve_irredundant(ocp, guess, mesh, observer);
        };
        // An arc of a control is none of its parts.
        let plain = without_arcs(mesh.clone());
        let rounded = match smooth.rounded() {
            Some(rounded) => self.rounded_start(rounded, guess, plain.clone(), observer)?,
            None => None,
        };
        let start = smooth.guess(rounded.as_ref().unwrap_or(guess));
        let mut solution = self.solve_irredundant(&smooth.ocp, &start, plain, observer)?;
        if solves_as_posed(&smooth, &solution) || !may_go_on(solution.status) {
            solution.trajectory = smooth.as_posed(solution.trajectory);
            return Ok(solution);
        }
        // Parts that overlap gain what the magnitude does not.
        let posed = self.solve_irredundant(ocp, guess, mesh, observer)?;
        Ok(posed.after(solution.meshes))
    }

    /// The solution with rounded lengths of vectors of controls on the first mesh; none where it has none.
    fn rounded_start(
        &self,
        rounded: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<Option<Guess>, RadauError> {
        let settings = RadauSettings { max_refinements: 0, ..self.settings.clone() };
        let solution = Self { settings }.solve_on(rounded, guess, mesh, observer)?;
        Ok(solution.status.is_success().then(|| Guess::earlier(&solution.trajectory)))
    }

    /// Solves without statements that follow from others.
    fn solve_irredundant(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<RadauSolution, RadauError> {
        let Some(mut irredundant) = Irredundant::of(ocp) else {
            return self.solve_with_starts(ocp, guess, &mesh, observer);
        };
        let meant = irredundant.as_meant(mesh);
        let mut solution = self.solve_with_starts(&irredundant.ocp, guess, &meant, observer)?;
        if solution.status.is_success() && irredundant.misses_ends(&solution.trajectory) {
            irredundant = irredundant.with_posed_ends(ocp);
            let again = self.solve_with_starts(&irredundant.ocp, guess, &meant, observer)?;
            solution = again.after(solution.meshes);
        }
        solution.trajectory = irredundant.as_posed(solution.trajectory);
        Ok(solution)
    }
}

/// True if a solution by parts is one of the problem as it was posed.
fn solves_as_posed(smooth: &WithoutKinks, solution: &RadauSolution) -> bool {
    solution.status.is_success() && smooth.overlap(&solution.trajectory) <= OVERLAP
}

/// True if the solve ended for a reason that another mesh may not have.
pub(crate) fn may_go_on(status: Status) -> bool {
    !matches!(status, Status::Interrupted | Status::TimeLimit)
}
