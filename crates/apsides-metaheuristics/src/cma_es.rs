//! Evolution strategy with covariance matrix adaptation, CMA-ES (Hansen 2016, The CMA Evolution Strategy: A Tutorial,
//! arXiv 1604.00772).
//!
//! Points are drawn from a normal distribution `m + sigma N(0, C)`. The mean `m` moves to the better half of them, the
//! covariance `C` learns the steps that succeeded and, with the active update, unlearns those that failed, and the step
//! size `sigma` grows where successive steps agree. All is invariant to rotations and to increasing functions of the
//! objective. Coordinates are parts of the box, from 0 to 1; fixed ones take no part.
//!
//! A run that has converged is followed by another one, as [`Restarts`] says.

mod distribution;
mod eigen;
mod penalty;
mod restarts;
mod scratch;
mod vectors;
mod weights;

use crate::algorithm::require_population;
use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Evaluation, Generator, Points, Population, SearchError, SearchSpace,
    Task,
};
use distribution::Distribution;
use penalty::Penalty;
use restarts::{Course, Schedule, Start};
use serde::{Deserialize, Serialize};
use vectors::dot;
use weights::Weights;

/// The way on after a run that has converged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Restarts {
    /// Nothing: the search ends.
    None,
    /// A run with twice the population, IPOP (Auger and Hansen 2005, <https://doi.org/10.1109/CEC.2005.1554902>).
    #[default]
    Increasing,
    /// The same in turns with runs of small populations and short steps, BIPOP (Hansen 2009,
    /// <https://doi.org/10.1145/1570256.1570333>): better where many short runs are, and the budget is large.
    TwoRegimes,
}

/// The treatment of points outside of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CmaBounds {
    /// Evaluated at the nearest point of the box, with an objective that grows with the distance.
    #[default]
    Penalty,
    /// Drawn again, for minima inside of the box; the nearest point of the box after many times.
    Resampling,
}

/// Settings of CMA-ES.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CmaEsSettings {
    /// Points of a generation in the first run, at least 4; default `None` is `4 + 3 ln n`, rounded down.
    pub population: Option<usize>,
    /// First standard deviation of each coordinate as a part of the box, above 0 and at most 1; default 0.3.
    pub step: f64,
    /// Says whether bad points are unlearnt; default yes.
    pub active: bool,
    /// Default penalty.
    pub bounds: CmaBounds,
    /// Default with a growing population, which suits budgets of about 10^4 evaluations for each coordinate.
    pub restarts: Restarts,
    /// Objectives of a generation, and the best ones of recent generations, that differ by less end a run; default 1e-12.
    pub tolerance: f64,
}

impl Default for CmaEsSettings {
    fn default() -> Self {
        Self {
            population: None,
            step: 0.3,
            active: true,
            bounds: CmaBounds::default(),
            restarts: Restarts::default(),
            tolerance: 1e-12,
        }
    }
}

/// Draws of one point until the nearest point of the box is taken.
const DRAWS: usize = 100;

/// CMA-ES.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CmaEs {
    settings: CmaEsSettings,
    space: SearchSpace,
    generator: Generator,
    /// Coordinates that are not fixed.
    free: Vec<usize>,
    population: usize,
    distribution: Distribution,
    penalty: Penalty,
    course: Course,
    schedule: Schedule,
    /// Steps from the mean of the points of this generation, and the same whitened; a row for each.
    steps: Vec<f64>,
    whitened: Vec<f64>,
    /// Points from outside for the next generation.
    injected: Points,
    /// The last generation.
    last: Population,
    /// The last generation as it is ranked, and the ranks.
    ranked: Vec<usize>,
    penalised: Vec<Evaluation>,
    best: Option<Candidate>,
    ended: Option<Convergence>,
}

