//! Settings of the interior point method.

use std::time::Duration;

use apsides_kkt::KktSettings;

use crate::error::NlpError;

/// Scaling of functions and variables before the method sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ScalingMethod {
    /// No scaling: the problem is solved in the user's units.
    None,
    /// Objective and constraints are multiplied so that no gradient at the starting point has an entry above `max`
    /// (Waechter and Biegler, section 3.8).
    Gradient {
        /// Largest entry of a scaled gradient.
        max: f64,
    },
    /// Scaling by the units of [`Nlp::scaling`](crate::Nlp::scaling); as [`None`](Self::None) where the problem gives none.
    User,
    /// Scaling by the units of the problem first, then by the gradients of the functions so scaled.
    UserThenGradient {
        /// Largest entry of a scaled gradient.
        max: f64,
    },
}

/// Choice of the barrier parameter in the adaptive strategy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BarrierOracle {
    /// Least linearised optimality error along the segment of affine and centring step
    /// (Nocedal, Waechter, Waltz 2009, doi 10.1137/060649513).
    QualityFunction,
    /// Mehrotra's cube of the reduction that the affine step promises.
    Probing,
    /// The formula of LOQO (Vanderbei, Shanno 1999, doi 10.1023/A:1008677427361).
    Loqo,
}

/// Strategy by which the barrier parameter goes to zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BarrierStrategy {
    /// Fiacco-McCormick: the barrier problem is solved to a tolerance before the parameter is reduced.
    Monotone,
    /// A new parameter at each iteration, with the monotone strategy as fallback while there is no progress.
    Adaptive,
}

