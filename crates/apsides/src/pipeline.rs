//! From a mission to a verified outcome.

use std::collections::BTreeMap;
use std::time::Instant;

use apsides_nlp::{Observer, Status};
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_radau::{Explanation, Radau, RadauSettings, RadauSolution, Unmet};
use apsides_verify::{Certificate, Verification, VerifySettings, verify};

use crate::missions::Posed;
use crate::{Counters, Error, Mission, ObjectiveValue, Outcome, Summary, Timing};

impl Mission {
    /// The problem and a start.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn pose(&self) -> Result<Posed, Error> {
        (self.kind.pose)(&self.values)
    }

    /// Whether a trajectory has the phases of this mission, so that a solve can start from it.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn has_phases_of(&self, trajectory: &Trajectory) -> Result<bool, Error> {
        let ocp = self.pose()?.ocp;
        let names = ocp.phases.iter().map(|p| &p.name);
        let same_names = names.eq(trajectory.phases.iter().map(|p| &p.name));
        Ok(same_names && Guess::earlier(trajectory).check(&ocp).is_ok())
    }

    /// Scalars of a solution; the unit ends the key.
    #[must_use]
    pub fn results(&self, trajectory: &Trajectory) -> BTreeMap<String, f64> {
        (self.kind.results)(&self.values, trajectory)
    }

    /// Solves the mission and verifies the answer.
    ///
    /// `start` replaces the mission's own guess, for instance by the trajectory of a neighbouring case. The observer sees every
    /// iteration and can stop the solve; the best trajectory so far is returned then.
    ///
    /// # Errors
    /// When the request is ill-posed. A mission that cannot be flown ends with a status and an explanation.
    pub fn solve(&self, start: Option<&Trajectory>, observer: &mut dyn Observer) -> Result<Outcome, Error> {
        let begin = Instant::now();
        let Posed { ocp, guess } = self.pose()?;
        let (guess, mesh) = match start {
            Some(t) => {
                let mesh = Mesh { phases: t.phases.iter().map(|p| p.mesh.clone()).collect() };
                (Guess::earlier(t), mesh)
            }
            None => {
                let mesh = self.first_mesh(&ocp)?;
                (guess, mesh)
            }
        };
        let method = Radau { settings: self.radau_settings() };
        let build = milliseconds(begin);
        let begin = Instant::now();
        let first_mesh = mesh.clone();
        let solution = method.solve_on(&ocp, &guess, mesh, observer)?;
        let solve = milliseconds(begin);
        let begin = Instant::now();
        let Verification { certificate, .. } =
            verify(&ocp, &solution.trajectory, &VerifySettings::default())?;
        let timing_ms = Timing { build, solve, verify: milliseconds(begin) };
        let conflict = match solution.status {
            Status::Infeasible | Status::RestorationFailed => {
                Some(conflict(&method, &ocp, &solution, &guess, &first_mesh)?)
            }
            _ => None,
        };
        Ok(self.outcome(ocp, solution, conflict.as_ref(), certificate, timing_ms))
    }

    /// The largest residuals of the mission's own guess before the first iteration, by name, at most `most`.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn guess_residuals(&self, most: usize) -> Result<Vec<Unmet>, Error> {
        let Posed { ocp, guess } = self.pose()?;
        let method = Radau { settings: self.radau_settings() };
        Ok(method.guess_residuals(&ocp, &guess, &self.first_mesh(&ocp)?, most)?)
    }

    fn first_mesh(&self, ocp: &Ocp) -> Result<Mesh, Error> {
        let (intervals, points) = (self.values.count("radau.intervals"), self.values.count("radau.points"));
        Ok(Mesh::uniform(ocp, intervals, points)?)
    }

    pub(crate) fn radau_settings(&self) -> RadauSettings {
        let mut settings = RadauSettings {
            mesh_tolerance: self.values.number("radau.mesh_tolerance"),
            max_meshes: self.values.count("radau.max_meshes"),
            threads: self.threads,
            ..RadauSettings::default()
        };
        settings.nlp.tolerance = self.values.number("radau.nlp_tolerance");
        settings
    }

    fn outcome(
        &self,
        ocp: Ocp,
        solution: RadauSolution,
        conflict: Option<&Explanation>,
        certificate: Certificate,
        timing_ms: Timing,
    ) -> Outcome {
        let last = solution.meshes.last();
        let counters = Counters {
            iterations: solution.meshes.iter().map(|m| m.iterations).sum(),
            factorisations: solution.meshes.iter().map(|m| m.factorisations).sum(),
            variables: last.map_or(0, |m| m.variables),
            constraints: last.map_or(0, |m| m.constraints),
            mesh_iterations: solution.meshes.len(),
        };
        let objective = ObjectiveValue {
            name: ocp.objective.name.clone(),
            value: solution.trajectory.objective,
            unit: ocp.objective.unit.clone(),
        };
        let explanation = explain(&solution, conflict, self);
        let summary = Summary {
            mission: self.name().into(),
            method: self.values.word("method").into(),
            status: status_word(&solution).into(),
            objective,
            results: self.results(&solution.trajectory),
            counters,
            timing_ms,
            certificate,
            warnings: solution.warnings.iter().map(ToString::to_string).collect(),
            sensitivity: None,
        };
        Outcome {
            headline: self.kind.headline,
            curves: (self.kind.curves)(&self.values, &solution.trajectory),
            ocp,
            trajectory: solution.trajectory,
            report: Some(solution.report),
            summary,
            mission_file: self.to_file(),
            explanation,
        }
    }
}

fn milliseconds(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}

/// The word for scripts.
fn status_word(solution: &RadauSolution) -> &'static str {
    match solution.status {
        Status::Optimal if solution.accurate => "optimal",
        Status::Acceptable if solution.accurate => "acceptable",
        Status::Optimal | Status::Acceptable => "mesh-limit",
        Status::Infeasible => "infeasible",
        Status::Diverging => "diverging",
        Status::IterationLimit => "iteration-limit",
        Status::TimeLimit => "time-limit",
        Status::Interrupted => "interrupted",
        Status::RestorationFailed => "restoration-failed",
        Status::EvaluationFailed(_) => "evaluation-failed",
        _ => "not-converged",
    }
}

/// What conflicts and what to relax: from the best trajectory reached, else from the guess.
fn conflict(
    method: &Radau,
    ocp: &Ocp,
    solution: &RadauSolution,
    guess: &Guess,
    mesh: &Mesh,
) -> Result<Explanation, Error> {
    let reached = Mesh { phases: solution.trajectory.phases.iter().map(|p| p.mesh.clone()).collect() };
    let found = method.explain(ocp, &Guess::earlier(&solution.trajectory), &reached)?;
    if found.status.is_success() {
        return Ok(found);
    }
    Ok(method.explain(ocp, guess, mesh)?)
}

/// What is missing, in the user's units.
fn explain(solution: &RadauSolution, conflict: Option<&Explanation>, mission: &Mission) -> Option<String> {
    if solution.status.is_success() {
        if solution.accurate {
            return None;
        }
        let error = solution.meshes.last().map_or(f64::NAN, |m| m.error);
        return Some(format!(
            "the error between the points is {error:.1e}, above `radau.mesh_tolerance` = {:.1e}; raise `radau.max_meshes`",
            mission.values.number("radau.mesh_tolerance")
        ));
    }
    let mut text = format!("{}", solution.status);
    match (conflict.filter(|c| c.status.is_success()), &solution.unmet) {
        (Some(found), _) => text += &format!(": {found}"),
        (None, Some(unmet)) => text += &format!(": {unmet}: cannot be met"),
        (None, None) => {}
    }
    Some(text)
}