impl CmaEs {
    /// A distribution about a random point, or about the first start point; the other start points are in the first generation.
    ///
    /// # Errors
    /// Fewer than 4 points and settings out of range.
    pub fn new(settings: &CmaEsSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let space = task.space;
        let free: Vec<usize> = (0..space.dimension()).filter(|&i| space.width(i) > 0.0).collect();
        let n = free.len();
        let population = settings.population.unwrap_or(4 + (3.0 * (n.max(1) as f64).ln()) as usize);
        require_population("CMA-ES", population, 4)?;
        let holds = settings.step > 0.0 && settings.step <= 1.0;
        require("CMA-ES: step", settings.step, holds, "above 0 and at most 1 is needed")?;
        let t = settings.tolerance;
        require("CMA-ES: tolerance", t, (0.0..f64::INFINITY).contains(&t), "at least 0 is needed")?;
        let mut generator = Generator::new(task.seed);
        let mean = match task.start.rows().next() {
            Some(x) => free.iter().map(|&i| space.fraction(i, x[i])).collect(),
            None => free.iter().map(|_| generator.uniform()).collect(),
        };
        let weights = Weights::new(n.max(1), population, settings.active);
        let mut injected = Points::new(space.dimension());
        injected.extend(task.start);
        Ok(Self {
            settings: settings.clone(),
            space: space.clone(),
            generator,
            population,
            distribution: Distribution::new(mean, settings.step, weights),
            penalty: Penalty::new(n, population),
            course: Course::new(n, population, settings.step),
            schedule: Schedule::new(settings.restarts, population),
            steps: Vec::new(),
            whitened: Vec::new(),
            injected,
            last: Population::new(space.dimension()),
            ranked: Vec::new(),
            penalised: Vec::new(),
            best: None,
            ended: None,
            free,
        })
    }

    /// A run from a new random mean.
    fn restart(&mut self, start: Start) {
        let n = self.free.len();
        let mean = self.free.iter().map(|_| self.generator.uniform()).collect();
        let step = self.settings.step * start.step;
        self.population = start.population;
        let weights = Weights::new(n, start.population, self.settings.active);
        self.distribution = Distribution::new(mean, step, weights);
        self.penalty = Penalty::new(n, start.population);
        self.course = Course::new(n, start.population, step);
    }

    /// Draws the step of row `k` and puts its point into `x`.
    fn draw(&mut self, k: usize, x: &mut [f64]) {
        let n = self.free.len();
        let (y, z) = (&mut self.steps[k * n..(k + 1) * n], &mut self.whitened[k * n..(k + 1) * n]);
        let d = &self.distribution;
        let draws = match self.settings.bounds {
            CmaBounds::Penalty => 1,
            CmaBounds::Resampling => DRAWS,
        };
        for _ in 0..draws {
            d.draw(&mut self.generator, z, y);
            if d.mean.iter().zip(&*y).all(|(m, y)| (0.0..=1.0).contains(&(m + d.sigma * y))) {
                break;
            }
        }
        for ((&i, m), y) in self.free.iter().zip(&d.mean).zip(y) {
            x[i] = self.space.at(i, m + d.sigma * *y);
        }
    }

    /// Takes a point from outside as row `k`. A step that is long for the distribution is shortened for the update, so that one
    /// point does not decide it (Hansen 2011, Injecting External Solutions Into CMA-ES, arXiv 1110.4181).
    fn inject(&mut self, k: usize, x: &[f64]) {
        let n = self.free.len();
        let (y, z) = (&mut self.steps[k * n..(k + 1) * n], &mut self.whitened[k * n..(k + 1) * n]);
        let d = &self.distribution;
        for ((&i, m), y) in self.free.iter().zip(&d.mean).zip(y.iter_mut()) {
            *y = (self.space.fraction(i, x[i]) - m) / d.sigma;
        }
        d.whiten(y, z);
        let length = dot(z, z).sqrt();
        let n = n as f64;
        let longest = n.sqrt() + 2.0 * n / (n + 2.0);
        if length > longest {
            y.iter_mut().chain(z).for_each(|v| *v *= longest / length);
        }
    }

    /// Results with the cost of what was cut off, and their order.
    fn rank(&mut self, evaluations: &[Evaluation]) {
        let n = self.free.len();
        self.penalised.clear();
        self.penalised.extend_from_slice(evaluations);
        if self.settings.bounds == CmaBounds::Penalty {
            let (d, penalty) = (&self.distribution, &mut self.penalty);
            penalty.adapt(d, evaluations);
            for (evaluation, y) in self.penalised.iter_mut().zip(self.steps.chunks_exact(n)) {
                evaluation.objective += penalty.cost(d, |i| {
                    let x = d.mean[i] + d.sigma * y[i];
                    x - x.clamp(0.0, 1.0)
                });
            }
        }
        let penalised = &self.penalised;
        self.ranked.clear();
        self.ranked.extend(0..evaluations.len());
        self.ranked.sort_unstable_by(|&i, &j| penalised[i].order(&penalised[j]).then(i.cmp(&j)));
    }
}

