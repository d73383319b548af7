//! The result at a point, and which of two results is better.

use crate::number;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// The result at one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// The value that is minimised. One that is not finite says that the evaluation failed.
    #[serde(with = "number")]
    pub objective: f64,
    /// The distance of the point from satisfying the constraints: 0 or less where it does, NaN where that failed.
    #[serde(with = "number")]
    pub violation: f64,
}

impl Evaluation {
    /// A failed evaluation, worse than any other.
    pub const FAILED: Self = Self { objective: f64::NAN, violation: f64::NAN };

    /// An objective without constraints.
    pub fn new(objective: f64) -> Self {
        Self { objective, violation: 0.0 }
    }

    /// An objective with constraints `c_i <= 0`; the violation is the sum of positive `c_i`.
    pub fn constrained(objective: f64, constraints: &[f64]) -> Self {
        // `max` drops a NaN, the comparison keeps it.
        let violation = constraints.iter().map(|&c| if c <= 0.0 { 0.0 } else { c }).sum();
        Self { objective, violation }
    }

    /// Mean of results, of which one that failed fails all.
    pub(crate) fn mean(results: impl IntoIterator<Item = Self>) -> Self {
        let mut sum = Self::new(0.0);
        let mut count = 0.0;
        for result in results {
            if result.is_failed() {
                return Self::FAILED;
            }
            sum.objective += result.objective;
            sum.violation += result.violation.max(0.0);
            count += 1.0;
        }
        Self { objective: sum.objective / count, violation: sum.violation / count }
    }

    /// Tells whether there is no result: the objective is not finite or the violation is NaN.
    pub fn is_failed(&self) -> bool {
        !self.objective.is_finite() || self.violation.is_nan()
    }

    /// Tells whether the point satisfies the constraints.
    pub fn is_feasible(&self) -> bool {
        !self.is_failed() && self.violation <= 0.0
    }

    /// The feasibility rules (Deb 2000) as a total order, better first: the lower objective of two feasible points, a feasible
    /// before an infeasible one, the lower violation of two infeasible ones, and failed ones last.
    #[inline]
    pub fn order(&self, other: &Self) -> Ordering {
        // Most results are feasible and finite.
        let plain = |e: &Self| e.violation <= 0.0 && e.objective.is_finite();
        if plain(self) && plain(other) {
            return self.objective.partial_cmp(&other.objective).unwrap_or(Ordering::Equal);
        }
        let failed = self.is_failed().cmp(&other.is_failed());
        if failed != Ordering::Equal || self.is_failed() {
            return failed;
        }
        let violation = self.violation.max(0.0).total_cmp(&other.violation.max(0.0));
        violation.then_with(|| (self.objective + 0.0).total_cmp(&(other.objective + 0.0)))
    }

    /// Tells whether this one is strictly better.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.order(other) == Ordering::Less
    }
}

impl From<f64> for Evaluation {
    fn from(objective: f64) -> Self {
        Self::new(objective)
    }
}

/// A function to minimise. Closures of `&[f64]` that return `f64` or [`Evaluation`] are objectives.
pub trait Objective: Sync {
    /// The result at `x`, a point of the box. Called from several threads.
    fn evaluate(&self, x: &[f64]) -> Evaluation;

    /// The result of one sample of a noisy objective. `sample` is the number of the evaluation in the search: an objective that
    /// seeds its noise with it gives the same search for any number of threads.
    fn evaluate_sample(&self, x: &[f64], _sample: u64) -> Evaluation {
        self.evaluate(x)
    }
}

impl<F, E> Objective for F
where
    F: Fn(&[f64]) -> E + Sync,
    E: Into<Evaluation>,
{
    fn evaluate(&self, x: &[f64]) -> Evaluation {
        self(x).into()
    }
}

/// A point with its result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// The point.
    pub x: Vec<f64>,
    /// Its result.
    pub evaluation: Evaluation,
}

impl Candidate {
    /// Replaces `best` by a better result and says whether it did. Failed evaluations are never kept.
    pub fn improve(best: &mut Option<Self>, x: &[f64], evaluation: &Evaluation) -> bool {
        if evaluation.is_failed() {
            return false;
        }
        match best {
            Some(old) if !evaluation.is_better_than(&old.evaluation) => false,
            Some(old) => {
                old.x.copy_from_slice(x);
                old.evaluation = *evaluation;
                true
            }
            None => {
                *best = Some(Self { x: x.to_vec(), evaluation: *evaluation });
                true
            }
        }
    }
}

/// The weight of violations of constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Constraints {
    /// By the order of [`Evaluation::order`]: any feasible point before any infeasible one. Needs no weight.
    #[default]
    FeasibilityRules,
    /// The objective plus the violation times a weight.
    Penalty {
        /// Objective for a violation of 1, above 0.
        weight: f64,
    },
}

/// The treatment of noise of the objective.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Noise {
    /// Nothing: one evaluation for each point.
    #[default]
    None,
    /// The mean of several evaluations at each point.
    Mean {
        /// Evaluations of a point, at least 1.
        samples: usize,
    },
    /// A point that seems better than the best so far is evaluated again, and the mean of all its evaluations counts, so that one
    /// lucky evaluation is not kept as the best.
    ConfirmBest {
        /// More evaluations of such a point, at least 1.
        repeats: usize,
    },
}

impl Noise {
    /// Evaluations of each point of a generation.
    pub(crate) fn samples(self) -> u64 {
        match self {
            Self::Mean { samples } => samples as u64,
            Self::None | Self::ConfirmBest { .. } => 1,
        }
    }
}
