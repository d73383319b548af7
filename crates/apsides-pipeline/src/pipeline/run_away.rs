//! Objectives that keep improving as a quantity grows that nothing bounds: a mean effort as the time grows, a state that escapes.
//!
//! Such a problem has no optimum. A solve ends where the improvement is below its tolerance, far away, or fails; neither is an answer. So a
//! quantity without a bound that has come far, or that a solve failed with, is bounded for a try, farther each time: where the best is at
//! each of these bounds, and better at each, the objective runs away with it. A true optimum far away is inside one of them.

use std::fmt;

use apsides_nlp::Status;
use apsides_ocp::method::Counters;
use apsides_ocp::{Bounds, Guess, Ocp, Scaling, Solution, Start, Trajectory, behind_number};
use apsides_verify::{Check, CheckKind, Verdict};

use crate::Error;
use crate::method::MethodName;
use crate::observer::Observer;
use crate::outcome::Decisions;
use crate::posed::Posed;

use super::Pipeline;
use super::certified::Certified;

/// A quantity is far away at this multiple of its size in the guess.
const FAR: f64 = 1e3;
/// Factor between the bounds that are tried.
const FARTHER: f64 = 10.0;
/// Bounds that are tried after a solve that failed, and those that the best must be at.
const TRIES: usize = 4;
const LEAST_TRIES: usize = 3;
/// Iterations of a solve with such a bound.
const MOST_ITERATIONS: usize = 300;
/// Refinements of such a solve: whether a bound is reached shows on a coarse mesh.
const MOST_REFINEMENTS: usize = 4;
/// Iterations times variables of a first solve above which nothing is tried.
const MOST_WORK: usize = 3_000_000;
/// A gain below this part of the one before is that of an objective that has come to its end.
const FADING: f64 = 1e-3;
/// A gain of the objective, relative, that is no rounding.
const GAIN: f64 = 1e-9;
/// The best is at a bound if it is this close to it, relative.
const AT_BOUND: f64 = 1e-3;

/// A quantity that grows without a bound, and the objective on the way.
pub(super) struct RunAway {
    /// The quantity in words, such as "final time of phase `coast`".
    name: String,
    unit: String,
    /// Values of the quantity, and the least objective there.
    reached: Vec<(f64, f64)>,
    unit_of_objective: String,
}

/// A quantity that may have no bound.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    FinalTime(usize),
    Parameter(usize),
    State(usize, usize),
}

impl Quantity {
    /// All times, parameters and states of a problem.
    fn all(ocp: &Ocp) -> Vec<Self> {
        let phases = ocp.phases.iter().enumerate();
        let times = (0..ocp.phases.len()).map(Self::FinalTime);
        let states = phases.flat_map(|(k, p)| (0..p.states.len()).map(move |s| Self::State(k, s)));
        times.chain((0..ocp.parameters.len()).map(Self::Parameter)).chain(states).collect()
    }

    /// The value of largest magnitude along a trajectory.
    fn value(self, trajectory: &Trajectory) -> f64 {
        match self {
            Self::FinalTime(k) => trajectory.phases[k].final_time,
            Self::Parameter(k) => trajectory.parameters[k],
            Self::State(k, s) => {
                let phase = &trajectory.phases[k];
                let values = phase.nodes().map(|(time, _)| phase.state_at(time)[s]);
                values.fold(0.0, |far: f64, v| if v.abs() > far.abs() { v } else { far })
            }
        }
    }

