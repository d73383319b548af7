//! Strategies for the barrier parameter: monotone (Waechter and Biegler, eq. 7) and adaptive (Nocedal, Waechter and
//! Waltz 2009, with the globalisation by the optimality error).

use crate::engine::{Engine, dot};
use crate::model::BarrierModel;
use crate::settings::{BarrierOracle, BarrierStrategy, NlpSettings};

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
    /// Adaptive strategy: whether the parameter is chosen anew at each iteration.
    free: bool,
    references: [f64; MEMORY],
    next_reference: usize,
    largest: f64,
    /// The steps have become tiny: reduce the parameter whatever the error.
    pub force: bool,
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
            force: false,
        }
    }

    /// Forgets the past; the next phase starts in free mode if adaptive.
    pub(crate) fn restart(&mut self) {
        self.free = self.adaptive;
        self.references = [f64::INFINITY; MEMORY];
        self.largest = f64::INFINITY;
        self.force = false;
    }

    fn is_progress(&self, error: f64) -> bool {
        self.references.iter().any(|&reference| error <= REDUCTION * reference)
    }

    fn remember(&mut self, error: f64) {
        self.references[self.next_reference] = error;
        self.next_reference = (self.next_reference + 1) % MEMORY;
    }
}

impl Engine {
    /// Monotone strategy: reduces the parameter while its barrier problem is solved.
    pub(crate) fn update_monotone(&mut self, model: &mut impl BarrierModel) {
        if self.control.free {
            return;
        }
        let floor = self.final_barrier;
        loop {
            let solved =
                self.barrier_error(self.barrier) <= self.settings.barrier_tolerance_factor * self.barrier;
            if !solved && !self.control.force {
                return;
            }
            self.control.force = false;
            let linear = self.settings.barrier_decrease * self.barrier;
            let next = linear.min(self.barrier.powf(self.settings.barrier_exponent)).max(floor);
            if next >= self.barrier {
                return;
            }
            self.set_barrier(model, next);
        }
    }

    /// Adaptive strategy: switches between free and fixed mode by the progress of the optimality error; answers
    /// whether the
    /// parameter is to be chosen at this iteration.
    pub(crate) fn enters_free_mode(&mut self, model: &mut impl BarrierModel) -> bool {
        if !self.control.adaptive {
            return false;
        }
        let average = self.bounds.average_complementarity(&self.current);
        if self.control.largest == f64::INFINITY {
            self.control.largest = LARGEST_BARRIER * average.max(self.barrier);
        }
        let error = self.squared_error();
        let progress = self.control.is_progress(error) && !self.control.force;
        self.control.force = false;
        if progress {
            self.control.remember(error);
            self.control.free = true;
        } else if self.control.free {
            self.control.free = false;
            let barrier = self.bounded_barrier(FALLBACK_FRACTION * average);
            self.set_barrier(model, barrier);
        }
        self.control.free
    }

    fn bounded_barrier(&self, barrier: f64) -> f64 {
        barrier.min(self.control.largest).max(self.final_barrier)
    }

    /// The parameter for this iteration, from the affine direction in `step` and the centring direction in `corrected`.
    pub(crate) fn choose_barrier(&self) -> f64 {
        let average = self.bounds.average_complementarity(&self.current);
        if self.bounds.len() == 0 {
            return self.final_barrier;
        }
        let centring = match self.control.oracle {
            BarrierOracle::QualityFunction => self.best_centring(average),
            BarrierOracle::Probing => self.probed_centring(average),
            BarrierOracle::Loqo => self.loqo_centring(average),
        };
        self.bounded_barrier(centring * average)
    }

    fn loqo_centring(&self, average: f64) -> f64 {
        let point = &self.current;
        let lower = self.bounds.lower_set.iter().map(|&i| point.lower_slack[i] * point.zl[i]);
        let upper = self.bounds.upper_set.iter().map(|&i| point.upper_slack[i] * point.zu[i]);
        let uniformity = lower.chain(upper).fold(f64::INFINITY, f64::min) / average;
        0.1 * (0.05 * (1.0 - uniformity) / uniformity).min(2.0).powi(3)
    }

    fn probed_centring(&self, average: f64) -> f64 {
        let primal = self.bounds.longest_primal(&self.current, &self.step.v, 1.0);
        let dual = self.bounds.longest_dual(&self.current, &self.step.zl, &self.step.zu, 1.0);
        let mut sum = 0.0;
        self.for_each_product(0.0, primal, dual, |product| sum += product);
        (sum / self.bounds.len() as f64 / average).max(0.0).powi(3).clamp(LEAST_CENTRING, 1.0)
    }

