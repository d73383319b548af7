//! A problem of the gallery, solved by Radau collocation and verified.

use std::time::{Duration, Instant};

use apsides::radau::{Radau, RadauSolution};
use apsides::verify::{Certificate, Check, CheckKind, Verdict, Verification, VerifySettings, verify};
use apsides_problems::Problem;

/// Any error of the crates under test.
pub type Failure = Box<dyn std::error::Error>;

/// A problem of the gallery, solved and verified.
pub struct Run {
    /// The problem that was solved.
    pub problem: &'static Problem,
    /// The solution.
    pub solution: RadauSolution,
    /// The verification.
    pub certificate: Certificate,
    /// Wall-clock time of the solve.
    pub time: Duration,
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
        self.solution.meshes.iter().map(|m| m.counters.iterations).sum()
    }

    /// Factorisations over all meshes.
    #[must_use]
    pub fn factorisations(&self) -> usize {
        self.solution.meshes.iter().map(|m| m.counters.factorisations).sum()
    }

    /// Failed checks of feasibility, those of bounds along a phase apart from the others.
    #[must_use]
    pub fn infeasibilities(&self) -> (Vec<&Check>, Vec<&Check>) {
        let failed = |c: &&Check| c.kind == CheckKind::Feasibility && !c.passed;
        self.certificate.checks.iter().filter(failed).partition(|c| c.name.contains(" along "))
    }

    /// The first reason why the verdict is not that of an optimum, without its numbers; none where it is.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        if self.certificate.verdict >= Verdict::StrictLocalOptimum {
            return None;
        }
        let needed = [CheckKind::Feasibility, CheckKind::Optimality, CheckKind::Curvature];
        let failed = self.certificate.checks.iter().find(|c| !c.passed && needed.contains(&c.kind));
        let reason = match failed {
            Some(check) => format!("{} above its limit", check.name),
            None => self.certificate.remarks.first()?.split(" (").next()?.to_owned(),
        };
        Some(reason)
    }

    /// One row of the table of the gallery, in Markdown.
    #[must_use]
    pub fn table_row(&self) -> String {
        let reason = self.reason().map_or_else(String::new, |reason| format!(": {reason}"));
        format!(
            "| {} | {} | {:.10} | {:.1e} | {}{reason} | {} | {} | {} | {:.1} |",
            self.problem.name,
            self.problem.optimum.value,
            self.solution.trajectory.objective,
            self.difference(),
            self.certificate.verdict,
            self.solution.meshes.len(),
            self.solution.meshes.last().map_or(0, |m| m.points),
            self.iterations(),
            self.time.as_secs_f64() * 1e3
        )
    }
}