impl Algorithm for CmaEs {
    fn ask(&mut self, points: &mut Points) {
        points.clear();
        let rows = self.population * self.free.len();
        self.steps.resize(rows, 0.0);
        self.whitened.resize(rows, 0.0);
        let injected = std::mem::replace(&mut self.injected, Points::new(self.space.dimension()));
        for k in 0..self.population {
            if k < injected.len() {
                points.push(injected.row(k));
            } else {
                points.push(self.space.lower());
            }
            match injected.len() {
                _ if self.free.is_empty() => {}
                count if k < count => self.inject(k, injected.row(k)),
                _ => self.draw(k, points.row_mut(k)),
            }
        }
        self.injected = injected;
        self.injected.clear();
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        for (x, evaluation) in points.rows().zip(evaluations) {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.last.clear();
        self.last.points.extend(points);
        self.last.evaluations.extend_from_slice(evaluations);
        self.schedule.count(evaluations.len());
        if self.free.is_empty() {
            self.ended = Some(Convergence::Spread);
            return;
        }
        // A generation without any result teaches nothing.
        if evaluations.iter().all(Evaluation::is_failed) {
            return;
        }
        self.rank(evaluations);
        self.distribution.update(&self.steps, &self.whitened, &self.ranked);
        let spent = self.schedule.is_spent();
        let end = self.course.end(&self.distribution, &self.penalised, &self.ranked, self.settings.tolerance);
        if spent || end.is_some() {
            match self.schedule.next(&mut self.generator) {
                Some(start) => self.restart(start),
                None => self.ended = end,
            }
        }
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        self.last.copy_best(count, into);
    }

    /// Migrants are evaluated again in the next generation, and pull the distribution towards them if they rank well.
    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
            if self.injected.len() < self.population / 2 {
                self.injected.push(x);
            }
        }
        self.last.replace_worst(migrants, |_, _| {});
    }

    fn spread(&self) -> f64 {
        self.last.points.spread(&self.space)
    }

    fn converged(&self) -> Option<Convergence> {
        self.ended
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs to a target; evaluations, or `None` where the budget is spent.
    fn evaluations(
        settings: &CmaEsSettings,
        space: &SearchSpace,
        seed: u64,
        target: f64,
        objective: impl Fn(&[f64]) -> f64,
    ) -> Option<usize> {
        let n = space.dimension();
        let task = Task { space, start: &Points::new(n), seed, budget: 20_000 };
        let mut cma = CmaEs::new(settings, &task).expect("settings");
        let (mut points, mut count) = (Points::new(n), 0);
        while count < 20_000 {
            cma.ask(&mut points);
            count += points.len();
            let results: Vec<_> = points.rows().map(|x| Evaluation::new(objective(x))).collect();
            cma.tell(&points, &results);
            if cma.best().is_some_and(|b| b.evaluation.objective <= target) {
                return Some(count);
            }
            if cma.converged().is_some() {
                return None;
            }
        }
        None
    }

    /// Mean over seeds, all of which succeed.
    fn mean(settings: &CmaEsSettings, target: f64, objective: impl Fn(&[f64]) -> f64 + Copy) -> f64 {
        let space = SearchSpace::cube(10, -5.0, 5.0).expect("a box");
        let all = (1..=10).map(|seed| evaluations(settings, &space, seed, target, objective));
        all.map(|count| count.expect("the target is met") as f64).sum::<f64>() / 10.0
    }

    fn sphere(x: &[f64]) -> f64 {
        x.iter().map(|x| (x - 1.0).powi(2)).sum()
    }

    #[test]
    fn an_increasing_function_of_the_objective_changes_nothing() {
        let space = SearchSpace::cube(5, -5.0, 5.0).expect("a box");
        let settings = CmaEsSettings::default();
        // Inside of the box penalties are 0; the minimum is far from the bounds.
        let plain = evaluations(&settings, &space, 4, 1e-6, sphere);
        let cubed = evaluations(&settings, &space, 4, 1e-18, |x| sphere(x).powi(3));
        assert!(plain.is_some());
        assert_eq!(plain, cubed);
    }

    #[test]
    fn the_matrix_learns_an_ill_conditioned_rotated_bowl() {
        // Condition 10^6. The steps along the axes of pairs, turned by 45 degrees, are a million times as steep one way.
        let bowl = |x: &[f64]| {
            let pairs = x.chunks_exact(2).map(|p| (p[0] + p[1] - 2.0).powi(2) + 1e6 * (p[0] - p[1]).powi(2));
            pairs.sum::<f64>()
        };
        let straight = |x: &[f64]| {
            x.chunks_exact(2).map(|p| (p[0] - 1.0).powi(2) + 1e6 * (p[1] - 1.0).powi(2)).sum::<f64>()
        };
        let settings = CmaEsSettings { restarts: Restarts::None, ..CmaEsSettings::default() };
        let (turned, straight) = (mean(&settings, 1e-8, bowl), mean(&settings, 1e-8, straight));
        assert!((turned / straight - 1.0).abs() < 0.1, "{turned} {straight}");
        // The ellipsoid of condition 10^6 in 10 dimensions takes about 6000 evaluations (Hansen 2016, figure 7, scaled).
        assert!(turned < 8000.0, "{turned}");
        // Unlearning makes it faster (Jastrebski and Arnold 2006).
        let passive = mean(&CmaEsSettings { active: false, ..settings }, 1e-8, bowl);
        assert!(passive > 1.1 * turned, "{passive} {turned}");
    }

    #[test]
    fn minima_on_the_bound_are_met_by_the_penalty() {
        let space = SearchSpace::cube(4, 0.0, 1.0).expect("a box");
        // Least at the corner (0, 0, 1, 1), outside of which it goes on falling.
        let slope = |x: &[f64]| x[0] + 10.0 * x[1] - x[2] - 0.1 * x[3];
        for seed in 1..=10 {
            let settings = CmaEsSettings { restarts: Restarts::None, ..CmaEsSettings::default() };
            assert!(evaluations(&settings, &space, seed, -1.1 + 1e-9, slope).is_some(), "{seed}");
        }
    }

    #[test]
    fn restarts_double_the_population() {
        let space = SearchSpace::cube(2, -1.0, 1.0).expect("a box");
        let task = Task { space: &space, start: &Points::new(2), seed: 1, budget: 10_000 };
        let mut cma = CmaEs::new(&CmaEsSettings::default(), &task).expect("settings");
        let (mut points, mut sizes) = (Points::new(2), vec![]);
        for _ in 0..600 {
            cma.ask(&mut points);
            if sizes.last() != Some(&points.len()) {
                sizes.push(points.len());
            }
            let results: Vec<_> = points.rows().map(|x| Evaluation::new(sphere(x))).collect();
            cma.tell(&points, &results);
        }
        assert!(sizes.starts_with(&[6, 12, 24]), "{sizes:?}");
    }

    #[test]
    fn a_migrant_far_away_draws_the_distribution_near() {
        let space = SearchSpace::cube(3, -5.0, 5.0).expect("a box");
        let mut start = Points::new(3);
        start.push(&[-4.0; 3]);
        let task = Task { space: &space, start: &start, seed: 1, budget: 10_000 };
        let settings = CmaEsSettings { step: 0.01, ..CmaEsSettings::default() };
        let mut cma = CmaEs::new(&settings, &task).expect("settings");
        let mut points = Points::new(3);
        let mut generation = |cma: &mut CmaEs| {
            cma.ask(&mut points);
            let results: Vec<_> = points.rows().map(|x| Evaluation::new(sphere(x))).collect();
            cma.tell(&points, &results);
            cma.distribution.mean[0]
        };
        let before = generation(&mut cma);
        let mut migrants = Population::new(3);
        migrants.push(&[1.0; 3], Evaluation::new(0.0));
        cma.immigrate(&migrants);
        let after = generation(&mut cma);
        // Further than three standard deviations of the mean, in coordinates from 0 to 1.
        assert!(after - before > 3.0 * 0.01 / 1.7 * 0.3, "{before} {after}");
        assert_eq!(cma.best().map(|b| b.evaluation.objective), Some(0.0));
    }
}
