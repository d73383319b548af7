//! Random numbers from a seed, with a state that can be saved.

use crate::{Points, SearchSpace};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

/// A seeded generator, xoshiro256++ (Blackman and Vigna 2021).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Generator(Xoshiro256PlusPlus);

impl Generator {
    /// A generator from a seed.
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// A seed for another generator, such as that of an island.
    pub fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in [0, 1), with 53 random bits.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON)
    }

    /// Uniform in [lower, upper).
    pub fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.uniform()
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// An index below `count`, which is at least 1.
    pub fn index(&mut self, count: usize) -> usize {
        // The upper half of the product: its bias is below count / 2^64.
        ((u128::from(self.0.next_u64()) * count as u128) >> 64) as usize
    }

    /// Normal with mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Adds points to `points` until there are `count`: a Latin hypercube (McKay, Beckman and Conover 1979), which has one point
    /// in each of the equal slices of every coordinate.
    pub fn fill(&mut self, space: &SearchSpace, count: usize, points: &mut Points) {
        let (first, missing) = (points.len(), count.saturating_sub(points.len()));
        for _ in 0..missing {
            points.add();
        }
        let mut slices: Vec<usize> = (0..missing).collect();
        for i in 0..space.dimension() {
            for k in (1..missing).rev() {
                slices.swap(k, self.index(k + 1));
            }
            for (k, &slice) in slices.iter().enumerate() {
                points.row_mut(first + k)[i] = space.at(i, (slice as f64 + self.uniform()) / missing as f64);
            }
        }
    }
}
