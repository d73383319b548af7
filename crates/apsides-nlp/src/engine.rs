//! The iteration of the primal-dual interior point method, for any [`BarrierModel`].

use std::time::Instant;

use apsides_iteration::{Evaluation, Flow, IterationRecord, Observer, OptimalityError, Residuals, Status};

use crate::augmented::AugmentedSystem;
use crate::barrier::BarrierControl;
use crate::iterate::Point;
use crate::line_search::{LineSearch, Search};
use crate::model::{BarrierModel, Structure};
use crate::scaled::ScaledProblem;
use crate::settings::NlpSettings;
use crate::state::SolverState;
use crate::step::Regularisation;
use crate::vector::{all_finite, max_abs, max_product};

/// The reason for which [`Engine::run`] returned.
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

/// The method: the shared state, the strategies that act on it, and what ends it.
pub(crate) struct Engine {
    pub(crate) state: SolverState,
    pub(crate) control: BarrierControl,
    regularisation: Regularisation,
    pub(crate) search: LineSearch,
    /// The iterate with the least optimality error.
    best: Point,
    best_error: f64,
    acceptable_in_a_row: usize,
    /// The objective at the first iterate.
    first_objective: Option<f64>,
    steps: usize,
}

impl Engine {
    /// An engine for a model; its least barrier parameter is one that meets the tolerances of the unscaled problem.
    pub(crate) fn for_model(model: &impl BarrierModel, settings: &NlpSettings) -> Self {
        let unit = model.residual_units().map_or(1.0, |units| units.complementarity);
        let final_barrier = settings.final_barrier(unit);
        let mut engine = Self::new(model.structure(), model.lower(), model.upper(), settings);
        engine.state.final_barrier = final_barrier;
        engine
    }

    pub(crate) fn new(structure: &Structure, lower: &[f64], upper: &[f64], settings: &NlpSettings) -> Self {
        let (n, m) = (structure.primal(), structure.constraints);
        Self {
            state: SolverState::new(structure, lower, upper, settings),
            control: BarrierControl::new(settings),
            regularisation: Regularisation::default(),
            search: LineSearch::new(n, m),
            best: Point::new(n, m),
            best_error: f64::INFINITY,
            acceptable_in_a_row: 0,
            first_objective: None,
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
            if self.steps > 0 && model.leaves(&self.state.current.v) {
                return Exit::Left;
            }
            if let Some(status) = self.verdict(session) {
                return Exit::Finished(status);
            }
            self.control.update_monotone(&mut self.state, model);
            session.iteration += 1;
            session.restoration_iterations += usize::from(model.is_restoration());
            let state = &mut self.state;
            model.hessian(&state.current.v, &state.current.y, &mut state.hessian, &mut state.diagonal);
            if !all_finite(&state.hessian) {
                return Exit::Finished(Status::EvaluationFailed(Evaluation::Hessian));
            }
            if !self.regularisation.find_direction(state, &mut self.control, model, system) {
                return self.no_step();
            }
            match self.search.run(&mut self.state, model, system) {
                Search::Accepted => self.steps += 1,
                Search::Stalled => return Exit::Finished(self.stalled_status()),
                Search::Failed => return self.no_step(),
            }
        }
    }

    pub(crate) fn measure_errors(&mut self, model: &impl BarrierModel) {
        let (dual, complementarity) = self.state.error_divisors();
        let raw = Residuals {
            dual_infeasibility: max_abs(&self.state.dual_residual),
            primal_infeasibility: max_abs(&self.state.current.constraints),
            complementarity: self.state.bounds.complementarity_error(&self.state.current, 0.0),
        };
        let scaled = Residuals {
            dual_infeasibility: raw.dual_infeasibility / dual,
            complementarity: raw.complementarity / complementarity,
            ..raw
        };
        let unscaled = match model.residual_units() {
            Some(units) => Residuals {
                dual_infeasibility: max_product(&self.state.dual_residual, &units.dual),
                primal_infeasibility: max_product(&self.state.current.constraints, &units.primal),
                complementarity: raw.complementarity * units.complementarity,
            },
            None => raw,
        };
        self.state.errors = OptimalityError { scaled, unscaled };
        if scaled.max() < self.best_error || self.best_error == f64::INFINITY {
            self.best_error = scaled.max();
            self.best.copy_from(&self.state.current);
        }
    }

