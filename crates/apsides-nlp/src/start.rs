//! Starting points (Waechter and Biegler, section 3.6) and warm starts.

use apsides_iteration::Evaluation;

use crate::augmented::AugmentedSystem;
use crate::engine::Engine;
use crate::error::NlpError;
use crate::model::BarrierModel;
use crate::scaled::ScaledProblem;
use crate::state::SolverState;
use crate::warm_start::WarmStart;

/// A violation relative to the starting point's (at least 1) below which steps may go by the objective alone.
const MIN_VIOLATION: f64 = 1e-4;
/// Bounds farther than this from the start get a smaller multiplier.
const FAR_BOUND: f64 = 1e4;
/// Warm-started multipliers stay within this factor of their central values.
const WARM_SAFEGUARD: f64 = 10.0;

impl Engine {
    /// The problem's starting point, moved inside the bounds, with estimated multipliers.
    pub(crate) fn start_cold(
        &mut self,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
    ) -> Result<(), Evaluation> {
        problem.scaled_start(&mut self.state.current.v);
        let (push, fraction) = (self.state.settings.bound_push, self.state.settings.bound_fraction);
        self.state.bounds.push_inside(&mut self.state.current.v, push, fraction);
        self.state.set_slacks(problem);
        self.state.bounds.push_inside(&mut self.state.current.v, push, fraction);
        self.evaluate_start(problem)?;
        // Bounds as far away as a huge number would make the average complementarity meaningless.
        let multiplier =
            |slack: f64| self.state.settings.initial_bound_multiplier * (FAR_BOUND / slack).min(1.0);
        let (lower_set, upper_set) = (&self.state.bounds.lower_set, &self.state.bounds.upper_set);
        for &i in lower_set {
            self.state.current.zl[i] = multiplier(self.state.current.lower_slack[i]);
        }
        for &i in upper_set {
            self.state.current.zu[i] = multiplier(self.state.current.upper_slack[i]);
        }
        self.state.estimate_multipliers(problem.structure(), system);
        self.state.update_dual_residual(problem);
        Ok(())
    }

    /// The given point and multipliers, moved close to the central path of a small barrier parameter.
    pub(crate) fn start_warm(
        &mut self,
        problem: &mut ScaledProblem<'_>,
        warm: &WarmStart,
    ) -> Result<(), Evaluation> {
        self.take_warm(problem, warm);
        self.state.set_slacks(problem);
        let average = self.state.complementarity_of_start();
        let barrier = warm.barrier.unwrap_or_else(|| {
            average.min(self.state.settings.initial_barrier).max(self.state.settings.warm_start_barrier)
        });
        self.state.barrier = barrier.max(self.state.final_barrier);
        self.state.tau = self.state.settings.boundary_fraction.max(1.0 - self.state.barrier);
        self.state.push_to_central_path();
        self.state.set_slacks(problem);
        self.state.push_to_central_path();
        self.state.measure_current();
        self.state.bounds.safeguard_multipliers(&mut self.state.current, self.state.barrier, WARM_SAFEGUARD);
        self.evaluate_start(problem)
    }

    /// The start of a problem with the multipliers of `warm`; those of slacks follow from their constraints.
    pub(crate) fn take_warm(&mut self, problem: &ScaledProblem<'_>, warm: &WarmStart) {
        problem.scaled_start(&mut self.state.current.v);
        let factors = problem.scaling_factors();
        for (k, &i) in problem.free().iter().enumerate() {
            let factor = factors.objective / factors.variables[i];
            self.state.current.zl[k] = (warm.lower_multipliers[i] * factor).max(0.0);
            self.state.current.zu[k] = (warm.upper_multipliers[i] * factor).max(0.0);
        }
        for (row, &i) in problem.kept().iter().enumerate() {
            self.state.current.y[row] =
                warm.constraint_multipliers[i] * factors.objective / factors.constraints[i];
        }
        let n = problem.structure().variables;
        for (k, unit) in problem.structure().units.iter().enumerate() {
            let y = self.state.current.y[unit.row];
            self.state.current.zl[n + k] = (-y).max(0.0);
            self.state.current.zu[n + k] = y.max(0.0);
        }
        for (i, (zl, zu)) in self.state.current.zl.iter_mut().zip(&mut self.state.current.zu).enumerate() {
            *zl = if self.state.bounds.lower[i].is_finite() { *zl } else { 0.0 };
            *zu = if self.state.bounds.upper[i].is_finite() { *zu } else { 0.0 };
        }
    }

