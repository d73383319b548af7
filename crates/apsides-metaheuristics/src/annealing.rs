//! Simulated annealing with a step length for each coordinate (Corana, Marchesi, Martini and Ridella 1987).
//!
//! A walker tries a step along one coordinate after the other, uniform within that coordinate's step length, and takes one that is
//! worse by `d` with the probability `exp(-d / T)`. After a number of rounds over all coordinates each step length changes so that
//! about half of its steps are taken: with the share `a` of steps that were taken,
//!
//! ```text
//! v <- v (1 + c (a - 0.6) / 0.4) for a > 0.6,   v / (1 + c (0.4 - a) / 0.4) for a < 0.4
//! ```
//!
//! After a number of such changes the temperature falls by a factor and all walkers go to the best point. Violations are walked
//! on like objectives, with a temperature of their own, before the objective counts.

use crate::algorithm::require_population;
use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Evaluation, Generator, Points, Population, SearchError, SearchSpace,
    Task,
};
use serde::{Deserialize, Serialize};

/// Settings of simulated annealing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnnealingSettings {
    /// Walkers, each with step lengths of its own, which are the points of a generation; default 1. Several use several cores.
    pub walkers: usize,
    /// Random points of the first generation, at least 2 and no fewer than the walkers; default 20. Walkers start from the best.
    pub first: usize,
    /// Rounds over all coordinates between changes of the step lengths, at least 1; default 20.
    pub rounds: usize,
    /// Changes of the step lengths at one temperature, at least 1; default 1. The paper has at least 100 and
    /// far fewer temperatures; for the same evaluations a slow cooling in small steps does as well.
    pub changes: usize,
    /// First temperature, above 0, in units of the objective; default `None` for the standard deviation of the first generation.
    pub temperature: Option<f64>,
    /// Factor from one temperature to the next, above 0 and below 1; default `None` for one that goes through 14 powers of ten in
    /// the budget. The paper has 0.85.
    pub cooling: Option<f64>,
    /// The strength with which step lengths change, above 0; default 2.
    pub adaptation: f64,
    /// The search has converged when the best objective changed less than this over four temperatures, and so did that of all
    /// walkers; default `None` for never.
    pub tolerance: Option<f64>,
}

impl Default for AnnealingSettings {
    fn default() -> Self {
        Self {
            walkers: 1,
            first: 20,
            rounds: 20,
            changes: 1,
            temperature: None,
            cooling: None,
            adaptation: 2.0,
            tolerance: None,
        }
    }
}

/// The last temperature over the first where the budget sets the cooling.
const COOLED: f64 = 1e-14;

/// Temperatures over which results are compared.
const COMPARED: usize = 4;

/// Simulated annealing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Annealing {
    settings: AnnealingSettings,
    space: SearchSpace,
    generator: Generator,
    /// The points of the first generation, until they are asked for.
    start: Points,
    /// Coordinates that are not fixed; a fixed one where all are.
    free: Vec<usize>,
    /// The points of the walkers.
    walkers: Population,
    /// Step lengths as parts of the box, for each walker and coordinate.
    steps: Points,
    /// Steps taken since the last change, for each walker and coordinate.
    taken: Points,
    /// Place in the list of free coordinates, round and change.
    position: [usize; 3],
    /// Temperatures of the objective and of the violation.
    temperatures: [f64; 2],
    cooling: f64,
    /// Best objectives at the last temperatures, newest first.
    recent: Vec<f64>,
    settled: bool,
    best: Option<Candidate>,
}

impl Annealing {
    /// Walkers before the first generation.
    ///
    /// # Errors
    /// No walkers, a first generation that is too small, and settings out of range.
    pub fn new(settings: &AnnealingSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let s = settings;
        require_population("simulated annealing: walkers", s.walkers, 1)?;
        require_population("simulated annealing: first", s.first, s.walkers.max(2))?;
        require_population("simulated annealing: rounds", s.rounds, 1)?;
        require_population("simulated annealing: changes", s.changes, 1)?;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let temperature = s.temperature.unwrap_or(1.0);
        for (name, value) in [
            ("simulated annealing: temperature", temperature),
            ("simulated annealing: adaptation", s.adaptation),
        ] {
            require(name, value, positive(value), "above 0 and finite is needed")?;
        }
        let cooling = s.cooling.unwrap_or(0.5);
        let holds = cooling > 0.0 && cooling < 1.0;
        require("simulated annealing: cooling", cooling, holds, "above 0 and below 1 is needed")?;
        let tolerance = s.tolerance.unwrap_or(0.0);
        require("simulated annealing: tolerance", tolerance, tolerance >= 0.0, "at least 0 is needed")?;

        let dimension = task.space.dimension();
        let mut generator = Generator::new(task.seed);
        let start = task.first_points(s.first, &mut generator);
        let mut free: Vec<usize> = (0..dimension).filter(|&i| task.space.width(i) > 0.0).collect();
        if free.is_empty() {
            free.push(0);
        }
        let (mut steps, mut taken) = (Points::new(dimension), Points::new(dimension));
        for _ in 0..s.walkers {
            steps.add().fill(1.0);
            taken.add();
        }
        let level: f64 = [free.len(), s.rounds, s.changes, s.walkers].map(|n| n as f64).iter().product();
        let levels = (task.budget.saturating_sub(s.first) as f64 / level).max(1.0);
        Ok(Self {
            cooling: s.cooling.unwrap_or_else(|| COOLED.powf(1.0 / levels)),
            settings: s.clone(),
            space: task.space.clone(),
            generator,
            start,
            free,
            walkers: Population::new(dimension),
            steps,
            taken,
            position: [0; 3],
            temperatures: [temperature, 0.0],
            recent: Vec::with_capacity(COMPARED + 1),
            settled: false,
            best: None,
        })
    }