    fn report(&self, model: &impl BarrierModel, session: &mut Session<'_>) -> Flow {
        let objective =
            model.residual_units().map_or(1.0, |units| units.objective) * self.state.current.objective;
        session.observer.iteration(&IterationRecord {
            iteration: session.iteration,
            restoration: model.is_restoration(),
            objective,
            primal_infeasibility: self.state.errors.scaled.primal_infeasibility,
            dual_infeasibility: self.state.errors.scaled.dual_infeasibility,
            barrier: self.state.barrier,
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
        let first = *self.first_objective.get_or_insert(self.state.current.objective);
        let settings = &self.state.settings;
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
        if self.diverges_from(first) {
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

    /// Returns true if the point is too far away, or the objective too low beside the first one, at a point that is feasible but for
    /// rounding.
    fn diverges_from(&self, first: f64) -> bool {
        let (settings, largest) = (&self.state.settings, max_abs(&self.state.current.v));
        let feasible = self.state.errors.scaled.primal_infeasibility <= settings.tolerance * largest.max(1.0);
        largest > settings.diverging_threshold
            || (feasible
                && self.state.current.objective < first - settings.unbounded_objective * first.abs().max(1.0))
    }

    pub(crate) fn is_optimal(&self) -> bool {
        let (settings, unscaled) = (&self.state.settings, &self.state.errors.unscaled);
        self.state.errors.scaled.max() <= settings.tolerance
            && unscaled.dual_infeasibility <= settings.dual_tolerance
            && unscaled.primal_infeasibility <= settings.constraint_tolerance
            && unscaled.complementarity <= settings.complementarity_tolerance
    }

    fn is_acceptable(&self) -> bool {
        let (settings, unscaled) = (&self.state.settings, &self.state.errors.unscaled);
        self.state.errors.scaled.max() <= settings.acceptable_tolerance
            && unscaled.dual_infeasibility <= settings.acceptable_dual_tolerance
            && unscaled.primal_infeasibility <= settings.acceptable_constraint_tolerance
            && unscaled.complementarity <= settings.acceptable_complementarity_tolerance
    }

    /// The exit when no step is acceptable: at an almost feasible point a restoration phase cannot help.
    fn no_step(&self) -> Exit {
        if self.is_acceptable() {
            return Exit::Finished(Status::Acceptable);
        }
        if self.state.errors.scaled.primal_infeasibility <= 1e-2 * self.state.settings.tolerance {
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
        self.state.trial.copy_from(&self.state.current);
        let errors = self.state.errors;
        if !problem.move_inside(&mut self.state.current.v) {
            return true;
        }
        if self.state.current.evaluate(problem) && self.state.differentiate(problem).is_ok() {
            self.measure_errors(problem);
            if self.is_optimal() {
                return true;
            }
        }
        self.state.current.copy_from(&self.state.trial);
        self.state.errors = errors;
        false
    }

    /// Returns true if the last matrix had the inertia of a minimum without regularisation.
    pub(crate) fn has_regular_curvature(&self) -> bool {
        self.steps > 0 && self.regularisation.used == 0.0
    }

    /// Goes back to an earlier point.
    pub(crate) fn return_to(&mut self, model: &mut impl BarrierModel, point: &Point) {
        self.best.copy_from(point);
        self.recall_best(model);
    }

    /// Returns true if the objective is lower than at the iterate with the least optimality error, by this part of its size.
    pub(crate) fn is_lower_than_best(&self, problem: &ScaledProblem<'_>, part: f64) -> bool {
        let best = self.best.objective;
        self.state.current.objective < best - part * problem.size_of_objective(best)
    }

    /// Goes back to the iterate with the least optimality error.
    pub(crate) fn recall_best(&mut self, model: &mut impl BarrierModel) {
        self.state.current.copy_from(&self.best);
        if self.state.differentiate(model).is_ok() {
            self.measure_errors(model);
        }
    }
}
