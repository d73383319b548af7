//! The quality function of the adaptive strategy (Nocedal, Waechter and Waltz 2009, doi 10.1137/060649513, section 4): a linear model of the
//! squared optimality error after a step, as a function of the barrier parameter.

use pulp::{Arch, Simd, WithSimd};

use crate::state::SolverState;
use crate::vector::dot;

/// Bounds that are treated at once.
const LANES: usize = 4;

/// The model: all that an evaluation needs of each bound, side by side; allocated once.
#[derive(Debug, Clone, Default)]
pub(crate) struct QualityFunction {
    bounds: Vec<Lanes>,
    count: usize,
    /// Mean squares of the dual residual and of the constraints.
    dual_error: f64,
    primal_error: f64,
    /// Part of a slack or of a multiplier that a step may take.
    tau: f64,
}

/// Some bounds: products of slack and multiplier, and the relative changes of both. A lane without a bound has nothing.
#[derive(Debug, Clone, Copy)]
struct Lanes {
    product: [f64; LANES],
    slack: RelativeStep,
    multiplier: RelativeStep,
}

/// Affine step, and derivative of the step by the barrier parameter, relative to what they change.
#[derive(Debug, Clone, Copy)]
struct RelativeStep {
    affine: [f64; LANES],
    centring: [f64; LANES],
}

impl RelativeStep {
    const NONE: Self = Self { affine: [0.0; LANES], centring: [0.0; LANES] };

    fn set(&mut self, lane: usize, [value, affine, centring]: [f64; 3]) {
        (self.affine[lane], self.centring[lane]) = (affine / value, centring / value);
    }

    /// The relative change of a step with this barrier parameter.
    #[inline(always)]
    fn change(&self, lane: usize, barrier: f64) -> f64 {
        self.affine[lane] + barrier * self.centring[lane]
    }

    /// Raises the largest relative decreases to those of a step with this barrier parameter.
    #[inline(always)]
    fn raise(&self, barrier: f64, largest: &mut [f64; LANES]) {
        for lane in 0..LANES {
            let decrease = -self.change(lane, barrier);
            largest[lane] = if decrease > largest[lane] { decrease } else { largest[lane] };
        }
    }
}

impl QualityFunction {
    /// Takes in the affine direction in `step` and the centring direction in `corrected`.
    pub(crate) fn take_in(&mut self, state: &SolverState) {
        let mean = |values: &[f64]| dot(values, values) / values.len().max(1) as f64;
        let (point, bounds, step, centring) = (&state.current, &state.bounds, &state.step, &state.corrected);
        self.dual_error = mean(&state.dual_residual);
        self.primal_error = mean(&point.constraints);
        self.tau = state.settings.boundary_fraction;
        self.count = bounds.len();
        self.bounds.clear();
        let none = Lanes { product: [0.0; LANES], slack: RelativeStep::NONE, multiplier: RelativeStep::NONE };
        self.bounds.resize(self.count.div_ceil(LANES), none);
        let lower = bounds.lower_set.iter().map(|&i| {
            let slack = [point.lower_slack[i], step.v[i], centring.v[i]];
            (slack, [point.zl[i], step.zl[i], centring.zl[i]])
        });
        let upper = bounds.upper_set.iter().map(|&i| {
            let slack = [point.upper_slack[i], -step.v[i], -centring.v[i]];
            (slack, [point.zu[i], step.zu[i], centring.zu[i]])
        });
        for (k, (slack, multiplier)) in lower.chain(upper).enumerate() {
            let lanes = &mut self.bounds[k / LANES];
            lanes.product[k % LANES] = slack[0] * multiplier[0];
            lanes.slack.set(k % LANES, slack);
            lanes.multiplier.set(k % LANES, multiplier);
        }
    }

    /// The modelled error after the longest steps with this barrier parameter.
    pub(crate) fn value(&self, barrier: f64) -> f64 {
        Arch::new().dispatch(Evaluation { function: self, barrier })
    }

    #[inline(always)]
    fn evaluate(&self, barrier: f64) -> f64 {
        let (mut primal, mut dual) = ([self.tau; LANES], [self.tau; LANES]);
        for lanes in &self.bounds {
            lanes.slack.raise(barrier, &mut primal);
            lanes.multiplier.raise(barrier, &mut dual);
        }
        let longest = |decreases: [f64; LANES]| self.tau / decreases.into_iter().fold(self.tau, f64::max);
        let (primal, dual) = (longest(primal), longest(dual));
        let mut sums = [0.0; LANES];
        for lanes in &self.bounds {
            for lane in 0..LANES {
                let slack = 1.0 + primal * lanes.slack.change(lane, barrier);
                let multiplier = 1.0 + dual * lanes.multiplier.change(lane, barrier);
                let product = lanes.product[lane] * (slack * multiplier);
                sums[lane] += product * product;
            }
        }
        let complementarity: f64 = sums.into_iter().sum();
        (1.0 - dual).powi(2) * self.dual_error
            + (1.0 - primal).powi(2) * self.primal_error
            + complementarity / self.count as f64
    }
}

