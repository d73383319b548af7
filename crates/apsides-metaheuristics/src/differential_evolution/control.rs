//! The factor `F` and the crossover rate `CR` of each trial point, and what is learnt from those that succeed.

use crate::{DifferentialAdaptation, Evaluation, Generator};
use serde::{Deserialize, Serialize};

/// Probability that a member of jDE gets a new factor, and a new rate; bounds of the factor.
const CHANGE: f64 = 0.1;
const FACTORS: (f64, f64) = (0.1, 1.0);
/// Width of the distributions of L-SHADE.
const WIDTH: f64 = 0.1;

/// An adaptation with its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Control {
    adaptation: DifferentialAdaptation,
    /// `F` and `CR` of the trials of this generation, by member.
    drawn: Vec<[f64; 2]>,
    /// Those of the members; jDE alone.
    own: Vec<[f64; 2]>,
    /// Means that `F` and `CR` are drawn about; L-SHADE alone. A mean rate that is `None` stays 0.
    means: Vec<(f64, Option<f64>)>,
    /// Entry of the means that is written next.
    next: usize,
    /// `F`, `CR` and improvement of the trials that succeeded in this generation.
    successes: Vec<[f64; 3]>,
}

impl Control {
    pub(super) fn new(adaptation: DifferentialAdaptation, members: usize) -> Self {
        let (mut own, mut means) = (Vec::new(), Vec::new());
        match adaptation {
            DifferentialAdaptation::Fixed { .. } => {}
            DifferentialAdaptation::SelfAdaptive => own = vec![[0.5, 0.9]; members],
            DifferentialAdaptation::SuccessHistory { memory, .. } => means = vec![(0.5, Some(0.5)); memory],
        }
        let successes = Vec::with_capacity(if means.is_empty() { 0 } else { members });
        Self { adaptation, drawn: Vec::with_capacity(members), own, means, next: 0, successes }
    }

    /// Forgets the trials of the last generation.
    pub(super) fn begin(&mut self) {
        self.drawn.clear();
    }

    /// `F` and `CR` of the trial of a member; members come in order.
    pub(super) fn draw(&mut self, member: usize, generator: &mut Generator) -> (f64, f64) {
        let [factor, crossover] = match self.adaptation {
            DifferentialAdaptation::Fixed { factor, crossover } => return (factor, crossover),
            DifferentialAdaptation::SelfAdaptive => {
                let [mut factor, mut crossover] = self.own[member];
                if generator.chance(CHANGE) {
                    factor = generator.between(FACTORS.0, FACTORS.1);
                }
                if generator.chance(CHANGE) {
                    crossover = generator.uniform();
                }
                [factor, crossover]
            }
            DifferentialAdaptation::SuccessHistory { memory, .. } => {
                let (factor, crossover) = self.means[generator.index(memory)];
                let crossover = crossover.map_or(0.0, |c| (c + WIDTH * generator.normal()).clamp(0.0, 1.0));
                let factor = loop {
                    // The ratio of two normal numbers has the distribution of Cauchy; NaN is drawn again.
                    let factor = factor + WIDTH * (generator.normal() / generator.normal());
                    if factor > 0.0 {
                        break factor.min(1.0);
                    }
                };
                [factor, crossover]
            }
        };
        self.drawn.push([factor, crossover]);
        (factor, crossover)
    }

    /// The trial of a member is better.
    pub(super) fn succeed(&mut self, member: usize, old: &Evaluation, new: &Evaluation) {
        match self.adaptation {
            DifferentialAdaptation::Fixed { .. } => {}
            DifferentialAdaptation::SelfAdaptive => self.own[member] = self.drawn[member],
            DifferentialAdaptation::SuccessHistory { .. } => {
                let [factor, crossover] = self.drawn[member];
                self.successes.push([factor, crossover, improvement(old, new)]);
            }
        }
    }

    /// The trial of a member is as good, and replaces it.
    pub(super) fn stay(&mut self, member: usize) {
        if self.adaptation == DifferentialAdaptation::SelfAdaptive {
            self.own[member] = self.drawn[member];
        }
    }

    /// Writes the weighted Lehmer means of what succeeded into the memory.
    pub(super) fn learn(&mut self) {
        if self.successes.is_empty() {
            return;
        }
        let total: f64 = self.successes.iter().map(|s| s[2]).sum();
        // Improvements that say nothing, such as the first results after failures, count alike.
        let weighed = total > 0.0 && total.is_finite();
        let mut sums = [0.0; 4];
        for &[factor, crossover, improvement] in &self.successes {
            let weight = if weighed { improvement / total } else { 1.0 };
            sums[0] += weight * factor;
            sums[1] += weight * factor * factor;
            sums[2] += weight * crossover;
            sums[3] += weight * crossover * crossover;
        }
        let (factor, crossover) = &mut self.means[self.next];
        *factor = sums[1] / sums[0];
        *crossover = crossover.filter(|_| sums[2] > 0.0).map(|_| sums[3] / sums[2]);
        self.next = (self.next + 1) % self.means.len();
        self.successes.clear();
    }
}

/// The decrease of the violation, or else of the objective; 0 where the old evaluation failed.
fn improvement(old: &Evaluation, new: &Evaluation) -> f64 {
    if old.is_failed() {
        return 0.0;
    }
    let violation = old.violation.max(0.0) - new.violation.max(0.0);
    let gain = if violation > 0.0 { violation } else { old.objective - new.objective };
    if gain.is_finite() { gain } else { 0.0 }
}
