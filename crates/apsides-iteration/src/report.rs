//! The outcome of a nonlinear program.

use std::time::Duration;

use crate::Status;

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
    /// Residuals of the scaled problem; dual parts divided by the size of the multipliers (Waechter and Biegler, eq. 5).
    pub scaled: Residuals,
    /// Residuals without divisors in the user's units, or in those of the problem's own scaling where the solve uses them: then the stopping
    /// tests do not depend on the user's units.
    pub unscaled: Residuals,
}

/// Counts of the work done in a solve.
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

/// Wall-clock times of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Timing {
    /// Time in the functions and derivatives of the problem.
    pub evaluation: Duration,
    /// Time in the linear systems, analysis included.
    pub linear_systems: Duration,
    /// Time of the whole solve.
    pub total: Duration,
}

/// Factors by which the method multiplied functions and variables.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalingFactors {
    /// Scaled objective = factor times objective.
    pub objective: f64,
    /// Scaled variable = factor times variable; length `n`.
    pub variables: Vec<f64>,
    /// Scaled constraint = factor times constraint; length `m`.
    pub constraints: Vec<f64>,
}

/// The violation of a constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Index of the constraint.
    pub constraint: usize,
    /// Distance to the nearest bound in the user's units: negative below the lower, positive above the upper bound.
    pub amount: f64,
}

/// The outcome of a solve, in the user's units and signs: at a solution `grad f + J^T constraint_multipliers -
/// lower_multipliers + upper_multipliers = 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveReport {
    /// Status of the solve.
    pub status: Status,
    /// The point, length `n`: the last iterate if optimal, else the best one. It is put back between the bounds unless an
    /// optimal point would lose its tolerance by that; then it is outside by rounding, 2e-12 relative to max(1, |bound|)
    /// (scaled).
    pub x: Vec<f64>,
    /// Objective at `x`.
    pub objective: f64,
    /// Constraint functions at `x`, length `m`.
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