/// Compiled for the vectors of the machine. A type of its own, since as a closure it is too long to be taken into the code for them: quality
/// solves took 2.5 % longer.
struct Evaluation<'a> {
    function: &'a QualityFunction,
    barrier: f64,
}

impl WithSimd for Evaluation<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        self.function.evaluate(self.barrier)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Structure;
    use crate::settings::NlpSettings;

    /// Round-off of sums of a few terms.
    const ROUNDING: f64 = 1e-14;

    /// Five variables with six bounds among them, with steps that are stopped by a slack and by a multiplier.
    fn state() -> SolverState {
        let structure = Structure::of_sizes(5, 1);
        let infinite = f64::INFINITY;
        let lower = [0.0, -infinite, 0.0, 1.0, -infinite];
        let upper = [infinite, 2.0, 3.0, 5.0, infinite];
        let mut state = SolverState::new(&structure, &lower, &upper, &NlpSettings::default());
        state.current.v.copy_from_slice(&[0.5, 1.5, 1.0, 1.25, 7.0]);
        state.measure_current();
        state.current.zl.copy_from_slice(&[1.0, 0.0, 0.25, 2.0, 0.0]);
        state.current.zu.copy_from_slice(&[0.0, 0.5, 0.125, 0.0625, 0.0]);
        state.step.v.copy_from_slice(&[-0.75, 0.25, 0.5, -0.125, 4.0]);
        state.step.zl.copy_from_slice(&[0.5, 0.0, -0.5, -1.0, 0.0]);
        state.step.zu.copy_from_slice(&[0.0, 1.0, -0.0625, 0.5, 0.0]);
        state.corrected.v.copy_from_slice(&[2.0, -1.0, 0.5, 0.25, 1.0]);
        state.corrected.zl.copy_from_slice(&[1.0, 0.0, 3.0, 0.5, 0.0]);
        state.corrected.zu.copy_from_slice(&[0.0, -2.0, 1.0, 0.25, 0.0]);
        state.dual_residual.copy_from_slice(&[0.5, -0.25, 0.0, 1.0, 0.125]);
        state.current.constraints[0] = 0.75;
        state
    }

    #[test]
    fn the_model_is_the_error_after_the_longest_steps() {
        let state = state();
        let mut quality = QualityFunction::default();
        quality.take_in(&state);
        for barrier in [0.0, 1e-3, 0.3] {
            let step = |affine: &[f64], centring: &[f64], i: usize| affine[i] + barrier * centring[i];
            let (bounds, point) = (&state.bounds, &state.current);
            let (tau, step_length) = (state.settings.boundary_fraction, |length: f64| (1.0 - length).powi(2));
            let dv: Vec<f64> = (0..5).map(|i| step(&state.step.v, &state.corrected.v, i)).collect();
            let dzl: Vec<f64> = (0..5).map(|i| step(&state.step.zl, &state.corrected.zl, i)).collect();
            let dzu: Vec<f64> = (0..5).map(|i| step(&state.step.zu, &state.corrected.zu, i)).collect();
            let primal = bounds.longest_primal(point, &dv, tau);
            let dual = bounds.longest_dual(point, &dzl, &dzu, tau);
            let lower = bounds
                .lower_set
                .iter()
                .map(|&i| (point.lower_slack[i] + primal * dv[i]) * (point.zl[i] + dual * dzl[i]));
            let upper = bounds
                .upper_set
                .iter()
                .map(|&i| (point.upper_slack[i] - primal * dv[i]) * (point.zu[i] + dual * dzu[i]));
            let products: f64 = lower.chain(upper).map(|p| p * p).sum();
            let expected = step_length(dual) * dot(&state.dual_residual, &state.dual_residual) / 5.0
                + step_length(primal) * 0.75 * 0.75
                + products / bounds.len() as f64;
            assert!(barrier > 0.0 || (primal < 1.0 && dual < 1.0));
            assert!((quality.value(barrier) / expected - 1.0).abs() < ROUNDING, "{barrier}");
        }
    }
}