    /// Walkers at the best points of the first generation, and temperatures from its results.
    fn begin(&mut self, points: &Points, evaluations: &[Evaluation]) {
        let good = || evaluations.iter().filter(|e| !e.is_failed());
        let deviation = |value: fn(&Evaluation) -> f64| {
            let count = good().count().max(1) as f64;
            let mean = good().map(value).sum::<f64>() / count;
            (good().map(|e| (value(e) - mean).powi(2)).sum::<f64>() / count).sqrt()
        };
        let objective = deviation(|e| e.objective);
        let usual = if objective > 0.0 && objective.is_finite() { objective } else { 1.0 };
        let violation = deviation(|e| e.violation.max(0.0));
        self.temperatures =
            [self.settings.temperature.unwrap_or(usual), if violation.is_finite() { violation } else { 0.0 }];
        let mut order: Vec<usize> = (0..evaluations.len()).collect();
        order.sort_by(|&i, &j| evaluations[i].order(&evaluations[j]));
        for &k in order.iter().take(self.settings.walkers) {
            self.walkers.push(points.row(k), evaluations[k]);
        }
    }

    /// Tells whether a walker takes a step from one result to another.
    fn accepts(&mut self, old: &Evaluation, new: &Evaluation) -> bool {
        if new.is_failed() || old.is_failed() {
            return old.is_failed();
        }
        let excess = new.violation.max(0.0) - old.violation.max(0.0);
        let (worse, temperature) = if excess == 0.0 {
            (new.objective - old.objective, self.temperatures[0])
        } else {
            (excess, self.temperatures[1])
        };
        worse <= 0.0 || self.generator.chance((-worse / temperature).exp())
    }

    /// The next coordinate; after a round of rounds other step lengths, after a number of those a lower temperature.
    fn advance(&mut self) {
        let limits = [self.free.len(), self.settings.rounds, self.settings.changes];
        for (level, limit) in limits.into_iter().enumerate() {
            self.position[level] += 1;
            if self.position[level] < limit {
                return;
            }
            self.position[level] = 0;
            match level {
                1 => self.change_steps(),
                2 => self.cool(),
                _ => {}
            }
        }
    }

    fn change_steps(&mut self) {
        let (rounds, adaptation) = (self.settings.rounds as f64, self.settings.adaptation);
        for walker in 0..self.walkers.len() {
            let taken = self.taken.row_mut(walker);
            for (step, taken) in self.steps.row_mut(walker).iter_mut().zip(taken) {
                let share = *taken / rounds;
                if share > 0.6 {
                    *step *= 1.0 + adaptation * (share - 0.6) / 0.4;
                } else if share < 0.4 {
                    *step /= 1.0 + adaptation * (0.4 - share) / 0.4;
                }
                *step = step.clamp(f64::EPSILON, 1.0);
                *taken = 0.0;
            }
        }
    }

    fn cool(&mut self) {
        self.temperatures = self.temperatures.map(|t| t * self.cooling);
        let Some(best) = &self.best else { return };
        if let Some(tolerance) = self.settings.tolerance {
            let value = best.evaluation.objective;
            let near = |other: f64| (other - value).abs() <= tolerance;
            self.settled = self.recent.len() == COMPARED
                && self.recent.iter().all(|&r| near(r))
                && self.walkers.evaluations.iter().all(|e| near(e.objective));
            self.recent.truncate(COMPARED - 1);
            self.recent.insert(0, value);
        }
        for walker in 0..self.walkers.len() {
            self.walkers.set(walker, &best.x, best.evaluation);
        }
    }
}

