//! Strategies for the barrier parameter: monotone (Waechter and Biegler, eq. 7) and adaptive (Nocedal, Waechter and
//! Waltz 2009, with the globalisation by the optimality error).

use apsides_basis::golden_section;

use crate::model::BarrierModel;
use crate::quality::QualityFunction;
use crate::settings::{BarrierOracle, BarrierStrategy, NlpSettings};
use crate::state::SolverState;
use crate::vector::{dot, sum};

/// Iterates whose error a free-mode iterate must improve on one of.
const MEMORY: usize = 4;
/// Required reduction of the error.
const REDUCTION: f64 = 0.9999;
/// Range of the centring parameter.
const LEAST_CENTRING: f64 = 1e-6;
const LARGEST_CENTRING: f64 = 100.0;
/// Section steps of the quality function.
const SECTIONS: usize = 8;
/// Barrier parameter of the monotone fallback relative to the average complementarity.
const FALLBACK_FRACTION: f64 = 0.8;
/// Upper limit on the barrier parameter relative to the first average complementarity.
const LARGEST_BARRIER: f64 = 1e3;

/// State of the strategy.
#[derive(Debug, Clone)]
pub(crate) struct BarrierControl {
    adaptive: bool,
    oracle: BarrierOracle,
    /// Adaptive strategy: the parameter is chosen anew at each iteration.
    free: bool,
    references: [f64; MEMORY],
    next_reference: usize,
    largest: f64,
    quality: QualityFunction,
}

impl BarrierControl {
    pub(crate) fn new(settings: &NlpSettings) -> Self {
        let adaptive = settings.barrier == BarrierStrategy::Adaptive;
        Self {
            adaptive,
            oracle: settings.barrier_oracle,
            free: adaptive,
            references: [f64::INFINITY; MEMORY],
            next_reference: 0,
            largest: f64::INFINITY,
            quality: QualityFunction::default(),
        }
    }

    /// Forgets the past; the next phase starts in free mode if adaptive.
    pub(crate) fn restart(&mut self) {
        self.free = self.adaptive;
        self.references = [f64::INFINITY; MEMORY];
        self.largest = f64::INFINITY;
    }

    fn is_progress(&self, error: f64) -> bool {
        self.references.iter().any(|&reference| error <= REDUCTION * reference)
    }

    fn remember(&mut self, error: f64) {
        self.references[self.next_reference] = error;
        self.next_reference = (self.next_reference + 1) % MEMORY;
    }

    /// Monotone strategy: reduces the parameter while its barrier problem is solved.
    pub(crate) fn update_monotone(&mut self, state: &mut SolverState, model: &mut impl BarrierModel) {
        if self.free {
            return;
        }
        let floor = state.final_barrier;
        loop {
            let solved =
                state.barrier_error(state.barrier) <= state.settings.barrier_tolerance_factor * state.barrier;
            if !solved && !state.forces_reduction {
                return;
            }
            state.forces_reduction = false;
            let linear = state.settings.barrier_decrease * state.barrier;
            let next = linear.min(state.barrier.powf(state.settings.barrier_exponent)).max(floor);
            if next >= state.barrier {
                return;
            }
            state.set_barrier(model, next);
        }
    }

    /// Adaptive strategy: switches between free and fixed mode by the progress of the optimality error; true if
    /// the parameter is to be chosen at this iteration.
    pub(crate) fn enters_free_mode(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
    ) -> bool {
        if !self.adaptive {
            return false;
        }
        let average = state.bounds.average_complementarity(&state.current);
        if self.largest == f64::INFINITY {
            self.largest = LARGEST_BARRIER * average.max(state.barrier);
        }
        let error = squared_error(state);
        let progress = self.is_progress(error) && !state.forces_reduction;
        state.forces_reduction = false;
        if progress {
            self.remember(error);
            self.free = true;
        } else if self.free {
            self.free = false;
            let barrier = self.bounded_barrier(state, FALLBACK_FRACTION * average);
            state.set_barrier(model, barrier);
        }
        self.free
    }

