//! The iteration of the primal-dual interior point method, for any [`BarrierModel`].

use std::time::Instant;

use apsides_iteration::{Evaluation, Flow, IterationRecord, Observer, OptimalityError, Residuals, Status};

use crate::augmented::AugmentedSystem;
use crate::barrier::BarrierControl;
use crate::filter::Filter;
use crate::iterate::{Bounds, Direction, Point};
use crate::line_search::{LineSearch, Search};
use crate::model::{BarrierModel, Structure};
use crate::scaled::ScaledProblem;
use crate::settings::NlpSettings;
use crate::step::Regularisation;

/// Multipliers of this average size leave the errors unscaled (Waechter and Biegler, eq. 6).
const MULTIPLIER_SIZE: f64 = 100.0;

/// Why [`Engine::run`] returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// The solve is over.
    Finished(Status),
    /// No acceptable step: the constraint violation has to be reduced by other means.
    NeedsRestoration,
    /// [`BarrierModel::leaves`] was true.
    Left,
}

/// Observer, deadline and iteration counts, which a solve shares with its restoration phases.
pub(crate) struct Session<'a> {
    pub observer: &'a mut dyn Observer,
    pub deadline: Option<Instant>,
    pub iteration: usize,
    pub restoration_iterations: usize,
}

/// The state of the method.
pub(crate) struct Engine {
    pub(crate) settings: NlpSettings,
    pub(crate) bounds: Bounds,
    pub(crate) current: Point,
    pub(crate) trial: Point,
    /// The iterate with the least optimality error.
    pub(crate) best: Point,
    best_error: f64,
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
    pub(crate) step: Direction,
    pub(crate) corrected: Direction,
    pub(crate) barrier: f64,
    /// The least barrier parameter.
    pub(crate) final_barrier: f64,
    pub(crate) tau: f64,
    pub(crate) filter: Filter,
    pub(crate) control: BarrierControl,
    pub(crate) regularisation: Regularisation,
    pub(crate) search: LineSearch,
    pub(crate) errors: OptimalityError,
    acceptable_in_a_row: usize,
    steps: usize,
}

impl Engine {
    /// An engine for a model; its least barrier parameter is one that meets the tolerances of the unscaled problem.
    pub(crate) fn for_model(model: &impl BarrierModel, settings: &NlpSettings) -> Self {
        let unit = model.residual_units().map_or(1.0, |units| units.complementarity);
        let final_barrier = settings.final_barrier(unit);
        Self { final_barrier, ..Self::new(model.structure(), model.lower(), model.upper(), settings) }
    }

    pub(crate) fn new(structure: &Structure, lower: &[f64], upper: &[f64], settings: &NlpSettings) -> Self {
        let (n, m) = (structure.primal(), structure.constraints);
        Self {
            settings: settings.clone(),
            bounds: Bounds::new(lower, upper),
            current: Point::new(n, m),
            trial: Point::new(n, m),
            best: Point::new(n, m),
            best_error: f64::INFINITY,
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
            tau: settings.boundary_fraction,
            filter: Filter::new(),
            control: BarrierControl::new(settings),
            regularisation: Regularisation::default(),
            search: LineSearch::new(n, m),
            errors: OptimalityError::default(),
            acceptable_in_a_row: 0,
            steps: 0,
        }
    }

    /// Iterates from the current point until something has to be decided elsewhere.
    pub(crate) fn run<M: BarrierModel>(
        &mut self,
        model: &mut M,
        system: &mut AugmentedSystem,
        session: &mut Session<'_>,
    ) -> Exit {
        self.steps = 0;
        loop {
            self.measure_errors(model);
            if self.report(model, session) == Flow::Stop {
                return Exit::Finished(Status::Interrupted);
            }
            if self.steps > 0 && model.leaves(&self.current.v) {
                return Exit::Left;
            }
            if let Some(status) = self.verdict(session) {
                return Exit::Finished(status);
            }
            self.update_monotone(model);
            session.iteration += 1;
            session.restoration_iterations += usize::from(model.is_restoration());
            model.hessian(&self.current.v, &self.current.y, &mut self.hessian, &mut self.diagonal);
            if self.hessian.iter().any(|value| !value.is_finite()) {
                return Exit::Finished(Status::EvaluationFailed(Evaluation::Hessian));
            }
            if !self.find_direction(model, system) {
                return self.no_step();
            }
            match self.line_search(model, system) {
                Search::Accepted => self.steps += 1,
                Search::Stalled => return Exit::Finished(self.stalled_status()),
                Search::Failed => return self.no_step(),
            }
        }
    }

