//! The penalty on steps out of the box (Hansen, Niederberger, Guzzella, Koumoutsakos 2009,
//! <https://doi.org/10.1109/TEVC.2008.924423>, section IV.B).
//!
//! A point outside is evaluated at the nearest point of the box, and its objective grows by the weighted square of what was cut
//! off. The weights come from the range of recent objectives, and grow while the mean is far outside.

use super::distribution::Distribution;
use super::scratch::Scratch;
use crate::Evaluation;
use serde::{Deserialize, Serialize};

/// Weights by coordinate, and what they come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Penalty {
    weights: Vec<f64>,
    /// Says whether the weights are set, which they are when the mean is outside for the first time.
    set: bool,
    /// Interquartile ranges of recent generations, the oldest at `next`.
    ranges: Vec<f64>,
    next: usize,
    longest: usize,
    #[serde(skip)]
    sorted: Scratch<Vec<f64>>,
}

impl Penalty {
    pub(super) fn new(dimension: usize, population: usize) -> Self {
        let longest = 20 + 3 * dimension / population;
        Self {
            weights: vec![0.0; dimension],
            set: false,
            ranges: Vec::with_capacity(longest),
            next: 0,
            longest,
            sorted: Scratch(Vec::with_capacity(population.max(longest))),
        }
    }

    /// Takes the objectives of a generation in, and fits the weights to the mean, whose coordinates are in the box from 0 to 1.
    pub(super) fn adapt(&mut self, distribution: &Distribution, evaluations: &[Evaluation]) {
        let n = self.weights.len() as f64;
        let sorted = &mut self.sorted.0;
        sorted.clear();
        sorted.extend(evaluations.iter().filter(|e| !e.is_failed()).map(|e| e.objective));
        sorted.sort_unstable_by(f64::total_cmp);
        let range = if sorted.is_empty() {
            0.0
        } else {
            sorted[3 * (sorted.len() - 1) / 4] - sorted[(sorted.len() - 1) / 4]
        };
        let variance = |i: usize| (distribution.sigma * distribution.deviation(i)).powi(2);
        let mean_variance = (0..self.weights.len()).map(variance).sum::<f64>() / n;
        let range = range / mean_variance;
        if range.is_finite() && range > 0.0 {
            if self.ranges.len() < self.longest {
                self.ranges.push(range);
            } else {
                self.ranges[self.next] = range;
                self.next = (self.next + 1) % self.longest;
            }
        }
        let outside = |m: f64| (m - m.clamp(0.0, 1.0)).abs();
        if distribution.mean.iter().all(|&m| outside(m) == 0.0) || self.ranges.is_empty() {
            return;
        }
        if !self.set {
            sorted.clear();
            sorted.extend_from_slice(&self.ranges);
            sorted.sort_unstable_by(f64::total_cmp);
            let median = sorted[sorted.len() / 2];
            self.weights.fill(2.0 * median);
            // Values of the first generations say little about the ranges near the bound.
            self.set = distribution.generations > 2;
        }
        let w = &distribution.weights;
        let growth = 1.1_f64.powf((w.effective / (10.0 * n)).min(1.0));
        let far = 3.0 * (n.sqrt() / w.effective).max(1.0);
        for (i, weight) in self.weights.iter_mut().enumerate() {
            if outside(distribution.mean[i]) > far * variance(i).sqrt() {
                *weight *= growth;
            }
        }
    }

    /// The penalty on a point that was cut off by `outside(i)` along coordinate `i`.
    pub(super) fn cost(&self, distribution: &Distribution, outside: impl Fn(usize) -> f64) -> f64 {
        let n = self.weights.len();
        let log = |i: usize| distribution.deviation(i).max(f64::MIN_POSITIVE).ln();
        let mut mean = None;
        let mut cost = 0.0;
        for (i, weight) in self.weights.iter().enumerate() {
            let outside = outside(i);
            if outside != 0.0 {
                let mean = *mean.get_or_insert_with(|| (0..n).map(log).sum::<f64>() / n as f64);
                // Logarithms of variances are twice those of deviations.
                cost += weight * outside * outside / (1.8 * (log(i) - mean)).exp();
            }
        }
        cost / n as f64
    }
}
