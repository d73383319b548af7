//! The status of a solve: how it ended.

use std::fmt;

/// The status of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// A point that satisfies the optimality conditions to the tolerance.
    Optimal,
    /// A point that satisfies them to the acceptable tolerance only.
    Acceptable,
    /// A stationary point of the constraint violation: no feasible point nearby.
    Infeasible,
    /// No point that meets the constraints was found, and nothing shows that there is none.
    NoFeasiblePoint,
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
    /// Returns true if the point can be used as a solution.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Optimal | Self::Acceptable)
    }

    /// The word for files and scripts, such as `optimal` or `iteration-limit`; `not-converged` where the steps became too small.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::Acceptable => "acceptable",
            Self::Infeasible => "infeasible",
            Self::NoFeasiblePoint => "no-feasible-point",
            Self::Diverging => "diverging",
            Self::IterationLimit => "iteration-limit",
            Self::TimeLimit => "time-limit",
            Self::Interrupted => "interrupted",
            Self::RestorationFailed => "restoration-failed",
            Self::EvaluationFailed(_) => "evaluation-failed",
            Self::StepTooSmall => "not-converged",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Optimal => f.write_str("optimal to the tolerance"),
            Self::Acceptable => f.write_str("optimal to the acceptable tolerance"),
            Self::Infeasible => f.write_str("converged to a point of local infeasibility"),
            Self::NoFeasiblePoint => f.write_str("no feasible point found"),
            Self::Diverging => f.write_str("iterates diverge; the problem may be unbounded"),
            Self::IterationLimit => f.write_str("iteration limit reached"),
            Self::TimeLimit => f.write_str("time limit reached"),
            Self::Interrupted => f.write_str("stopped on request"),
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