    /// Golden section in the logarithm of the centring parameter.
    fn best_centring(&self, average: f64) -> f64 {
        let dual = dot(&self.dual_residual, &self.dual_residual) / self.dual_residual.len() as f64;
        let constraints = &self.current.constraints;
        let primal = dot(constraints, constraints) / constraints.len().max(1) as f64;
        let quality = |log_centring: f64| self.quality(log_centring.exp() * average, dual, primal);
        let least = LEAST_CENTRING.max((self.final_barrier / average).min(1.0)).ln();
        let (mut low, mut high) = if quality(0.0) <= quality(0.99_f64.ln()) {
            (0.0, LARGEST_CENTRING.min(self.control.largest / average).max(1.0).ln())
        } else {
            (least, 0.99_f64.ln().max(least))
        };
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
        let (mut quality_a, mut quality_b) = (quality(a), quality(b));
        for _ in 0..SECTIONS {
            if quality_a <= quality_b {
                (high, b, quality_b) = (b, a, quality_a);
                a = high - golden * (high - low);
                quality_a = quality(a);
            } else {
                (low, a, quality_a) = (a, b, quality_b);
                b = low + golden * (high - low);
                quality_b = quality(b);
            }
        }
        if quality_a <= quality_b { a.exp() } else { b.exp() }
    }

    /// Linear model of the squared optimality error after a step with this barrier parameter.
    fn quality(&self, barrier: f64, dual_error: f64, primal_error: f64) -> f64 {
        let (point, bounds, tau) = (&self.current, &self.bounds, self.settings.boundary_fraction);
        let mut primal = 1.0_f64;
        let mut dual = 1.0_f64;
        for &i in &bounds.lower_set {
            let dv = self.step.v[i] + barrier * self.corrected.v[i];
            let dz = self.step.zl[i] + barrier * self.corrected.zl[i];
            primal = primal.min(if dv < 0.0 { -tau * point.lower_slack[i] / dv } else { 1.0 });
            dual = dual.min(if dz < 0.0 { -tau * point.zl[i] / dz } else { 1.0 });
        }
        for &i in &bounds.upper_set {
            let dv = self.step.v[i] + barrier * self.corrected.v[i];
            let dz = self.step.zu[i] + barrier * self.corrected.zu[i];
            primal = primal.min(if dv > 0.0 { tau * point.upper_slack[i] / dv } else { 1.0 });
            dual = dual.min(if dz < 0.0 { -tau * point.zu[i] / dz } else { 1.0 });
        }
        let mut complementarity = 0.0;
        self.for_each_product(barrier, primal, dual, |product| complementarity += product * product);
        (1.0 - dual).powi(2) * dual_error
            + (1.0 - primal).powi(2) * primal_error
            + complementarity / bounds.len() as f64
    }

    /// Slack times multiplier of every bound after a step with the given lengths.
    fn for_each_product(&self, barrier: f64, primal: f64, dual: f64, mut use_product: impl FnMut(f64)) {
        let point = &self.current;
        for &i in &self.bounds.lower_set {
            let slack = point.lower_slack[i] + primal * (self.step.v[i] + barrier * self.corrected.v[i]);
            use_product(slack * (point.zl[i] + dual * (self.step.zl[i] + barrier * self.corrected.zl[i])));
        }
        for &i in &self.bounds.upper_set {
            let slack = point.upper_slack[i] - primal * (self.step.v[i] + barrier * self.corrected.v[i]);
            use_product(slack * (point.zu[i] + dual * (self.step.zu[i] + barrier * self.corrected.zu[i])));
        }
    }

    /// Sum of the mean squares of dual residual, constraints and complementarity.
    fn squared_error(&self) -> f64 {
        let mean = |values: &[f64]| dot(values, values) / values.len().max(1) as f64;
        let point = &self.current;
        let lower = self.bounds.lower_set.iter().map(|&i| (point.lower_slack[i] * point.zl[i]).powi(2));
        let upper = self.bounds.upper_set.iter().map(|&i| (point.upper_slack[i] * point.zu[i]).powi(2));
        let complementarity = lower.chain(upper).sum::<f64>() / self.bounds.len().max(1) as f64;
        mean(&self.dual_residual) + mean(&point.constraints) + complementarity
    }
}
