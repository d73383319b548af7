//! The search direction: regularised factorisation and solves (Waechter and Biegler, eq. 11-13 and algorithm IC).

use crate::augmented::{AugmentedSystem, Newton};
use crate::barrier::BarrierControl;
use crate::iterate::{Bounds, Direction, Point};
use crate::model::{BarrierModel, Structure};
use crate::state::SolverState;
use crate::vector::{in_vectors, max_abs, sum_abs};

/// Growth of the primal regularisation when nothing is known of its size.
const FIRST_GROWTH: f64 = 100.0;
/// Growth when an earlier iteration needed one.
const GROWTH: f64 = 8.0;
/// Decrease from one iteration to the next.
const DECREASE: f64 = 1.0 / 3.0;
/// Largest first trial relative to the Hessian.
const LARGEST_TRIAL: f64 = 1e6;
/// Least primal regularisation.
const LEAST: f64 = 1e-20;
/// A smaller error of the barrier problem is close to its solution: there, the step without regularisation converges
/// faster, and it is tried at each iteration.
const CLOSE: f64 = 1e-3;
/// A linear system with a larger relative residual counts as singular.
pub(crate) const SINGULAR_RESIDUAL: f64 = 1e-5;

/// A step that leaves more than this part of the linearised violation is of no use.
const LINEARISED_REDUCTION: f64 = 0.5;

/// Memory of algorithm IC (inertia correction).
#[derive(Debug, Clone, Default)]
pub(crate) struct Regularisation {
    /// The last primal regularisation that was not zero.
    last: f64,
    /// The primal regularisation of the current factor.
    pub used: f64,
    /// True when the matrix of the iteration before was not factorised without regularisation.
    presumed: bool,
}

impl Regularisation {
    /// Factorises the system at the current point and finds the search direction, with the barrier parameter chosen
    /// on the way in the adaptive strategy. False if no regularisation gives a useful one.
    pub(crate) fn find_direction(
        &mut self,
        state: &mut SolverState,
        control: &mut BarrierControl,
        model: &mut impl BarrierModel,
        system: &mut AugmentedSystem,
    ) -> bool {
        for &i in &state.bounds.lower_set {
            state.diagonal[i] += state.current.zl[i] / state.current.lower_slack[i];
        }
        for &i in &state.bounds.upper_set {
            state.diagonal[i] += state.current.zu[i] / state.current.upper_slack[i];
        }
        system.load(Some(&state.hessian), &state.diagonal, &state.jacobian);
        let free = control.enters_free_mode(state, model);
        let first_barrier = if free { 0.0 } else { state.barrier };
        // Without bounds the direction does not depend on the barrier parameter.
        let centres = free && state.bounds.len() > 0;
        if !self.factor_and_solve(state, model.structure(), system, first_barrier, centres) {
            return false;
        }
        if free {
            let barrier = control.choose_barrier(state);
            state.set_barrier(model, barrier);
            if centres {
                add_scaled(&mut state.step, &state.corrected, barrier);
            }
        }
        state.fill_barrier_gradient();
        true
    }

    /// The first regularisation to try: none, except far from the solution where the iteration before found that it needs one. That saves the
    /// factorisation that says so again; for more iterations in a row, steps stay short that could be long.
    fn presumes(&mut self, state: &SolverState) -> f64 {
        let close = state.barrier_error(state.barrier) < CLOSE;
        self.presumed = self.used > 0.0 && !close && !self.presumed;
        if self.presumed { self.next_after(state) } else { 0.0 }
    }

    /// The first regularisation to try after the last one that was used.
    fn next_after(&self, state: &SolverState) -> f64 {
        (DECREASE * self.last).min(state.largest_useful_regularisation()).max(LEAST)
    }

