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
    pub(crate) function: Arc<dyn NodeFunction>,
    pub(crate) last: Last,
}

/// Outputs and first derivatives at the last point of each: one evaluation serves objective and constraints, or gradient
/// and Jacobian, and memory is kept.
#[derive(Clone, Default)]
pub(crate) struct Last {
    values: Evaluated,
    /// Outputs, then the entries of their Jacobian.
    derivatives: Evaluated,
    /// Weights of the outputs in the Hessian.
    weights: Vec<f64>,
}

/// Numbers computed at a point.
#[derive(Clone, Default)]
struct Evaluated {
    /// None before the first evaluation.
    at: Option<Vec<f64>>,
    numbers: Vec<f64>,
}

impl Evaluated {
    /// The numbers at `x`, from `evaluate` unless it is the last point.
    fn at(&mut self, x: &[f64], length: usize, evaluate: impl FnOnce(&mut [f64])) -> &[f64] {
        // By bits: functions may differ at 0 and -0, and a point that is not a number is the same again.
        let is_last = |last: &Vec<f64>| last.iter().zip(x).all(|(a, b)| a.to_bits() == b.to_bits());
        if !self.at.as_ref().is_some_and(is_last) {
            let at = self.at.get_or_insert_default();
            at.clear();
            at.extend_from_slice(x);
            self.numbers.resize(length, 0.0);
            evaluate(&mut self.numbers);
        }
        &self.numbers
    }
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
            last: Default::default(),
        }
    }};
}
pub(crate) use program;

impl Program {
    /// Returns true if an objective agrees with the optimum to the tolerance.
    #[must_use]
    pub fn agrees_with(&self, objective: f64) -> bool {
        (objective - self.optimum).abs() <= self.tolerance * self.optimum.abs().max(1.0)
    }

    /// Output 0 is the objective, the others are the constraints.
    #[must_use]
    pub fn function(&self) -> &dyn NodeFunction {
        &*self.function
    }

    fn values(&mut self, x: &[f64]) -> &[f64] {
        let function = &self.function;
        self.last.values.at(x, function.outputs(), |out| function.value(x, out))
    }

    /// Entries of the Jacobian of all outputs.
    fn entries(&mut self, x: &[f64]) -> &[f64] {
        let function = &self.function;
        let outputs = function.outputs();
        let numbers = self.last.derivatives.at(x, outputs + function.pattern().jacobian_len(), |numbers| {
            let (out, entries) = numbers.split_at_mut(outputs);
            function.jacobian(x, out, entries);
        });
        &numbers[outputs..]
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
        let function = Arc::clone(&self.function);
        gradient.fill(0.0);
        // The entries of output 0 come first.
        let pattern = function.pattern();
        for (&col, &value) in pattern.columns[..pattern.row_offsets[1]].iter().zip(self.entries(x)) {
            gradient[col] = value;
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&self.values(x)[1..]);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let first = self.function.pattern().row_offsets[1];
        values.copy_from_slice(&self.entries(x)[first..]);
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let weights = &mut self.last.weights;
        weights.clear();
        weights.push(objective_factor);
        weights.extend_from_slice(multipliers);
        self.function.hessian(x, weights, values);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use apsides_ad::NodePattern;
    use apsides_ad::{Formula, trace::OpaqueFunction};

    use super::*;
    use crate::nlp::hock_schittkowski::collection;

    /// Counts evaluations.
    struct Counted {
        function: Arc<dyn NodeFunction>,
        values: AtomicUsize,
        jacobians: AtomicUsize,
    }

    impl NodeFunction for Counted {
        fn inputs(&self) -> usize {
            self.function.inputs()
        }
        fn outputs(&self) -> usize {
            self.function.outputs()
        }
        fn pattern(&self) -> &NodePattern {
            self.function.pattern()
        }
        fn value(&self, z: &[f64], out: &mut [f64]) {
            self.values.fetch_add(1, Ordering::Relaxed);
            self.function.value(z, out);
        }
        fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
            self.jacobians.fetch_add(1, Ordering::Relaxed);
            self.function.jacobian(z, out, entries);
        }
        fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
            self.function.hessian(z, weights, entries);
        }
        fn formula(&self) -> Result<Formula, OpaqueFunction> {
            self.function.formula()
        }
    }

    #[test]
    fn a_point_is_evaluated_once() {
        let mut program = collection().into_iter().find(|p| p.number == 71).expect("in the collection");
        let counted = Arc::new(Counted { function: program.function, values: 0.into(), jacobians: 0.into() });
        program.function = Arc::clone(&counted) as Arc<dyn NodeFunction>;
        let counts = || (counted.values.load(Ordering::Relaxed), counted.jacobians.load(Ordering::Relaxed));
        let (mut c, mut g, mut j) = ([0.0; 2], [0.0; 4], [0.0; 8]);
        let x = [1.0, 5.0, 5.0, 1.0];
        // x0 x3 (x0 + x1 + x2) + x2, the product and the sum of squares.
        assert_eq!(program.objective(&x), 16.0);
        program.constraint_values(&x, &mut c);
        assert_eq!(c, [25.0, 52.0]);
        program.gradient(&x, &mut g);
        assert_eq!(g, [12.0, 1.0, 2.0, 11.0]);
        program.jacobian(&x, &mut j);
        assert_eq!(j, [25.0, 5.0, 5.0, 25.0, 2.0, 10.0, 10.0, 2.0]);
        assert_eq!(counts(), (1, 1));
        let next = [1.0, 5.0, 5.0, 2.0];
        assert_eq!(program.objective(&next), 27.0);
        program.gradient(&x, &mut g);
        assert_eq!(counts(), (2, 1));
        program.gradient(&next, &mut g);
        assert_eq!(g, [24.0, 2.0, 3.0, 11.0]);
        // Zeros of either sign are two points.
        program.objective(&[0.0, 5.0, 5.0, 2.0]);
        program.objective(&[-0.0, 5.0, 5.0, 2.0]);
        assert_eq!(counts(), (4, 2));
    }
}
