//! Sums of squares in formulas.

use apsides_ad::Formula;
use apsides_ad::formula::{Binary, Operation, Unary};

use crate::Phase;

/// Terms of a sum: one in which values occur again and again could have more of them than can be looked at.
const MOST_TERMS: usize = 64;

/// A value times a factor, of which a term is the square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Root {
    pub(crate) value: usize,
    pub(crate) factor: f64,
}

impl Root {
    /// The root of the square times a number.
    fn times(self, number: f64) -> Self {
        Self { factor: self.factor * number.sqrt(), ..self }
    }
}

/// A term of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Summand {
    pub(crate) value: usize,
    pub(crate) is_added: bool,
}

/// The terms of which a value is the sum; none if an input of the formula is among them, or they are too many.
pub(crate) fn terms(formula: &Formula, sum: usize) -> Option<Vec<Summand>> {
    let mut terms = Vec::new();
    let mut open = vec![Summand { value: sum, is_added: true }];
    while let Some(term) = open.pop() {
        let Summand { value, is_added } = term;
        let added = |value| Summand { value, is_added };
        let taken = |value| Summand { value, is_added: !is_added };
        match operation(formula, value)? {
            Operation::Unary(Unary::Neg, a) => open.push(taken(a)),
            Operation::Binary(Binary::Add, a, b) => open.extend([added(a), added(b)]),
            Operation::Binary(Binary::Sub, a, b) => open.extend([added(a), taken(b)]),
            _ if terms.len() < MOST_TERMS => terms.push(term),
            _ => return None,
        }
    }
    Some(terms)
}

/// The value, and its factor, of which another value is the square.
pub(crate) fn root(formula: &Formula, value: usize) -> Option<Root> {
    match operation(formula, value)? {
        Operation::Binary(Binary::Mul, a, b) if a == b => Some(Root { value: a, factor: 1.0 }),
        Operation::Powi(value, 2) => Some(Root { value, factor: 1.0 }),
        Operation::Binary(Binary::Mul, a, b) => {
            let of = |c: f64, square: usize| Some(root(formula, square)?.times(c));
            constant(formula, a)
                .and_then(|c| of(c, b))
                .or_else(|| constant(formula, b).and_then(|c| of(c, a)))
        }
        Operation::Binary(Binary::Div, a, b) => {
            let divisor = constant(formula, b)?;
            Some(root(formula, a)?.times(1.0 / divisor))
        }
        _ => None,
    }
    .filter(|root| root.factor > 0.0 && root.factor.is_finite())
}

/// The controls of whose vector the roots are the components, in their order; none if they are fewer than two, or anything else.
pub(crate) fn vector_of_controls(phase: &Phase, roots: &[Root]) -> Option<Vec<usize>> {
    let control = |root: &Root| {
        let control = root.value.checked_sub(phase.states.len());
        control.filter(|c| root.factor == 1.0 && *c < phase.controls.len())
    };
    let mut controls = roots.iter().map(control).collect::<Option<Vec<_>>>()?;
    controls.sort_unstable();
    let is_set = controls.windows(2).all(|w| w[0] != w[1]);
    (is_set && controls.len() > 1).then_some(controls)
}

fn operation(formula: &Formula, value: usize) -> Option<Operation> {
    value.checked_sub(formula.inputs()).map(|k| formula.operations()[k])
}

fn constant(formula: &Formula, value: usize) -> Option<f64> {
    match operation(formula, value) {
        Some(Operation::Constant(c)) => Some(c),
        _ => None,
    }
}
