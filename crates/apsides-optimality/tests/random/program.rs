//! Nonlinear programs assembled from terms, so that a generator can put any function anywhere, and the generator of
//! pseudo-random numbers.

use apsides_nlp::{Nlp, Pattern};

use crate::support::INF;

/// SplitMix64 (Steele, Lea, Flood 2014, doi 10.1145/2660193.2660195): the same numbers on every machine.
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform between the two numbers.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// An index below `count`, which is not zero.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    /// A coefficient of either sign, not close to zero.
    pub(crate) fn coefficient(&mut self) -> f64 {
        let size = self.between(0.1, 2.0);
        if self.chance(0.5) { size } else { -size }
    }

    /// Ten to a power between the two.
    pub(crate) fn power_of_ten(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.between(low, high))
    }

    pub(crate) fn point(&mut self, n: usize, low: f64, high: f64) -> Vec<f64> {
        (0..n).map(|_| self.between(low, high)).collect()
    }
}

/// The form of a term in its variable `x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Form {
    Constant,
    Linear,
    /// `x` times the other variable, which may be the same.
    Product(usize),
    Fourth,
    /// `exp(rate x)`.
    Exp(f64),
    /// NaN where `x` is not positive.
    Log,
    Reciprocal,
}

/// `factor` times a form of the variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Term {
    pub factor: f64,
    pub variable: usize,
    pub form: Form,
}

impl Term {
    pub(crate) fn new(factor: f64, variable: usize, form: Form) -> Self {
        Self { factor, variable, form }
    }

    /// Value, first and second derivative by the variable; a product counts as linear in it.
    fn derivatives(&self, x: &[f64]) -> [f64; 3] {
        let u = x[self.variable];
        let [value, first, second] = match self.form {
            Form::Constant => [1.0, 0.0, 0.0],
            Form::Linear => [u, 1.0, 0.0],
            Form::Product(other) if other == self.variable => [u * u, 2.0 * u, 2.0],
            Form::Product(other) => [u * x[other], x[other], 0.0],
            Form::Fourth => [u.powi(4), 4.0 * u.powi(3), 12.0 * u * u],
            Form::Exp(rate) => {
                let e = (rate * u).exp();
                [e, rate * e, rate * rate * e]
            }
            Form::Log if u > 0.0 => [u.ln(), 1.0 / u, -1.0 / (u * u)],
            Form::Log => [f64::NAN; 3],
            Form::Reciprocal => [1.0 / u, -1.0 / (u * u), 2.0 / u.powi(3)],
        };
        [self.factor * value, self.factor * first, self.factor * second]
    }

    /// The other variable of a product of two.
    fn other(&self) -> Option<usize> {
        match self.form {
            Form::Product(other) if other != self.variable => Some(other),
            _ => None,
        }
    }

    fn is_linear(&self) -> bool {
        matches!(self.form, Form::Constant | Form::Linear)
    }
}

/// A sum of terms.
pub(crate) type Function = Vec<Term>;

pub(crate) fn value(function: &[Term], x: &[f64]) -> f64 {
    function.iter().map(|term| term.derivatives(x)[0]).sum()
}

/// The function times a number.
pub(crate) fn multiple(function: &[Term], factor: f64) -> Function {
    function.iter().map(|term| Term { factor: factor * term.factor, ..*term }).collect()
}

/// `factor (a^T x + b)^2`, where `linear` has the terms of `a^T x`.
pub(crate) fn square(linear: &[Term], offset: f64, factor: f64) -> Function {
    let mut out = vec![Term::new(factor * offset * offset, 0, Form::Constant)];
    for (k, a) in linear.iter().enumerate() {
        out.push(Term::new(2.0 * factor * offset * a.factor, a.variable, Form::Linear));
        out.push(Term::new(factor * a.factor * a.factor, a.variable, Form::Product(a.variable)));
        for b in &linear[..k] {
            out.push(Term::new(2.0 * factor * a.factor * b.factor, a.variable, Form::Product(b.variable)));
        }
    }
    out
}

/// A constraint.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub function: Function,
    pub lower: f64,
    pub upper: f64,
}

impl Row {
    pub(crate) fn equality(function: Function, target: f64) -> Self {
        Self { function, lower: target, upper: target }
    }

    pub(crate) fn at_most(function: Function, upper: f64) -> Self {
        Self { function, lower: -INF, upper }
    }

    pub(crate) fn at_least(function: Function, lower: f64) -> Self {
        Self { function, lower, upper: INF }
    }
}

/// A program of sums of terms. Every term has entries of its own in the patterns, so that pairs repeat.
#[derive(Debug, Clone)]
pub(crate) struct Program {
    pub start: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub objective: Function,
    pub rows: Vec<Row>,
}

impl Program {
    /// Without bounds, objective and rows.
    pub(crate) fn free(start: Vec<f64>) -> Self {
        let n = start.len();
        Self { start, lower: vec![-INF; n], upper: vec![INF; n], objective: Vec::new(), rows: Vec::new() }
    }
}

impl Nlp for Program {
    fn variables(&self) -> usize {
        self.start.len()
    }
    fn constraints(&self) -> usize {
        self.rows.len()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        for (i, row) in self.rows.iter().enumerate() {
            (lower[i], upper[i]) = (row.lower, row.upper);
        }
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn jacobian_pattern(&self) -> Pattern {
        let mut pattern = Pattern::default();
        for (i, row) in self.rows.iter().enumerate() {
            for term in &row.function {
                for variable in std::iter::once(term.variable).chain(term.other()) {
                    pattern.rows.push(i);
                    pattern.cols.push(variable);
                }
            }
        }
        pattern
    }
    fn hessian_pattern(&self) -> Pattern {
        let functions = std::iter::once(&self.objective).chain(self.rows.iter().map(|row| &row.function));
        Pattern::from_pairs(functions.flatten().filter(|term| !term.is_linear()).map(|term| {
            let other = term.other().unwrap_or(term.variable);
            (term.variable.max(other), term.variable.min(other))
        }))
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        value(&self.objective, x)
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        for term in &self.objective {
            gradient[term.variable] += term.derivatives(x)[1];
            if let Some(other) = term.other() {
                gradient[other] += term.factor * x[term.variable];
            }
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        for (out, row) in values.iter_mut().zip(&self.rows) {
            *out = value(&row.function, x);
        }
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let mut entries = values.iter_mut();
        let mut push = |value: f64| {
            if let Some(entry) = entries.next() {
                *entry = value;
            }
        };
        for term in self.rows.iter().flat_map(|row| &row.function) {
            push(term.derivatives(x)[1]);
            if term.other().is_some() {
                push(term.factor * x[term.variable]);
            }
        }
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let rows = self.rows.iter().zip(multipliers).map(|(row, y)| (&row.function, *y));
        let terms = std::iter::once((&self.objective, objective_factor))
            .chain(rows)
            .flat_map(|(function, weight)| function.iter().map(move |term| (term, weight)));
        let nonlinear = terms.filter(|(term, _)| !term.is_linear());
        for (entry, (term, weight)) in values.iter_mut().zip(nonlinear) {
            let second = if term.other().is_some() { term.factor } else { term.derivatives(x)[2] };
            *entry = weight * second;
        }
    }
}
