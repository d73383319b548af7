//! Solutions with their certificates.

use apsides_nlp::Status;
use apsides_ocp::method::{Deficiency, Warning};
use apsides_ocp::{Ocp, Solution, Trajectory};
use apsides_radau::Explanation;
use apsides_verify::{
    Certificate, Check, CheckKind, StatedCostate, Verdict, Verification, VerifySettings, stated_costates,
    verify,
};

use crate::Error;
use crate::mission::Scalars;
use crate::outcome::Decisions;
use crate::posed::Posed;

use super::Pipeline;

/// A solution with its certificate, and what was found to conflict in it.
pub(super) struct Certified {
    pub(super) solution: Solution,
    pub(super) flight: Flight,
    pub(super) conflict: Option<Explanation>,
}

/// The certificate of a whole flight, and its trajectory where that is not the solution itself.
pub(super) struct Flight {
    pub(super) certificate: Certificate,
    pub(super) expanded: Option<Trajectory>,
}

impl Certified {
    /// A solution with its certificate. A solve that led nowhere from a point that is certified, on a finer mesh or as its steps became too
    /// small, has solved the problem, and so has one whose mesh is too coarse by its own measure alone, as where nothing determines a control.
    pub(super) fn new(mut solution: Solution, flight: Flight) -> Self {
        let led_nowhere = matches!(
            solution.status,
            Status::StepTooSmall
                | Status::IterationLimit
                | Status::RestorationFailed
                | Status::EvaluationFailed(_)
        );
        let is_coarse = solution.deficiency.as_ref().is_some_and(Deficiency::is_of_accuracy);
        if (led_nowhere || is_coarse) && flight.certificate.verdict >= Verdict::Extremal {
            solution.status = Status::Acceptable;
            let doubt = solution.deficiency.take().filter(|_| is_coarse);
            solution.warnings.extend(doubt.map(Warning::Coarse));
        }
        Self { solution, flight, conflict: None }
    }

    /// True if the solve found no feasible point: by its own word, or since it ended without success at a trajectory that misses requirements by far.
    pub(super) fn found_none_feasible(&self) -> bool {
        let misses_by_far = || {
            let checks = self.flight.certificate.checks.iter();
            checks.filter(|c| c.kind == CheckKind::Feasibility).any(|c| c.value > BY_FAR * c.limit)
        };
        match self.solution.status {
            Status::Infeasible | Status::RestorationFailed => true,
            Status::IterationLimit | Status::StepTooSmall => misses_by_far(),
            _ => false,
        }
    }

    /// The same with what is known of a solve that found no feasible point: the requirements conflict where motions from several starts
    /// miss them by no less; from a single start, or without a conflict, no more is said than that nothing was found.
    /// A solve that ended for another reason did not say so itself: it takes more starts, and what they do not agree on is not said.
    pub(super) fn with_true_status(mut self) -> Self {
        let is_certain = self.conflict.as_ref().is_some_and(Explanation::is_certain);
        let agree = self.conflict.as_ref().is_some_and(|c| c.starts >= AGREED);
        let conflicts = self.conflict.as_ref().is_some_and(|c| !c.conflicts.is_empty());
        self.solution.status = match self.solution.status {
            Status::Infeasible if !is_certain => Status::NoFeasiblePoint,
            Status::RestorationFailed if is_certain => Status::Infeasible,
            Status::IterationLimit | Status::StepTooSmall if is_certain && agree => Status::Infeasible,
            status @ (Status::IterationLimit | Status::StepTooSmall) if conflicts => {
                self.conflict = None;
                status
            }
            status => status,
        };
        self
    }
}

/// Times the limit of a check by which a trajectory is not near what the check asks for: limits are a ten millionth of the scales.
const BY_FAR: f64 = 1e4;

/// Starts from which no motion misses requirements by less where the solve did not itself say that they conflict.
const AGREED: usize = 3;

/// Steps along an interval of a flight whose solve was ended before its end: one that needs more is far from any that is verified.
const STEPS_OF_THE_UNFINISHED: usize = 2_000;

