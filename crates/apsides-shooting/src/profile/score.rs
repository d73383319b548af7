//! One number, or an objective and a violation, for a flight: what searches without derivatives compare.

use apsides_ocp::{Guess, Scaling};

use super::flight::{Excess, Flight};
use super::shooting::ProfileShooting;

/// The costs of misses and excesses.
///
/// ```text
/// violation = sqrt(sum_i (w_i max(0, |miss_i| - tolerance_i))^2) + w (sum of the relative excesses above the tolerance)
/// penalised = objective + violation
/// ```
///
/// The misses of the states are taken together as one distance, so that two coordinates of a position with weights in objective per
/// length cost by the distance. Excesses are those along the flight and of the conditions at its end. All of a failed flight is NaN,
/// its violation infinite.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileScore {
    /// Objective unit per unit of each state missed at the end.
    pub miss_weights: Vec<f64>,
    /// Miss of each state that costs nothing, in its unit.
    pub miss_tolerances: Vec<f64>,
    /// Objective unit per excess as large as the bound itself.
    pub excess_weight: f64,
    /// Relative excess that costs nothing.
    pub excess_tolerance: f64,
}

impl ProfileScore {
    /// A miss of a state's scale, and an excess as large as the bound, cost `price`, in the objective's unit. What is a millionth of that
    /// costs nothing.
    #[must_use]
    pub fn new(shooting: &ProfileShooting<'_>, price: f64) -> Self {
        let scaling = Scaling::new(shooting.ocp(), &Guess::linear(shooting.ocp()));
        let scales = &scaling.phases[0].states;
        Self {
            miss_weights: scales.iter().map(|s| price / s).collect(),
            miss_tolerances: scales.iter().map(|s| 1e-6 * s).collect(),
            excess_weight: price,
            excess_tolerance: 1e-6,
        }
    }

    /// The costs of the misses and excesses of a flight; infinite where it failed.
    #[must_use]
    pub fn violation(&self, flight: &Flight) -> f64 {
        if !flight.end.is_complete() {
            return f64::INFINITY;
        }
        let weights = self.miss_weights.iter().zip(&self.miss_tolerances);
        let misses = flight.state_misses.iter().zip(weights);
        let squares = misses.map(|(miss, (w, tolerance))| (w * (miss.abs() - tolerance).max(0.0)).powi(2));
        let excesses = flight.peaks.iter().chain(&flight.end_conditions);
        let counted = |e: &Excess| if e.relative > self.excess_tolerance { e.relative } else { 0.0 };
        squares.sum::<f64>().sqrt() + self.excess_weight * excesses.map(counted).sum::<f64>()
    }

    /// Objective as minimised, and violation: for comparisons by feasibility first.
    #[must_use]
    pub fn separate(&self, flight: &Flight) -> (f64, f64) {
        (flight.objective, self.violation(flight))
    }

    /// Objective as minimised, and the violation added to it.
    #[must_use]
    pub fn penalised(&self, flight: &Flight) -> f64 {
        flight.objective + self.violation(flight)
    }
}
