//! Further starts, where one leads to no minimum or to no solution though there is a feasible trajectory.
//!
//! The certificate of a solution that is stationary and no minimum says so: another control has a smaller Hamiltonian, or a change lowers the
//! objective to second order. From the better controls, and from bent trajectories, which have no symmetry to keep, a solve may end at
//! a better one. So it may where the certificate cannot tell a minimum from a saddle, and where a straight line led nowhere: through the middle of
//! an obstacle, or where nothing has a gradient or a value.

use std::collections::VecDeque;

use apsides_nlp::Status;
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Start};
use apsides_verify::{Verdict, VerifySettings, with_least_hamiltonian};

use crate::Error;
use crate::method::MethodName;
use crate::observer::Observer;
use crate::outcome::Decisions;
use crate::posed::Posed;

use super::Pipeline;
use super::certified::Certified;

/// Bent starts that are tried from one trajectory.
const BENT: usize = 3;
/// Further starts that are tried in all.
const MOST_STARTS: usize = 8;
/// Iterations from a further start.
const MOST_ITERATIONS: usize = 300;
/// The same where the first solve found an extremal that may be a saddle.
const MOST_ITERATIONS_IN_DOUBT: usize = 100;
/// Iterations times variables of a first solve above which no further start is tried: each may take as long.
const MOST_WORK: usize = 2_000_000;
/// The same of a solve that ended at a conflict, or at an extremal that may be a saddle: most conflicts are real, and most extremals are minima.
const MOST_WORK_IN_DOUBT: usize = 100_000;
/// Least gain of the objective, relative to the larger of the two.
const LEAST_GAIN: f64 = 1e-6;

impl Certified {
    /// True if the solve succeeded and its certificate names something better.
    fn is_no_minimum(&self) -> bool {
        self.solution.is_success() && self.flight.certificate.names_something_better()
    }

    /// True if the solve succeeded and its certificate does not tell a minimum from a saddle. Bends of several phases would leave the order of events
    /// that these stand for, such as the burns of an injection.
    fn may_be_a_saddle(&self) -> bool {
        self.solution.is_success()
            && self.solution.trajectory.phases.len() == 1
            && self.flight.certificate.leaves_open_a_saddle()
    }

    /// True if another start may lead to a better solution than this one.
    fn is_no_minimum_or_may_be_none(&self) -> bool {
        self.is_no_minimum() || self.may_be_a_saddle()
    }

    /// True if the solve found requirements that conflict, near where it ended at least.
    fn ended_at_a_conflict(&self) -> bool {
        matches!(self.solution.status, Status::Infeasible | Status::RestorationFailed) && !self.has_feasible()
    }

    /// True if a start failed where another one may not. Infeasibility is local: where the slope of a condition vanishes there is no way to
    /// meet it, as that of `cos(angle) == 0` from an angle of zero.
    fn may_be_missed(&self) -> bool {
        matches!(
            self.solution.status,
            Status::IterationLimit
                | Status::StepTooSmall
                | Status::Diverging
                | Status::EvaluationFailed(_)
                | Status::Infeasible
                | Status::RestorationFailed
        )
    }

    /// True if the requirements do not conflict.
    fn has_feasible(&self) -> bool {
        self.conflict.as_ref().is_some_and(|c| c.status.is_success() && c.conflicts.is_empty())
    }
}