    /// Fresh gradient, Jacobian and dual residual at the current point; false if something is not finite.
    pub(crate) fn differentiate(&mut self, model: &mut impl BarrierModel) -> Result<(), Evaluation> {
        model.gradient(&self.current.v, &mut self.gradient);
        if self.gradient.iter().any(|value| !value.is_finite()) {
            return Err(Evaluation::Gradient);
        }
        model.jacobian(&self.current.v, &mut self.jacobian);
        if self.jacobian.iter().any(|value| !value.is_finite()) {
            return Err(Evaluation::Jacobian);
        }
        self.update_dual_residual(model);
        Ok(())
    }

    pub(crate) fn update_dual_residual(&mut self, model: &impl BarrierModel) {
        let point = &self.current;
        for (i, residual) in self.dual_residual.iter_mut().enumerate() {
            *residual = self.gradient[i] - point.zl[i] + point.zu[i];
        }
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
        self.search.barrier_changed();
        if model.barrier_changed(barrier) {
            self.current.objective = model.objective(&self.current.v);
            model.gradient(&self.current.v, &mut self.gradient);
            self.update_dual_residual(model);
        }
    }

    /// Divisors of dual infeasibility and complementarity.
    fn error_divisors(&self) -> (f64, f64) {
        let point = &self.current;
        let bounds: f64 = point.zl.iter().chain(&point.zu).sum();
        let constraints: f64 = point.y.iter().map(|y| y.abs()).sum();
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

    fn measure_errors(&mut self, model: &impl BarrierModel) {
        let (dual, complementarity) = self.error_divisors();
        let raw = Residuals {
            dual_infeasibility: max_abs(&self.dual_residual),
            primal_infeasibility: max_abs(&self.current.constraints),
            complementarity: self.bounds.complementarity_error(&self.current, 0.0),
        };
        let scaled = Residuals {
            dual_infeasibility: raw.dual_infeasibility / dual,
            complementarity: raw.complementarity / complementarity,
            ..raw
        };
        let unscaled = match model.residual_units() {
            Some(units) => Residuals {
                dual_infeasibility: max_product(&self.dual_residual, &units.dual),
                primal_infeasibility: max_product(&self.current.constraints, &units.primal),
                complementarity: raw.complementarity * units.complementarity,
            },
            None => raw,
        };
        self.errors = OptimalityError { scaled, unscaled };
        if scaled.max() < self.best_error || self.best_error == f64::INFINITY {
            self.best_error = scaled.max();
            self.best.copy_from(&self.current);
        }
    }

    fn report(&self, model: &impl BarrierModel, session: &mut Session<'_>) -> Flow {
        let objective = model.residual_units().map_or(1.0, |units| units.objective) * self.current.objective;
        session.observer.iteration(&IterationRecord {
            iteration: session.iteration,
            restoration: model.is_restoration(),
            objective,
            primal_infeasibility: self.errors.scaled.primal_infeasibility,
            dual_infeasibility: self.errors.scaled.dual_infeasibility,
            barrier: self.barrier,
            step_norm: self.search.step_norm,
            regularisation: self.regularisation.used,
            dual_step: self.search.dual_step,
            primal_step: self.search.primal_step,
            line_search_trials: self.search.trials,
            step_kind: self.search.kind,
        })
    }

    fn verdict(&mut self, session: &Session<'_>) -> Option<Status> {
        if self.is_optimal() {
            return Some(Status::Optimal);
        }
        let settings = &self.settings;
        if self.is_acceptable() {
            self.acceptable_in_a_row += 1;
            if settings.acceptable_iterations > 0
                && self.acceptable_in_a_row >= settings.acceptable_iterations
            {
                return Some(Status::Acceptable);
            }
        } else {
            self.acceptable_in_a_row = 0;
        }
        if self.diverges() {
            return Some(Status::Diverging);
        }
        if session.iteration >= settings.max_iterations {
            return Some(Status::IterationLimit);
        }
        if session.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return Some(Status::TimeLimit);
        }
        None
    }

