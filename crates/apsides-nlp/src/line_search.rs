//! Backtracking filter line search with second-order corrections, watchdog and soft restoration
//! (Waechter and Biegler, sections 2.3 to 2.4 and 3.2 to 3.4).

use crate::augmented::AugmentedSystem;
use crate::engine::{Engine, dot, max_abs};
use crate::filter::{BARRIER_MARGIN, VIOLATION_MARGIN, at_most};
use crate::iterate::{Direction, Point};
use crate::model::BarrierModel;

/// Factor and exponents of the switching condition (eq. 19).
const SWITCH_FACTOR: f64 = 1.0;
const SWITCH_VIOLATION_EXPONENT: f64 = 1.1;
const SWITCH_BARRIER_EXPONENT: f64 = 2.3;
/// Armijo constant (eq. 20).
const ARMIJO: f64 = 1e-8;
/// Safety factor on the least step length (eq. 23).
const LEAST_STEP_FACTOR: f64 = 0.05;
/// A correction must reduce the violation to this fraction for another one to be tried.
const CORRECTION_REDUCTION: f64 = 0.99;
/// Multipliers stay within this factor of their central values (eq. 16).
const MULTIPLIER_SAFEGUARD: f64 = 1e10;
/// The barrier function may rise by at most this many orders of magnitude.
const LARGEST_RISE: f64 = 5.0;
/// Relative size of a tiny step.
const TINY_STEP: f64 = 10.0 * f64::EPSILON;
/// Relative size of a step of the multipliers that does not count, and tiny steps in a row that may move them more.
const DUAL_TINY_STEP: f64 = 1e-8;
const MAX_TINY_STEPS: usize = 20;
/// Required reduction of the optimality error by a soft restoration step.
const SOFT_REDUCTION: f64 = 1.0 - 1e-4;
/// Iterations in a row with a first trial rejected by the filter that clear it, and how often this may happen.
const FILTER_RESET_TRIGGER: usize = 5;
const MAX_FILTER_RESETS: usize = 5;

/// Outcome of a line search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Search {
    /// The current point has moved.
    Accepted,
    /// Only steps of the size of rounding errors are left.
    Stalled,
    /// No step is acceptable.
    Failed,
}

/// The values that a trial point is compared with.
#[derive(Debug, Clone, Copy, Default)]
struct Reference {
    violation: f64,
    barrier: f64,
    /// Directional derivative of the barrier function.
    slope: f64,
}

impl Reference {
    /// The switching condition: enough predicted decrease of the barrier function to ask for it.
    fn switches(&self, alpha: f64) -> bool {
        self.slope < 0.0
            && alpha * (-self.slope).powf(SWITCH_BARRIER_EXPONENT)
                > SWITCH_FACTOR * self.violation.powf(SWITCH_VIOLATION_EXPONENT)
    }

