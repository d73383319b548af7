//! The state that the parts of the iteration share: points, derivatives, search directions, barrier parameter, filter.

use apsides_iteration::{Evaluation, OptimalityError};

use crate::filter::Filter;
use crate::iterate::{Bounds, Direction, Point};
use crate::model::{BarrierModel, Structure};
use crate::settings::NlpSettings;
use crate::vector::{all_finite, in_vectors, max_abs, sum, sum_abs};

/// Multipliers of this average size leave the errors unscaled (Waechter and Biegler, eq. 6).
const MULTIPLIER_SIZE: f64 = 100.0;

/// Current and trial point with their derivatives, the search directions, the barrier parameter and the filter. All
/// vectors are allocated once.
pub(crate) struct SolverState {
    pub(crate) settings: NlpSettings,
    pub(crate) bounds: Bounds,
    pub(crate) current: Point,
    pub(crate) trial: Point,
    pub(crate) gradient: Vec<f64>,
    pub(crate) trial_gradient: Vec<f64>,
    pub(crate) jacobian: Vec<f64>,
    pub(crate) trial_jacobian: Vec<f64>,
    pub(crate) hessian: Vec<f64>,
    /// Diagonal of the Hessian outside its pattern plus `Sigma`.
    pub(crate) diagonal: Vec<f64>,
    /// Gradient of the Lagrangian, `grad f + J^T y - zl + zu`.
    pub(crate) dual_residual: Vec<f64>,
    pub(crate) barrier_gradient: Vec<f64>,
    pub(crate) work: Vec<f64>,
    /// The search direction.
    pub(crate) step: Direction,
    /// The centring direction, then that of a second-order correction.
    pub(crate) corrected: Direction,
    pub(crate) barrier: f64,
    /// The least barrier parameter.
    pub(crate) final_barrier: f64,
    /// The barrier parameter has changed since the last line search.
    pub(crate) barrier_is_new: bool,
    /// The steps have become tiny: the barrier parameter is to be reduced whatever the error.
    pub(crate) forces_reduction: bool,
    /// Part of the distance to a bound that a step may take.
    pub(crate) tau: f64,
    pub(crate) filter: Filter,
    /// Errors of the current point.
    pub(crate) errors: OptimalityError,
}

impl SolverState {
    pub(crate) fn new(structure: &Structure, lower: &[f64], upper: &[f64], settings: &NlpSettings) -> Self {
        let (n, m) = (structure.primal(), structure.constraints);
        Self {
            settings: settings.clone(),
            bounds: Bounds::new(lower, upper),
            current: Point::new(n, m),
            trial: Point::new(n, m),
            gradient: vec![0.0; n],
            trial_gradient: vec![0.0; n],
            jacobian: vec![0.0; structure.jacobian.len()],
            trial_jacobian: vec![0.0; structure.jacobian.len()],
            hessian: vec![0.0; structure.hessian.len()],
            diagonal: vec![0.0; n],
            dual_residual: vec![0.0; n],
            barrier_gradient: vec![0.0; n],
            work: vec![0.0; n],
            step: Direction::new(n, m),
            corrected: Direction::new(n, m),
            barrier: settings.initial_barrier,
            final_barrier: settings.final_barrier(1.0),
            barrier_is_new: false,
            forces_reduction: false,
            tau: settings.boundary_fraction,
            filter: Filter::new(),
            errors: OptimalityError::default(),
        }
    }

    /// Measures the distances of the trial point to its bounds.
    pub(crate) fn measure_trial(&mut self) {
        self.bounds.measure(&mut self.trial, Some(&self.current), self.barrier, self.final_barrier);
    }

    /// Measures the distances of the current point to its bounds.
    pub(crate) fn measure_current(&mut self) {
        self.bounds.measure(&mut self.current, None, self.barrier, self.final_barrier);
    }

    /// Evaluates gradient, Jacobian and dual residual at the current point.
    ///
    /// # Errors
    /// The function whose derivative is not finite.
    pub(crate) fn differentiate(&mut self, model: &mut impl BarrierModel) -> Result<(), Evaluation> {
        model.gradient(&self.current.v, &mut self.gradient);
        if !all_finite(&self.gradient) {
            return Err(Evaluation::Gradient);
        }
        model.jacobian(&self.current.v, &mut self.jacobian);
        if !all_finite(&self.jacobian) {
            return Err(Evaluation::Jacobian);
        }
        self.update_dual_residual(model);
        Ok(())
    }

    /// Gradient of the Lagrangian from the present gradient, Jacobian and multipliers.
    pub(crate) fn update_dual_residual(&mut self, model: &impl BarrierModel) {
        let point = &self.current;
        let residual = &mut self.dual_residual;
        in_vectors(|| {
            let n = residual.len();
            let (gradient, zl, zu) = (&self.gradient[..n], &point.zl[..n], &point.zu[..n]);
            for i in 0..n {
                residual[i] = gradient[i] - zl[i] + zu[i];
            }
        });
        model.structure().add_transpose_product(&self.jacobian, &point.y, &mut self.dual_residual);
    }

    /// Value of the barrier function.
    pub(crate) fn barrier_value(&self, point: &Point) -> f64 {
        point.objective + self.barrier * self.bounds.barrier_term(point, self.settings.damping)
    }

    /// Sets the barrier parameter and what follows from it.
    pub(crate) fn set_barrier(&mut self, model: &mut impl BarrierModel, barrier: f64) {
        self.barrier = barrier;
        self.tau = self.settings.boundary_fraction.max(1.0 - barrier);
        self.filter.clear();
        self.barrier_is_new = true;
        if model.barrier_changed(barrier) {
            self.current.objective = model.objective(&self.current.v);
            model.gradient(&self.current.v, &mut self.gradient);
            self.update_dual_residual(model);
        }
    }

    /// Divisors of dual infeasibility and complementarity.
    pub(crate) fn error_divisors(&self) -> (f64, f64) {
        let point = &self.current;
        let bounds = sum(&point.zl, |z| *z) + sum(&point.zu, |z| *z);
        let constraints = sum_abs(&point.y);
        let count = self.bounds.len();
        let divisor =
            |sum: f64, terms: usize| (sum / terms.max(1) as f64).max(MULTIPLIER_SIZE) / MULTIPLIER_SIZE;
        (divisor(bounds + constraints, count + point.y.len()), divisor(bounds, count))
    }

    /// The optimality error of the barrier problem (Waechter and Biegler, eq. 5).
    pub(crate) fn barrier_error(&self, barrier: f64) -> f64 {
        let (dual, complementarity) = self.error_divisors();
        let infeasibility = max_abs(&self.dual_residual) / dual;
        infeasibility
            .max(max_abs(&self.current.constraints))
            .max(self.bounds.complementarity_error(&self.current, barrier) / complementarity)
    }
}
