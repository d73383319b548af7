//! From a mission to a verified outcome.

use std::collections::BTreeMap;
use std::time::Instant;

use apsides_nlp::Status;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_radau::{Explanation, Unmet};
use apsides_verify::{Certificate, Check, CheckKind, Verification, VerifySettings, verify};

use crate::method::{self, Solution};
use crate::missions::{Optimised, Posed};
use crate::site_selection::SiteSummary;
use crate::{
    Counters, Decisions, Error, Mission, ObjectiveValue, Observer, Outcome, Reduced, Summary, Timing,
};

impl Mission {
    /// The problem and a start.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn pose(&self) -> Result<Posed, Error> {
        (self.kind.optimised()?.pose)(&self.decide()?.values)
    }

    /// What the mission decides before its flight is posed, for instance a site on a map.
    ///
    /// # Errors
    /// When the values do not make a problem, or no site is fit; the sentence names what comes nearest.
    pub fn decide(&self) -> Result<Decisions, Error> {
        match self.kind.optimised()?.decide {
            Some(decide) => decide(&self.values),
            None => Ok(Decisions::new(self.values.clone(), Vec::new())),
        }
    }

    /// The mission with its decisions as values, so that nothing is open.
    pub(crate) fn decided(&self, decisions: &Decisions) -> Self {
        Self { values: decisions.values.clone(), ..self.clone() }
    }

    /// Whether a trajectory has the phases of the problem that is solved, so that a solve can start from it.
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
        self.kind.as_optimised().map_or_else(BTreeMap::new, |o| (o.results)(&self.values, trajectory))
    }

    /// Solves the mission and verifies the answer.
    ///
    /// `start` replaces the mission's own guess, for instance by that of a neighbouring case ([`Outcome::solved`]). The observer sees every
    /// iteration and can stop the solve; the best trajectory so far is returned then.
    ///
    /// # Errors
    /// When the request is ill-posed. A mission that cannot be flown ends with a status and an explanation.
    pub fn solve(&self, start: Option<&Trajectory>, observer: &mut dyn Observer) -> Result<Outcome, Error> {
        let begin = Instant::now();
        let decisions = self.decide()?;
        let decided = self.decided(&decisions);
        Ok(Outcome {
            mission_file: self.to_file(),
            ..decided.solve_decided(decisions, begin, start, observer)?
        })
    }

    fn solve_decided(
        &self,
        decisions: Decisions,
        begin: Instant,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Error> {
        let kind = self.kind.optimised()?;
        let posed = (kind.pose)(&self.values)?;
        let build = milliseconds(begin);
        let begin = Instant::now();
        let solution = match start {
            Some(_) => self.solve_by_method(&posed, start, observer)?,
            None => self.solve_from_guess(&posed, observer)?,
        };
        let solve = milliseconds(begin);
        let begin = Instant::now();
        let flight = self.flight(&posed, &decisions, &solution.trajectory)?;
        let margins = match solution.status.is_success() && solution.shortfall.is_none() {
            true => (kind.margins)(self, &solution.trajectory)?,
            false => BTreeMap::new(),
        };
        let timing_ms = Timing { build, solve, verify: milliseconds(begin) };
        let conflict = match solution.status {
            Status::Infeasible | Status::RestorationFailed => Some(self.conflict(&posed, &solution)?),
            _ => None,
        };
        Ok(self.outcome(kind, posed, decisions, solution, margins, conflict.as_ref(), flight, timing_ms))
    }

    /// Solves from the mission's own guess, through the easier cases that lead to it where it has some.
    fn solve_from_guess(&self, posed: &Posed, observer: &mut dyn Observer) -> Result<Solution, Error> {
        let mut start: Option<Trajectory> = None;
        let mut work = Counters::default();
        // Indirect shooting leads its own solution to a limit.
        let own = self.method() == method::INDIRECT && posed.costates.is_some();
        let approach = if own { Vec::new() } else { (self.kind.optimised()?.approach)(&self.values) };
        for values in approach {
            let easier = Self { values, ..self.clone() };
            let easier_posed = easier.pose()?;
            let solution = easier.solve_by_method(&easier_posed, start.as_ref(), observer)?;
            work.iterations += solution.counters.iterations;
            work.factorisations += solution.counters.factorisations;
            work.mesh_iterations += solution.counters.mesh_iterations;
            if !solution.status.is_success() {
                // From here on it would not become easier.
                break;
            }
            // Where the easier case is a reduction and this one is not, its whole flight is what this one starts from.
            let fits = Guess::earlier(&solution.trajectory).check(&posed.ocp).is_ok();
            start =
                Some(if fits { solution.trajectory } else { easier_posed.expand(&solution.trajectory)? });
        }
        let mut solution = self.solve_by_method(posed, start.as_ref(), observer)?;
        solution.counters.iterations += work.iterations;
        solution.counters.factorisations += work.factorisations;
        solution.counters.mesh_iterations += work.mesh_iterations;
        Ok(solution)
    }

    /// The certificate of a trajectory of the whole flight.
    ///
    /// # Errors
    /// When the values do not make a problem, or the trajectory does not fit it.
    pub fn verify(&self, trajectory: &Trajectory) -> Result<Certificate, Error> {
        let decisions = self.decide()?;
        let decided = self.decided(&decisions);
        decided.certify((self.kind.optimised()?.pose)(&decided.values)?.flight(), &decisions, trajectory)
    }

    fn certify(
        &self,
        flight: &Ocp,
        decisions: &Decisions,
        trajectory: &Trajectory,
    ) -> Result<Certificate, Error> {
        let Verification { certificate, .. } = verify(flight, trajectory, &VerifySettings::default())?;
        let kind = self.kind.optimised()?;
        let own = (kind.checks)(&self.values, trajectory);
        let of_sites = (kind.site_checks)(&self.values, &decisions.sites, trajectory);
        Ok(Certificate::new(certificate.checks.into_iter().chain(own).chain(of_sites).collect()))
    }

    /// The whole flight of a solution with its certificate. What cannot be expanded, as after a solve that failed, is certified as
    /// far as it goes.
    fn flight(&self, posed: &Posed, decisions: &Decisions, solution: &Trajectory) -> Result<Flight, Error> {
        if posed.expansion.is_none() {
            return Ok(Flight {
                certificate: self.certify(&posed.ocp, decisions, solution)?,
                expanded: None,
            });
        }
        match posed.expand(solution) {
            Ok(trajectory) => {
                let certificate = self.certify(posed.flight(), decisions, &trajectory)?;
                Ok(Flight { certificate, expanded: Some(trajectory) })
            }
            Err(e) => {
                let found = verify(&posed.ocp, solution, &VerifySettings::default())?;
                let mut checks = found.certificate.checks;
                let name = "phases that are not joined to a flight";
                checks.push(Check::new(name, CheckKind::Feasibility, 1.0, 0.0, "-", e.to_string()));
                Ok(Flight { certificate: Certificate::new(checks), expanded: None })
            }
        }
    }

    /// What conflicts and what to relax: from the best trajectory reached, else from the guess.
    fn conflict(&self, posed: &Posed, solution: &Solution) -> Result<Explanation, Error> {
        let method = self.radau();
        let phases = &solution.trajectory.phases;
        if phases.iter().all(|p| p.costate.is_some()) {
            let reached = Mesh { phases: phases.iter().map(|p| p.mesh.clone()).collect() };
            let found = method.explain(&posed.ocp, &Guess::earlier(&solution.trajectory), &reached)?;
            if found.status.is_success() {
                return Ok(found);
            }
        }
        Ok(method.explain(&posed.ocp, &posed.guess, &self.first_mesh(&posed.ocp)?)?)
    }

    /// The largest residuals of the mission's own guess before the first iteration, by name, at most `most`.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn guess_residuals(&self, most: usize) -> Result<Vec<Unmet>, Error> {
        let Posed { ocp, guess, .. } = self.pose()?;
        Ok(self.radau().guess_residuals(&ocp, &guess, &self.first_mesh(&ocp)?, most)?)
    }

    fn outcome(
        &self,
        kind: &Optimised,
        posed: Posed,
        decisions: Decisions,
        solution: Solution,
        margins: BTreeMap<String, f64>,
        conflict: Option<&Explanation>,
        flight: Flight,
        timing_ms: Timing,
    ) -> Outcome {
        let Posed { ocp, expansion, .. } = posed;
        let objective = ObjectiveValue {
            name: ocp.objective.name.clone(),
            value: solution.trajectory.objective,
            unit: ocp.objective.unit.clone(),
        };
        let missing = conflict.and_then(|c| (kind.missing)(self, c));
        let explanation = explain(&solution, conflict).map(|text| match missing {
            Some(missing) => format!("{text}; {missing}"),
            None => text,
        });
        let status = status_word(&solution).into();
        let certificate = flight.certificate;
        let (ocp, trajectory, reduced) = match (flight.expanded, expansion) {
            (Some(trajectory), Some(whole)) => {
                (whole.ocp, trajectory, Some(Reduced { ocp, trajectory: solution.trajectory }))
            }
            _ => (ocp, solution.trajectory, None),
        };
        let summary = Summary {
            mission: self.name().into(),
            method: self.method().into(),
            status,
            objective,
            results: self.results(&trajectory).into_iter().chain(margins).collect(),
            counters: solution.counters,
            timing_ms,
            certificate,
            warnings: solution.warnings,
            switches: solution.switches,
            search: solution.search,
            sites: decisions.sites.iter().map(SiteSummary::from).collect(),
            sensitivity: None,
        };
        Outcome {
            headline: kind.headline,
            curves: (kind.curves)(&self.values, &trajectory),
            ocp,
            trajectory,
            reduced,
            status: solution.status,
            report: solution.report,
            summary,
            mission_file: self.to_file(),
            decisions,
            explanation,
        }
    }
}