    /// Shortest step worth trying.
    fn least_step(&self, min_violation: f64) -> f64 {
        let mut alpha = VIOLATION_MARGIN;
        if self.slope < 0.0 {
            alpha = alpha.min(BARRIER_MARGIN * self.violation / -self.slope);
            if self.violation <= min_violation {
                alpha = alpha.min(
                    SWITCH_FACTOR * self.violation.powf(SWITCH_VIOLATION_EXPONENT)
                        / (-self.slope).powf(SWITCH_BARRIER_EXPONENT),
                );
            }
        }
        LEAST_STEP_FACTOR * alpha
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// Sufficient decrease of the barrier function: the filter stays.
    Objective,
    /// Sufficient decrease of one of the two: the reference enters the filter.
    Either,
    RejectedByFilter,
    Rejected,
}

impl Verdict {
    fn is_accepted(self) -> bool {
        matches!(self, Self::Objective | Self::Either)
    }
}

/// A stored point to return to, should the full steps that follow it not pay.
#[derive(Debug)]
struct Watchdog {
    active: bool,
    trials: usize,
    alpha: f64,
    dual: f64,
    reference: Reference,
    point: Point,
    step: Direction,
}

/// State of the line search between iterations, and what the log says of the last one.
#[derive(Debug)]
pub(crate) struct LineSearch {
    pub step_norm: f64,
    pub primal_step: f64,
    pub dual_step: f64,
    pub trials: usize,
    pub kind: char,
    /// Right-hand side of the second-order correction.
    pub corrected_constraints: Vec<f64>,
    /// Violations below this call for the Armijo condition.
    pub min_violation: f64,
    /// Tiny steps in a row.
    tiny_steps: usize,
    soft_steps: usize,
    shortened_in_a_row: usize,
    filter_rejections: usize,
    filter_resets: usize,
    watchdog: Watchdog,
}

impl LineSearch {
    pub(crate) fn new(n: usize, m: usize) -> Self {
        Self {
            step_norm: 0.0,
            primal_step: 0.0,
            dual_step: 0.0,
            trials: 0,
            kind: '-',
            corrected_constraints: vec![0.0; m],
            min_violation: 0.0,
            tiny_steps: 0,
            soft_steps: 0,
            shortened_in_a_row: 0,
            filter_rejections: 0,
            filter_resets: 0,
            watchdog: Watchdog {
                active: false,
                trials: 0,
                alpha: 0.0,
                dual: 0.0,
                reference: Reference::default(),
                point: Point::new(n, m),
                step: Direction::new(n, m),
            },
        }
    }

    /// Values of the old barrier function mean nothing for the new one.
    pub(crate) fn barrier_changed(&mut self) {
        self.watchdog.active = false;
        self.shortened_in_a_row = 0;
        self.filter_rejections = 0;
    }

    /// Forgets everything but the log.
    pub(crate) fn restart(&mut self) {
        self.barrier_changed();
        self.tiny_steps = 0;
        self.soft_steps = 0;
        self.filter_resets = 0;
    }
}

impl Engine {
    /// Moves the current point along `step`.
    pub(crate) fn line_search(
        &mut self,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
    ) -> Search {
        let primal = self.bounds.longest_primal(&self.current, &self.step.v, self.tau);
        let dual = self.bounds.longest_dual(&self.current, &self.step.zl, &self.step.zu, self.tau);
        self.search.step_norm = max_abs(&self.step.v);
        self.search.trials = 0;
        if self.is_tiny() {
            return self.take_tiny_step(model, primal, dual);
        }
        self.search.tiny_steps = 0;
        let mut reference = Reference {
            violation: self.current.violation,
            barrier: self.barrier_value(&self.current),
            slope: dot(&self.barrier_gradient, &self.step.v),
        };
        let (mut primal, mut dual) = (primal, dual);
        let mut first = true;
        if self.search.watchdog.active {
            if self.take_watchdog_step(model, primal, dual) {
                return Search::Accepted;
            }
            reference = self.search.watchdog.reference;
            (primal, dual) = (0.5 * self.search.watchdog.alpha, self.search.watchdog.dual);
            first = false;
        } else if self.settings.watchdog_trigger > 0
            && self.search.shortened_in_a_row >= self.settings.watchdog_trigger
        {
            self.start_watchdog(primal, dual, reference);
            if self.take_watchdog_step(model, primal, dual) {
                return Search::Accepted;
            }
            self.search.watchdog.active = false;
        }
        if self.backtrack(model, system, reference, primal, dual, first) {
            return Search::Accepted;
        }
        if self.take_soft_step(model, reference) { Search::Accepted } else { Search::Failed }
    }

