//! The solver: sets a solve up, alternates between the engine and the restoration phase, and reports in the user's
//! units.

use std::time::Instant;

use apsides_iteration::{
    Counters, Observer, OptimalityError, Residuals, SolveReport, Status, Timing, Violation,
};

use crate::augmented::AugmentedSystem;
use crate::engine::{Engine, Exit, Session};
use crate::error::NlpError;
use crate::model::BarrierModel;
use crate::problem::Nlp;
use crate::restoration::{Recovery, Restoration};
use crate::scaled::ScaledProblem;
use crate::sensitivity::{ActiveConstraints, Curvature, Sensitivity};
use crate::settings::NlpSettings;
use crate::start::check_warm_start;
use crate::warm_start::WarmStart;

/// Restorations that end at a feasible point without the filter's consent, per solve.
const MAX_FILTER_OVERRIDES: usize = 5;

/// Least gain of the objective, relative to its size, for which a saddle is left.
const BETTER: f64 = 1e-4;

/// Most iterations of one way out of a saddle.
const ESCAPE_ITERATIONS: usize = 100;

/// The interior point method with filter line search of Waechter and Biegler (2006).
#[derive(Debug, Clone, Default)]
pub struct InteriorPoint {
    /// All settings; the defaults are those of the literature.
    pub settings: NlpSettings,
}

impl InteriorPoint {
    /// A solver with the given settings.
    pub fn new(settings: NlpSettings) -> Self {
        Self { settings }
    }

    /// Solves from the problem's initial point.
    ///
    /// # Errors
    /// An ill-posed problem or setting; not converging is a [`Status`].
    pub fn solve<N: Nlp + ?Sized>(&self, nlp: &mut N) -> Result<SolveReport, NlpError> {
        self.run(&mut { nlp }, None, &mut ())
    }

    /// The same with an observer of the iterations.
    ///
    /// # Errors
    /// As [`InteriorPoint::solve`].
    pub fn solve_observed<N: Nlp + ?Sized>(
        &self,
        nlp: &mut N,
        observer: &mut dyn Observer,
    ) -> Result<SolveReport, NlpError> {
        self.run(&mut { nlp }, None, observer)
    }

    /// Solves from a point with multipliers, such as an earlier solution of a similar problem.
    ///
    /// # Errors
    /// As [`InteriorPoint::solve`]; also if `warm` has vectors of the wrong length or numbers that are not finite.
    pub fn solve_from<N: Nlp + ?Sized>(
        &self,
        nlp: &mut N,
        warm: &WarmStart,
        observer: &mut dyn Observer,
    ) -> Result<SolveReport, NlpError> {
        self.run(&mut { nlp }, Some(warm), observer)
    }

    /// Factorises the optimality conditions at the solution in `report`, for derivatives of the solution with respect
    /// to parameters. The settings are those of the solve.
    ///
    /// # Errors
    /// A report of another problem, or of a point that is not an isolated local minimum
    /// ([`NlpError::NoDerivative`]).
    pub fn sensitivity<N: Nlp + ?Sized>(
        &self,
        nlp: &mut N,
        report: &SolveReport,
    ) -> Result<Sensitivity, NlpError> {
        Sensitivity::new(&mut { nlp }, &self.settings, report, Curvature::OfLagrangian)
    }

    /// Factorises the active constraints at the solution in `report`, to tell whether its multipliers are the only ones. The settings are
    /// those of the solve.
    ///
    /// # Errors
    /// A report of another problem, or none of a solution ([`NlpError::NoDerivative`]).
    pub fn active_constraints<N: Nlp + ?Sized>(
        &self,
        nlp: &mut N,
        report: &SolveReport,
    ) -> Result<ActiveConstraints, NlpError> {
        ActiveConstraints::new(&mut { nlp }, &self.settings, report)
    }

    fn run(
        &self,
        nlp: &mut dyn Nlp,
        warm: Option<&WarmStart>,
        observer: &mut dyn Observer,
    ) -> Result<SolveReport, NlpError> {
        let start = Instant::now();
        self.settings.validate()?;
        if let Some(warm) = warm {
            check_warm_start(warm, nlp.variables(), nlp.constraints())?;
        }
        let mut problem = ScaledProblem::new(nlp, &self.settings, warm.map(|warm| &warm.x[..]), None)?;
        if problem.structure().variables == 0 {
            return Ok(self.report_fixed(&mut problem, start));
        }
        let mut system = AugmentedSystem::of(&problem, &self.settings)?;
        self.run_with(&mut problem, &mut system, warm, observer, start)
    }

