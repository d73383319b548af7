//! Backtracking filter line search with second-order corrections, watchdog and soft restoration
//! (Waechter and Biegler, sections 2.3 to 2.4 and 3.2 to 3.4).

use crate::augmented::AugmentedSystem;
use crate::filter::{BARRIER_MARGIN, VIOLATION_MARGIN, at_most};
use crate::iterate::{Direction, Point};
use crate::model::BarrierModel;
use crate::state::SolverState;
use crate::vector::{all_finite, dot, max_abs, sum, sum_abs};

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
/// A step up to this length between soft restoration steps does not end their row: both can go on for ever, without a way to anywhere.
const NO_WAY_OUT: f64 = 1e-6;
/// Iterations in a row whose last rejected trial the filter alone rejected that clear it, and how often this may happen.
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

/// Lengths of a step: of the variables and constraint multipliers, and of the bound multipliers.
#[derive(Debug, Clone, Copy, Default)]
struct Lengths {
    primal: f64,
    dual: f64,
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
    /// The decrease of the barrier function that the switching condition asks for: the filter stays (algorithm A, step A-7).
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
    lengths: Lengths,
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
    /// True if the filter alone stood against the last trial that was rejected.
    last_rejected_by_filter: bool,
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
            last_rejected_by_filter: false,
            filter_rejections: 0,
            filter_resets: 0,
            watchdog: Watchdog {
                active: false,
                trials: 0,
                lengths: Lengths::default(),
                reference: Reference::default(),
                point: Point::new(n, m),
                step: Direction::new(n, m),
            },
        }
    }

    /// Values of the old barrier function mean nothing for the new one.
    fn forget_barrier(&mut self) {
        self.watchdog.active = false;
        self.shortened_in_a_row = 0;
        self.last_rejected_by_filter = false;
        self.filter_rejections = 0;
    }

    /// Forgets everything but the log.
    pub(crate) fn restart(&mut self) {
        self.forget_barrier();
        self.tiny_steps = 0;
        self.soft_steps = 0;
        self.filter_resets = 0;
    }

    /// Moves the current point along `step`.
    pub(crate) fn run(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
    ) -> Search {
        if std::mem::take(&mut state.barrier_is_new) {
            self.forget_barrier();
        }
        let mut longest = state.longest_step();
        self.step_norm = max_abs(&state.step.v);
        self.trials = 0;
        if state.is_tiny() {
            return self.take_tiny_step(state, model, longest);
        }
        self.tiny_steps = 0;
        let mut reference = Reference {
            violation: state.current.violation,
            barrier: state.barrier_value(&state.current),
            slope: dot(&state.barrier_gradient, &state.step.v),
        };
        let mut first = true;
        if self.watchdog.active {
            if self.take_watchdog_step(state, model, longest) {
                return Search::Accepted;
            }
            reference = self.watchdog.reference;
            longest = self.watchdog.lengths;
            longest.primal *= 0.5;
            first = false;
        } else if state.settings.watchdog_trigger > 0
            && self.shortened_in_a_row >= state.settings.watchdog_trigger
        {
            self.start_watchdog(state, longest, reference);
            if self.take_watchdog_step(state, model, longest) {
                return Search::Accepted;
            }
            self.watchdog.active = false;
        }
        if self.backtrack(state, model, system, reference, longest, first) {
            return Search::Accepted;
        }
        if self.take_soft_step(state, model, reference) { Search::Accepted } else { Search::Failed }
    }

    fn backtrack(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
        reference: Reference,
        longest: Lengths,
        may_correct: bool,
    ) -> bool {
        let least = reference.least_step(self.min_violation);
        let mut alpha = longest.primal;
        loop {
            self.trials += 1;
            if state.try_step(model, alpha, false) {
                let verdict = self.judge(state, reference, alpha);
                if verdict.is_accepted() && state.differentiate_trial(model) {
                    let lengths = Lengths { primal: alpha, ..longest };
                    self.accept(state, model, verdict, reference, lengths, false);
                    self.count_shortened(alpha < longest.primal || !may_correct);
                    return true;
                }
                if alpha == longest.primal
                    && may_correct
                    && state.trial.violation >= reference.violation
                    && self.correct(state, model, system, reference, alpha)
                {
                    return true;
                }
            }
            alpha *= 0.5;
            if alpha < least || alpha * self.step_norm == 0.0 {
                return false;
            }
        }
    }

    /// Counts the iterations in a row whose last rejected trial only the filter stood against, and after several of them clears it: its
    /// entries are then mostly from far away.
    fn count_filter_rejections(&mut self, state: &mut SolverState) {
        if !std::mem::take(&mut self.last_rejected_by_filter) {
            self.filter_rejections = 0;
            return;
        }
        self.filter_rejections += 1;
        if self.filter_rejections >= FILTER_RESET_TRIGGER && self.filter_resets < MAX_FILTER_RESETS {
            self.filter_rejections = 0;
            self.filter_resets += 1;
            state.filter.clear();
        }
    }

    fn count_shortened(&mut self, shortened: bool) {
        self.shortened_in_a_row = if shortened { self.shortened_in_a_row + 1 } else { 0 };
    }

    fn judge(&mut self, state: &SolverState, reference: Reference, alpha: f64) -> Verdict {
        let verdict = self.verdict(state, reference, alpha);
        if !verdict.is_accepted() {
            self.last_rejected_by_filter = verdict == Verdict::RejectedByFilter;
        }
        verdict
    }

    fn verdict(&self, state: &SolverState, reference: Reference, alpha: f64) -> Verdict {
        let violation = state.trial.violation;
        let barrier = state.barrier_value(&state.trial);
        if !barrier.is_finite() || violation > state.filter.max_violation {
            return Verdict::Rejected;
        }
        let rise = barrier - reference.barrier;
        if rise > 0.0 && rise.log10() > LARGEST_RISE + reference.barrier.abs().max(10.0).log10() {
            return Verdict::Rejected;
        }
        let switches = reference.switches(alpha);
        let falls = switches && at_most(rise, ARMIJO * alpha * reference.slope, reference.barrier);
        if switches && reference.violation <= self.min_violation {
            if !falls {
                return Verdict::Rejected;
            }
        } else {
            let margin = BARRIER_MARGIN * reference.violation;
            if !at_most(violation, (1.0 - VIOLATION_MARGIN) * reference.violation, reference.violation)
                && !at_most(rise, -margin, reference.barrier)
            {
                return Verdict::Rejected;
            }
        }
        let verdict = if falls { Verdict::Objective } else { Verdict::Either };
        if state.filter.accepts(violation, barrier) { verdict } else { Verdict::RejectedByFilter }
    }

    /// Second-order corrections (algorithm A, steps ).
    fn correct(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
        reference: Reference,
        alpha: f64,
    ) -> bool {
        let mut length = alpha;
        let mut before = reference.violation;
        self.corrected_constraints.copy_from_slice(&state.current.constraints);
        for correction in 0..state.settings.max_corrections {
            if correction > 0 && state.trial.violation > CORRECTION_REDUCTION * before {
                return false;
            }
            before = state.trial.violation;
            for (sum, trial) in self.corrected_constraints.iter_mut().zip(&state.trial.constraints) {
                *sum = length * *sum + trial;
            }
            if !state.find_correction(model.structure(), system, &self.corrected_constraints) {
                return false;
            }
            length = state.bounds.longest_primal(&state.current, &state.corrected.v, state.tau);
            if !state.try_step(model, length, true) {
                return false;
            }
            let verdict = self.judge(state, reference, alpha);
            if verdict.is_accepted() && state.differentiate_trial(model) {
                let corrected = &state.corrected;
                let dual = state.bounds.longest_dual(&state.current, &corrected.zl, &corrected.zu, state.tau);
                self.accept(state, model, verdict, reference, Lengths { primal: length, dual }, true);
                self.count_shortened(false);
                return true;
            }
        }
        false
    }

    fn accept(
        &mut self,
        state: &mut SolverState,
        model: &impl BarrierModel,
        verdict: Verdict,
        reference: Reference,
        lengths: Lengths,
        corrected: bool,
    ) {
        self.count_filter_rejections(state);
        if verdict == Verdict::Either {
            state.filter.add(reference.violation, reference.barrier);
        }
        if lengths.primal > NO_WAY_OUT {
            self.soft_steps = 0;
        }
        self.kind = match (verdict, corrected) {
            (Verdict::Objective, false) => 'f',
            (Verdict::Objective, true) => 'F',
            (_, false) => 'h',
            (_, true) => 'H',
        };
        self.commit(state, model, lengths, corrected);
    }

    /// Makes the trial point, which must have been differentiated, the current one. The old one stays in `trial`.
    fn commit(
        &mut self,
        state: &mut SolverState,
        model: &impl BarrierModel,
        lengths: Lengths,
        corrected: bool,
    ) {
        let Lengths { primal, dual } = lengths;
        let step = if corrected { &state.corrected } else { &state.step };
        let advance = |out: &mut [f64], from: &[f64], step: &[f64], alpha: f64| {
            for ((out, from), step) in out.iter_mut().zip(from).zip(step) {
                *out = from + alpha * step;
            }
        };
        advance(&mut state.trial.y, &state.current.y, &step.y, primal);
        advance(&mut state.trial.zl, &state.current.zl, &step.zl, dual);
        advance(&mut state.trial.zu, &state.current.zu, &step.zu, dual);
        state.bounds.safeguard_multipliers(&mut state.trial, state.barrier, MULTIPLIER_SAFEGUARD);
        self.primal_step = primal;
        self.dual_step = dual;
        state.swap_trial(model);
    }

    /// A step of the size of rounding errors is taken without a test, since none could tell anything. After two in a
    /// row that do not move the multipliers either, or many that do, the barrier parameter is reduced; at its least value
    /// the method has stalled.
    fn take_tiny_step(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
        lengths: Lengths,
    ) -> Search {
        let patience = if state.moves_multipliers() { MAX_TINY_STEPS } else { 1 };
        if self.tiny_steps >= patience {
            if state.barrier <= state.final_barrier {
                return Search::Stalled;
            }
            state.forces_reduction = true;
        }
        self.tiny_steps += 1;
        self.trials = 1;
        if !state.try_step(model, lengths.primal, false) || !state.differentiate_trial(model) {
            return Search::Stalled;
        }
        self.kind = 't';
        self.commit(state, model, lengths, false);
        Search::Accepted
    }

    fn start_watchdog(&mut self, state: &SolverState, lengths: Lengths, reference: Reference) {
        let watchdog = &mut self.watchdog;
        watchdog.active = true;
        watchdog.trials = 0;
        watchdog.lengths = lengths;
        watchdog.reference = reference;
        watchdog.point.copy_from(&state.current);
        watchdog.step.copy_from(&state.step);
    }

    /// A full step under the watchdog: compared with the stored point, and taken in any case for a few iterations. If
    /// it is not taken the stored point and step are current again.
    fn take_watchdog_step(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
        lengths: Lengths,
    ) -> bool {
        self.trials += 1;
        self.watchdog.trials += 1;
        let (reference, alpha) = (self.watchdog.reference, self.watchdog.lengths.primal);
        if state.try_step(model, lengths.primal, false) && state.differentiate_trial(model) {
            let verdict = self.judge(state, reference, alpha);
            if verdict.is_accepted() {
                self.accept(state, model, verdict, reference, lengths, false);
                self.watchdog.active = false;
                self.count_shortened(false);
                self.kind = 'w';
                return true;
            }
            if self.watchdog.trials < state.settings.watchdog_trials
                && state.trial.violation <= state.filter.max_violation
                && state.barrier_value(&state.trial).is_finite()
            {
                self.commit(state, model, lengths, false);
                self.kind = 'w';
                return true;
            }
        }
        self.watchdog.active = false;
        self.count_shortened(false);
        if self.watchdog.trials > 1 {
            state.current.copy_from(&self.watchdog.point);
            state.step.copy_from(&self.watchdog.step);
            self.step_norm = max_abs(&state.step.v);
            // The derivatives were finite here before.
            let _ = state.differentiate(model);
        }
        false
    }

    /// A step that reduces the optimality error instead of entering the restoration phase (section 3.3).
    fn take_soft_step(
        &mut self,
        state: &mut SolverState,
        model: &mut impl BarrierModel,
        reference: Reference,
    ) -> bool {
        if self.soft_steps >= state.settings.max_soft_restorations {
            return false;
        }
        let Lengths { primal, dual } = state.longest_step();
        let alpha = primal.min(dual);
        if !state.try_step(model, alpha, false)
            || state.trial.violation > state.filter.max_violation
            || !state.differentiate_trial(model)
        {
            return false;
        }
        let before = state.mean_error();
        self.commit(state, model, Lengths { primal: alpha, dual: alpha }, false);
        if state.mean_error() > SOFT_REDUCTION * before {
            state.swap_trial(model);
            return false;
        }
        if self.soft_steps == 0 {
            state.filter.add(reference.violation, reference.barrier);
        }
        self.soft_steps += 1;
        self.kind = 's';
        true
    }
}

