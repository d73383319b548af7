//! When a run of CMA-ES has ended, and how the next one starts.

use super::Restarts;
use super::distribution::Distribution;
use super::scratch::Scratch;
use crate::{Convergence, Evaluation, Generator};
use serde::{Deserialize, Serialize};

/// Population and step size of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Start {
    pub(super) population: usize,
    /// The step as a part of the first run's.
    pub(super) step: f64,
}

/// The sequence of runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Schedule {
    restarts: Restarts,
    first: usize,
    /// Population of the last run with a growing population.
    large: usize,
    /// Evaluations of runs with growing and with small populations.
    spent: [usize; 2],
    /// Says whether the present run is one with a small population, its evaluations, and how many it may have.
    small: bool,
    run: usize,
    limit: Option<usize>,
}

impl Schedule {
    pub(super) fn new(restarts: Restarts, population: usize) -> Self {
        Self {
            restarts,
            first: population,
            large: population,
            spent: [0; 2],
            small: false,
            run: 0,
            limit: None,
        }
    }

    pub(super) fn count(&mut self, evaluations: usize) {
        self.run += evaluations;
        self.spent[usize::from(self.small)] += evaluations;
    }

    /// Tells whether the present run has had its share.
    pub(super) fn is_spent(&self) -> bool {
        self.limit.is_some_and(|limit| self.run >= limit)
    }

    /// The next run after one that has ended, `None` where there is none.
    pub(super) fn next(&mut self, generator: &mut Generator) -> Option<Start> {
        let run = std::mem::take(&mut self.run);
        match self.restarts {
            Restarts::None => return None,
            Restarts::Increasing => self.small = false,
            Restarts::TwoRegimes => {
                if !self.small {
                    // Small runs may take half of what the last large one took.
                    self.limit = Some(run / 2);
                }
                // The first run counts for neither: a small population comes after two large ones.
                self.small = self.large > self.first && self.spent[1] < self.spent[0];
            }
        }
        if self.small {
            let ratio = self.large as f64 / self.first as f64;
            let u = generator.uniform();
            let population = self.first as f64 * (0.5 * ratio).powf(u * u);
            let step = 10.0_f64.powf(-2.0 * generator.uniform());
            return Some(Start { population: (population as usize).max(self.first), step });
        }
        self.limit = None;
        self.large *= 2;
        Some(Start { population: self.large, step: 1.0 })
    }
}

/// The history that the stopping tests of a run look back on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    /// Best objective of recent generations, the oldest at `next`.
    recent: Vec<f64>,
    next: usize,
    longest: usize,
    /// Best and median objective of the generations of the run, the newest last.
    best: Vec<f64>,
    median: Vec<f64>,
    first_sigma: f64,
    #[serde(skip)]
    sorted: Scratch<Vec<f64>>,
}

/// Objectives of so many generations are kept, by dropping the older half.
const KEPT: usize = 4096;
/// Part of the first step size below which a run has converged, and largest growth of it.
const LEAST_STEP: f64 = 1e-12;
const LARGEST_STEP: f64 = 1e4;
const LARGEST_CONDITION: f64 = 1e14;

impl Course {
    pub(super) fn new(dimension: usize, population: usize, sigma: f64) -> Self {
        let longest = 10 + (30 * dimension).div_ceil(population);
        Self {
            recent: Vec::with_capacity(longest),
            next: 0,
            longest,
            best: Vec::with_capacity(KEPT),
            median: Vec::with_capacity(KEPT),
            first_sigma: sigma,
            sorted: Scratch(Vec::with_capacity(KEPT)),
        }
    }

