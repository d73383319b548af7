//! Genetic algorithm with real numbers.
//!
//! Parents are the winners of tournaments. Children come from simulated binary crossover (Deb and Agrawal 1995): with the parents
//! `y1 < y2` of a coordinate,
//!
//! ```text
//! c = (y1 + y2 -+ b (y2 - y1)) / 2,   b = (u a)^(1/(n+1)) for u <= 1/a, else (2 - u a)^(-1/(n+1)),   a = 2 - g^-(n+1)
//! ```
//!
//! where `u` is uniform, `n` the distribution index and `g = 1 + 2 (distance of the parent to its bound) / (y2 - y1)`, so that no
//! child leaves the box. Polynomial mutation (Deb and Goyal 1996) then moves single coordinates. The best of children and elite
//! are the next generation.

use crate::algorithm::require_population;
use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Evaluation, Generator, Points, Population, SearchError, SearchSpace,
    Task,
};
use serde::{Deserialize, Serialize};

/// Settings of a genetic algorithm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GeneticSettings {
    /// Members, and children of each generation, at least 2; default 100.
    pub population: usize,
    /// Members in one tournament, at least 1; default 2. More press harder.
    pub tournament: usize,
    /// Probability that two parents are crossed rather than copied; default 0.9.
    pub crossover: f64,
    /// Distribution index of the crossover, at least 0; default 2. Children of a larger one are closer to their parents.
    pub crossover_index: f64,
    /// Probability that a coordinate mutates; default `None` for one over their number.
    pub mutation: Option<f64>,
    /// Distribution index of the mutation, at least 0; default 20. A larger one makes smaller moves.
    pub mutation_index: f64,
    /// Best parents that compete with the children for places in the next generation: 0 for none, default
    /// `None` for all.
    pub elite: Option<usize>,
}

impl Default for GeneticSettings {
    fn default() -> Self {
        Self {
            population: 100,
            tournament: 2,
            crossover: 0.9,
            crossover_index: 2.0,
            mutation: None,
            mutation_index: 20.0,
            elite: None,
        }
    }
}

/// Parents closer than this part of the box are taken as equal, which keeps the spread factor finite.
const EQUAL: f64 = 1e-14;

/// A genetic algorithm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Genetic {
    settings: GeneticSettings,
    space: SearchSpace,
    generator: Generator,
    /// The points of the first generation, until they are asked for.
    first: Points,
    /// Best first.
    parents: Population,
    next: Population,
    order: Vec<usize>,
    best: Option<Candidate>,
}

impl Genetic {
    /// A random population.
    ///
    /// # Errors
    /// Fewer than 2 members and settings out of range.
    pub fn new(settings: &GeneticSettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let s = settings;
        require_population("genetic algorithm", s.population, 2)?;
        let tournament = s.tournament as f64;
        require("genetic algorithm: tournament", tournament, s.tournament > 0, "at least 1 is needed")?;
        let mutation = s.mutation.unwrap_or(0.0);
        for (name, p) in
            [("genetic algorithm: crossover", s.crossover), ("genetic algorithm: mutation", mutation)]
        {
            require(name, p, (0.0..=1.0).contains(&p), "0 to 1 is needed")?;
        }
        for (name, n) in [
            ("genetic algorithm: crossover_index", s.crossover_index),
            ("genetic algorithm: mutation_index", s.mutation_index),
        ] {
            require(name, n, n >= 0.0 && n.is_finite(), "at least 0 and finite is needed")?;
        }
        let mut generator = Generator::new(task.seed);
        Ok(Self {
            first: task.first_points(s.population, &mut generator),
            settings: s.clone(),
            space: task.space.clone(),
            generator,
            parents: Population::new(task.space.dimension()),
            next: Population::new(task.space.dimension()),
            order: Vec::new(),
            best: None,
        })
    }

