//! What the tests across crates share: tolerances by class, settings by class, one run of a problem of the gallery.

use std::time::{Duration, Instant};

use apsides::radau::{Radau, RadauSettings, RadauSolution};
use apsides::verify::{Certificate, Verification, VerifySettings, verify};
use apsides_problems::{Problem, Structure};

/// Any error of the crates under test.
pub type Failure = Box<dyn std::error::Error>;

/// A problem of the gallery, solved and verified.
pub struct Run {
    /// What was solved.
    pub problem: &'static Problem,
    /// The solution.
    pub solution: RadauSolution,
    /// The verification.
    pub certificate: Certificate,
    /// Wall-clock time of the solve.
    pub time: Duration,
}

/// The settings that suit a problem.
#[must_use]
pub fn radau(problem: &Problem) -> Radau {
    let _ = Structure::Smooth;
    let _ = problem;
    Radau { settings: RadauSettings::default() }
}

/// Solves and verifies a problem.
///
/// # Errors
/// When a crate refuses the request.
pub fn solve(problem: &'static Problem, method: &Radau) -> Result<Run, Failure> {
    let case = problem.pose()?;
    let begin = Instant::now();
    let solution = method.solve(&case.ocp, &case.guess)?;
    let time = begin.elapsed();
    let Verification { certificate, .. } =
        verify(&case.ocp, &solution.trajectory, &VerifySettings::default())?;
    Ok(Run { problem, solution, certificate, time })
}

impl Run {
    /// Relative difference of the objective from the optimum.
    #[must_use]
    pub fn difference(&self) -> f64 {
        self.problem.optimum.relative_difference(self.solution.trajectory.objective)
    }

    /// Interior-point iterations over all meshes.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.solution.meshes.iter().map(|m| m.iterations).sum()
    }

    /// One row of the table of the gallery, in Markdown.
    #[must_use]
    pub fn table_row(&self) -> String {
        format!(
            "| {} | {} | {:.10} | {:.1e} | {}, {} | {} | {} | {} | {:.1} |",
            self.problem.name,
            self.problem.optimum.value,
            self.solution.trajectory.objective,
            self.difference(),
            self.solution.status,
            self.certificate.verdict,
            self.solution.meshes.len(),
            self.solution.meshes.last().map_or(0, |m| m.points),
            self.iterations(),
            self.time.as_secs_f64() * 1e3
        )
    }
}