    /// The reason why the run has ended after this generation, `None` while it has not. `evaluations` are in the order `ranked`, best first.
    /// The tests are those of Hansen 2016, section B.3, with the stagnation of Hansen 2009.
    pub(super) fn end(
        &mut self,
        distribution: &Distribution,
        evaluations: &[Evaluation],
        ranked: &[usize],
        tolerance: f64,
    ) -> Option<Convergence> {
        let d = distribution;
        let n = d.mean.len();
        if !d.sound || d.condition() > LARGEST_CONDITION {
            return Some(Convergence::Condition);
        }
        let (best, worst) = (evaluations[ranked[0]], evaluations[ranked[ranked.len() - 1]]);
        let largest = (0..n).map(|i| d.deviation(i).max(d.path_c[i].abs())).fold(0.0, f64::max);
        if d.sigma * largest < LEAST_STEP * self.first_sigma || d.has_no_effect() {
            return Some(Convergence::Spread);
        }
        let longest_axis = d.lengths.iter().fold(0.0_f64, |a, &b| a.max(b));
        if d.sigma * longest_axis > LARGEST_STEP * self.first_sigma {
            return Some(Convergence::Condition);
        }
        if best.violation > 0.0 || best.is_failed() {
            // Objectives of infeasible points say nothing about progress.
            return None;
        }
        if self.recent.len() < self.longest {
            self.recent.push(best.objective);
        } else {
            self.recent[self.next] = best.objective;
            self.next = (self.next + 1) % self.longest;
            let range = |values: &[f64]| {
                let least = values.iter().fold(f64::INFINITY, |a, &b| a.min(b));
                values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)) - least
            };
            let past = range(&self.recent);
            let flat = worst.violation <= 0.0 && worst.objective - best.objective < tolerance;
            if past == 0.0 || (past < tolerance && flat) {
                return Some(Convergence::FlatObjective);
            }
        }
        let median = evaluations[ranked[ranked.len() / 2]].objective;
        if median.is_finite() {
            self.best.push(best.objective);
            self.median.push(median);
        }
        self.stagnates(n, ranked.len()).then_some(Convergence::FlatObjective)
    }

    /// Tells whether neither the best nor the median objectives of the last 30 % of a long enough time are better than those of the
    /// first 30 %.
    fn stagnates(&mut self, n: usize, population: usize) -> bool {
        let count = self.best.len();
        let least = 120 + 30 * n / population;
        let window = (count / 5).max(least);
        let mut median_of = |values: &[f64]| {
            let sorted = &mut self.sorted.0;
            sorted.clear();
            sorted.extend_from_slice(values);
            *sorted.select_nth_unstable_by(values.len() / 2, f64::total_cmp).1
        };
        let mut improves = |values: &[f64]| {
            let (recent, part) = (&values[count - window..], 3 * window / 10);
            median_of(&recent[window - part..]) < median_of(&recent[..part])
        };
        // Once in a while is enough.
        let stagnates =
            count > 2 * least && count.is_multiple_of(16) && !improves(&self.best) && !improves(&self.median);
        if count >= KEPT {
            self.best.drain(..KEPT / 2);
            self.median.drain(..KEPT / 2);
        }
        stagnates
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn populations_double() {
        let mut generator = Generator::new(1);
        let mut schedule = Schedule::new(Restarts::Increasing, 10);
        for k in 1..5 {
            schedule.count(100);
            assert_eq!(schedule.next(&mut generator), Some(Start { population: 10 << k, step: 1.0 }));
        }
        assert_eq!(Schedule::new(Restarts::None, 10).next(&mut generator), None);
    }

    #[test]
    fn two_regimes_spend_alike() {
        let mut generator = Generator::new(1);
        let mut schedule = Schedule::new(Restarts::TwoRegimes, 10);
        let mut spent = [0, 0];
        let (mut population, mut small) = (10, false);
        for _ in 0..60 {
            // Runs of a hundred generations.
            let used = (population * 100).min(schedule.limit.unwrap_or(usize::MAX));
            schedule.count(used);
            spent[usize::from(small)] += used;
            let start = schedule.next(&mut generator).unwrap();
            small = schedule.small;
            population = start.population;
            if small {
                assert!(start.step <= 1.0 && start.step >= 0.01);
                assert!(population >= 10 && population <= schedule.large / 2 + 1);
            } else {
                assert_eq!(population, schedule.large);
            }
            if spent[0] > 20_000 {
                break;
            }
        }
        // Less than one large run apart.
        assert!(spent[1] > 0 && spent[1] < 2 * spent[0], "{spent:?}");
    }
}
