//! A conic program: built once, updated in place, solved again.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::error::{Refusal, require_finite, require_length};
use crate::triplets::ColumnPattern;
use crate::{ConicError, ConicSettings, Triplets};

/// A cone with its number of components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cone {
    /// All components are zero: equations.
    Zero(usize),
    /// No component is negative.
    NonNegative(usize),
    /// The first component is at least the Euclidean norm of the others.
    SecondOrder(usize),
}

impl Cone {
    /// Number of components.
    #[must_use]
    pub fn size(&self) -> usize {
        match *self {
            Self::Zero(n) | Self::NonNegative(n) | Self::SecondOrder(n) => n,
        }
    }

    fn least(&self) -> usize {
        if matches!(self, Self::SecondOrder(_)) { 2 } else { 1 }
    }
}

/// `min 1/2 x'Px + q'x` subject to `Ax + s = b`, `s` in the cones one after another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ConicData {
    /// `q`, one number per variable.
    pub linear: Vec<f64>,
    /// Upper triangle of `P`, positive semidefinite.
    pub quadratic: Triplets,
    /// `A`, as many rows as the cones have components.
    pub matrix: Triplets,
    /// `b`.
    pub right_hand_side: Vec<f64>,
    /// Cones of the rows, in order.
    pub cones: Vec<Cone>,
}

/// The status of a solve: how it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// Solved to the tolerances.
    Solved,
    /// Solved to reduced tolerances: gap 5e-5, residuals 1e-4.
    SolvedReduced,
    /// No point meets the constraints; the dual is a certificate.
    Infeasible,
    /// The objective has no lower bound.
    Unbounded,
    /// The limit of iterations came first.
    IterationLimit,
    /// Rounding errors, or steps without progress, came first.
    Stalled,
    /// Not solved since the last update.
    NotSolved,
}

impl Status {
    /// Returns true if there is a solution, be it to reduced tolerances.
    #[must_use]
    pub fn has_solution(self) -> bool {
        matches!(self, Self::Solved | Self::SolvedReduced)
    }
}

/// Figures of the last solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConicReport {
    /// Status of the solve.
    pub status: Status,
    /// Iterations of the interior-point method, one factorisation each.
    pub iterations: u32,
    /// Objective; NaN without a solution.
    pub objective: f64,
    /// Objective of the dual program; NaN without a solution.
    pub dual_objective: f64,
    /// Relative residual of `Ax + s = b`.
    pub primal_residual: f64,
    /// Relative residual of `Px + q + A'z = 0`.
    pub dual_residual: f64,
}

/// A program with a fixed pattern.
pub struct ConicProgram {
    solver: DefaultSolver<f64>,
    variables: usize,
    rows: usize,
    quadratic: ColumnPattern,
    matrix: ColumnPattern,
    /// Values by columns, for updates.
    quadratic_values: Vec<f64>,
    matrix_values: Vec<f64>,
    linear: Vec<f64>,
    right_hand_side: Vec<f64>,
    status: Status,
}

impl ConicProgram {
    /// Checks the data, analyses the pattern and scales rows and columns by these data.
    ///
    /// # Errors
    /// [`ConicError`] by name: lengths, entries out of bounds or below the diagonal, empty cones, numbers that are not finite,
    /// settings out of range.
    pub fn new(data: &ConicData, settings: ConicSettings) -> Result<Self, ConicError> {
        settings.check()?;
        let variables = data.linear.len();
        if variables == 0 {
            return Err(ConicError::NoVariable);
        }
        for (index, cone) in data.cones.iter().enumerate() {
            if cone.size() < cone.least() {
                return Err(ConicError::EmptyCone { index, size: cone.size() });
            }
        }
        let rows = data.cones.iter().map(Cone::size).sum();
        require_length(
            "right-hand side (one number per component of the cones)",
            rows,
            data.right_hand_side.len(),
        )?;
        require_finite("linear term", &data.linear)?;
        require_finite("right-hand side", &data.right_hand_side)?;
        data.quadratic.check("quadratic term", variables, variables)?;
        data.matrix.check("matrix", rows, variables)?;
        let mut places = data.quadratic.rows.iter().zip(&data.quadratic.columns);
        if let Some(index) = places.position(|(r, c)| r > c) {
            let (row, column) = (data.quadratic.rows[index], data.quadratic.columns[index]);
            return Err(ConicError::LowerTriangle { index, row, column });
        }
        let quadratic = ColumnPattern::new(&data.quadratic, variables);
        let matrix = ColumnPattern::new(&data.matrix, variables);
        let mut quadratic_values = vec![0.0; quadratic.rows.len()];
        let mut matrix_values = vec![0.0; matrix.rows.len()];
        quadratic.scatter(&data.quadratic.values, &mut quadratic_values);
        matrix.scatter(&data.matrix.values, &mut matrix_values);
        let columns = |pattern: &ColumnPattern, rows, values: &[f64]| {
            CscMatrix::new(rows, variables, pattern.starts.clone(), pattern.rows.clone(), values.to_vec())
        };
        let cones: Vec<_> = data.cones.iter().map(foreign).collect();
        let solver = DefaultSolver::new(
            &columns(&quadratic, variables, &quadratic_values),
            &data.linear,
            &columns(&matrix, rows, &matrix_values),
            &data.right_hand_side,
            &cones,
            foreign_settings(&settings),
        )
        .map_err(|e| ConicError::Refused(Refusal::new(e)))?;
        Ok(Self {
            solver,
            variables,
            rows,
            quadratic,
            matrix,
            quadratic_values,
            matrix_values,
            linear: data.linear.clone(),
            right_hand_side: data.right_hand_side.clone(),
            status: Status::NotSolved,
        })
    }