    fn backtrack(
        &mut self,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
        reference: Reference,
        longest: f64,
        dual: f64,
        may_correct: bool,
    ) -> bool {
        let least = reference.least_step(self.search.min_violation);
        let mut alpha = longest;
        loop {
            self.search.trials += 1;
            if self.try_step(model, alpha, false) {
                let verdict = self.judge(reference, alpha);
                if verdict.is_accepted() && self.differentiate_trial(model) {
                    self.accept(model, verdict, reference, alpha, dual, false);
                    self.count_shortened(alpha < longest || !may_correct);
                    return true;
                }
                if alpha == longest && may_correct {
                    if self.trial.violation >= reference.violation
                        && self.correct(model, system, reference, alpha)
                    {
                        return true;
                    }
                    if self.is_filter_cleared(verdict) {
                        continue;
                    }
                }
            }
            alpha *= 0.5;
            if alpha < least || alpha * self.search.step_norm == 0.0 {
                return false;
            }
        }
    }

    /// After several iterations whose full step only the filter stood against, clears it: its entries are then mostly
    /// from far away.
    fn is_filter_cleared(&mut self, verdict: Verdict) -> bool {
        if verdict != Verdict::RejectedByFilter {
            self.search.filter_rejections = 0;
            return false;
        }
        self.search.filter_rejections += 1;
        if self.search.filter_rejections < FILTER_RESET_TRIGGER
            || self.search.filter_resets >= MAX_FILTER_RESETS
        {
            return false;
        }
        self.search.filter_rejections = 0;
        self.search.filter_resets += 1;
        self.filter.clear();
        true
    }

    fn count_shortened(&mut self, shortened: bool) {
        self.search.shortened_in_a_row = if shortened { self.search.shortened_in_a_row + 1 } else { 0 };
    }

    /// Evaluates the trial point at this step length; false if it cannot be evaluated.
    fn try_step(&mut self, model: &mut impl BarrierModel, alpha: f64, corrected: bool) -> bool {
        let step = if corrected { &self.corrected } else { &self.step };
        for ((trial, current), step) in self.trial.v.iter_mut().zip(&self.current.v).zip(&step.v) {
            *trial = current + alpha * step;
        }
        self.bounds.measure(&mut self.trial, self.barrier);
        self.trial.evaluate(model)
    }

    fn judge(&self, reference: Reference, alpha: f64) -> Verdict {
        let violation = self.trial.violation;
        let barrier = self.barrier_value(&self.trial);
        if !barrier.is_finite() || violation > self.filter.max_violation {
            return Verdict::Rejected;
        }
        let rise = barrier - reference.barrier;
        if rise > 0.0 && rise.log10() > LARGEST_RISE + reference.barrier.abs().max(10.0).log10() {
            return Verdict::Rejected;
        }
        let verdict = if reference.switches(alpha) && reference.violation <= self.search.min_violation {
            let decrease = ARMIJO * alpha * reference.slope;
            if !at_most(rise, decrease, reference.barrier) {
                return Verdict::Rejected;
            }
            Verdict::Objective
        } else {
            let margin = BARRIER_MARGIN * reference.violation;
            if !at_most(violation, (1.0 - VIOLATION_MARGIN) * reference.violation, reference.violation)
                && !at_most(rise, -margin, reference.barrier)
            {
                return Verdict::Rejected;
            }
            Verdict::Either
        };
        if self.filter.accepts(violation, barrier) { verdict } else { Verdict::RejectedByFilter }
    }

    /// Second-order corrections (algorithm A, steps ).
    fn correct(
        &mut self,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
        reference: Reference,
        alpha: f64,
    ) -> bool {
        let mut length = alpha;
        let mut before = reference.violation;
        self.search.corrected_constraints.copy_from_slice(&self.current.constraints);
        for correction in 0..self.settings.max_corrections {
            if correction > 0 && self.trial.violation > CORRECTION_REDUCTION * before {
                return false;
            }
            before = self.trial.violation;
            for (sum, trial) in self.search.corrected_constraints.iter_mut().zip(&self.trial.constraints) {
                *sum = length * *sum + trial;
            }
            if !self.find_correction(model.structure(), system) {
                return false;
            }
            length = self.bounds.longest_primal(&self.current, &self.corrected.v, self.tau);
            if !self.try_step(model, length, true) {
                return false;
            }
            let verdict = self.judge(reference, alpha);
            if verdict.is_accepted() && self.differentiate_trial(model) {
                let corrected = &self.corrected;
                let dual = self.bounds.longest_dual(&self.current, &corrected.zl, &corrected.zu, self.tau);
                self.accept(model, verdict, reference, length, dual, true);
                self.count_shortened(false);
                return true;
            }
        }
        false
    }