impl SolverState {
    /// The longest step that keeps the variables inside their bounds and their multipliers positive.
    fn longest_step(&self) -> Lengths {
        Lengths {
            primal: self.bounds.longest_primal(&self.current, &self.step.v, self.tau),
            dual: self.bounds.longest_dual(&self.current, &self.step.zl, &self.step.zu, self.tau),
        }
    }

    /// Evaluates the trial point at this step length; false if it cannot be evaluated.
    fn try_step(&mut self, model: &mut impl BarrierModel, alpha: f64, corrected: bool) -> bool {
        let step = if corrected { &self.corrected } else { &self.step };
        for ((trial, current), step) in self.trial.v.iter_mut().zip(&self.current.v).zip(&step.v) {
            *trial = current + alpha * step;
        }
        self.measure_trial();
        self.trial.evaluate(model)
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
        if !all_finite(&self.trial_gradient) {
            return false;
        }
        model.jacobian(&self.trial.v, &mut self.trial_jacobian);
        all_finite(&self.trial_jacobian)
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

    /// Mean optimality error of the barrier problem.
    fn mean_error(&self) -> f64 {
        let (point, bounds) = (&self.current, &self.bounds);
        let lower = sum(&bounds.lower_set, |&i| (point.lower_slack[i] * point.zl[i] - self.barrier).abs());
        let upper = sum(&bounds.upper_set, |&i| (point.upper_slack[i] * point.zu[i] - self.barrier).abs());
        let equations = self.dual_residual.len() + point.constraints.len();
        (sum_abs(&self.dual_residual) + sum_abs(&point.constraints)) / equations as f64
            + (lower + upper) / bounds.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Structure;
    use crate::settings::NlpSettings;

    /// One free variable and one constraint, with a trial point of this violation and barrier function.
    fn state_with_trial(violation: f64, barrier: f64) -> SolverState {
        let structure = Structure::of_sizes(1, 1);
        let (lower, upper) = ([f64::NEG_INFINITY], [f64::INFINITY]);
        let mut state = SolverState::new(&structure, &lower, &upper, &NlpSettings::default());
        (state.trial.violation, state.trial.objective) = (violation, barrier);
        state
    }

    #[test]
    fn the_filter_stays_after_enough_decrease_whatever_the_violation() {
        let mut search = LineSearch::new(1, 1);
        search.min_violation = 1e-4;
        // The predicted decrease is worth more than the violation, which is above the least: no decrease is asked for, but one counts.
        let reference = Reference { violation: 0.5, barrier: 2.0, slope: -3.0 };
        assert!(reference.switches(1.0));
        assert_eq!(search.judge(&state_with_trial(0.6, 1.0), reference, 1.0), Verdict::Objective);
        assert_eq!(search.judge(&state_with_trial(0.4, 2.5), reference, 1.0), Verdict::Either);
        assert_eq!(search.judge(&state_with_trial(0.6, 2.5), reference, 1.0), Verdict::Rejected);
        // Where it is below the least one, the decrease is asked for.
        let reference = Reference { violation: 1e-5, ..reference };
        assert_eq!(search.judge(&state_with_trial(1e-6, 2.5), reference, 1.0), Verdict::Rejected);
        // Without the switching condition either reduction will do, and the filter grows.
        let reference = Reference { violation: 0.5, barrier: 2.0, slope: -1e-3 };
        assert_eq!(search.judge(&state_with_trial(0.6, 1.0), reference, 1.0), Verdict::Either);
    }

    #[test]
    fn five_iterations_whose_last_rejection_is_by_the_filter_clear_it() {
        let mut search = LineSearch::new(1, 1);
        let mut state = state_with_trial(0.5, 1.5);
        state.filter.add(0.1, 1.0);
        let reference = Reference { violation: 1.0, barrier: 2.0, slope: 0.0 };
        for iteration in 1..=FILTER_RESET_TRIGGER {
            assert!(!state.filter.accepts(0.5, 1.5), "iteration {iteration}");
            assert_eq!(search.judge(&state, reference, 1.0), Verdict::RejectedByFilter);
            search.count_filter_rejections(&mut state);
        }
        assert!(state.filter.accepts(0.5, 1.5));
        // An iteration without a rejection begins the count anew.
        state.filter.add(0.1, 1.0);
        for iteration in 0..2 * FILTER_RESET_TRIGGER {
            if iteration % 2 == 0 {
                search.judge(&state, reference, 1.0);
            }
            search.count_filter_rejections(&mut state);
        }
        assert!(!state.filter.accepts(0.5, 1.5));
    }
}
