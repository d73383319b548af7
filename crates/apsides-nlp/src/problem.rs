//! The nonlinear program as a user states it.

use crate::error::NlpError;
use crate::vector::in_vectors;

/// Positions of the structural non-zeros of a sparse matrix, as coordinate pairs.
///
/// A pair may occur more than once; the values of equal pairs are summed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pattern {
    /// Row of each entry, from zero.
    pub rows: Vec<usize>,
    /// Column of each entry, from zero; as long as `rows`.
    pub cols: Vec<usize>,
}

impl Pattern {
    /// The pattern with the given `(row, column)` pairs, in this order.
    pub fn from_pairs(pairs: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let (rows, cols) = pairs.into_iter().unzip();
        Self { rows, cols }
    }

    /// Every position of a `rows` by `cols` matrix, row by row.
    pub fn dense(rows: usize, cols: usize) -> Self {
        Self::from_pairs((0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))))
    }

    /// The lower triangle of a square matrix of `order` rows, row by row.
    pub fn lower_triangle(order: usize) -> Self {
        Self::from_pairs((0..order).flat_map(|row| (0..=row).map(move |col| (row, col))))
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns true if there is no entry.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// # Errors
    /// Lists of unequal length, or the first position outside a `rows` by `cols` matrix.
    pub(crate) fn check(&self, matrix: &'static str, rows: usize, cols: usize) -> Result<(), NlpError> {
        if self.rows.len() != self.cols.len() {
            let what = if matrix == "Jacobian" { "Jacobian pattern cols" } else { "Hessian pattern cols" };
            return Err(NlpError::Length { what, found: self.cols.len(), expected: self.rows.len() });
        }
        match self.first_beyond(|row, col| row >= rows || col >= cols) {
            Some(entry) => {
                let (row, col) = (self.rows[entry], self.cols[entry]);
                Err(NlpError::PatternRange { matrix, entry, row, col, rows, cols })
            }
            None => Ok(()),
        }
    }

    /// The first position that is where none may be.
    pub(crate) fn first_beyond(&self, is_beyond: impl Fn(usize, usize) -> bool) -> Option<usize> {
        let mut positions = self.rows.iter().zip(&self.cols);
        // As a rule there is none: all are looked at without a branch first.
        let any = in_vectors(|| positions.clone().fold(false, |any, (row, col)| any | is_beyond(*row, *col)));
        if any { positions.position(|(row, col)| is_beyond(*row, *col)) } else { None }
    }
}

/// Units in which a problem is well scaled: the method works on `x / variables`, `c / constraints` and
/// `f / objective`. All entries are positive and finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// Unit of the objective.
    pub objective: f64,
    /// Unit of each variable; length [`Nlp::variables`].
    pub variables: Vec<f64>,
    /// Unit of each constraint; length [`Nlp::constraints`].
    pub constraints: Vec<f64>,
}

/// The stage (for example the time interval) of every variable and constraint: a hint for the elimination order of
/// the linear systems, which makes their analysis cheap when the problem is a chain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stages {
    /// Stage of each variable; length [`Nlp::variables`].
    pub variables: Vec<u32>,
    /// Stage of each constraint; length [`Nlp::constraints`].
    pub constraints: Vec<u32>,
}

/// A sparse nonlinear program
///
/// ```text
/// minimise f(x)   subject to   cl <= c(x) <= cu,   xl <= x <= xu,
/// ```
///
/// with twice continuously differentiable `f` and `c`. The structure (sizes, bounds, patterns) is asked for once, at
/// the start of a solve. The evaluations always get a point between the (slightly relaxed) bounds on the variables. A
/// function that cannot be evaluated at `x` returns NaN or an infinity: the method then shortens its step.
pub trait Nlp {
    /// Number of variables `n`.
    fn variables(&self) -> usize;

    /// Number of constraints `m`, without the bounds on the variables.
    fn constraints(&self) -> usize;

    /// Bounds on the variables, each of length `n`. Infinite means none, equal means fixed.
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]);

    /// Bounds on the constraints, each of length `m`. Infinite means none, equal means an equality.
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]);

    /// The point to start from, length `n`. It may violate any bound.
    fn initial_point(&self, x: &mut [f64]);

    /// Positions of the non-zeros of the `m` by `n` constraint Jacobian.
    fn jacobian_pattern(&self) -> Pattern;

    /// Positions of the non-zeros of the `n` by `n` Hessian of the Lagrangian, lower triangle only.
    fn hessian_pattern(&self) -> Pattern;

    /// The objective `f(x)`.
    fn objective(&mut self, x: &[f64]) -> f64;

    /// The gradient of `f`, length `n`. `gradient` comes with unspecified content.
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]);

    /// The constraint functions `c(x)`, length `m`.
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]);

    /// The Jacobian of `c`, one value for each entry of [`Nlp::jacobian_pattern`].
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]);

    /// The Hessian of `objective_factor * f + sum_i multipliers[i] * c_i`, one value for each entry of
    /// [`Nlp::hessian_pattern`].
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]);

    /// Units for [`ScalingMethod::User`](crate::ScalingMethod::User); none by default.
    fn scaling(&self) -> Option<Scaling> {
        None
    }

    /// Stages of a chain-structured problem; none by default.
    fn stages(&self) -> Option<Stages> {
        None
    }
}

impl<N: Nlp + ?Sized> Nlp for &mut N {
    fn variables(&self) -> usize {
        (**self).variables()
    }
    fn constraints(&self) -> usize {
        (**self).constraints()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        (**self).variable_bounds(lower, upper);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        (**self).constraint_bounds(lower, upper);
    }
    fn initial_point(&self, x: &mut [f64]) {
        (**self).initial_point(x);
    }
    fn jacobian_pattern(&self) -> Pattern {
        (**self).jacobian_pattern()
    }
    fn hessian_pattern(&self) -> Pattern {
        (**self).hessian_pattern()
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        (**self).objective(x)
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        (**self).gradient(x, gradient);
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        (**self).constraint_values(x, values);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        (**self).jacobian(x, values);
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        (**self).hessian(x, objective_factor, multipliers, values);
    }
    fn scaling(&self) -> Option<Scaling> {
        (**self).scaling()
    }
    fn stages(&self) -> Option<Stages> {
        (**self).stages()
    }
}