    /// Takes migrants in place of as many of its worst members, whether they are better or not; before the first generation in place of random
    /// points.
    pub(crate) fn take_in(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        if self.parents.is_empty() {
            for (k, x) in migrants.points.rows().enumerate().take(self.first.len()) {
                self.first.row_mut(k).copy_from_slice(x);
            }
        }
        self.parents.take_in(migrants);
    }

    /// The winner of a tournament. Parents stand in order, so that the lowest index wins.
    fn select(&mut self) -> usize {
        let count = self.parents.len();
        (0..self.settings.tournament).map(|_| self.generator.index(count)).min().unwrap_or(0)
    }

    /// Two children of two parents into the rows `first` and `first + 1`, where there are so many.
    fn cross(&mut self, mother: usize, father: usize, points: &mut Points, count: usize) {
        let Self { settings, space, generator, parents, .. } = self;
        let (mother, father) = (parents.points.row(mother), parents.points.row(father));
        let crossed = generator.chance(settings.crossover);
        let first = points.len();
        let two = first + 1 < count;
        points.push(mother);
        if two {
            points.push(father);
        }
        if !crossed {
            return;
        }
        for i in 0..mother.len() {
            let (low, high) = (mother[i].min(father[i]), mother[i].max(father[i]));
            if !generator.chance(0.5) || high - low <= EQUAL * space.width(i) {
                continue;
            }
            let u = generator.uniform();
            let factor =
                |gap: f64| spread_factor(u, 1.0 + 2.0 * gap / (high - low), settings.crossover_index);
            let (below, above) = (factor(low - space.lower()[i]), factor(space.upper()[i] - high));
            let mut children =
                [low + high - below * (high - low), low + high + above * (high - low)].map(|c| 0.5 * c);
            if generator.chance(0.5) {
                children.swap(0, 1);
            }
            points.row_mut(first)[i] = space.clamp(i, children[0]);
            if two {
                points.row_mut(first + 1)[i] = space.clamp(i, children[1]);
            }
        }
    }

    fn mutate(&mut self, x: &mut [f64]) {
        let probability = self.settings.mutation.unwrap_or(1.0 / x.len() as f64);
        let power = self.settings.mutation_index + 1.0;
        for (i, x) in x.iter_mut().enumerate() {
            if !self.generator.chance(probability) {
                continue;
            }
            let (u, at) = (self.generator.uniform(), self.space.fraction(i, *x));
            let part = if u < 0.5 {
                (2.0 * u + (1.0 - 2.0 * u) * (1.0 - at).powf(power)).powf(1.0 / power) - 1.0
            } else {
                1.0 - (2.0 * (1.0 - u) + (2.0 * u - 1.0) * at.powf(power)).powf(1.0 / power)
            };
            *x = self.space.clamp(i, *x + part * self.space.width(i));
        }
    }

    /// The best of the elite and of the children become the parents.
    fn survive(&mut self, children: &Points, evaluations: &[Evaluation]) {
        let Self { settings, parents, next, order, .. } = self;
        order.clear();
        order.extend(0..evaluations.len());
        order.sort_unstable_by(|&i, &j| evaluations[i].order(&evaluations[j]).then(i.cmp(&j)));
        next.clear();
        // Both stand in order: the better of the next two, and of equals the parent.
        let mut elite = 0..settings.elite.unwrap_or(usize::MAX).min(parents.len());
        let mut sorted = order.iter();
        while next.len() < settings.population {
            let (parent, child) = (elite.clone().next(), sorted.as_slice().first().copied());
            let parent = parent
                .filter(|&p| child.is_none_or(|c| !evaluations[c].is_better_than(&parents.evaluations[p])));
            if let Some(parent) = parent {
                next.push(parents.points.row(parent), parents.evaluations[parent]);
                elite.next();
            } else if let Some(child) = child {
                next.push(children.row(child), evaluations[child]);
                sorted.next();
            } else {
                break;
            }
        }
        std::mem::swap(parents, next);
    }
}