impl Pipeline {
    /// The solution, or a better one from another start where it is none or no minimum.
    ///
    /// # Errors
    /// As of a solve.
    pub(super) fn better_from_elsewhere(
        &self,
        posed: &Posed,
        decisions: &Decisions,
        first: Certified,
        observer: &mut dyn Observer,
    ) -> Result<Certified, Error> {
        let Counters { iterations, variables, .. } = first.solution.counters;
        let is_in_doubt = first.ended_at_a_conflict() || first.may_be_a_saddle();
        let most = if is_in_doubt { MOST_WORK_IN_DOUBT } else { MOST_WORK };
        let is_little = iterations.saturating_mul(variables) <= most;
        let is_called_for = first.is_no_minimum_or_may_be_none() || first.may_be_missed();
        if self.methods().name != MethodName::Radau || !is_little || !is_called_for {
            return Ok(first);
        }
        let most_iterations =
            if first.may_be_a_saddle() { MOST_ITERATIONS_IN_DOUBT } else { MOST_ITERATIONS };
        let few = self.methods().clone().with_most_iterations(most_iterations);
        let mut best = first;
        let mut starts = VecDeque::from(self.further_starts(posed, &best)?);
        let mut work = Vec::new();
        while let Some(start) = starts.pop_front().filter(|_| work.len() < MOST_STARTS) {
            let solution = few.solve_from(posed, &start, observer)?;
            let is_interrupted = solution.status == Status::Interrupted;
            let flight = self.flight(posed, decisions, &solution)?;
            let found = Certified::new(solution, flight);
            if is_better(posed, &found, &best) {
                work.push(std::mem::replace(&mut best, found).solution.counters);
                if best.is_no_minimum_or_may_be_none() {
                    starts = self.further_starts(posed, &best)?.into();
                } else if best.flight.certificate.is_verified() {
                    starts.clear();
                }
            } else {
                work.push(found.solution.counters);
            }
            if is_interrupted {
                break;
            }
        }
        best.solution.counters = Counters::total(work.into_iter().chain([best.solution.counters]));
        Ok(best)
    }

    /// The starts from which a solve may end elsewhere, the most promising one first.
    fn further_starts(&self, posed: &Posed, first: &Certified) -> Result<Vec<Start>, Error> {
        let (ocp, found) = (&posed.ocp, &first.solution.trajectory);
        let mut starts = Vec::new();
        let base = if first.is_no_minimum_or_may_be_none() {
            if posed.expansion.is_none()
                && let Some(better) = with_least_hamiltonian(ocp, found, &VerifySettings::default())?
            {
                starts.push(Start::new(Guess::along(&better)?));
            }
            Guess::along(found)?
        } else {
            if let Some(feasible) = first.conflict.as_ref().and_then(|c| c.feasible.as_ref()) {
                // A first mesh that is coarser may carry no feasible motion, as where controls turn from bound to bound without a pause.
                starts.push(Start::new(Guess::along(feasible)?).with_mesh(feasible.mesh()));
            }
            posed.guess.clone()
        };
        starts.extend((1..=BENT).map(|number| Start::new(base.bent(ocp, number))));
        Ok(starts)
    }
}

/// True if a solve that succeeded has a lower objective than another one, or the same one and more to show for it, or the other one found
/// nothing.
fn is_better(posed: &Posed, found: &Certified, than: &Certified) -> bool {
    // What the mesh carries not well enough is nearer than no feasible point at all.
    if found.solution.status.is_success() && !than.solution.status.is_success() {
        return true;
    }
    if !found.solution.is_success() || found.flight.certificate.verdict == Verdict::Rejected {
        return false;
    }
    let cost = |c: &Certified| posed.ocp.objective.sense.sign() * c.solution.trajectory.objective;
    let shown = |c: &Certified| (cost(c), c.flight.certificate.verdict);
    // An extremal is given up for another one alone that costs less.
    if than.may_be_a_saddle() {
        return found.flight.certificate.is_verified() && costs_less(cost(found), cost(than));
    }
    !than.solution.is_success() || excels(shown(found), shown(than))
}

/// True if a cost is lower, or the same with a higher verdict.
fn excels((cost, verdict): (f64, Verdict), (other, its_verdict): (f64, Verdict)) -> bool {
    costs_less(cost, other) || (!costs_less(other, cost) && cost.is_finite() && verdict > its_verdict)
}

fn costs_less(cost: f64, other: f64) -> bool {
    other - cost > LEAST_GAIN * other.abs().max(cost.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_with_one_cost_the_one_with_the_higher_verdict_is_kept() {
        let (feasible, extremal) = (Verdict::Feasible, Verdict::Extremal);
        let cost = -153.584_581;
        for off in [0.0, 1e-7, -1e-7] {
            assert!(excels((cost + off, extremal), (cost, feasible)), "{off}");
            assert!(!excels((cost + off, feasible), (cost, feasible)), "{off}");
            assert!(!excels((cost + off, feasible), (cost, extremal)), "{off}");
        }
        assert!(excels((cost - 1.0, feasible), (cost, extremal)));
        assert!(!excels((cost + 1.0, extremal), (cost, feasible)));
        assert!(!excels((f64::NAN, extremal), (cost, feasible)));
    }
}
