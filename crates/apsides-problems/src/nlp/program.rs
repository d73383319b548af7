//! One program of a collection as an [`Nlp`] by exact differentiation.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_nlp::{Nlp, Pattern};

pub(crate) const INF: f64 = f64::INFINITY;

/// A nonlinear program with its published start and optimum.
#[derive(Clone)]
pub struct Program {
    /// Number in its collection.
    pub number: u32,
    /// Start as published.
    pub start: Vec<f64>,
    /// Lower bounds of the variables.
    pub lower: Vec<f64>,
    /// Upper bounds of the variables.
    pub upper: Vec<f64>,
    /// Lower bounds of the constraints.
    pub constraint_lower: Vec<f64>,
    /// Upper bounds of the constraints.
    pub constraint_upper: Vec<f64>,
    /// Best known value of the objective.
    pub optimum: f64,
    /// Largest difference from the optimum that its digits support, relative to its magnitude or 1.
    pub tolerance: f64,
    /// Output 0 is the objective, the others are the constraints.
    pub function: Arc<dyn NodeFunction>,
}

/// `program!(number, variables, 1 + constraints, start, (lower, upper), (constraint bounds), optimum, tolerance, |x| outputs)`
///
/// The body is generic in the scalar `S`; output 0 is the objective.
macro_rules! program {
    ($number:literal, $n:literal, $m:literal, $start:expr, ($lower:expr, $upper:expr), ($cl:expr, $cu:expr),
     $optimum:expr, $tolerance:expr, |$x:ident| $body:expr) => {{
        struct Function;
        impl apsides_ad::VectorFunction<$n, $m> for Function {
            fn evaluate<S: apsides_ad::Scalar>(&self, $x: &[S; $n]) -> [S; $m] {
                $body
            }
        }
        let (start, lower, upper): ([f64; $n], [f64; $n], [f64; $n]) = ($start, $lower, $upper);
        let (constraint_lower, constraint_upper): ([f64; $m - 1], [f64; $m - 1]) = ($cl, $cu);
        $crate::nlp::Program {
            number: $number,
            start: start.to_vec(),
            lower: lower.to_vec(),
            upper: upper.to_vec(),
            constraint_lower: constraint_lower.to_vec(),
            constraint_upper: constraint_upper.to_vec(),
            optimum: $optimum,
            tolerance: $tolerance,
            function: apsides_ad::vector_node(Function),
        }
    }};
}
pub(crate) use program;

impl Program {
    /// Whether an objective agrees with the optimum to the tolerance.
    #[must_use]
    pub fn agrees_with(&self, objective: f64) -> bool {
        (objective - self.optimum).abs() <= self.tolerance * self.optimum.abs().max(1.0)
    }

    /// The same program from ten times its start, clipped into the bounds.
    #[must_use]
    pub fn from_far(mut self) -> Self {
        for (x, (lower, upper)) in self.start.iter_mut().zip(self.lower.iter().zip(&self.upper)) {
            *x = (10.0 * *x).clamp(*lower, *upper);
        }
        self
    }

    fn values(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.function.outputs()];
        self.function.value(x, &mut out);
        out
    }

    fn entries(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.function.outputs()];
        let mut entries = vec![0.0; self.function.pattern().jacobian_len()];
        self.function.jacobian(x, &mut out, &mut entries);
        entries
    }
}

impl Nlp for Program {
    fn variables(&self) -> usize {
        self.start.len()
    }
    fn constraints(&self) -> usize {
        self.constraint_lower.len()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.constraint_lower);
        upper.copy_from_slice(&self.constraint_upper);
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn jacobian_pattern(&self) -> Pattern {
        let entries = self.function.pattern().jacobian_entries();
        Pattern::from_pairs(entries.filter(|entry| entry.0 > 0).map(|(row, col)| (row - 1, col)))
    }
    fn hessian_pattern(&self) -> Pattern {
        Pattern::from_pairs(self.function.pattern().hessian.iter().copied())
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        self.values(x)[0]
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        let entries = self.entries(x);
        for ((_, col), value) in
            self.function.pattern().jacobian_entries().zip(entries).filter(|e| e.0.0 == 0)
        {
            gradient[col] = value;
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&self.values(x)[1..]);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&self.entries(x)[self.function.pattern().row_offsets[1]..]);
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let weights: Vec<f64> =
            std::iter::once(objective_factor).chain(multipliers.iter().copied()).collect();
        self.function.hessian(x, &weights, values);
    }
}