    /// The size that the guess gives the quantity.
    fn size(self, guess: &Guess, scaling: &Scaling) -> f64 {
        let size = match self {
            Self::FinalTime(k) => guess.phases[k].final_time - guess.phases[k].initial_time,
            Self::Parameter(k) => guess.parameters[k].abs().max(scaling.parameters[k]),
            Self::State(k, s) => scaling.phases[k].states[s],
        };
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// True if nothing bounds the quantity in the direction of a value.
    fn is_open(self, ocp: &Ocp, value: f64) -> bool {
        let is_open = |b: Bounds| if value > 0.0 { b.upper } else { b.lower }.is_infinite();
        match self {
            Self::FinalTime(k) => {
                let phase = &ocp.phases[k];
                value > 0.0 && is_open(phase.final_time) && is_open(phase.duration)
            }
            Self::Parameter(k) => is_open(ocp.parameters[k].bounds),
            Self::State(k, s) => is_open(ocp.phases[k].states[s].variable.bounds),
        }
    }

    /// The problem with a bound on the quantity, in the direction of the bound; fixed there where `is_fixed`.
    fn bounded(self, ocp: &Ocp, bound: f64, is_fixed: bool) -> Ocp {
        let mut bounded = ocp.clone();
        let bounds = match self {
            Self::FinalTime(k) => &mut bounded.phases[k].final_time,
            Self::Parameter(k) => &mut bounded.parameters[k].bounds,
            Self::State(k, s) => &mut bounded.phases[k].states[s].variable.bounds,
        };
        let range = match (is_fixed, bound > 0.0) {
            (true, _) => Bounds::fixed(bound),
            (false, true) => Bounds::at_most(bound),
            (false, false) => Bounds::at_least(bound),
        };
        *bounds = bounds.intersect(&range);
        bounded
    }

    /// A guess in which the quantity has a value; the times of the phases before and after keep their lengths.
    fn moved(self, guess: &Guess, value: f64) -> Guess {
        let mut moved = guess.clone();
        match self {
            Self::FinalTime(k) => {
                let by = value - moved.phases[k].final_time;
                moved.phases[k].final_time = value;
                for later in &mut moved.phases[k + 1..] {
                    later.initial_time += by;
                    later.final_time += by;
                }
            }
            Self::Parameter(k) => moved.parameters[k] = value,
            Self::State(..) => {}
        }
        moved
    }

    fn words(self, ocp: &Ocp) -> (String, String) {
        let of = |name: &str, k: usize| format!("`{name}` of phase `{}`", ocp.phases[k].name);
        match self {
            Self::FinalTime(k) => (of("final time", k), ocp.phases[k].time_unit.clone()),
            Self::Parameter(k) => {
                (format!("parameter `{}`", ocp.parameters[k].name), ocp.parameters[k].unit.clone())
            }
            Self::State(k, s) => {
                let v = &ocp.phases[k].states[s].variable;
                (of(&v.name, k), v.unit.clone())
            }
        }
    }
}

/// Solves of one problem with a bound on one quantity.
struct Tries<'a> {
    pipeline: &'a Pipeline,
    posed: &'a Posed,
    quantity: Quantity,
    work: Vec<Counters>,
}

impl Tries<'_> {
    /// The solution with a bound, if the solve succeeds.
    fn solve(
        &mut self,
        bound: f64,
        is_fixed: bool,
        guess: &Guess,
        observer: &mut dyn Observer,
    ) -> Result<Option<Solution>, Error> {
        let methods = self.pipeline.methods().clone().with_most_iterations(MOST_ITERATIONS);
        let methods = methods.with_most_refinements(MOST_REFINEMENTS);
        let ocp = self.quantity.bounded(&self.posed.ocp, bound, is_fixed);
        let guess = self.quantity.moved(guess, bound);
        let solution = methods.solve_from(&Posed::new(ocp, guess.clone()), &Start::new(guess), observer)?;
        self.work.push(solution.counters);
        Ok(Some(solution).filter(|s| s.status.is_success()))
    }

    fn run_away(&self, reached: Vec<(f64, f64)>) -> RunAway {
        let (name, unit) = self.quantity.words(&self.posed.ocp);
        let unit_of_objective = self.posed.ocp.objective.unit.clone();
        RunAway { name, unit, reached, unit_of_objective }
    }
}

impl Pipeline {
    /// Marks a solution that runs away with a quantity that nothing bounds, and names it: its status is [`Status::Diverging`], and no optimum is
    /// certified.
    ///
    /// # Errors
    /// As of a solve.
    pub(super) fn marked_run_away(
        &self,
        posed: &Posed,
        decisions: &Decisions,
        mut found: Certified,
        observer: &mut dyn Observer,
    ) -> Result<(Certified, Option<RunAway>), Error> {
        let Counters { iterations, variables, .. } = found.solution.counters;
        let is_little = iterations.saturating_mul(variables) <= MOST_WORK;
        if self.methods().name != MethodName::Radau || posed.expansion.is_some() || !is_little {
            return Ok((found, None));
        }
        let is_solved = found.solution.status.is_success();
        let has_failed = matches!(
            found.solution.status,
            Status::IterationLimit | Status::StepTooSmall | Status::RestorationFailed
        );
        if !is_solved && !has_failed {
            return Ok((found, None));
        }
        let (ocp, scaling) = (&posed.ocp, Scaling::new(&posed.ocp, &posed.guess));
        for quantity in Quantity::all(ocp) {
            let (value, size) =
                (quantity.value(&found.solution.trajectory), quantity.size(&posed.guess, &scaling));
            let is_far = value.is_finite() && value.abs() >= FAR * size;
            // A failed solve may end anywhere, with times and parameters at those of the guess. States can be bounded for a try, and not fixed, as
            // it takes beyond a solution.
            let is_suspect = match quantity {
                Quantity::State(..) => is_far && has_failed,
                _ => is_far || has_failed,
            };
            let towards = if value == 0.0 { size } else { value };
            if !is_suspect || !quantity.is_open(ocp, towards) {
                continue;
            }
            let mut tries = Tries { pipeline: self, posed, quantity, work: Vec::new() };
            let ran = match is_solved {
                true => beyond(&mut tries, &found.solution, observer)?.map(|ran| (ran, None)),
                false => farther(&mut tries, size.copysign(towards), observer)?
                    .map(|(ran, last)| (ran, Some(last))),
            };
            let work = Counters::total(tries.work.into_iter().chain([found.solution.counters]));
            let Some((ran, last)) = ran else {
                found.solution.counters = work;
                continue;
            };
            let solution = last.unwrap_or(found.solution);
            let flight = self.flight(posed, decisions, &solution)?;
            let mut marked = Certified::new(solution, flight);
            marked.solution.status = Status::Diverging;
            marked.solution.deficiency = None;
            marked.solution.counters = work;
            if marked.flight.certificate.verdict > Verdict::Feasible {
                let certificate = marked.flight.certificate.clone();
                marked.flight.certificate = certificate.with_checks([ran.check()]);
            }
            return Ok((marked, Some(ran)));
        }
        Ok((found, None))
    }
}

