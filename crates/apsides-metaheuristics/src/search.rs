//! A search: what is allowed, when it ends, what comes out.

use crate::error::require;
use crate::{
    Candidate, Constraints, Convergence, Engine, Evaluation, HistoryPoint, Method, Noise, Objective,
    SearchError, SearchSpace,
};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Duration;

mod run;

pub use run::Run;

/// A search ends when the best objective has hardly improved for a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stagnation {
    /// Generations without improvement.
    pub generations: usize,
    /// Improvement that counts, in units of the objective. A first feasible point and a lower violation count always.
    pub improvement: f64,
}

/// A search in a box. Everything but the method has a default; `0` evaluations are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Search {
    /// Algorithm with its settings; default a particle swarm.
    pub method: Method,
    /// Seed of all random numbers; default 0.
    pub seed: u64,
    /// Evaluations at most, at least 1; default 10 000. The last generation is cut short to meet it.
    pub budget: usize,
    /// Time of the whole search at most, looked at after each generation; default none.
    pub time_limit: Option<Duration>,
    /// A feasible objective at which the search ends; default none.
    pub target: Option<f64>,
    /// Default none.
    pub stagnation: Option<Stagnation>,
    /// Evaluations, all failed, after which the search gives up; default 2000.
    pub patience: usize,
    /// Default feasibility rules.
    pub constraints: Constraints,
    /// Default none.
    pub noise: Noise,
    /// Threads that evaluate: 0, the default, for one on each core, 1 for the calling thread. Results are the same for any number.
    pub threads: usize,
    /// Points of the first generation, inside of the box; default none.
    pub start: Vec<Vec<f64>>,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            method: Method::default(),
            seed: 0,
            budget: 10_000,
            time_limit: None,
            target: None,
            stagnation: None,
            patience: 2000,
            constraints: Constraints::default(),
            noise: Noise::default(),
            threads: 0,
            start: Vec::new(),
        }
    }
}

impl Search {
    /// A search by a method, everything else as by default.
    pub fn new(method: Method) -> Self {
        Self { method, ..Self::default() }
    }

    /// The best point that is found.
    ///
    /// # Errors
    /// An ill-posed request; a search that finds nothing is a report with its [`StopReason`].
    pub fn minimize<O: Objective + ?Sized>(
        &self,
        space: &SearchSpace,
        objective: &O,
    ) -> Result<SearchReport, SearchError> {
        self.minimize_observed(space, objective, &mut |_| ControlFlow::Continue(()))
    }

    /// As [`Search::minimize`], with an observer that sees every generation and may end the search.
    ///
    /// # Errors
    /// As [`Search::minimize`].
    pub fn minimize_observed<O: Objective + ?Sized>(
        &self,
        space: &SearchSpace,
        objective: &O,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<SearchReport, SearchError> {
        let mut run = Run::new(self, space)?;
        run.finish(objective, observer)?;
        Ok(run.report())
    }

    /// Refuses settings that make no search.
    pub(crate) fn check(&self, space: &SearchSpace) -> Result<(), SearchError> {
        if self.budget == 0 {
            return Err(SearchError::NoBudget);
        }
        if let Constraints::Penalty { weight } = self.constraints {
            let holds = weight > 0.0 && weight.is_finite();
            require("penalty: weight", weight, holds, "above 0 and finite is needed")?;
        }
        match self.noise {
            Noise::None => {}
            Noise::Mean { samples: n } => {
                let allowed = "1 to the budget is needed";
                require("noise: samples", n as f64, (1..=self.budget).contains(&n), allowed)?;
            }
            Noise::ConfirmBest { repeats: n } => {
                require("noise: repeats", n as f64, n > 0, "at least 1 is needed")?;
            }
        }
        if let Some(s) = self.stagnation {
            let generations = s.generations as f64;
            require("stagnation: generations", generations, s.generations > 0, "at least 1 is needed")?;
            require("stagnation: improvement", s.improvement, s.improvement >= 0.0, "at least 0 is needed")?;
        }
        if let Some(target) = self.target {
            require("target", target, true, "a number is needed")?;
        }
        for (point, x) in self.start.iter().enumerate() {
            if x.len() != space.dimension() {
                let what = format!("start point {point}");
                return Err(SearchError::Length { what, found: x.len(), expected: space.dimension() });
            }
            if let Some(index) = space.first_outside(x) {
                let (value, lower, upper) = (x[index], space.lower()[index], space.upper()[index]);
                return Err(SearchError::StartOutside { point, index, value, lower, upper });
            }
        }
        Ok(())
    }
}

/// The state of a search after a generation, for an observer.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress<'a> {
    /// Generations so far.
    pub generation: usize,
    /// Evaluations so far.
    pub evaluations: usize,
    /// The best point so far.
    pub best: Option<&'a Candidate>,
    /// Failed evaluations so far.
    pub failures: usize,
    /// The algorithm, whose [spread](crate::Algorithm::spread) is the extent of its population.
    pub engine: &'a Engine,
}

/// The reason why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum StopReason {
    /// The budget of evaluations is used up.
    Budget,
    /// The time is used up.
    TimeLimit,
    /// A feasible point meets the target.
    Target,
    /// The best objective no longer improves.
    Stagnation,
    /// The algorithm has nothing more to gain.
    Converged(Convergence),
    /// The observer ended the search.
    Stopped,
    /// Every evaluation failed: there is no best point.
    AllFailed,
}

/// The result of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchReport {
    /// The best point with its result as the objective gave it, `None` where every evaluation failed.
    pub best: Option<Candidate>,
    /// Evaluations.
    pub evaluations: usize,
    /// Generations.
    pub generations: usize,
    /// The reason why it ended.
    pub stop: StopReason,
    /// The course, thinned out to at most about two thousand generations.
    pub history: Vec<HistoryPoint>,
    /// Failed evaluations: objective not finite or violation NaN.
    pub failures: usize,
    /// Time of the search, that before a checkpoint included.
    pub elapsed: Duration,
}

impl SearchReport {
    /// The best point, where it is feasible.
    pub fn feasible(&self) -> Option<&Candidate> {
        self.best.as_ref().filter(|c| Evaluation::is_feasible(&c.evaluation))
    }
}