    /// Values and derivatives at the starting point, and the limits that the filter takes from it.
    pub(crate) fn evaluate_start(&mut self, model: &mut impl BarrierModel) -> Result<(), Evaluation> {
        self.state.measure_current();
        if !self.state.current.evaluate(model) {
            let failed_objective = !self.state.current.objective.is_finite();
            return Err(if failed_objective { Evaluation::Objective } else { Evaluation::Constraints });
        }
        self.state.filter.clear();
        self.state.filter.max_violation =
            self.state.settings.largest_violation * self.state.current.violation.max(1.0);
        self.search.min_violation = MIN_VIOLATION * self.state.current.violation.max(1.0);
        self.search.restart();
        self.control.restart();
        self.state.forces_reduction = false;
        self.state.differentiate(model)
    }
}

impl SolverState {
    /// Slacks from the constraint functions at the current `x`.
    pub(crate) fn set_slacks(&mut self, problem: &mut ScaledProblem<'_>) {
        if problem.structure().slacks == 0 {
            return;
        }
        problem.scaled_constraints(&self.current.v, &mut self.current.constraints);
        let structure = problem.structure();
        for (unit, slack) in structure.units.iter().zip(&mut self.current.v[structure.variables..]) {
            let value = self.current.constraints[unit.row];
            *slack = if value.is_finite() { value } else { 0.0 };
        }
    }

    /// Average complementarity of a point that may violate its bounds.
    fn complementarity_of_start(&self) -> f64 {
        let (point, bounds) = (&self.current, &self.bounds);
        let lower = bounds.lower_set.iter().map(|&i| (point.v[i] - bounds.lower[i]).max(0.0) * point.zl[i]);
        let upper = bounds.upper_set.iter().map(|&i| (bounds.upper[i] - point.v[i]).max(0.0) * point.zu[i]);
        lower.chain(upper).sum::<f64>() / bounds.len().max(1) as f64
    }

    /// Moves every variable at least as far from its bound as its multiplier says for this barrier parameter.
    fn push_to_central_path(&mut self) {
        let (barrier, least) = (self.barrier, self.settings.warm_start_push);
        let fraction = self.settings.bound_fraction;
        let distance = |bound: f64, multiplier: f64, width: f64| {
            let central = (barrier / multiplier.max(f64::MIN_POSITIVE)).min(barrier.sqrt());
            (central.max(least) * bound.abs().max(1.0)).min(fraction * width)
        };
        for (i, value) in self.current.v.iter_mut().enumerate() {
            let (low, high) = (self.bounds.lower[i], self.bounds.upper[i]);
            if low.is_finite() {
                *value = value.max(low + distance(low, self.current.zl[i], high - low));
            }
            if high.is_finite() {
                *value = value.min(high - distance(high, self.current.zu[i], high - low));
            }
        }
    }
}

/// Refuses a warm start that does not fit the problem.
///
/// # Errors
/// The first vector of the wrong length or with an entry that is not finite.
pub(crate) fn check_warm_start(warm: &WarmStart, n: usize, m: usize) -> Result<(), NlpError> {
    let vectors = [
        ("warm start x", &warm.x, n),
        ("warm start constraint_multipliers", &warm.constraint_multipliers, m),
        ("warm start lower_multipliers", &warm.lower_multipliers, n),
        ("warm start upper_multipliers", &warm.upper_multipliers, n),
    ];
    for (what, values, expected) in vectors {
        if values.len() != expected {
            return Err(NlpError::Length { what, found: values.len(), expected });
        }
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(NlpError::Start { what, index, value: values[index] });
        }
    }
    if let Some(value) = warm.barrier
        && !(value > 0.0 && value.is_finite())
    {
        return Err(NlpError::Start { what: "warm start barrier", index: 0, value });
    }
    Ok(())
}
