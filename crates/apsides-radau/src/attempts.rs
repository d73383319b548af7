//! Attempts, one after the other: from a guess, with rows for the states that turn out to be at bounds, and without them again.

use apsides_nlp::Observer;
use apsides_ocp::{Guess, Mesh, Ocp};

use crate::RadauError;
use crate::mesh_sequence::{Attempt, Ending, MeshSequence};
use crate::solved::Solved;
use crate::solver::{Radau, RadauSolution, may_go_on};
use crate::state_bounds::StateRows;

impl Radau {
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
            match (MeshSequence::new(&self.settings, posed, attempt).run(observer)?, with_rows.take()) {
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
                    if is_solved || solution.adrift || !may_go_on(solution.status) {
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
}