/// The certificate of a whole flight, and its trajectory where that is not the solution itself.
struct Flight {
    certificate: Certificate,
    expanded: Option<Trajectory>,
}

fn milliseconds(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}

/// The word for scripts.
fn status_word(solution: &Solution) -> &'static str {
    match (solution.status, &solution.shortfall) {
        (Status::Optimal | Status::Acceptable, Some(shortfall)) => shortfall.status,
        (Status::Optimal, None) => "optimal",
        (Status::Acceptable, None) => "acceptable",
        (Status::Infeasible, _) => "infeasible",
        (Status::Diverging, _) => "diverging",
        (Status::IterationLimit, _) => "iteration-limit",
        (Status::TimeLimit, _) => "time-limit",
        (Status::Interrupted, _) => "interrupted",
        (Status::RestorationFailed, _) => "restoration-failed",
        (Status::EvaluationFailed(_), _) => "evaluation-failed",
        _ => "not-converged",
    }
}

/// What is missing, in the user's units.
fn explain(solution: &Solution, conflict: Option<&Explanation>) -> Option<String> {
    if solution.status.is_success() {
        return solution.shortfall.as_ref().map(|s| s.text.clone());
    }
    let mut text = format!("{}", solution.status);
    match (conflict.filter(|c| c.status.is_success()), &solution.unmet) {
        (Some(found), _) => text += &format!(": {found}"),
        (None, Some(unmet)) => text += &format!(": {unmet}: cannot be met"),
        (None, None) => {}
    }
    Some(text)
}
