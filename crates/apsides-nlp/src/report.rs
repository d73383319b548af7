//! The outcome of a solve.

use std::fmt;
use std::time::Duration;

use crate::problem::Nlp;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// A point that satisfies the optimality conditions to the tolerance.
    Optimal,
    /// A point that satisfies them to the acceptable tolerance only.
    Acceptable,
    /// A stationary point of the constraint violation: no feasible point nearby.
    Infeasible,
    /// The iterates grow without limit: the problem is probably unbounded.
    Diverging,
    /// The iteration limit was reached.
    IterationLimit,
    /// The time limit was reached.
    TimeLimit,
    /// The observer asked to stop.
    Interrupted,
    /// The restoration phase found neither a better point nor a stationary point of the violation.
    RestorationFailed,
    /// A function or derivative was not finite where there is no shorter step to take.
    EvaluationFailed(Evaluation),
    /// The steps became too small to make progress.
    StepTooSmall,
}

impl Status {
    /// Whether the point can be used as a solution.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Optimal | Self::Acceptable)
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Optimal => f.write_str("optimal to the tolerance"),
            Self::Acceptable => f.write_str("optimal to the acceptable tolerance"),
            Self::Infeasible => f.write_str("converged to a point of local infeasibility"),
            Self::Diverging => f.write_str("iterates diverge; the problem may be unbounded"),
            Self::IterationLimit => f.write_str("iteration limit reached"),
            Self::TimeLimit => f.write_str("time limit reached"),
            Self::Interrupted => f.write_str("stopped by the observer"),
            Self::RestorationFailed => f.write_str("the restoration phase failed"),
            Self::EvaluationFailed(what) => {
                write!(f, "the {what} is not finite where no shorter step is possible")
            }
            Self::StepTooSmall => f.write_str("steps too small to make progress"),
        }
    }
}

/// A function or derivative of the problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evaluation {
    /// Objective.
    Objective,
    /// Gradient of the objective.
    Gradient,
    /// Constraint functions.
    Constraints,
    /// Constraint Jacobian.
    Jacobian,
    /// Hessian of the Lagrangian.
    Hessian,
}

impl fmt::Display for Evaluation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Objective => "objective",
            Self::Gradient => "gradient",
            Self::Constraints => "constraint function",
            Self::Jacobian => "Jacobian",
            Self::Hessian => "Hessian",
        })
    }
}

/// The three parts of the optimality error, each a largest absolute entry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residuals {
    /// Gradient of the Lagrangian.
    pub dual_infeasibility: f64,
    /// Constraint violation.
    pub primal_infeasibility: f64,
    /// Distance to a bound times its multiplier.
    pub complementarity: f64,
}

impl Residuals {
    /// The largest of the three.
    pub fn max(&self) -> f64 {
        self.dual_infeasibility.max(self.primal_infeasibility).max(self.complementarity)
    }
}

/// Optimality error of a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OptimalityError {
    /// Of the scaled problem; dual parts divided by the size of the multipliers (Waechter and Biegler, eq. 5).
    pub scaled: Residuals,
    /// Not divided; in the user's units, or in those of [`Nlp::scaling`](crate::Nlp::scaling) where the solve uses them: then
    /// the stopping tests do not depend on the user's units.
    pub unscaled: Residuals,
}

/// Work done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Iterations, those of the restoration phase included.
    pub iterations: usize,
    /// Iterations of the restoration phase.
    pub restoration_iterations: usize,
    /// Objective evaluations.
    pub objective: usize,
    /// Gradient evaluations.
    pub gradient: usize,
    /// Constraint evaluations.
    pub constraints: usize,
    /// Jacobian evaluations.
    pub jacobian: usize,
    /// Hessian evaluations.
    pub hessian: usize,
    /// Factorisations of the linear system.
    pub factorisations: usize,
    /// Solves with a factorisation.
    pub solves: usize,
    /// Calls of the restoration phase.
    pub restorations: usize,
}