    /// Algorithm IC: the least regularisation for which the system has as many positive eigenvalues as there are
    /// variables, and is solved accurately. If `centres`, the centring direction is found, too.
    fn factor_and_solve(
        &mut self,
        state: &mut SolverState,
        structure: &Structure,
        system: &mut AugmentedSystem,
        barrier: f64,
        centres: bool,
    ) -> bool {
        let (mut primal, mut dual) = (self.presumes(state), 0.0);
        loop {
            let inertia = system.factor(structure, &state.diagonal, primal, dual);
            let mut singular = inertia.is_none_or(|inertia| inertia.zero > 0);
            let correct = inertia.is_some_and(|inertia| inertia.negative == structure.constraints);
            if correct && !singular {
                let residual = state.solve_for_barrier(structure, system, barrier, centres);
                if residual <= SINGULAR_RESIDUAL {
                    break;
                }
                singular = true;
            }
            if singular && dual == 0.0 && structure.constraints > 0 {
                dual = state.settings.dual_regularisation * state.barrier.powf(0.25);
                continue;
            }
            let last = self.last;
            primal = match (primal == 0.0, last == 0.0) {
                (true, true) => state.settings.first_regularisation,
                (true, false) => self.next_after(state),
                (false, true) => FIRST_GROWTH * primal,
                (false, false) => GROWTH * primal,
            };
            if primal > state.settings.max_regularisation {
                self.used = primal;
                return false;
            }
        }
        self.used = primal;
        if primal > 0.0 {
            self.last = primal;
        }
        state.reduces_violation(dual)
    }
}

impl SolverState {
    /// Far above the size of the Hessian: a larger first trial only comes from an earlier point with a larger one.
    fn largest_useful_regularisation(&self) -> f64 {
        LARGEST_TRIAL * max_abs(&self.hessian).max(self.settings.first_regularisation)
    }

    /// Returns true if the step reduces the linearised constraints. With dual regularisation it leaves `dual_shift * dy` of
    /// them, which is all where a Jacobian row vanishes: many such steps lead nowhere.
    fn reduces_violation(&self, dual_shift: f64) -> bool {
        let left = dual_shift * sum_abs(&self.step.y);
        left <= LINEARISED_REDUCTION * self.current.violation
            || self.errors.scaled.primal_infeasibility <= self.settings.tolerance
    }

    /// The direction of the barrier problem with parameter `barrier`, into `step`; its derivative with respect to the barrier parameter, too,
    /// into `corrected`, if `centres`. Returns the relative residual of the first.
    fn solve_for_barrier(
        &mut self,
        structure: &Structure,
        system: &mut AugmentedSystem,
        barrier: f64,
        centres: bool,
    ) -> f64 {
        let (point, rhs) = (&self.current, &mut self.work);
        let damping = barrier * self.settings.damping;
        in_vectors(|| {
            let n = rhs.len();
            let (zl, zu, dual_residual) = (&point.zl[..n], &point.zu[..n], &self.dual_residual[..n]);
            let (below, above, single) =
                (&point.lower_slack[..n], &point.upper_slack[..n], &self.bounds.single[..n]);
            for i in 0..n {
                rhs[i] = dual_residual[i] + zl[i] - zu[i] - barrier / below[i]
                    + barrier / above[i]
                    + damping * single[i];
            }
        });
        if centres {
            self.prepare_centring();
        }
        let (point, step, course) = (&self.current, &mut self.step, &mut self.corrected);
        let newton =
            Newton { primal: &self.work, dual: &point.constraints, dv: &mut step.v, dy: &mut step.y };
        let residual = if centres {
            let dual = &self.trial.constraints;
            let centring =
                Newton { primal: &self.barrier_gradient, dual, dv: &mut course.v, dy: &mut course.y };
            let [residual, _] = system.solve(structure, &self.jacobian, [newton, centring]);
            complete_centring(&self.bounds, point, course);
            residual
        } else {
            let [residual] = system.solve(structure, &self.jacobian, [newton]);
            residual
        };
        complete_bound_multipliers(&self.bounds, point, step, barrier);
        residual
    }

    /// Derivative of the direction with respect to the barrier parameter, into `corrected`.
    pub(crate) fn find_centring(&mut self, structure: &Structure, system: &mut AugmentedSystem) {
        self.prepare_centring();
        let course = &mut self.corrected;
        let dual = &self.trial.constraints;
        let centring = Newton { primal: &self.barrier_gradient, dual, dv: &mut course.v, dy: &mut course.y };
        system.solve(structure, &self.jacobian, [centring]);
        complete_centring(&self.bounds, &self.current, course);
    }

    /// The residuals of the centring direction. The barrier gradient and the trial's constraints are free to hold them until the direction
    /// is found.
    fn prepare_centring(&mut self) {
        let point = &self.current;
        let (rhs, damping) = (&mut self.barrier_gradient, self.settings.damping);
        in_vectors(|| {
            let n = rhs.len();
            let (below, above, single) =
                (&point.lower_slack[..n], &point.upper_slack[..n], &self.bounds.single[..n]);
            for i in 0..n {
                rhs[i] = 1.0 / above[i] - 1.0 / below[i] + damping * single[i];
            }
        });
        self.trial.constraints.fill(0.0);
    }