    fn accept(
        &mut self,
        model: &impl BarrierModel,
        verdict: Verdict,
        reference: Reference,
        primal: f64,
        dual: f64,
        corrected: bool,
    ) {
        if verdict == Verdict::Either {
            self.filter.add(reference.violation, reference.barrier);
        }
        self.search.soft_steps = 0;
        self.search.kind = match (verdict, corrected) {
            (Verdict::Objective, false) => 'f',
            (Verdict::Objective, true) => 'F',
            (_, false) => 'h',
            (_, true) => 'H',
        };
        self.commit(model, primal, dual, corrected);
    }

    /// Makes the trial point, which must have been differentiated, the current one. The old one stays in `trial`.
    fn commit(&mut self, model: &impl BarrierModel, primal: f64, dual: f64, corrected: bool) {
        let step = if corrected { &self.corrected } else { &self.step };
        let advance = |out: &mut [f64], from: &[f64], step: &[f64], alpha: f64| {
            for ((out, from), step) in out.iter_mut().zip(from).zip(step) {
                *out = from + alpha * step;
            }
        };
        advance(&mut self.trial.y, &self.current.y, &step.y, primal);
        advance(&mut self.trial.zl, &self.current.zl, &step.zl, dual);
        advance(&mut self.trial.zu, &self.current.zu, &step.zu, dual);
        self.bounds.safeguard_multipliers(&mut self.trial, self.barrier, MULTIPLIER_SAFEGUARD);
        self.search.primal_step = primal;
        self.search.dual_step = dual;
        self.swap_trial(model);
    }

    fn swap_trial(&mut self, model: &impl BarrierModel) {
        std::mem::swap(&mut self.current, &mut self.trial);
        std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
        std::mem::swap(&mut self.jacobian, &mut self.trial_jacobian);
        self.update_dual_residual(model);
    }

    /// Derivatives at the trial point; false if they are not finite.
    fn differentiate_trial(&mut self, model: &mut impl BarrierModel) -> bool {
        model.gradient(&self.trial.v, &mut self.trial_gradient);
        if self.trial_gradient.iter().any(|value| !value.is_finite()) {
            return false;
        }
        model.jacobian(&self.trial.v, &mut self.trial_jacobian);
        self.trial_jacobian.iter().all(|value| value.is_finite())
    }

    fn is_tiny(&self) -> bool {
        max_abs(&self.current.constraints) < 1e-4
            && self
                .step
                .v
                .iter()
                .zip(&self.current.v)
                .all(|(step, v)| step.abs() <= TINY_STEP * (1.0 + v.abs()))
    }

    /// Returns true if the step changes a multiplier by more than rounding.
    fn moves_multipliers(&self) -> bool {
        let moves = |steps: &[f64], values: &[f64]| {
            steps.iter().zip(values).any(|(step, value)| step.abs() > DUAL_TINY_STEP * (1.0 + value.abs()))
        };
        let (step, point) = (&self.step, &self.current);
        moves(&step.y, &point.y) || moves(&step.zl, &point.zl) || moves(&step.zu, &point.zu)
    }

    /// A step of the size of rounding errors is taken without a test, since none could tell anything. After two in a
    /// row that do not move the multipliers either, or many that do, the barrier parameter is reduced; at its least value
    /// the method has stalled.
    fn take_tiny_step(&mut self, model: &mut impl BarrierModel, primal: f64, dual: f64) -> Search {
        let patience = if self.moves_multipliers() { MAX_TINY_STEPS } else { 1 };
        if self.search.tiny_steps >= patience {
            if self.barrier <= self.final_barrier {
                return Search::Stalled;
            }
            self.control.force = true;
        }
        self.search.tiny_steps += 1;
        self.search.trials = 1;
        if !self.try_step(model, primal, false) || !self.differentiate_trial(model) {
            return Search::Stalled;
        }
        self.search.kind = 't';
        self.commit(model, primal, dual, false);
        Search::Accepted
    }