    /// A solve of a problem with free variables, with a system that was analysed for its structure.
    pub(crate) fn run_with(
        &self,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
        warm: Option<&WarmStart>,
        observer: &mut dyn Observer,
        start: Instant,
    ) -> Result<SolveReport, NlpError> {
        let mut engine = Engine::for_model(problem, &self.settings);
        let mut session = Session {
            observer,
            deadline: self.settings.time_limit.map(|limit| start + limit),
            iteration: 0,
            restoration_iterations: 0,
        };
        let started = match warm {
            Some(warm) => engine.start_warm(problem, warm),
            None => engine.start_cold(problem, system),
        };
        let mut restorations = 0;
        let mut status = match started {
            Ok(()) => iterate(&mut engine, problem, system, &mut session, &mut restorations),
            Err(what) => Status::EvaluationFailed(what),
        };
        for _ in 0..self.settings.max_saddle_escapes {
            // Beside a saddle steps are short, and the last of them no more than acceptable.
            if !matches!(status, Status::Optimal | Status::Acceptable) {
                break;
            }
            let of_saddle = status;
            let saddle = engine.state.current.clone();
            if !engine.leaves_saddle(problem, system) {
                break;
            }
            let most = session.iteration + ESCAPE_ITERATIONS;
            engine.state.settings.max_iterations = most.min(self.settings.max_iterations);
            status = iterate(&mut engine, problem, system, &mut session, &mut restorations);
            let reached = &engine.state.current;
            let is_better =
                reached.objective < saddle.objective - BETTER * problem.size_of_objective(saddle.objective);
            if !(is_better && matches!(status, Status::Optimal | Status::Diverging)) {
                engine.return_to(problem, &saddle);
                status = of_saddle;
                break;
            }
        }
        if status == Status::Optimal && self.settings.polish > 0.0 {
            engine.polish(&self.settings, problem, system);
        }
        let keeps_point = matches!(
            status,
            Status::Optimal | Status::Infeasible | Status::Diverging | Status::EvaluationFailed(_)
        );
        // An acceptable point beyond a saddle is better than the saddle, however exact that was.
        let is_better = status == Status::Acceptable && engine.is_lower_than_best(problem, BETTER);
        if !keeps_point && !is_better {
            engine.recall_best(problem);
        }
        let inside = status != Status::Optimal || engine.ends_inside(problem);
        let counters = Counters {
            iterations: session.iteration,
            restoration_iterations: session.restoration_iterations,
            restorations,
            factorisations: system.factorisations,
            solves: system.solves,
            ..Counters::default()
        };
        let mut report = report_point(&engine, problem, status, counters, inside);
        report.timing.linear_systems = system.time;
        report.timing.total = start.elapsed();
        Ok(report)
    }

    /// The report of a problem without free variables.
    pub(crate) fn report_fixed(&self, problem: &mut ScaledProblem<'_>, start: Instant) -> SolveReport {
        let x = problem.user_point(&[]);
        let (objective, constraint_values) = problem.user_values(&x);
        let m = constraint_values.len();
        let worst_constraint = worst_violation(problem, &constraint_values);
        let violation = worst_constraint.map_or(0.0, |worst| worst.amount.abs());
        let finite = constraint_values.iter().all(|value| value.is_finite());
        let status = match (objective.is_finite(), finite) {
            (false, _) => Status::EvaluationFailed(crate::Evaluation::Objective),
            (_, false) => Status::EvaluationFailed(crate::Evaluation::Constraints),
            _ if violation <= self.settings.tolerance => Status::Optimal,
            _ => Status::Infeasible,
        };
        let (lower_multipliers, upper_multipliers) = fixed_multipliers(problem, &x, &vec![0.0; m]);
        let residuals = Residuals { primal_infeasibility: violation, ..Residuals::default() };
        SolveReport {
            status,
            objective,
            constraint_values,
            constraint_multipliers: vec![0.0; m],
            lower_multipliers,
            upper_multipliers,
            errors: OptimalityError { scaled: residuals, unscaled: residuals },
            worst_constraint,
            counters: problem.counters,
            barrier: 0.0,
            timing: Timing { evaluation: problem.time, total: start.elapsed(), ..Timing::default() },
            scaling: problem.scaling_factors().clone(),
            x,
        }
    }
}