    /// The direction of a second-order correction, into `corrected`: with the given constraints instead of those of
    /// the current point.
    pub(crate) fn find_correction(
        &mut self,
        structure: &Structure,
        system: &mut AugmentedSystem,
        constraints: &[f64],
    ) -> bool {
        let (point, rhs) = (&self.current, &mut self.work);
        for (i, rhs) in rhs.iter_mut().enumerate() {
            *rhs = self.barrier_gradient[i] + self.dual_residual[i] - self.gradient[i] + point.zl[i]
                - point.zu[i];
        }
        let step = &mut self.corrected;
        let newton = Newton { primal: rhs, dual: constraints, dv: &mut step.v, dy: &mut step.y };
        let [residual] = system.solve(structure, &self.jacobian, [newton]);
        complete_bound_multipliers(&self.bounds, point, step, self.barrier);
        residual <= SINGULAR_RESIDUAL
    }

    /// Gradient of the barrier function.
    fn fill_barrier_gradient(&mut self) {
        let point = &self.current;
        let damping = self.barrier * self.settings.damping;
        let (values, barrier) = (&mut self.barrier_gradient, self.barrier);
        in_vectors(|| {
            let n = values.len();
            let (below, above, single) =
                (&point.lower_slack[..n], &point.upper_slack[..n], &self.bounds.single[..n]);
            let gradient = &self.gradient[..n];
            for i in 0..n {
                values[i] = gradient[i] - barrier / below[i] + barrier / above[i] + damping * single[i];
            }
        });
    }

    /// Least-squares constraint multipliers at the current point (Waechter and Biegler, eq. 36), zero if they are
    /// large.
    pub(crate) fn estimate_multipliers(&mut self, structure: &Structure, system: &mut AugmentedSystem) {
        self.diagonal.fill(1.0);
        system.load(None, &self.diagonal, &self.jacobian);
        let point = &mut self.current;
        point.y.fill(0.0);
        for (i, rhs) in self.work.iter_mut().enumerate() {
            *rhs = self.gradient[i] - point.zl[i] + point.zu[i];
        }
        self.trial.constraints.fill(0.0);
        let factored = system.factor(structure, &self.diagonal, 0.0, 0.0).is_some();
        let step = &mut self.step;
        let residual = if factored {
            let zero = &self.trial.constraints;
            let newton = Newton { primal: &self.work, dual: zero, dv: &mut step.v, dy: &mut step.y };
            let [residual] = system.solve(structure, &self.jacobian, [newton]);
            residual
        } else {
            f64::INFINITY
        };
        let largest = step.y.iter().fold(0.0_f64, |largest, y| largest.max(y.abs()));
        if residual <= SINGULAR_RESIDUAL && largest <= self.settings.multiplier_limit {
            point.y.copy_from_slice(&step.y);
        }
    }
}

/// The steps of the bound multipliers that belong to `step.v` (Waechter and Biegler, eq. 12).
pub(crate) fn complete_bound_multipliers(bounds: &Bounds, point: &Point, step: &mut Direction, barrier: f64) {
    for &i in &bounds.lower_set {
        step.zl[i] = (barrier - point.zl[i] * step.v[i]) / point.lower_slack[i] - point.zl[i];
    }
    for &i in &bounds.upper_set {
        step.zu[i] = (barrier + point.zu[i] * step.v[i]) / point.upper_slack[i] - point.zu[i];
    }
}

/// The same of the derivative with respect to the barrier parameter.
fn complete_centring(bounds: &Bounds, point: &Point, course: &mut Direction) {
    for &i in &bounds.lower_set {
        course.zl[i] = (1.0 - point.zl[i] * course.v[i]) / point.lower_slack[i];
    }
    for &i in &bounds.upper_set {
        course.zu[i] = (1.0 + point.zu[i] * course.v[i]) / point.upper_slack[i];
    }
}

fn add_scaled(step: &mut Direction, other: &Direction, factor: f64) {
    let add = |out: &mut [f64], values: &[f64]| {
        for (out, value) in out.iter_mut().zip(values) {
            *out += factor * value;
        }
    };
    add(&mut step.v, &other.v);
    add(&mut step.y, &other.y);
    add(&mut step.zl, &other.zl);
    add(&mut step.zu, &other.zu);
}
