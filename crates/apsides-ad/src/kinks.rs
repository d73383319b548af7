//! The kinks of formulas.

use std::collections::HashSet;

use crate::formula::{Binary, Formula, Operation, Unary};

/// The condition at which a formula switches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Condition {
    /// A value is equal to a number.
    Number {
        /// The value.
        value: usize,
        /// The number.
        number: f64,
    },
    /// Two values are equal.
    Equal(usize, usize),
}

/// A place at which a formula has a kink or a jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormulaKink {
    /// The condition under which a formula is not smooth.
    pub condition: Condition,
    /// The input, and its number there, if the condition is that one input has a number.
    pub input: Option<(usize, f64)>,
    /// Says whether the value jumps there, not only its slope.
    pub jumps: bool,
}

/// A value as a function of the inputs.
#[derive(Clone, Copy)]
enum Shape {
    /// `offset + slope z[input]`; a constant has slope zero.
    Line { input: usize, slope: f64, offset: f64 },
    /// Anything else.
    Other,
}

impl Shape {
    fn constant(offset: f64) -> Self {
        Self::Line { input: 0, slope: 0.0, offset }
    }

    /// `a self + b other`.
    fn combine(self, a: f64, other: Self, b: f64) -> Self {
        match (self, other) {
            (Self::Line { input: i, slope: s, offset: c }, Self::Line { input: j, slope: t, offset: d })
                if i == j || s == 0.0 || t == 0.0 =>
            {
                Self::Line {
                    input: if s == 0.0 { j } else { i },
                    slope: a * s + b * t,
                    offset: a * c + b * d,
                }
            }
            _ => Self::Other,
        }
    }

    fn number(self) -> Option<f64> {
        match self {
            Self::Line { slope: 0.0, offset, .. } => Some(offset),
            _ => None,
        }
    }

    /// The input and its number where the value is zero.
    fn root(self) -> Option<(usize, f64)> {
        match self {
            Self::Line { input, slope, offset } if slope != 0.0 => {
                Some((input, -offset / slope)).filter(|r| r.1.is_finite())
            }
            _ => None,
        }
    }
}

impl Formula {
    /// The places where a first derivative or a value jumps: where absolute values, signs, minima, maxima and selections switch, and the
    /// ends of tables that stay constant beyond them. A condition on constants alone is none.
    #[must_use]
    pub fn kinks(&self) -> Vec<FormulaKink> {
        let mut shapes: Vec<Shape> =
            (0..self.inputs()).map(|input| Shape::Line { input, slope: 1.0, offset: 0.0 }).collect();
        let (mut kinks, mut known) = (Vec::new(), HashSet::new());
        for &operation in self.operations() {
            let at = |value: usize, number: f64| {
                (
                    Condition::Number { value, number },
                    shapes[value].combine(1.0, Shape::constant(number), -1.0),
                )
            };
            let (conditions, jumps) = match operation {
                Operation::Unary(Unary::Abs, a) => (vec![at(a, 0.0)], false),
                Operation::Unary(Unary::Sign, a) => (vec![at(a, 0.0)], true),
                Operation::Binary(Binary::Min | Binary::Max, a, b) => {
                    (vec![(Condition::Equal(a, b), shapes[a].combine(1.0, shapes[b], -1.0))], false)
                }
                Operation::Select(c, _, _) => (vec![at(c, 0.0)], true),
                Operation::Curve(t, a) => {
                    (self.tables()[t].kinks().into_iter().map(|knot| at(a, knot)).collect(), false)
                }
                _ => (Vec::new(), false),
            };
            for (condition, shape) in conditions {
                let key = match condition {
                    Condition::Number { value, number } => (value, number.to_bits(), jumps),
                    Condition::Equal(a, b) => (a, b as u64, jumps),
                };
                if shape.number().is_none() && known.insert((std::mem::discriminant(&condition), key)) {
                    kinks.push(FormulaKink { condition, input: shape.root(), jumps });
                }
            }
            shapes.push(shape(operation, &shapes));
        }
        kinks
    }
}

fn shape(operation: Operation, shapes: &[Shape]) -> Shape {
    let zero = Shape::constant(0.0);
    match operation {
        Operation::Constant(c) => Shape::constant(c),
        Operation::Unary(Unary::Neg, a) => shapes[a].combine(-1.0, zero, 0.0),
        Operation::Binary(Binary::Add, a, b) => shapes[a].combine(1.0, shapes[b], 1.0),
        Operation::Binary(Binary::Sub, a, b) => shapes[a].combine(1.0, shapes[b], -1.0),
        Operation::Binary(Binary::Mul, a, b) => match (shapes[a].number(), shapes[b].number()) {
            (_, Some(c)) => shapes[a].combine(c, zero, 0.0),
            (Some(c), _) => shapes[b].combine(c, zero, 0.0),
            _ => Shape::Other,
        },
        Operation::Binary(Binary::Div, a, b) => match shapes[b].number() {
            Some(c) => shapes[a].combine(1.0 / c, zero, 0.0),
            None => Shape::Other,
        },
        _ => Shape::Other,
    }
}
