//! The problem in the form that the interior point engine solves: minimise `f(v)` subject to `c(v) = 0`, `l <= v <= u`.
//!
//! The variables `v` are `x` followed by *unit variables*, each of which enters one constraint with the coefficient +1
//! or -1 and nothing else that is coupled: the slacks of the inequality constraints and, in the restoration phase, the
//! elastic variables. The linear system never sees them: they are eliminated by hand.

use crate::problem::Pattern;

/// A variable whose Jacobian column has the single entry `sign` in `row`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UnitVariable {
    pub row: usize,
    pub sign: f64,
}

/// Sizes and patterns, fixed for a solve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Structure {
    /// Length of the `x` part of the variables.
    pub variables: usize,
    /// The first `slacks` unit variables are slacks.
    pub slacks: usize,
    pub units: Vec<UnitVariable>,
    pub constraints: usize,
    /// Jacobian with respect to `x`.
    pub jacobian: Pattern,
    /// Hessian with respect to `x`, lower triangle.
    pub hessian: Pattern,
}

impl Structure {
    /// One without slacks and derivatives.
    #[cfg(test)]
    pub(crate) fn of_sizes(variables: usize, constraints: usize) -> Self {
        let (jacobian, hessian) = (Pattern::default(), Pattern::default());
        Self { variables, slacks: 0, units: Vec::new(), constraints, jacobian, hessian }
    }

    /// Number of variables, unit variables included.
    pub(crate) fn primal(&self) -> usize {
        self.variables + self.units.len()
    }

    /// `out += J^T y`.
    pub(crate) fn add_transpose_product(&self, jacobian: &[f64], y: &[f64], out: &mut [f64]) {
        let (x, units) = out.split_at_mut(self.variables);
        for ((&row, &col), value) in self.jacobian.rows.iter().zip(&self.jacobian.cols).zip(jacobian) {
            x[col] += value * y[row];
        }
        for (unit, out) in self.units.iter().zip(units) {
            *out += unit.sign * y[unit.row];
        }
    }

    /// `out += J v`, for the `x` part of the Jacobian only.
    pub(crate) fn add_product(&self, jacobian: &[f64], x: &[f64], out: &mut [f64]) {
        for ((&row, &col), value) in self.jacobian.rows.iter().zip(&self.jacobian.cols).zip(jacobian) {
            out[row] += value * x[col];
        }
    }
}

/// Factors from scaled residuals to those of [`OptimalityError::unscaled`](crate::OptimalityError::unscaled).
#[derive(Debug, Clone)]
pub(crate) struct ResidualUnits {
    /// Unit of each entry of the gradient of the Lagrangian.
    pub dual: Vec<f64>,
    /// Unit of each constraint.
    pub primal: Vec<f64>,
    /// Unit of the complementarity.
    pub complementarity: f64,
    /// Factor from the scaled objective to the user's.
    pub objective: f64,
}

/// A problem in the form above. Evaluations that fail return non-finite numbers.
pub(crate) trait BarrierModel {
    fn structure(&self) -> &Structure;
    fn lower(&self) -> &[f64];
    fn upper(&self) -> &[f64];
    fn objective(&mut self, v: &[f64]) -> f64;
    fn gradient(&mut self, v: &[f64], gradient: &mut [f64]);
    fn constraints(&mut self, v: &[f64], values: &mut [f64]);
    fn jacobian(&mut self, v: &[f64], values: &mut [f64]);
    /// Hessian of the Lagrangian: `values` on the pattern, plus `diagonal` (length [`Structure::primal`]).
    fn hessian(&mut self, v: &[f64], y: &[f64], values: &mut [f64], diagonal: &mut [f64]);
    fn residual_units(&self) -> Option<&ResidualUnits> {
        None
    }
    /// The barrier parameter has changed; returns true if the objective depends on it.
    fn barrier_changed(&mut self, _barrier: f64) -> bool {
        false
    }
    /// Returns true if the solve is to be left at this iterate although it is not optimal.
    fn leaves(&mut self, _v: &[f64]) -> bool {
        false
    }
    /// Returns true for the restoration problem.
    fn is_restoration(&self) -> bool {
        false
    }
}
