//! Choice of the step: the first one, and PI control afterwards (Hairer et al., sections II.4 and IV.2).

use crate::scheme::{ErrorWeights, Scheme, Stages};
use crate::system::OdeSystem;

/// Keeps the next step a little below what the error would allow.
const SAFETY: f64 = 0.9;

/// The step-size controller; factors are those of the magnitude.
pub(crate) struct StepControl {
    previous_error: f64,
    rejected: bool,
}

impl StepControl {
    pub(crate) fn new() -> Self {
        Self { previous_error: 1e-4, rejected: false }
    }

    /// Factor to the next step after an accepted one of this error norm.
    pub(crate) fn accepted<M: Scheme>(&mut self, error: f64) -> f64 {
        let (shrink, grow) = M::STEP_RATIO;
        let mut factor = SAFETY / error.powf(M::EXPONENT);
        if M::BETA > 0.0 {
            factor *= self.previous_error.powf(M::BETA);
        }
        // Not to grow right after a rejection avoids a second one.
        let factor = factor.clamp(shrink, if self.rejected { 1.0 } else { grow });
        self.previous_error = error.max(1e-4);
        self.rejected = false;
        factor
    }

    /// Factor to the next attempt after a rejected one; an error that is not finite asks for a much shorter step.
    pub(crate) fn rejected<M: Scheme>(&mut self, error: f64) -> f64 {
        self.rejected = true;
        if error.is_finite() { (SAFETY / error.powf(M::EXPONENT)).clamp(M::STEP_RATIO.0, 1.0) } else { 0.1 }
    }
}

/// Magnitude of the first step from the rate and its change over a small Euler step; one evaluation.
///
/// Expects `x` and `k[0]` in `stages`, uses `point` and `k[1]`. `limit` bounds the result.
pub(crate) fn first_step<M: Scheme, S: OdeSystem>(
    system: &S,
    t: f64,
    direction: f64,
    limit: f64,
    stages: &mut Stages,
    weights: &ErrorWeights,
) -> f64 {
    let Stages { x, point, k: [k0, k1, ..], .. } = stages;
    let controlled = weights.absolute.len();
    let norm = |v: &dyn Fn(usize) -> f64| {
        let sum: f64 = (0..controlled).map(|i| (v(i) / weights.scale(i, x[i], x[i])).powi(2)).sum();
        (sum / controlled as f64).sqrt()
    };
    let size = norm(&|i| x[i]);
    let speed = norm(&|i| k0[i]);
    let mut h = if size < 1e-5 || speed < 1e-5 { 1e-6 } else { 0.01 * size / speed };
    h = h.min(limit);
    for i in 0..x.len() {
        point[i] = x[i] + direction * h * k0[i];
    }
    system.rate(t + direction * h, point, k1);
    let change = norm(&|i| k1[i] - k0[i]) / h;
    let largest = change.max(speed);
    let guess = if largest <= 1e-15 {
        (1e-3 * h).max(1e-6)
    } else {
        (0.01 / largest).powf(1.0 / f64::from(M::ORDER))
    };
    // `min` ignores a NaN from a rate outside its domain.
    guess.min(100.0 * h).min(limit)
}

/// Counts signs that stability, not accuracy, limits the step (Hairer and Wanner, section IV.2).
pub(crate) struct StiffnessTest {
    interval: Option<usize>,
    hits: u32,
    misses: u32,
}

impl StiffnessTest {
    pub(crate) fn new(interval: Option<usize>) -> Self {
        Self { interval, hits: 0, misses: 0 }
    }

    /// Looks at an accepted, completed step, the `accepted`-th; true when the system is found stiff.
    pub(crate) fn stiff<M: Scheme>(&mut self, accepted: usize, h: f64, stages: &Stages) -> bool {
        let Some(interval) = self.interval else { return false };
        if self.hits == 0 && !accepted.is_multiple_of(interval) {
            return false;
        }
        let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let rates = distance(&stages.k[M::LAST], &stages.k[M::BEFORE_LAST]);
        let states = distance(&stages.next, &stages.point);
        if states > 0.0 && h.abs() * (rates / states).sqrt() > M::STABILITY_LIMIT {
            self.misses = 0;
            self.hits += 1;
        } else if self.hits > 0 {
            self.misses += 1;
            if self.misses == 6 {
                self.hits = 0;
                self.misses = 0;
            }
        }
        self.hits == 15
    }
}