    /// Number of variables.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.variables
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Replaces the values of `P`, in the order of the entries the program was built with.
    ///
    /// # Errors
    /// [`ConicError::Dimension`], [`ConicError::NotFinite`]; the old values then stay.
    pub fn set_quadratic(&mut self, values: &[f64]) -> Result<(), ConicError> {
        require_length("quadratic term", self.quadratic.entries(), values.len())?;
        require_finite("quadratic term", values)?;
        self.quadratic.scatter(values, &mut self.quadratic_values);
        self.status = Status::NotSolved;
        self.solver.update_P(&self.quadratic_values).map_err(refused)
    }

    /// Replaces `q`.
    ///
    /// # Errors
    /// As [`set_quadratic`](Self::set_quadratic).
    pub fn set_linear(&mut self, values: &[f64]) -> Result<(), ConicError> {
        require_length("linear term", self.variables, values.len())?;
        require_finite("linear term", values)?;
        self.linear.copy_from_slice(values);
        self.status = Status::NotSolved;
        self.solver.update_q(&self.linear).map_err(refused)
    }

    /// Replaces the values of `A`, in the order of the entries the program was built with.
    ///
    /// # Errors
    /// As [`set_quadratic`](Self::set_quadratic).
    pub fn set_matrix(&mut self, values: &[f64]) -> Result<(), ConicError> {
        require_length("matrix", self.matrix.entries(), values.len())?;
        require_finite("matrix", values)?;
        self.matrix.scatter(values, &mut self.matrix_values);
        self.status = Status::NotSolved;
        self.solver.update_A(&self.matrix_values).map_err(refused)
    }

    /// Replaces `b`.
    ///
    /// # Errors
    /// As [`set_quadratic`](Self::set_quadratic).
    pub fn set_right_hand_side(&mut self, values: &[f64]) -> Result<(), ConicError> {
        require_length("right-hand side", self.rows, values.len())?;
        require_finite("right-hand side", values)?;
        self.right_hand_side.copy_from_slice(values);
        self.status = Status::NotSolved;
        self.solver.update_b(&self.right_hand_side).map_err(refused)
    }

    /// Solves with the present data.
    pub fn solve(&mut self) -> Status {
        self.solver.solve();
        self.status = match self.solver.solution.status {
            SolverStatus::Solved => Status::Solved,
            SolverStatus::AlmostSolved => Status::SolvedReduced,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Status::Infeasible,
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Status::Unbounded,
            SolverStatus::MaxIterations | SolverStatus::MaxTime => Status::IterationLimit,
            SolverStatus::Unsolved => Status::NotSolved,
            SolverStatus::NumericalError
            | SolverStatus::InsufficientProgress
            | SolverStatus::CallbackTerminated => Status::Stalled,
        };
        self.status
    }

    /// Figures of the last solve.
    #[must_use]
    pub fn report(&self) -> ConicReport {
        let s = &self.solver.solution;
        ConicReport {
            status: self.status,
            iterations: s.iterations,
            objective: s.obj_val,
            dual_objective: s.obj_val_dual,
            primal_residual: s.r_prim,
            dual_residual: s.r_dual,
        }
    }

    /// Variables of the last solve.
    #[must_use]
    pub fn x(&self) -> &[f64] {
        &self.solver.solution.x
    }

    /// Multipliers of the rows, in the dual cones; a certificate when infeasible.
    #[must_use]
    pub fn dual(&self) -> &[f64] {
        &self.solver.solution.z
    }

    /// `s = b - Ax`, in the cones.
    #[must_use]
    pub fn slack(&self) -> &[f64] {
        &self.solver.solution.s
    }
}

impl std::fmt::Debug for ConicProgram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ConicProgram")
            .field("variables", &self.variables)
            .field("rows", &self.rows)
            .field("status", &self.status)
            .finish_non_exhaustive()
    }
}

fn foreign(cone: &Cone) -> SupportedConeT<f64> {
    match *cone {
        Cone::Zero(n) => SupportedConeT::ZeroConeT(n),
        Cone::NonNegative(n) => SupportedConeT::NonnegativeConeT(n),
        Cone::SecondOrder(n) => SupportedConeT::SecondOrderConeT(n),
    }
}

/// Updates need the pattern as it was given: no presolve, no zeros dropped.
fn foreign_settings(settings: &ConicSettings) -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_iter: settings.max_iterations,
        tol_gap_abs: settings.gap_tolerance,
        tol_gap_rel: settings.gap_tolerance,
        tol_feas: settings.feasibility_tolerance,
        presolve_enable: false,
        input_sparse_dropzeros: false,
        max_threads: 1,
        ..DefaultSettings::default()
    }
}

fn refused(e: clarabel::solver::DataUpdateError) -> ConicError {
    ConicError::Refused(Refusal::new(e))
}

#[cfg(test)]
#[path = "program_tests.rs"]
mod tests;