impl Algorithm for Annealing {
    fn ask(&mut self, points: &mut Points) {
        points.clear();
        if self.walkers.is_empty() {
            points.extend(&self.start);
            return;
        }
        let i = self.free[self.position[0]];
        for walker in 0..self.walkers.len() {
            points.push(self.walkers.points.row(walker));
            let x = &mut points.row_mut(walker)[i];
            let step = self.steps.row(walker)[i] * self.space.width(i);
            let target = *x + step * self.generator.between(-1.0, 1.0);
            // A step out of the box becomes a random point of the coordinate, as in the paper.
            *x = if target == self.space.clamp(i, target) {
                target
            } else {
                self.space.at(i, self.generator.uniform())
            };
        }
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        for (x, evaluation) in points.rows().zip(evaluations) {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        if self.walkers.is_empty() {
            self.begin(points, evaluations);
            return;
        }
        let i = self.free[self.position[0]];
        for (walker, evaluation) in evaluations.iter().enumerate() {
            let old = self.walkers.evaluations[walker];
            if self.accepts(&old, evaluation) {
                self.walkers.set(walker, points.row(walker), *evaluation);
                self.taken.row_mut(walker)[i] += 1.0;
            }
        }
        self.advance();
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        // The best point first: walkers may have left it.
        if let Some(best) = self.best.as_ref().filter(|_| count > 0) {
            into.push(&best.x, best.evaluation);
            self.walkers.copy_best(count - 1, into);
        }
    }

    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.walkers.replace_worst(migrants, |_, _| {});
    }

    fn spread(&self) -> f64 {
        if self.walkers.is_empty() {
            return self.start.spread(&self.space);
        }
        let count = (self.free.len() * self.walkers.len()) as f64;
        self.steps.rows().map(|s| self.free.iter().map(|&i| s[i]).sum::<f64>()).sum::<f64>() / count
    }

    fn converged(&self) -> Option<Convergence> {
        self.settled.then_some(Convergence::FlatObjective)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn annealing(settings: &AnnealingSettings, budget: usize) -> Annealing {
        let space = SearchSpace::cube(2, -1.0, 1.0).expect("a box");
        let task = Task { space: &space, start: &Points::new(2), seed: 5, budget };
        Annealing::new(settings, &task).expect("walkers")
    }

    #[test]
    fn steps_follow_the_share_that_was_taken() {
        let mut annealing = annealing(&AnnealingSettings::default(), 1000);
        annealing.walkers.push(&[0.0, 0.0], Evaluation::new(0.0));
        annealing.steps.row_mut(0).copy_from_slice(&[0.1, 0.1]);
        annealing.taken.row_mut(0).copy_from_slice(&[20.0, 0.0]);
        annealing.change_steps();
        // All taken: 1 + c = 3 times; none taken: a third. Corana et al. 1987, step 5 with c = 2.
        const ROUNDING: f64 = 1e-15;
        assert!((annealing.steps.row(0)[0] - 0.3).abs() < ROUNDING);
        assert!((annealing.steps.row(0)[1] - 0.1 / 3.0).abs() < ROUNDING);
        assert_eq!(annealing.taken.row(0), [0.0, 0.0]);
    }

    #[test]
    fn worse_points_are_taken_by_metropolis_rule() {
        let mut annealing = annealing(&AnnealingSettings::default(), 1000);
        annealing.temperatures = [2.0, 0.5];
        const DRAWS: usize = 20_000;
        /// Four standard deviations of a share of the draws, at most `4 sqrt(0.25 / DRAWS)`.
        const FOUR_DEVIATIONS: f64 = 0.0142;
        let mut share = |old: Evaluation, new: Evaluation| {
            (0..DRAWS).filter(|_| annealing.accepts(&old, &new)).count() as f64 / DRAWS as f64
        };
        let with = |objective, violation| Evaluation { objective, violation };
        assert!((share(with(1.0, 0.0), with(2.0, 0.0)) - (-0.5_f64).exp()).abs() < FOUR_DEVIATIONS);
        assert!((share(with(1.0, 0.0), with(-9.0, 0.5)) - (-1.0_f64).exp()).abs() < FOUR_DEVIATIONS);
        assert_eq!(share(with(1.0, 0.2), with(9.0, 0.1)), 1.0);
        assert_eq!(share(with(1.0, 0.2), Evaluation::FAILED), 0.0);
        assert_eq!(share(Evaluation::FAILED, with(1.0, 3.0)), 1.0);
    }

    #[test]
    fn budget_sets_the_last_temperature() {
        /// Round-off of fifty factors.
        const ROUNDING: f64 = 1e-12;
        // Two coordinates, 20 rounds, 5 changes: 200 evaluations for each temperature, after 20 random points.
        let settings = AnnealingSettings { changes: 5, ..Default::default() };
        let annealing = annealing(&settings, 20 + 200 * 50);
        assert!((annealing.cooling.powi(50) / COOLED - 1.0).abs() < ROUNDING);
    }
}
