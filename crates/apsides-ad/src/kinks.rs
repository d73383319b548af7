//! The kinks of formulas.

use std::collections::HashSet;
use std::sync::Arc;

use crate::formula::{Binary, Formula, Operation, Unary};
use crate::table::Table;

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

/// The steps, relative to the knot or to one, beside a knot of a table at which its slope is that of one side.
const BESIDE: f64 = 1e-12;

/// Operations of a formula that is made.
struct Written {
    inputs: usize,
    operations: Vec<Operation>,
}

impl Written {
    fn push(&mut self, operation: Operation) -> usize {
        self.operations.push(operation);
        self.inputs + self.operations.len() - 1
    }

    fn constant(&mut self, number: f64) -> usize {
        self.push(Operation::Constant(number))
    }

    /// The line through a value at a number, as a function of another value.
    fn line(&mut self, of: usize, through: (f64, f64), slope: f64) -> usize {
        let (number, slope, height) =
            (self.constant(through.0), self.constant(slope), self.constant(through.1));
        let way = self.push(Operation::Binary(Binary::Sub, of, number));
        let rise = self.push(Operation::Binary(Binary::Mul, slope, way));
        self.push(Operation::Binary(Binary::Add, height, rise))
    }
}

impl Operation {
    /// The conditions at which the operation switches, and whether its value jumps there.
    fn conditions(self, tables: &[Arc<Table>]) -> (Vec<Condition>, bool) {
        let zero = |value| vec![Condition::Number { value, number: 0.0 }];
        match self {
            Self::Unary(Unary::Abs, a) => (zero(a), false),
            Self::Unary(Unary::Sign, a) => (zero(a), true),
            Self::Binary(Binary::Min | Binary::Max, a, b) => (vec![Condition::Equal(a, b)], false),
            Self::Select(c, _, _) => (zero(c), true),
            Self::Curve(t, value) => {
                let knots = tables[t].kinks().into_iter();
                (knots.map(|number| Condition::Number { value, number }).collect(), false)
            }
            _ => (Vec::new(), false),
        }
    }
}

impl Formula {
    /// The value that is zero at some kinks of this formula, one output for each: that of a condition less its number, or the first
    /// of two values less the second.
    #[must_use]
    pub fn arguments_of(&self, kinks: &[FormulaKink]) -> Self {
        let mut written = Written { inputs: self.inputs(), operations: self.operations().to_vec() };
        let outputs: Vec<usize> = (kinks.iter())
            .map(|kink| {
                let (value, other) = match kink.condition {
                    Condition::Number { value, number } => (value, written.constant(number)),
                    Condition::Equal(a, b) => (a, b),
                };
                written.push(Operation::Binary(Binary::Sub, value, other))
            })
            .collect();
        Self::pruned(self.inputs(), &written.operations, self.tables(), &outputs)
    }

    /// The values of which the formula takes roots and powers below two that are no whole numbers, one output for each: where one of them is zero,
    /// the formula has no second derivative, and no first one or several of them.
    #[must_use]
    pub fn radicands(&self) -> Self {
        let mut outputs: Vec<usize> = (self.operations().iter())
            .filter_map(|operation| match *operation {
                Operation::Unary(Unary::Sqrt | Unary::Cbrt, a) => Some(a),
                Operation::Powf(a, exponent) if exponent < 2.0 && exponent.fract() != 0.0 => Some(a),
                _ => None,
            })
            .collect();
        outputs.sort_unstable();
        outputs.dedup();
        Self::pruned(self.inputs(), self.operations(), self.tables(), &outputs)
    }

    /// The outputs where the argument of a kink is positive less those where it is negative, each continued to the other side; zero
    /// along the kink unless an output jumps there.
    #[must_use]
    pub fn jump_at(&self, kink: &FormulaKink) -> Self {
        let mut written = Written { inputs: self.inputs(), operations: Vec::new() };
        let [above, below] = [true, false].map(|is_above| self.write_beside(kink, is_above, &mut written));
        let outputs: Vec<usize> = (above.iter().zip(&below))
            .map(|(a, b)| written.push(Operation::Binary(Binary::Sub, *a, *b)))
            .collect();
        Self::pruned(self.inputs(), &written.operations, self.tables(), &outputs)
    }

