//! Ant colony optimisation of real numbers, ACO_R (Socha and Dorigo 2008).
//!
//! An archive holds the `k` best points, best first. An ant picks a point `l` of it with a probability in proportion to
//!
//! ```text
//! w_l = exp(-(l - 1)^2 / (2 q^2 k^2)) / (q k sqrt(2 pi))
//! ```
//!
//! and draws each coordinate from a normal distribution about that of the point, with the deviation
//! `xi sum_e |s_e - s_l| / (k - 1)`.

use crate::algorithm::require_population;
use crate::error::require;
use crate::{
    Algorithm, Candidate, Convergence, Evaluation, Generator, Points, Population, SearchError, SearchSpace,
    Task,
};
use serde::{Deserialize, Serialize};

/// Settings of an ant colony.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AntColonySettings {
    /// Points of the archive `k`, at least 2; default 50.
    pub archive: usize,
    /// Ants, which are the points of a generation, at least 1; default 10.
    pub ants: usize,
    /// Locality `q`, above 0; default 0.1. With a small one ants stay with the best point.
    pub locality: f64,
    /// Speed of convergence `xi`, above 0; default 0.85. A larger one converges more slowly.
    pub evaporation: f64,
}

impl Default for AntColonySettings {
    fn default() -> Self {
        Self { archive: 50, ants: 10, locality: 0.1, evaporation: 0.85 }
    }
}

/// An ant colony.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AntColony {
    settings: AntColonySettings,
    space: SearchSpace,
    generator: Generator,
    /// The points of the first generation, until they are asked for.
    first: Points,
    /// Best first.
    archive: Population,
    /// Sums of the weights up to each point of the archive.
    cumulative: Vec<f64>,
    /// Within `ask`: sums of distances to the points that guide ants, and where they stand by the index of the guide.
    sums: Points,
    places: Vec<Option<usize>>,
    best: Option<Candidate>,
}

impl AntColony {
    /// Takes migrants in place of as many of the worst of its archive, whether they are better or not.
    pub(crate) fn take_in(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
        }
        self.archive.take_in(migrants);
    }

    /// A colony with an archive of random points.
    ///
    /// # Errors
    /// An archive of fewer than 2 points, no ants, and settings out of range.
    pub fn new(settings: &AntColonySettings, task: &Task<'_>) -> Result<Self, SearchError> {
        let s = settings;
        require_population("ant colony: archive", s.archive, 2)?;
        require_population("ant colony: ants", s.ants, 1)?;
        for (name, value) in
            [("ant colony: locality", s.locality), ("ant colony: evaporation", s.evaporation)]
        {
            require(name, value, value > 0.0 && value.is_finite(), "above 0 and finite is needed")?;
        }
        let mut generator = Generator::new(task.seed);
        let width = s.locality * s.archive as f64;
        // The common factor of the weights cancels.
        let weights = (0..s.archive).map(|l| (-0.5 * (l as f64 / width).powi(2)).exp());
        Ok(Self {
            first: task.first_points(s.archive, &mut generator),
            settings: s.clone(),
            space: task.space.clone(),
            generator,
            archive: Population::new(task.space.dimension()),
            cumulative: weights.scan(0.0, |sum, w| Some(add(sum, w))).collect(),
            sums: Points::new(task.space.dimension()),
            places: Vec::new(),
            best: None,
        })
    }

    /// A point of the archive by its weight.
    fn select(&mut self) -> usize {
        let total = self.cumulative.last().copied().unwrap_or(0.0);
        let mark = self.generator.uniform() * total;
        self.cumulative.partition_point(|&sum| sum <= mark).min(self.archive.len() - 1)
    }

    /// Where the sums of distances to a guide stand; several ants share them.
    fn place(&mut self, guide: usize) -> usize {
        if let Some(place) = self.places[guide] {
            return place;
        }
        let place = self.sums.len();
        self.places[guide] = Some(place);
        let (guide, sums) = (self.archive.points.row(guide), self.sums.add());
        // Row by row, as the archive lies in memory.
        for other in self.archive.points.rows() {
            for (sum, (a, b)) in sums.iter_mut().zip(other.iter().zip(guide)) {
                *sum += (a - b).abs();
            }
        }
        place
    }
}

