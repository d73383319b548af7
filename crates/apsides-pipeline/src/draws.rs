//! Optima of a mission whose numbers are uncertain: keys are drawn, and each case is solved anew from the mission's own solution.
//!
//! The draws of a sample depend on seed and index alone, so that results are the same for any number of threads.

use std::ops::Range;

use apsides_metaheuristics::Generator;

use crate::Error;
use crate::dispersion::sample_seed;
use crate::montecarlo::{Batch, LinearCovariance, Sample, Statistics, check_sizes, fly_all, gathered};
use crate::outcome::Outcome;
use crate::pipeline::Pipeline;

/// Numbers of a mission that are drawn, normal and independent, around their values.
#[derive(Clone, Debug, PartialEq)]
pub struct Draws {
    /// Number of samples, those that are there already included.
    pub samples: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Threads; the results do not depend on it.
    pub threads: usize,
    /// Keys and their standard deviations, in the units of the keys.
    pub sigmas: Vec<(String, f64)>,
}

impl Draws {
    /// Names of the results of each sample, the unit at the end: those of a solution.
    #[must_use]
    pub fn columns(plan: &Outcome) -> Vec<&str> {
        plan.summary.results.keys().map(String::as_str).collect()
    }

    /// The deviations of the keys of a sample, in their order.
    #[must_use]
    pub fn deviations(&self, index: usize) -> Vec<f64> {
        let mut random = Generator::new(sample_seed(self.seed, index));
        self.sigmas.iter().map(|(_, sigma)| sigma * random.normal()).collect()
    }

    /// Refuses, before anything is solved, keys that are no numbers and sizes that are negative or infinite.
    ///
    /// # Errors
    /// The first mistake.
    pub fn check(&self, mission: &Pipeline) -> Result<(), Error> {
        mission.optimised()?;
        for (key, _) in &self.sigmas {
            mission.values().key(key, "--sigma")?;
            mission.values().number(key)?;
        }
        let names: Vec<&str> = self.sigmas.iter().map(|(key, _)| key.as_str()).collect();
        let sizes: Vec<f64> = self.sigmas.iter().map(|(_, sigma)| *sigma).collect();
        check_sizes(&names, &sizes)
    }

    /// Solves the samples behind those that are `done`, in order, each from `plan`; `each` sees every new one and says whether to go on.
    ///
    /// # Errors
    /// As of [`check`](Self::check).
    pub fn run(
        &self,
        mission: &Pipeline,
        plan: &Outcome,
        done: Vec<Sample>,
        each: impl FnMut(&Sample) -> bool,
    ) -> Result<(Vec<Sample>, Statistics), Error> {
        let columns = Self::columns(plan);
        gathered(self.samples, self.seed, done, each, &columns, |indices, take| {
            self.fly(mission, plan, indices, take)
        })
    }

    /// Solves the samples of some indices, in order, each from `plan`; `each` takes every one and says whether to go on. A sample that has no
    /// optimum, or numbers that the mission does not take, has no results.
    ///
    /// # Errors
    /// As of [`check`](Self::check).
    pub fn fly(
        &self,
        mission: &Pipeline,
        plan: &Outcome,
        indices: Range<usize>,
        each: impl FnMut(Sample) -> bool,
    ) -> Result<LinearCovariance, Error> {
        self.check(mission)?;
        let columns = Self::columns(plan);
        let one = mission.clone().with_threads(1);
        let (_, start) = plan.solved();
        let solve = |deviations: &[f64]| -> Option<Vec<f64>> {
            let mut case = one.clone();
            for ((key, _), deviation) in self.sigmas.iter().zip(deviations) {
                let value = case.values().number(key).ok()?;
                case = case.with(key, value + deviation).ok()?;
            }
            let mut outcome = case.solve(Some(start), &mut ()).ok()?;
            if outcome.explanation.is_some() {
                // The mission's own guess decides, as in a sweep.
                outcome = case.solve(None, &mut ()).ok()?;
            }
            let results = &outcome.summary.results;
            let solved = outcome.status.is_success();
            solved.then(|| columns.iter().map(|c| results.get(*c).copied().unwrap_or(f64::NAN)).collect())
        };
        let fly = |_: &mut (), index: usize| solve(&self.deviations(index));
        let of = Batch { indices, threads: self.threads, columns: columns.len() };
        fly_all(of, |index| self.deviations(index), || (), fly, each);
        Ok(None)
    }
}
