//! Indirect shooting as a [`Method`]: alone, and with a direct method that gives the costates it starts from.

use apsides_nlp::{Observer, Status};
use apsides_ocp::method::{Accuracy, Counters, Deficiency, Level, Reason, Remedy, Switch, Warning};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start, Trajectory};

use super::hamiltonian::ControlSwitch;
use super::solver::{IndirectShooting, IndirectSolution};
use super::start::IndirectStart;
use crate::ShootingError;

/// The name of the method.
const NAME: &str = "indirect";

/// The methods that impose what indirect shooting does not.
const DIRECT: &str = "radau";

impl Method for IndirectShooting {
    fn name(&self) -> &'static str {
        NAME
    }

    /// Starts from the costates of the earlier trajectory, else from those at the ends of the phases.
    ///
    /// # Errors
    /// Where the start has neither, and where the point reached cannot be flown and there is no earlier trajectory to return.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        self.run(problem, start, observer).map_err(MethodError::by(NAME))
    }
}

/// Indirect shooting after a direct method.
///
/// A start that has costates is tried first. Where there are none, or where they lead nowhere, the direct method solves the problem, and
/// indirect shooting starts from its costates. Where that does not converge either, the solution is that of the direct method, and says so.
#[derive(Debug)]
pub struct DirectIndirect {
    /// The method that gives costates, such as a collocation.
    pub direct: Box<dyn Method>,
    /// The method that solves the necessary conditions.
    pub indirect: IndirectShooting,
}

impl Method for DirectIndirect {
    fn name(&self) -> &'static str {
        NAME
    }

    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        let refuse = MethodError::by(NAME);
        let mut spent = Counters::default();
        let mut warnings = Vec::new();
        if let Some(begin) = self.indirect.start(problem, start).map_err(&refuse)? {
            let mut solution = self.indirect.solve(problem, &begin, observer).map_err(&refuse)?;
            let good = solution.status.is_success() && solution.exceeded.is_empty();
            match solution.trajectory.take() {
                Some(t) if good || solution.status == Status::Interrupted => {
                    return Ok(self.indirect.common(problem, &solution, t));
                }
                _ => {
                    let (iterations, from) = (solution.iterations, self.direct.name());
                    spent.iterations = iterations;
                    warnings.push(Warning::StartedAgain { iterations, from });
                }
            }
        }
        let mut direct = self.direct.solve(problem, start, observer)?;
        if !direct.status.is_success() {
            return Ok(Solution { instead: Some(self.direct.name()), ..direct });
        }
        let intervals = self.indirect.settings.intervals;
        let begin = IndirectStart::from_trajectory(&direct.trajectory, intervals).map_err(&refuse)?;
        let mut solution = self.indirect.solve(problem, &begin, observer).map_err(&refuse)?;
        warnings.append(&mut direct.warnings);
        if let Some(t) = solution.trajectory.take().filter(|_| solution.status.is_success()) {
            let mut found = self.indirect.common(problem, &solution, t);
            found.counters.iterations += spent.iterations + direct.counters.iterations;
            found.counters.factorisations = found.counters.iterations;
            return Ok(Solution { warnings, ..found });
        }
        let reason =
            Reason::NotConverged { method: NAME, status: solution.status, instead: self.direct.name() };
        let remedies = vec![Remedy::Raise(&["intervals"]), Remedy::Method(self.direct.name())];
        let instead = Some(self.direct.name());
        Ok(Solution {
            warnings,
            deficiency: Some(Deficiency { reason, cause: None, remedies }),
            instead,
            ..direct
        })
    }
}

impl IndirectShooting {
    fn run(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, ShootingError> {
        let refused = |reason| ShootingError::Start { place: format!("problem `{}`", problem.name), reason };
        let begin = self.start(problem, start)?;
        let missing = "it has no costates; give those of a direct method, or use `DirectIndirect`";
        let begin = begin.ok_or_else(|| refused(missing.into()))?;
        let mut solution = self.solve(problem, &begin, observer)?;
        let trajectory = solution.trajectory.take().or_else(|| start.earlier.clone());
        let status = solution.status;
        let no_flight =
            || refused(format!("the equations cannot be integrated from these costates ({status})"));
        Ok(self.common(problem, &solution, trajectory.ok_or_else(no_flight)?))
    }

    /// Where a solve begins, if the start has costates. Those at the ends of the phases are not taken when there is an earlier trajectory.
    fn start(&self, problem: &Ocp, start: &Start) -> Result<Option<IndirectStart>, ShootingError> {
        let intervals = self.settings.intervals;
        match (start.earlier_with_costates(), &start.costates) {
            (Some(t), _) => IndirectStart::from_trajectory(t, intervals).map(Some),
            (None, Some(costates)) if start.earlier.is_none() => {
                let begin = IndirectStart::from_guess(problem, &start.guess, costates, intervals)?;
                Ok(Some(begin.chained()))
            }
            _ => Ok(None),
        }
    }

    /// The solution in the form that all methods share.
    fn common(&self, problem: &Ocp, solution: &IndirectSolution, trajectory: Trajectory) -> Solution {
        let exceeded = &solution.exceeded;
        let switches = problem.phases.iter().zip(&solution.switches);
        let switches = switches.flat_map(|(phase, list)| list.iter().map(|s| switch(phase, s)));
        Solution {
            accuracy: vec![Accuracy::new(
                "last correction",
                solution.correction,
                self.settings.tolerance,
                "tolerance",
            )],
            deficiency: (!exceeded.is_empty()).then(|| Deficiency {
                reason: Reason::BoundsExceeded(exceeded.clone()),
                cause: None,
                remedies: vec![Remedy::Method(DIRECT)],
            }),
            counters: Counters {
                iterations: solution.iterations,
                factorisations: solution.iterations,
                variables: solution.unknowns,
                constraints: solution.unknowns,
                discretisations: 1,
            },
            switches: switches.collect(),
            ..Solution::new(trajectory, solution.status)
        }
    }
}

/// A switch with names and values.
fn switch(phase: &apsides_ocp::Phase, switch: &ControlSwitch) -> Switch {
    let control = &phase.controls[switch.control];
    let (lower, upper) = (Level::Lower(control.bounds.lower), Level::Upper(control.bounds.upper));
    let (from, to) = if switch.rises { (lower, upper) } else { (upper, lower) };
    Switch {
        phase: phase.name.clone(),
        name: control.name.clone(),
        unit: control.unit.clone(),
        time: switch.time,
        time_unit: phase.time_unit.clone(),
        located: true,
        from,
        to,
    }
}