/// The judgement of a solve that was ended takes no time of its own: its flight as far as few steps go, its own costates alone.
fn settings_for(status: Status) -> VerifySettings {
    let settings = VerifySettings::default();
    match status {
        Status::Interrupted => {
            VerifySettings { max_steps: STEPS_OF_THE_UNFINISHED, adjoint: false, ..settings }
        }
        _ => settings,
    }
}

impl Pipeline {
    /// True once the work is to end.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.run.cancellation.is_asked()
    }

    /// The certificate of a trajectory of the whole flight.
    ///
    /// # Errors
    /// When the values do not make a problem, or the trajectory does not fit it.
    pub fn verify(&self, trajectory: &Trajectory) -> Result<Certificate, Error> {
        self.optimised()?;
        let decisions = self.decide()?;
        let decided = self.decided(&decisions)?;
        decided.certify(decided.pose_decided()?.flight(), &decisions, trajectory, &VerifySettings::default())
    }

    /// The certificate of a trajectory of the whole flight by the costates and multipliers that it states alone, where [`Self::verify`] takes those of
    /// the adjoint equation instead of some that prove nothing.
    ///
    /// # Errors
    /// As of [`Self::verify`].
    pub fn verify_as_stated(&self, trajectory: &Trajectory) -> Result<Certificate, Error> {
        let decisions = self.decide()?;
        let decided = self.decided(&decisions)?;
        let settings = VerifySettings { adjoint: false, ..VerifySettings::default() };
        decided.certify(decided.pose_decided()?.flight(), &decisions, trajectory, &settings)
    }

    /// The certificate and the scalars of a trajectory of the whole flight, with those that take solves of their own where it is `solved`: what a
    /// solve states of it. What is rejected has none of these: solves of another mission than that of the trajectory need not come to an end.
    ///
    /// # Errors
    /// When the values do not make a problem, or the trajectory does not fit it.
    pub fn recomputed(&self, trajectory: &Trajectory, solved: bool) -> Result<(Certificate, Scalars), Error> {
        let certificate = self.verify(trajectory)?;
        let decided = self.decided(&self.decide()?)?;
        let margins = match solved && certificate.verdict > Verdict::Rejected {
            true => decided.mission().margins(decided.methods(), trajectory, &decided.run.cancellation)?,
            false => Scalars::new(),
        };
        Ok((certificate, decided.results(trajectory).into_iter().chain(margins).collect()))
    }

    /// The costates of a trajectory of the whole flight that are farthest from the costate equation, one of each phase.
    ///
    /// # Errors
    /// When the values do not make a problem, or the trajectory does not fit it.
    pub fn stated_costates(&self, trajectory: &Trajectory) -> Result<Vec<StatedCostate>, Error> {
        let decided = self.decided(&self.decide()?)?;
        let posed = decided.pose_decided()?;
        Ok(stated_costates(posed.flight(), trajectory, &VerifySettings::default())?)
    }

    fn certify(
        &self,
        flight: &Ocp,
        decisions: &Decisions,
        trajectory: &Trajectory,
        settings: &VerifySettings,
    ) -> Result<Certificate, Error> {
        let Verification { certificate, .. } = verify(flight, trajectory, settings)?;
        Ok(certificate.with_checks(self.mission().checks(decisions, trajectory)))
    }

    /// The whole flight of a solution with its certificate. What cannot be expanded, as after a solve that failed, is certified as
    /// far as it goes.
    pub(super) fn flight(
        &self,
        posed: &Posed,
        decisions: &Decisions,
        solution: &Solution,
    ) -> Result<Flight, Error> {
        let settings = settings_for(solution.status);
        let solution = &solution.trajectory;
        if posed.expansion.is_none() {
            return Ok(Flight {
                certificate: self.certify(&posed.ocp, decisions, solution, &settings)?,
                expanded: None,
            });
        }
        match posed.expand(solution) {
            Ok(trajectory) => {
                let certificate = self.certify(posed.flight(), decisions, &trajectory, &settings)?;
                Ok(Flight { certificate, expanded: Some(trajectory) })
            }
            Err(e) => {
                let found = verify(&posed.ocp, solution, &settings)?;
                let name = "phases that are not joined to a flight";
                let check = Check::new(name, CheckKind::Feasibility, 1.0, 0.0, "-", e.to_string());
                Ok(Flight { certificate: found.certificate.with_checks([check]), expanded: None })
            }
        }
    }
}
