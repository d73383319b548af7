//! The terms of a method along all phases.

use crate::phase::PhaseLayout;
use crate::workers::Workers;

/// The terms of a method along all phases: defects or matching conditions, path constraints, integrals.
///
/// Entries of Jacobian and Hessian are written in the order of [`add_patterns`](Self::add_patterns). Evaluations are at the
/// point of the last [`run`](Self::run) or [`refresh`](Self::refresh), whichever the method needs, and allocate nothing.
pub trait Discretisation: Sized {
    /// The placement of a phase.
    type Phase: PhaseLayout;

    /// Lets workers evaluate the terms; the numbers do not depend on them.
    fn share(&mut self, workers: &Workers);

    /// Adds the positions `(row, column)` of the entries of the Jacobian and of the lower triangle of the Hessian.
    fn add_patterns(&mut self, jacobian: &mut Vec<(usize, usize)>, hessian: &mut Vec<(usize, usize)>);

    /// Makes values known at `x`.
    fn run(&mut self, x: &[f64]);

    /// Makes values and first derivatives known at `x`; false when they were already.
    fn refresh(&mut self, x: &[f64]) -> bool;

    /// The share of the minimised cost at `x`, after [`run`](Self::run).
    fn cost(&mut self, x: &[f64]) -> f64;

    /// Adds the gradient of the share of the cost, after [`refresh`](Self::refresh).
    fn add_gradient(&self, x: &[f64], gradient: &mut [f64]);

    /// Adds the values at `x` to the rows, without the constant entries, after [`run`](Self::run).
    fn add_values(&mut self, x: &[f64], rows: &mut [f64]);

    /// Writes the entries of the Jacobian, after [`refresh`](Self::refresh).
    fn fill_jacobian(&mut self, x: &[f64], entries: &mut [f64]);

    /// Writes the entries of the Hessian of `cost` times the share of the cost plus the multipliers times the rows, after
    /// [`refresh`](Self::refresh).
    fn fill_hessian(&mut self, x: &[f64], cost: f64, multipliers: &[f64], entries: &mut [f64]);
}