    /// Returns true if the point is too far away, or the objective too low at a point that is feasible but for rounding.
    fn diverges(&self) -> bool {
        let (settings, largest) = (&self.settings, max_abs(&self.current.v));
        let feasible = self.errors.scaled.primal_infeasibility <= settings.tolerance * largest.max(1.0);
        largest > settings.diverging_threshold
            || (feasible && self.current.objective < -settings.unbounded_objective)
    }

    fn is_optimal(&self) -> bool {
        let (settings, unscaled) = (&self.settings, &self.errors.unscaled);
        self.errors.scaled.max() <= settings.tolerance
            && unscaled.dual_infeasibility <= settings.dual_tolerance
            && unscaled.primal_infeasibility <= settings.constraint_tolerance
            && unscaled.complementarity <= settings.complementarity_tolerance
    }

    fn is_acceptable(&self) -> bool {
        let (settings, unscaled) = (&self.settings, &self.errors.unscaled);
        self.errors.scaled.max() <= settings.acceptable_tolerance
            && unscaled.dual_infeasibility <= settings.acceptable_dual_tolerance
            && unscaled.primal_infeasibility <= settings.acceptable_constraint_tolerance
            && unscaled.complementarity <= settings.acceptable_complementarity_tolerance
    }

    /// The exit when no step is acceptable: at an almost feasible point a restoration phase cannot help.
    fn no_step(&self) -> Exit {
        if self.is_acceptable() {
            return Exit::Finished(Status::Acceptable);
        }
        if self.errors.scaled.primal_infeasibility <= 1e-2 * self.settings.tolerance {
            return Exit::Finished(Status::StepTooSmall);
        }
        Exit::NeedsRestoration
    }

    fn stalled_status(&self) -> Status {
        if self.is_acceptable() { Status::Acceptable } else { Status::StepTooSmall }
    }

    /// Forgets the best iterate and the regularisation of an earlier run.
    pub(crate) fn forget_past(&mut self) {
        self.best_error = f64::INFINITY;
        self.acceptable_in_a_row = 0;
        self.regularisation = Regularisation::default();
    }

    /// Puts the variables of an optimal point between the user's bounds, with the errors measured there; false, and the
    /// point as it was, if it is not optimal there.
    pub(crate) fn ends_inside(&mut self, problem: &mut ScaledProblem<'_>) -> bool {
        // The trial point is not needed any more.
        self.trial.copy_from(&self.current);
        let errors = self.errors;
        if !problem.move_inside(&mut self.current.v) {
            return true;
        }
        if self.current.evaluate(problem) && self.differentiate(problem).is_ok() {
            self.measure_errors(problem);
            if self.is_optimal() {
                return true;
            }
        }
        self.current.copy_from(&self.trial);
        self.errors = errors;
        false
    }

    /// Goes back to the iterate with the least optimality error.
    pub(crate) fn recall_best(&mut self, model: &mut impl BarrierModel) {
        self.current.copy_from(&self.best);
        if self.differentiate(model).is_ok() {
            self.measure_errors(model);
        }
    }
}

/// Largest absolute entry.
pub(crate) fn max_abs(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

fn max_product(values: &[f64], factors: &[f64]) -> f64 {
    values.iter().zip(factors).fold(0.0, |largest, (value, factor)| largest.max((value * factor).abs()))
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