/// Settings of [`InteriorPoint`](crate::InteriorPoint). All numbers are dimensionless unless said otherwise; "scaled"
/// refers to the problem after [`scaling`](Self::scaling).
#[derive(Debug, Clone)]
pub struct NlpSettings {
    /// Largest scaled optimality error of an optimal point; 1e-8.
    pub tolerance: f64,
    /// Largest dual infeasibility, [unscaled](crate::OptimalityError::unscaled); 1.
    pub dual_tolerance: f64,
    /// Largest constraint violation, unscaled; 1e-4.
    pub constraint_tolerance: f64,
    /// Largest complementarity, unscaled; 1e-4.
    pub complementarity_tolerance: f64,
    /// Scaled optimality error of an acceptable point; 1e-6.
    pub acceptable_tolerance: f64,
    /// Stop after so many acceptable iterates in a row; 0 switches this off; 15.
    pub acceptable_iterations: usize,
    /// Largest dual infeasibility of an acceptable point, unscaled; 1e10.
    pub acceptable_dual_tolerance: f64,
    /// Largest constraint violation of an acceptable point, unscaled; 1e-2.
    pub acceptable_constraint_tolerance: f64,
    /// Largest complementarity of an acceptable point, unscaled; 1e-2.
    pub acceptable_complementarity_tolerance: f64,
    /// Stop after so many iterations, those of the restoration phase included; 3000.
    pub max_iterations: usize,
    /// Stop after this wall-clock time, checked once per iteration; none.
    pub time_limit: Option<Duration>,
    /// An iterate with an entry above this (scaled) is called diverging; 1e20.
    pub diverging_threshold: f64,
    /// A feasible iterate is called diverging with an objective (scaled) that has fallen by more than this times that of the first iterate,
    /// or times one where that is less; 1e15.
    pub unbounded_objective: f64,
    /// A bound of at least this magnitude counts as absent; 1e19.
    pub infinite_bound: f64,
    /// Scaling of the problem; gradients up to 100.
    pub scaling: ScalingMethod,
    /// Strategy for the barrier parameter; monotone.
    pub barrier: BarrierStrategy,
    /// Choice of the barrier parameter in the adaptive strategy; quality function.
    pub barrier_oracle: BarrierOracle,
    /// Barrier parameter at the start; 0.1. With a good guess a smaller one saves iterations.
    pub initial_barrier: f64,
    /// The barrier parameter goes no lower than this fraction of `tolerance`, or of `complementarity_tolerance` where
    /// that is less in scaled terms; 1/11.
    pub final_barrier_fraction: f64,
    /// A barrier problem counts as solved at this multiple of the barrier parameter; 10.
    pub barrier_tolerance_factor: f64,
    /// Linear decrease of the barrier parameter; 0.2.
    pub barrier_decrease: f64,
    /// Exponent of its superlinear decrease, between 1 and 2; 1.5.
    pub barrier_exponent: f64,
    /// Least fraction of the way to the boundary that a step may go; 0.99.
    pub boundary_fraction: f64,
    /// Start at least this far inside a bound, relative to max(1, |bound|); 1e-2.
    pub bound_push: f64,
    /// Start at least this fraction of the interval inside a bound; 1e-2.
    pub bound_fraction: f64,
    /// Bounds of constraints are widened by this, relative to max(1, |bound|), so that an interior exists; 1e-10. Those of
    /// variables are not.
    pub bound_relaxation: f64,
    /// Weight of the linear term that keeps variables with one bound from drifting away; 1e-5.
    pub damping: f64,
    /// Bound multipliers at the start; 1.
    pub initial_bound_multiplier: f64,
    /// Least-squares multipliers above this are replaced by zero; 1000.
    pub multiplier_limit: f64,
    /// Second-order corrections tried per iteration; 4.
    pub max_corrections: usize,
    /// Shortened steps in a row that start the watchdog; 0 switches it off; 10.
    pub watchdog_trigger: usize,
    /// Full steps that the watchdog tries; 3.
    pub watchdog_trials: usize,
    /// Soft restoration steps in a row before the restoration phase; 10.
    pub max_soft_restorations: usize,
    /// Largest violation of the constraints that an iterate may have, times that of the starting point, at least 1; 1e4.
    pub largest_violation: f64,
    /// Weight of the constraint violation in the restoration phase; 1000.
    pub restoration_penalty: f64,
    /// The restoration phase must reduce the violation to this fraction; 0.9.
    pub restoration_reduction: f64,
    /// First trial of the primal regularisation; 1e-4.
    pub first_regularisation: f64,
    /// Largest primal regularisation; 1e40.
    pub max_regularisation: f64,
    /// Dual regularisation for singular systems, times the fourth root of the barrier parameter; 1e-8.
    pub dual_regularisation: f64,
    /// A warm start begins no closer to a bound than this, relative to max(1, |bound|); 1e-9.
    pub warm_start_push: f64,
    /// Least barrier parameter of a warm start that names none; 1e-6.
    pub warm_start_barrier: f64,
    /// Most steps along negative curvature from a point that meets the first-order conditions and is no minimum; 0 leaves such
    /// a point as the solution; 0.
    pub max_saddle_escapes: usize,
    /// A solution that meets at most this part of its bounds ends with Newton's method on its active set; 0, no solution does.
    pub polish: f64,
    /// Where that leads elsewhere, the active set is looked for by the course of the slacks too: multipliers that are small since little depends on
    /// them are active all the same; false.
    pub polish_by_course: bool,
    /// Settings of the linear systems. With [`Nlp::stages`](crate::Nlp::stages) the default ordering becomes the
    /// ordering by stages.
    pub kkt: KktSettings,
}

impl Default for NlpSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            dual_tolerance: 1.0,
            constraint_tolerance: 1e-4,
            complementarity_tolerance: 1e-4,
            acceptable_tolerance: 1e-6,
            acceptable_iterations: 15,
            acceptable_dual_tolerance: 1e10,
            acceptable_constraint_tolerance: 1e-2,
            acceptable_complementarity_tolerance: 1e-2,
            max_iterations: 3000,
            time_limit: None,
            diverging_threshold: 1e20,
            unbounded_objective: 1e15,
            infinite_bound: 1e19,
            scaling: ScalingMethod::Gradient { max: 100.0 },
            barrier: BarrierStrategy::Monotone,
            barrier_oracle: BarrierOracle::QualityFunction,
            initial_barrier: 0.1,
            final_barrier_fraction: 1.0 / 11.0,
            barrier_tolerance_factor: 10.0,
            barrier_decrease: 0.2,
            barrier_exponent: 1.5,
            boundary_fraction: 0.99,
            bound_push: 1e-2,
            bound_fraction: 1e-2,
            bound_relaxation: 1e-10,
            damping: 1e-5,
            initial_bound_multiplier: 1.0,
            multiplier_limit: 1e3,
            max_corrections: 4,
            watchdog_trigger: 10,
            watchdog_trials: 3,
            max_soft_restorations: 10,
            largest_violation: 1e4,
            restoration_penalty: 1e3,
            restoration_reduction: 0.9,
            first_regularisation: 1e-4,
            max_regularisation: 1e40,
            dual_regularisation: 1e-8,
            warm_start_push: 1e-9,
            warm_start_barrier: 1e-6,
            max_saddle_escapes: 0,
            polish: 0.0,
            polish_by_course: false,
            kkt: KktSettings::default(),
        }
    }
}