/// Looks from a solution far away whether the objective is better still beyond it.
fn beyond(
    tries: &mut Tries<'_>,
    found: &Solution,
    observer: &mut dyn Observer,
) -> Result<Option<RunAway>, Error> {
    let value = tries.quantity.value(&found.trajectory);
    let guess = Guess::along(&found.trajectory)?;
    let mut reached = Vec::new();
    for at in [value / FARTHER, value, value * FARTHER] {
        if at == value {
            reached.push((value, found.trajectory.objective));
            continue;
        }
        let Some(solution) = tries.solve(at, true, &guess, observer)? else { return Ok(None) };
        reached.push((at, solution.trajectory.objective));
    }
    Ok(tries.posed.improves(&reached).then(|| tries.run_away(reached)))
}

/// Looks with bounds, farther and farther, whether the best is at each of them.
fn farther(
    tries: &mut Tries<'_>,
    size: f64,
    observer: &mut dyn Observer,
) -> Result<Option<(RunAway, Solution)>, Error> {
    let mut guess = tries.posed.guess.clone();
    let (mut reached, mut last) = (Vec::new(), None);
    for k in 1..=TRIES {
        let bound = size * FARTHER.powi(k as i32);
        let Some(solution) = tries.solve(bound, false, &guess, observer)? else { break };
        let value = tries.quantity.value(&solution.trajectory);
        if (value - bound).abs() > AT_BOUND * bound.abs() {
            return Ok(None);
        }
        reached.push((bound, solution.trajectory.objective));
        if !tries.posed.improves(&reached) {
            return Ok(None);
        }
        guess = Guess::along(&solution.trajectory)?;
        last = Some(solution);
    }
    let is_shown = reached.len() >= LEAST_TRIES;
    Ok(last.filter(|_| is_shown).map(|solution| (tries.run_away(reached), solution)))
}

impl Posed {
    /// True if each objective is better than the one before, and the gains do not fade away.
    fn improves(&self, reached: &[(f64, f64)]) -> bool {
        let sign = self.ocp.objective.sense.sign();
        let gains = reached.windows(2).map(|w| (sign * (w[0].1 - w[1].1), w[0].1.abs().max(w[1].1.abs())));
        let gains: Vec<(f64, f64)> = gains.collect();
        gains.iter().all(|(gain, size)| *gain > GAIN * size)
            && gains.windows(2).all(|g| g[1].0 > FADING * g[0].0)
    }
}

impl RunAway {
    /// A check that fails: there is no optimum.
    fn check(&self) -> Check {
        let (last, first) = (self.reached.last(), self.reached.first());
        let gain = last.zip(first).map_or(f64::NAN, |(l, f)| (l.1 - f.1).abs());
        let place = last.map_or_else(String::new, |l| format!("{} at {:.3e} {}", self.name, l.0, self.unit));
        let name = format!("gain of the objective as {} grows", self.name);
        Check::new(name, CheckKind::Optimality, gain, 0.0, self.unit_of_objective.clone(), place)
    }
}

impl fmt::Display for RunAway {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |(value, objective): &(f64, f64)| {
            format!(
                "{objective:.3e}{} at {value:.3e}{}",
                behind_number(&self.unit_of_objective),
                behind_number(&self.unit)
            )
        };
        let on_the_way = self.reached.iter().map(at).collect::<Vec<_>>().join(", ");
        write!(
            f,
            "unbounded: the objective improves as far as {} grows, and nothing bounds it ({on_the_way}); state a bound of {}, or what it costs",
            self.name, self.name
        )
    }
}