    fn start_watchdog(&mut self, alpha: f64, dual: f64, reference: Reference) {
        let watchdog = &mut self.search.watchdog;
        watchdog.active = true;
        watchdog.trials = 0;
        watchdog.alpha = alpha;
        watchdog.dual = dual;
        watchdog.reference = reference;
        watchdog.point.copy_from(&self.current);
        watchdog.step.copy_from(&self.step);
    }

    /// A full step under the watchdog: compared with the stored point, and taken in any case for a few iterations. If
    /// it is not taken the stored point and step are current again.
    fn take_watchdog_step(&mut self, model: &mut impl BarrierModel, primal: f64, dual: f64) -> bool {
        self.search.trials += 1;
        self.search.watchdog.trials += 1;
        let (reference, alpha) = (self.search.watchdog.reference, self.search.watchdog.alpha);
        if self.try_step(model, primal, false) && self.differentiate_trial(model) {
            let verdict = self.judge(reference, alpha);
            if verdict.is_accepted() {
                self.accept(model, verdict, reference, primal, dual, false);
                self.search.watchdog.active = false;
                self.count_shortened(false);
                self.search.kind = 'w';
                return true;
            }
            if self.search.watchdog.trials < self.settings.watchdog_trials
                && self.trial.violation <= self.filter.max_violation
                && self.barrier_value(&self.trial).is_finite()
            {
                self.commit(model, primal, dual, false);
                self.search.kind = 'w';
                return true;
            }
        }
        self.search.watchdog.active = false;
        self.count_shortened(false);
        if self.search.watchdog.trials > 1 {
            self.current.copy_from(&self.search.watchdog.point);
            self.step.copy_from(&self.search.watchdog.step);
            self.search.step_norm = max_abs(&self.step.v);
            // The derivatives were finite here before.
            let _ = self.differentiate(model);
        }
        false
    }

    /// A step that reduces the optimality error instead of entering the restoration phase (section 3.3).
    fn take_soft_step(&mut self, model: &mut impl BarrierModel, reference: Reference) -> bool {
        if self.search.soft_steps >= self.settings.max_soft_restorations {
            return false;
        }
        let primal = self.bounds.longest_primal(&self.current, &self.step.v, self.tau);
        let dual = self.bounds.longest_dual(&self.current, &self.step.zl, &self.step.zu, self.tau);
        let alpha = primal.min(dual);
        if !self.try_step(model, alpha, false)
            || self.trial.violation > self.filter.max_violation
            || !self.differentiate_trial(model)
        {
            return false;
        }
        let before = self.mean_error();
        self.commit(model, alpha, alpha, false);
        if self.mean_error() > SOFT_REDUCTION * before {
            self.swap_trial(model);
            return false;
        }
        if self.search.soft_steps == 0 {
            self.filter.add(reference.violation, reference.barrier);
        }
        self.search.soft_steps += 1;
        self.search.kind = 's';
        true
    }

    /// Mean optimality error of the barrier problem.
    fn mean_error(&self) -> f64 {
        let sum = |values: &[f64]| values.iter().map(|value| value.abs()).sum::<f64>();
        let (point, bounds) = (&self.current, &self.bounds);
        let lower =
            bounds.lower_set.iter().map(|&i| (point.lower_slack[i] * point.zl[i] - self.barrier).abs());
        let upper =
            bounds.upper_set.iter().map(|&i| (point.upper_slack[i] * point.zu[i] - self.barrier).abs());
        let equations = self.dual_residual.len() + point.constraints.len();
        (sum(&self.dual_residual) + sum(&point.constraints)) / equations as f64
            + lower.chain(upper).sum::<f64>() / bounds.len().max(1) as f64
    }
}