/// The spread factor of simulated binary crossover for a uniform `u` and the relative distance `gap` to the bound.
fn spread_factor(u: f64, gap: f64, index: f64) -> f64 {
    let power = index + 1.0;
    // Whole powers, such as that of the default index, by products.
    let alpha = if power.fract() == 0.0 && power < 64.0 {
        2.0 - gap.powi(power as i32).recip()
    } else {
        2.0 - gap.powf(-power)
    };
    let base = if u * alpha <= 1.0 { u * alpha } else { 1.0 / (2.0 - u * alpha) };
    base.powf(1.0 / power)
}

impl Algorithm for Genetic {
    fn ask(&mut self, points: &mut Points) {
        points.clear();
        if self.parents.is_empty() {
            points.extend(&self.first);
            return;
        }
        let count = self.settings.population;
        while points.len() < count {
            let (mother, father) = (self.select(), self.select());
            self.cross(mother, father, points, count);
        }
        for k in 0..count {
            self.mutate(points.row_mut(k));
        }
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        for (x, evaluation) in points.rows().zip(evaluations) {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.survive(points, evaluations);
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        self.parents.copy_first(count, into);
    }

    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
            self.parents.insert_sorted(x, *evaluation);
        }
    }

    fn spread(&self) -> f64 {
        let told = !self.parents.is_empty();
        if told { self.parents.points.spread(&self.space) } else { self.first.spread(&self.space) }
    }

    fn converged(&self) -> Option<Convergence> {
        // While coordinates mutate there is something to gain.
        (self.settings.mutation == Some(0.0)
            && !self.parents.is_empty()
            && self.parents.points.coincide(&self.space))
        .then_some(Convergence::Spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROUNDING: f64 = 1e-12;

    #[test]
    fn children_keep_the_mean_of_their_parents_far_from_bounds() {
        // Deb and Agrawal 1995: (c1 + c2) / 2 = (y1 + y2) / 2, and half of the factors are below 1.
        let space = SearchSpace::cube(1, -1e6, 1e6).expect("a box");
        let mut start = Points::new(1);
        start.push(&[-1.0]);
        start.push(&[2.0]);
        let task = Task { space: &space, start: &start, seed: 7, budget: 100 };
        let settings =
            GeneticSettings { population: 2, crossover: 1.0, mutation: Some(0.0), ..Default::default() };
        let mut genetic = Genetic::new(&settings, &task).expect("a population");
        let mut points = Points::new(1);
        genetic.ask(&mut points);
        genetic.tell(&points, &[Evaluation::new(0.0), Evaluation::new(1.0)]);
        let (mut within, mut crossed) = (0, 0);
        for _ in 0..2000 {
            points.clear();
            genetic.cross(0, 1, &mut points, 2);
            let (a, b) = (points.row(0)[0], points.row(1)[0]);
            assert!((a + b - 1.0).abs() < ROUNDING);
            if a != -1.0 && a != 2.0 {
                crossed += 1;
                within += usize::from((a - b).abs() < 3.0);
            }
        }
        // Binomial with p = 1/2: four standard deviations about the mean.
        let deviation = (0.25 * f64::from(crossed)).sqrt();
        assert!(crossed > 900 && (within as f64 - 0.5 * f64::from(crossed)).abs() < 4.0 * deviation);
    }

    #[test]
    fn spread_factor_without_a_bound() {
        // u = 0.2 and n = 2: (2 u)^(1/3); u = 0.8: (1 / (2 (1 - u)))^(1/3). Deb and Agrawal 1995, equation 11.
        assert!((spread_factor(0.2, 1e9, 2.0) - 0.4_f64.cbrt()).abs() < ROUNDING);
        assert!((spread_factor(0.8, 1e9, 2.0) - 2.5_f64.cbrt()).abs() < ROUNDING);
        // A parent on its bound gets a child between the parents.
        assert!(spread_factor(0.999_999, 1.0, 2.0) <= 1.0);
    }
}