/// Alternates between the engine and the restoration phase. It ends because each turn takes an iteration.
fn iterate(
    engine: &mut Engine,
    problem: &mut ScaledProblem<'_>,
    system: &mut AugmentedSystem,
    session: &mut Session<'_>,
    restorations: &mut usize,
) -> Status {
    let mut restoration = Restoration::default();
    let mut overrides = 0;
    loop {
        match engine.run(problem, system, session) {
            Exit::Finished(status) => return status,
            Exit::NeedsRestoration | Exit::Left => {}
        }
        *restorations += 1;
        match restoration.run(engine, problem, system, session) {
            Recovery::Recovered => {}
            Recovery::RecoveredFeasible => {
                overrides += 1;
                if overrides > MAX_FILTER_OVERRIDES {
                    return Status::RestorationFailed;
                }
            }
            Recovery::Ended(status) => return status,
        }
    }
}

/// The current point of the engine in the user's units.
pub(crate) fn report_point(
    engine: &Engine,
    problem: &mut ScaledProblem<'_>,
    status: Status,
    counters: Counters,
    inside: bool,
) -> SolveReport {
    let v = &engine.state.current.v;
    let x = if inside { problem.user_point_inside(v) } else { problem.user_point(v) };
    let (objective, constraint_values) = problem.user_values(&x);
    let scaling = problem.scaling_factors().clone();
    let mut constraint_multipliers = vec![0.0; constraint_values.len()];
    for (y, &i) in engine.state.current.y.iter().zip(problem.kept()) {
        constraint_multipliers[i] = y * scaling.constraints[i] / scaling.objective;
    }
    let has_fixed = problem.free().len() < x.len();
    let (mut lower_multipliers, mut upper_multipliers) = if has_fixed {
        fixed_multipliers(problem, &x, &constraint_multipliers)
    } else {
        (vec![0.0; x.len()], vec![0.0; x.len()])
    };
    for (k, &i) in problem.free().iter().enumerate() {
        let factor = scaling.variables[i] / scaling.objective;
        lower_multipliers[i] = engine.state.current.zl[k] * factor;
        upper_multipliers[i] = engine.state.current.zu[k] * factor;
    }
    let evaluations = problem.counters;
    SolveReport {
        status,
        objective,
        constraint_multipliers,
        lower_multipliers,
        upper_multipliers,
        errors: engine.state.errors,
        worst_constraint: worst_violation(problem, &constraint_values),
        counters: Counters {
            objective: evaluations.objective,
            gradient: evaluations.gradient,
            constraints: evaluations.constraints,
            jacobian: evaluations.jacobian,
            hessian: evaluations.hessian,
            ..counters
        },
        barrier: engine.state.barrier,
        timing: Timing { evaluation: problem.time, ..Timing::default() },
        scaling,
        constraint_values,
        x,
    }
}

/// Multipliers that balance the Lagrangian gradient of the fixed variables; zero for the others.
fn fixed_multipliers(problem: &mut ScaledProblem<'_>, x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let residual = problem.user_dual_residual(x, y);
    let (lower, upper) = problem.variable_bounds();
    let fixed = |i: usize| lower[i] == upper[i];
    let part = |sign: f64| {
        (0..x.len()).map(|i| if fixed(i) { (sign * residual[i]).max(0.0) } else { 0.0 }).collect::<Vec<f64>>()
    };
    (part(1.0), part(-1.0))
}

/// The constraint with the largest scaled violation.
fn worst_violation(problem: &ScaledProblem<'_>, values: &[f64]) -> Option<Violation> {
    let (lower, upper) = problem.constraint_bounds();
    let factors = &problem.scaling_factors().constraints;
    let mut worst: Option<Violation> = None;
    for (constraint, &value) in values.iter().enumerate() {
        let amount = if value < lower[constraint] {
            value - lower[constraint]
        } else if value > upper[constraint] {
            value - upper[constraint]
        } else {
            continue;
        };
        let size = |violation: &Violation| violation.amount.abs() * factors[violation.constraint];
        let candidate = Violation { constraint, amount };
        let bound = if amount < 0.0 { lower[constraint] } else { upper[constraint] };
        let is_rounding = amount.abs() <= 10.0 * f64::EPSILON * bound.abs().max(1.0);
        if !is_rounding && worst.as_ref().is_none_or(|worst| size(worst) < size(&candidate)) {
            worst = Some(candidate);
        }
    }
    worst
}