/// Wall-clock times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Timing {
    /// In the functions and derivatives of the problem.
    pub evaluation: Duration,
    /// In the linear systems, analysis included.
    pub linear_systems: Duration,
    /// The whole solve.
    pub total: Duration,
}

/// Factors that the method multiplied functions and variables by.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingFactors {
    /// Scaled objective = factor times objective.
    pub objective: f64,
    /// Scaled variable = factor times variable; length `n`.
    pub variables: Vec<f64>,
    /// Scaled constraint = factor times constraint; length `m`.
    pub constraints: Vec<f64>,
}

/// How far a constraint is from its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Index of the constraint.
    pub constraint: usize,
    /// Distance to the nearest bound in the user's units: negative below the lower, positive above the upper bound.
    pub amount: f64,
}

/// The outcome of a solve, in the user's units and signs: at a solution
/// `grad f + J^T constraint_multipliers - lower_multipliers + upper_multipliers = 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveReport {
    /// How the solve ended.
    pub status: Status,
    /// The point, length `n`: the last one if optimal, else the best one met. It is put back between the bounds unless an
    /// optimal point would lose its tolerance by that; then it is outside by rounding, 2e-12 relative to max(1, |bound|)
    /// (scaled).
    pub x: Vec<f64>,
    /// Objective there.
    pub objective: f64,
    /// Constraint functions there, length `m`.
    pub constraint_values: Vec<f64>,
    /// Multipliers of the constraints, length `m`: positive at an upper, negative at a lower bound.
    pub constraint_multipliers: Vec<f64>,
    /// Multipliers of the lower bounds on the variables, length `n`, not negative.
    pub lower_multipliers: Vec<f64>,
    /// Multipliers of the upper bounds on the variables, length `n`, not negative.
    pub upper_multipliers: Vec<f64>,
    /// Optimality error.
    pub errors: OptimalityError,
    /// The most violated constraint relative to its scaling, if any is violated by more than rounding.
    pub worst_constraint: Option<Violation>,
    /// Work done.
    pub counters: Counters,
    /// Barrier parameter at the end.
    pub barrier: f64,
    /// Wall-clock times.
    pub timing: Timing,
    /// Scaling factors used.
    pub scaling: ScalingFactors,
}

/// A point and multipliers to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct WarmStart {
    /// Variables, length `n`.
    pub x: Vec<f64>,
    /// Multipliers of the constraints, length `m`.
    pub constraint_multipliers: Vec<f64>,
    /// Multipliers of the lower bounds, length `n`.
    pub lower_multipliers: Vec<f64>,
    /// Multipliers of the upper bounds, length `n`.
    pub upper_multipliers: Vec<f64>,
    /// Barrier parameter to begin with; from the average complementarity if none.
    pub barrier: Option<f64>,
}

impl WarmStart {
    /// A point with multipliers of the constraints; those of the bounds are what the gradient of the Lagrangian leaves there. None
    /// where that or a multiplier is not finite.
    pub fn from_multipliers<N: Nlp + ?Sized>(
        nlp: &mut N,
        x: Vec<f64>,
        constraint_multipliers: Vec<f64>,
    ) -> Option<Self> {
        let mut slope = vec![0.0; x.len()];
        nlp.gradient(&x, &mut slope);
        let pattern = nlp.jacobian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        nlp.jacobian(&x, &mut entries);
        for ((&row, &col), v) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
            slope[col] += v * constraint_multipliers[row];
        }
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        (finite(&slope) && finite(&constraint_multipliers)).then(|| Self {
            x,
            constraint_multipliers,
            lower_multipliers: slope.iter().map(|s| s.max(0.0)).collect(),
            upper_multipliers: slope.iter().map(|s| (-s).max(0.0)).collect(),
            barrier: None,
        })
    }
}

impl From<&SolveReport> for WarmStart {
    fn from(report: &SolveReport) -> Self {
        Self {
            x: report.x.clone(),
            constraint_multipliers: report.constraint_multipliers.clone(),
            lower_multipliers: report.lower_multipliers.clone(),
            upper_multipliers: report.upper_multipliers.clone(),
            barrier: None,
        }
    }
}