impl NlpSettings {
    /// The least barrier parameter, for a complementarity of `unit` per scaled one.
    pub(crate) fn final_barrier(&self, unit: f64) -> f64 {
        self.tolerance.min(self.complementarity_tolerance / unit) * self.final_barrier_fraction
    }

    /// # Errors
    /// The first field outside its range.
    pub(crate) fn validate(&self) -> Result<(), NlpError> {
        let positive: [(&'static str, f64); 19] = [
            ("largest_violation", self.largest_violation),
            ("tolerance", self.tolerance),
            ("dual_tolerance", self.dual_tolerance),
            ("constraint_tolerance", self.constraint_tolerance),
            ("complementarity_tolerance", self.complementarity_tolerance),
            ("diverging_threshold", self.diverging_threshold),
            ("unbounded_objective", self.unbounded_objective),
            ("infinite_bound", self.infinite_bound),
            ("initial_barrier", self.initial_barrier),
            ("final_barrier_fraction", self.final_barrier_fraction),
            ("barrier_tolerance_factor", self.barrier_tolerance_factor),
            ("bound_push", self.bound_push),
            ("initial_bound_multiplier", self.initial_bound_multiplier),
            ("restoration_penalty", self.restoration_penalty),
            ("first_regularisation", self.first_regularisation),
            ("max_regularisation", self.max_regularisation),
            ("dual_regularisation", self.dual_regularisation),
            ("warm_start_push", self.warm_start_push),
            ("warm_start_barrier", self.warm_start_barrier),
        ];
        for (name, value) in positive {
            if value <= 0.0 || value.is_nan() {
                return Err(NlpError::Setting { name, value, allowed: "a positive number" });
            }
        }
        let fractions: [(&'static str, f64); 3] = [
            ("barrier_decrease", self.barrier_decrease),
            ("boundary_fraction", self.boundary_fraction),
            ("restoration_reduction", self.restoration_reduction),
        ];
        for (name, value) in fractions {
            if !(value > 0.0 && value < 1.0) {
                return Err(NlpError::Setting { name, value, allowed: "a number between 0 and 1" });
            }
        }
        if !(self.bound_fraction > 0.0 && self.bound_fraction <= 0.5) {
            let value = self.bound_fraction;
            return Err(NlpError::Setting { name: "bound_fraction", value, allowed: "a number in (0, 0.5]" });
        }
        if !(self.barrier_exponent > 1.0 && self.barrier_exponent < 2.0) {
            let value = self.barrier_exponent;
            return Err(NlpError::Setting { name: "barrier_exponent", value, allowed: "a number in (1, 2)" });
        }
        let not_negative: [(&'static str, f64); 6] = [
            ("bound_relaxation", self.bound_relaxation),
            ("damping", self.damping),
            ("acceptable_tolerance", self.acceptable_tolerance),
            ("acceptable_dual_tolerance", self.acceptable_dual_tolerance),
            ("acceptable_constraint_tolerance", self.acceptable_constraint_tolerance),
            ("multiplier_limit", self.multiplier_limit),
        ];
        for (name, value) in not_negative {
            if value < 0.0 || value.is_nan() {
                return Err(NlpError::Setting { name, value, allowed: "a number that is not negative" });
            }
        }
        if let ScalingMethod::Gradient { max } | ScalingMethod::UserThenGradient { max } = self.scaling
            && (max <= 0.0 || max.is_nan())
        {
            return Err(NlpError::Setting {
                name: "scaling",
                value: max,
                allowed: "a positive largest gradient",
            });
        }
        Ok(())
    }
}