    /// Writes the formula as it is on one side of a kink, and gives its outputs.
    #[expect(clippy::unreachable, reason = "invariant: a table switches at numbers")]
    fn write_beside(&self, kink: &FormulaKink, is_above: bool, written: &mut Written) -> Vec<usize> {
        let mut place: Vec<usize> = (0..self.inputs()).collect();
        for &operation in self.operations() {
            let (conditions, jumps) = operation.conditions(self.tables());
            let switches = jumps == kink.jumps && conditions.contains(&kink.condition);
            let value = match operation {
                Operation::Unary(Unary::Abs, a) if switches && is_above => place[a],
                Operation::Unary(Unary::Abs, a) if switches => {
                    written.push(Operation::Unary(Unary::Neg, place[a]))
                }
                Operation::Unary(Unary::Sign, _) if switches => {
                    written.constant(if is_above { 1.0 } else { -1.0 })
                }
                Operation::Binary(Binary::Max, a, b) if switches => place[if is_above { a } else { b }],
                Operation::Binary(Binary::Min, a, b) if switches => place[if is_above { b } else { a }],
                Operation::Select(_, a, b) if switches => place[if is_above { a } else { b }],
                Operation::Curve(t, a) if switches => {
                    let Condition::Number { number, .. } = kink.condition else {
                        unreachable!("invariant: a table switches at numbers")
                    };
                    let step = BESIDE * number.abs().max(1.0);
                    let beside = if is_above { number + step } else { number - step };
                    let table = &self.tables()[t];
                    written.line(place[a], (number, table.curve(number)), table.curve_jet(beside)[1])
                }
                _ => written.push(operation.with_operands(|a| place[a], |t| t)),
            };
            place.push(value);
        }
        self.outputs().iter().map(|k| place[*k]).collect()
    }

    /// The places where the formula passes from one piece of a table to the next, across which a second derivative jumps, or a third one.
    #[must_use]
    pub fn joints(&self) -> Vec<FormulaKink> {
        let (mut joints, mut known) = (Vec::new(), HashSet::new());
        for &operation in self.operations() {
            let arguments = match operation {
                Operation::Curve(t, a) => vec![(t, 0, a)],
                Operation::Surface(t, a, b) => vec![(t, 0, a), (t, 1, b)],
                _ => Vec::new(),
            };
            for (table, variable, value) in arguments {
                for number in self.tables()[table].joints(variable) {
                    if known.insert((value, number.to_bits())) {
                        let condition = Condition::Number { value, number };
                        joints.push(FormulaKink { condition, input: None, jumps: false });
                    }
                }
            }
        }
        joints
    }

    /// The places where a first derivative or a value jumps: where absolute values, signs, minima, maxima and selections switch, and the
    /// ends of tables that stay constant beyond them. A condition on constants alone is none.
    #[must_use]
    pub fn kinks(&self) -> Vec<FormulaKink> {
        let mut shapes: Vec<Shape> =
            (0..self.inputs()).map(|input| Shape::Line { input, slope: 1.0, offset: 0.0 }).collect();
        let (mut kinks, mut known) = (Vec::new(), HashSet::new());
        for &operation in self.operations() {
            let (conditions, jumps) = operation.conditions(self.tables());
            for condition in conditions {
                let (key, shape) = match condition {
                    Condition::Number { value, number } => {
                        let number_as_shape = Shape::constant(number);
                        let shape = shapes[value].combine(1.0, number_as_shape, -1.0);
                        ((value, number.to_bits(), jumps), shape)
                    }
                    Condition::Equal(a, b) => ((a, b as u64, jumps), shapes[a].combine(1.0, shapes[b], -1.0)),
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

#[cfg(test)]
mod tests;