/// Adds to a running sum, which it returns.
fn add(sum: &mut f64, term: f64) -> f64 {
    *sum += term;
    *sum
}

impl Algorithm for AntColony {
    fn ask(&mut self, points: &mut Points) {
        points.clear();
        if self.archive.is_empty() {
            points.extend(&self.first);
            return;
        }
        let factor = self.settings.evaporation / (self.archive.len() - 1) as f64;
        self.sums.reserve(self.settings.ants.min(self.archive.len()));
        self.places.resize(self.archive.len(), None);
        for _ in 0..self.settings.ants {
            let guide = self.select();
            let place = self.place(guide);
            let (guide, sums) = (self.archive.points.row(guide), self.sums.row(place));
            for (i, x) in points.add().iter_mut().enumerate() {
                let deviation = factor * sums[i];
                *x = self.space.reflect(i, guide[i] + deviation * self.generator.normal());
            }
        }
        self.sums.clear();
        self.places.clear();
    }

    fn tell(&mut self, points: &Points, evaluations: &[Evaluation]) {
        let first = self.archive.is_empty();
        for (x, evaluation) in points.rows().zip(evaluations) {
            Candidate::improve(&mut self.best, x, evaluation);
            if first {
                self.archive.push(x, *evaluation);
            } else {
                self.archive.insert_sorted(x, *evaluation);
            }
        }
        if first {
            self.archive.sort();
        }
    }

    fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    fn emigrants(&self, count: usize, into: &mut Population) {
        self.archive.copy_first(count, into);
    }

    fn immigrate(&mut self, migrants: &Population) {
        for (x, evaluation) in migrants.iter() {
            Candidate::improve(&mut self.best, x, evaluation);
            self.archive.insert_sorted(x, *evaluation);
        }
    }

    fn spread(&self) -> f64 {
        let told = !self.archive.is_empty();
        if told { self.archive.points.spread(&self.space) } else { self.first.spread(&self.space) }
    }

    fn converged(&self) -> Option<Convergence> {
        (!self.archive.is_empty() && self.archive.points.coincide(&self.space)).then_some(Convergence::Spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_picked_by_their_weights() {
        let space = SearchSpace::cube(1, 0.0, 1.0).expect("a box");
        let task = Task { space: &space, start: &Points::new(1), seed: 3, budget: 100 };
        let settings = AntColonySettings { archive: 10, locality: 0.2, ..Default::default() };
        let mut colony = AntColony::new(&settings, &task).expect("a colony");
        let mut points = Points::new(1);
        colony.ask(&mut points);
        let evaluations: Vec<_> = points.rows().map(|x| Evaluation::new(x[0])).collect();
        colony.tell(&points, &evaluations);
        assert!(colony.archive.evaluations.windows(2).all(|w| w[0].objective <= w[1].objective));
        const DRAWS: usize = 40_000;
        let mut counts = [0_usize; 10];
        for _ in 0..DRAWS {
            counts[colony.select()] += 1;
        }
        // q k = 2: weights exp(-l^2 / 8) for l = 0 .. 9.
        let weights: Vec<f64> = (0..10).map(|l| (-f64::from(l * l) / 8.0).exp()).collect();
        let total: f64 = weights.iter().sum();
        for (count, weight) in counts.iter().zip(weights) {
            let (p, n) = (weight / total, DRAWS as f64);
            // Four and a half standard deviations of the binomial distribution.
            assert!((*count as f64 - n * p).abs() <= 4.5 * (n * p * (1.0 - p)).sqrt() + 1.0);
        }
    }
}
