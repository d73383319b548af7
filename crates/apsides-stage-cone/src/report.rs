//! The end of a solve, and its figures.

/// The status of a solve: how it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// Solved to the tolerances.
    Solved,
    /// Solved to reduced tolerances: gap 5e-5, residuals 1e-4.
    SolvedReduced,
    /// No point meets the constraints; the multipliers are a certificate.
    Infeasible,
    /// The objective has no lower bound; the variables are a ray along which it falls.
    Unbounded,
    /// The limit of iterations came first.
    IterationLimit,
    /// Rounding errors, or steps without progress, came first.
    Stalled,
}

impl Status {
    /// Returns true if there is a solution, be it to reduced tolerances.
    #[must_use]
    pub fn has_solution(self) -> bool {
        matches!(self, Self::Solved | Self::SolvedReduced)
    }
}

/// Figures of a solve with `NE` end equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageReport<const NE: usize> {
    /// Status of the solve.
    pub status: Status,
    /// Iterations, one factorisation each.
    pub iterations: u32,
    /// Objective; of a certificate of infeasibility infinite.
    pub objective: f64,
    /// Objective of the dual program; of a ray minus infinity.
    pub dual_objective: f64,
    /// Relative residual of the constraints.
    pub primal_residual: f64,
    /// Relative residual of the dual constraints.
    pub dual_residual: f64,
    /// Largest residual of the certificate of infeasibility, scaled to the value one, or of the ray, scaled to the descent one; NaN without one.
    pub certificate_residual: f64,
    /// Multipliers of the end equations; of an infeasible program part of the certificate.
    pub end_multipliers: [f64; NE],
}