    fn bounded_barrier(&self, state: &SolverState, barrier: f64) -> f64 {
        barrier.min(self.largest).max(state.final_barrier)
    }

    /// The parameter for this iteration, from the affine direction in `step` and the centring direction in `corrected`.
    pub(crate) fn choose_barrier(&mut self, state: &SolverState) -> f64 {
        let average = state.bounds.average_complementarity(&state.current);
        if state.bounds.len() == 0 {
            return state.final_barrier;
        }
        let centring = match self.oracle {
            BarrierOracle::QualityFunction => self.best_centring(state, average),
            BarrierOracle::Probing => probed_centring(state, average),
            BarrierOracle::Loqo => loqo_centring(state, average),
        };
        self.bounded_barrier(state, centring * average)
    }

    /// Golden section in the logarithm of the centring parameter.
    fn best_centring(&mut self, state: &SolverState, average: f64) -> f64 {
        self.quality.take_in(state);
        let quality = |log_centring: f64| self.quality.value(log_centring.exp() * average);
        let least = LEAST_CENTRING.max((state.final_barrier / average).min(1.0)).ln();
        let (low, high) = if quality(0.0) <= quality(0.99_f64.ln()) {
            (0.0, LARGEST_CENTRING.min(self.largest / average).max(1.0).ln())
        } else {
            (least, 0.99_f64.ln().max(least))
        };
        let [log_centring, _] = golden_section([low, high], 2 + SECTIONS, quality);
        log_centring.exp()
    }
}

fn loqo_centring(state: &SolverState, average: f64) -> f64 {
    let point = &state.current;
    let lower = state.bounds.lower_set.iter().map(|&i| point.lower_slack[i] * point.zl[i]);
    let upper = state.bounds.upper_set.iter().map(|&i| point.upper_slack[i] * point.zu[i]);
    let uniformity = lower.chain(upper).fold(f64::INFINITY, f64::min) / average;
    0.1 * (0.05 * (1.0 - uniformity) / uniformity).min(2.0).powi(3)
}

fn probed_centring(state: &SolverState, average: f64) -> f64 {
    let primal = state.bounds.longest_primal(&state.current, &state.step.v, 1.0);
    let dual = state.bounds.longest_dual(&state.current, &state.step.zl, &state.step.zu, 1.0);
    let mut sum = 0.0;
    for_each_product(state, 0.0, primal, dual, |product| sum += product);
    (sum / state.bounds.len() as f64 / average).max(0.0).powi(3).clamp(LEAST_CENTRING, 1.0)
}

/// Slack times multiplier of every bound after a step with the given lengths.
fn for_each_product(
    state: &SolverState,
    barrier: f64,
    primal: f64,
    dual: f64,
    mut use_product: impl FnMut(f64),
) {
    let point = &state.current;
    for &i in &state.bounds.lower_set {
        let slack = point.lower_slack[i] + primal * (state.step.v[i] + barrier * state.corrected.v[i]);
        use_product(slack * (point.zl[i] + dual * (state.step.zl[i] + barrier * state.corrected.zl[i])));
    }
    for &i in &state.bounds.upper_set {
        let slack = point.upper_slack[i] - primal * (state.step.v[i] + barrier * state.corrected.v[i]);
        use_product(slack * (point.zu[i] + dual * (state.step.zu[i] + barrier * state.corrected.zu[i])));
    }
}

/// Sum of the mean squares of dual residual, constraints and complementarity.
fn squared_error(state: &SolverState) -> f64 {
    let mean = |values: &[f64]| dot(values, values) / values.len().max(1) as f64;
    let point = &state.current;
    let lower = sum(&state.bounds.lower_set, |&i| (point.lower_slack[i] * point.zl[i]).powi(2));
    let upper = sum(&state.bounds.upper_set, |&i| (point.upper_slack[i] * point.zu[i]).powi(2));
    let complementarity = (lower + upper) / state.bounds.len().max(1) as f64;
    mean(&state.dual_residual) + mean(&point.constraints) + complementarity
}
