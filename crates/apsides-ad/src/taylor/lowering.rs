//! Formulas as the few rules that have recurrences.
//!
//! | rule | recurrence of the coefficients, `[k]` the one of order `k` |
//! | --- | --- |
//! | product `a b` | `sum_j a[j] b[k - j]` |
//! | quotient `q = a / b` | `(a[k] - sum_(j > 0) b[j] q[k - j]) / b[0]` |
//! | power `p = a^c` | `sum_(j > 0) (c j - (k - j)) a[j] p[k - j] / (k a[0])` |
//! | integral `y' = g a'` | `sum_(j > 0) j a[j] g[k - j] / k` |
//!
//! Every elementary function is an integral whose slope `g` is made of these rules again, as `sin' = cos a'`.

use std::collections::HashMap;

use super::TaylorError;
use crate::formula::{Binary, Formula, Operation, Unary};

/// The value that an integral or a power starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Start {
    Unary(Unary),
    Powf(f64),
    /// Angle of a point, of which the operand is the ordinate and this value the abscissa.
    Atan2(usize),
    Zero,
}

/// The way a value follows from those before it; an integral also from the values of lower order of its slope, which stands after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rule {
    /// State, parameter or time.
    Input,
    /// The same all along the solution.
    Fixed(Operation),
    /// `a + factor b`.
    Sum {
        a: usize,
        b: usize,
        factor: f64,
    },
    /// `by of`, where `by` is fixed.
    Scaled {
        by: usize,
        of: usize,
    },
    Product(usize, usize),
    Quotient(usize, usize),
    /// Times a fixed value, if any: the recurrence is the same.
    Power {
        of: usize,
        exponent: f64,
        start: Start,
        by: Option<usize>,
    },
    /// Times a fixed value, if any, where the slope is the integral itself.
    Integral {
        of: usize,
        start: Start,
        by: Option<usize>,
    },
}

/// A formula in these rules.
#[derive(Debug, Default)]
pub(super) struct Lowered {
    pub(super) rules: Vec<Rule>,
    /// One for each value: it changes along the solution.
    pub(super) moves: Vec<bool>,
    /// The slope of each integral.
    pub(super) slopes: HashMap<usize, usize>,
    pub(super) outputs: Vec<usize>,
    /// Base and exponent of values that are powers with an exponent that is no integer, so that the base is not negative.
    powers: HashMap<usize, (usize, f64)>,
    known: HashMap<[u64; 4], usize>,
}

/// Largest exponent that is taken as a product.
const LARGEST_PRODUCT: f64 = 1024.0;

impl Lowered {
    /// Inputs are states, parameters and the time.
    pub(super) fn new(formula: &Formula, states: usize) -> Result<Self, TaylorError> {
        let mut lowered = Self::default();
        let inputs = formula.inputs();
        for k in 0..inputs {
            lowered.rules.push(Rule::Input);
            lowered.moves.push(k < states || k + 1 == inputs);
        }
        let mut places: Vec<usize> = (0..inputs).collect();
        for (k, operation) in formula.operations().iter().enumerate() {
            let operation = operation.with_operands(|a| places[a], |table| table);
            let value = if operation.operands().any(|a| lowered.moves[a]) {
                lowered.operate(operation).ok_or_else(|| refusal(k, operation))?
            } else {
                lowered.fixed(operation)
            };
            places.push(value);
        }
        lowered.outputs = formula.outputs().iter().map(|&k| places[k]).collect();
        Ok(lowered)
    }

    fn fixed(&mut self, operation: Operation) -> usize {
        self.rules.push(Rule::Fixed(operation));
        self.moves.push(false);
        self.rules.len() - 1
    }

    fn number(&mut self, number: f64) -> usize {
        let key = [u64::MAX, number.to_bits(), 0, 0];
        match self.known.get(&key) {
            Some(&value) => value,
            None => {
                let value = self.fixed(Operation::Constant(number));
                self.known.insert(key, value);
                value
            }
        }
    }

    /// The value of a rule that moves, which is that of an equal one before it.
    fn rule(&mut self, rule: Rule) -> usize {
        let start = |start| match start {
            Start::Unary(f) => [1, f as u64],
            Start::Powf(c) => [2, c.to_bits()],
            Start::Atan2(x) => [3, x as u64],
            Start::Zero => [4, 0],
        };
        let times = |by: Option<usize>| by.map_or(0, |v| (v as u64 + 1) << 32);
        let key = match rule {
            Rule::Input | Rule::Fixed(_) => [0; 4],
            Rule::Sum { a, b, factor } => [1, a as u64, b as u64, factor.to_bits()],
            Rule::Scaled { by, of } => [2, by as u64, of as u64, 0],
            Rule::Product(a, b) => [3, a.min(b) as u64, a.max(b) as u64, 0],
            Rule::Quotient(a, b) => [4, a as u64, b as u64, 0],
            Rule::Power { of, exponent, by, .. } => [5 + times(by), of as u64, exponent.to_bits(), 0],
            Rule::Integral { of, start: from, by } => {
                [6 + times(by), of as u64, start(from)[0], start(from)[1]]
            }
        };
        let next = self.rules.len();
        let value = *self.known.entry(key).or_insert(next);
        if value == next {
            self.rules.push(rule);
            self.moves.push(true);
        }
        value
    }

    fn sum(&mut self, a: usize, b: usize, factor: f64) -> usize {
        self.rule(Rule::Sum { a, b, factor })
    }

    fn product(&mut self, a: usize, b: usize) -> usize {
        match (self.moves[a], self.moves[b]) {
            (false, false) => self.fixed(Operation::Binary(Binary::Mul, a, b)),
            (false, true) => self.scaled(a, b),
            (true, false) => self.scaled(b, a),
            (true, true) => match self.merged(a, b, 1.0) {
                Some(power) => power,
                None => self.rule(Rule::Product(a, b)),
            },
        }
    }

    /// A fixed value times one that moves: of powers and exponentials the fixed value is a factor of the start.
    fn scaled(&mut self, by: usize, of: usize) -> usize {
        match self.rules[of] {
            Rule::Power { of, exponent, start, by: None } => {
                self.rule(Rule::Power { of, exponent, start, by: Some(by) })
            }
            Rule::Integral { of, start: start @ Start::Unary(Unary::Exp), by: None } => {
                let value = self.rule(Rule::Integral { of, start, by: Some(by) });
                self.slopes.insert(value, value);
                value
            }
            _ => self.rule(Rule::Scaled { by, of }),
        }
    }

    fn quotient(&mut self, a: usize, b: usize) -> usize {
        if !self.moves[b] {
            let one = self.number(1.0);
            let by = self.fixed(Operation::Binary(Binary::Div, one, b));
            return self.product(by, a);
        }
        if let Some(power) = self.merged(a, b, -1.0) {
            return power;
        }
        match self.powers.get(&b) {
            Some(&(base, exponent)) => {
                let inverse = self.power(base, -exponent);
                self.product(a, inverse)
            }
            None => self.rule(Rule::Quotient(a, b)),
        }
    }

    /// `a b^sign` where both are powers of one base.
    fn merged(&mut self, a: usize, b: usize, sign: f64) -> Option<usize> {
        let [first, second] = [a, b].map(|v| self.powers.get(&v).copied());
        let (base, exponent) = match (first, second) {
            (Some((base, c)), Some((other, d))) if base == other => (base, c + sign * d),
            (Some((base, c)), None) if base == b => (base, c + sign),
            (None, Some((base, d))) if base == a => (base, 1.0 + sign * d),
            _ => return None,
        };
        if exponent == 0.0 {
            return None;
        }
        Some(if exponent == 1.0 { base } else { self.power(base, exponent) })
    }

    /// A power with an exponent that may be any number but zero.
    fn power(&mut self, of: usize, exponent: f64) -> usize {
        let start = if exponent == 0.5 { Start::Unary(Unary::Sqrt) } else { Start::Powf(exponent) };
        let value = self.rule(Rule::Power { of, exponent, start, by: None });
        if exponent.fract() != 0.0 {
            self.powers.insert(value, (of, exponent));
        }
        value
    }

    fn square(&mut self, a: usize) -> usize {
        self.rule(Rule::Product(a, a))
    }

    /// A power as products: a base of zero has one too.
    fn integer_power(&mut self, a: usize, n: u32) -> usize {
        let (mut square, mut left, mut power) = (a, n, None);
        loop {
            if left & 1 == 1 {
                power = Some(power.map_or(square, |p| self.rule(Rule::Product(p, square))));
            }
            left >>= 1;
            match power {
                Some(power) if left == 0 => return power,
                _ => square = self.square(square),
            }
        }
    }

    /// `y' = g a'`, with the slope `g` made from `y`.
    fn integral(&mut self, f: Unary, a: usize, slope: impl FnOnce(&mut Self, usize) -> usize) -> usize {
        let y = self.rule(Rule::Integral { of: a, start: Start::Unary(f), by: None });
        if !self.slopes.contains_key(&y) {
            // Before the slope is there it may ask for this integral again.
            self.slopes.insert(y, y);
            let g = slope(self, y);
            self.slopes.insert(y, g);
        }
        y
    }

    /// `offset + factor b`.
    fn affine(&mut self, offset: f64, b: usize, factor: f64) -> usize {
        let offset = self.number(offset);
        self.sum(offset, b, factor)
    }

    fn negated(&mut self, a: usize) -> usize {
        let minus = self.number(-1.0);
        self.rule(Rule::Scaled { by: minus, of: a })
    }

    fn recip(&mut self, a: usize) -> usize {
        let one = self.number(1.0);
        self.quotient(one, a)
    }

    /// The value of an operation on values of which one moves; none if it has no recurrence.
    fn operate(&mut self, operation: Operation) -> Option<usize> {
        Some(match operation {
            Operation::Unary(f, a) => self.unary(f, a)?,
            Operation::Binary(Binary::Add, a, b) if !self.moves[b] => self.sum(b, a, 1.0),
            Operation::Binary(Binary::Add, a, b) => self.sum(a, b, 1.0),
            Operation::Binary(Binary::Sub, a, b) => self.sum(a, b, -1.0),
            Operation::Binary(Binary::Mul, a, b) => self.product(a, b),
            Operation::Binary(Binary::Div, a, b) => self.quotient(a, b),
            Operation::Binary(Binary::Atan2, y, x) => self.angle(y, x),
            Operation::Binary(Binary::Pow, a, b) => {
                let ln = if self.moves[a] {
                    self.unary(Unary::Ln, a)?
                } else {
                    self.fixed(Operation::Unary(Unary::Ln, a))
                };
                let exponent = self.product(b, ln);
                self.unary(Unary::Exp, exponent)?
            }
            Operation::Powi(a, n) => self.real_power(a, f64::from(n)),
            Operation::Powf(a, c) => self.real_power(a, c),
            Operation::Constant(_)
            | Operation::Binary(Binary::Min | Binary::Max, ..)
            | Operation::Select(..)
            | Operation::Curve(..)
            | Operation::Surface(..) => return None,
        })
    }

    fn real_power(&mut self, a: usize, c: f64) -> usize {
        if c == 0.0 {
            self.number(1.0)
        } else if c.fract() != 0.0 || c.abs() > LARGEST_PRODUCT {
            self.power(a, c)
        } else {
            let power = self.integer_power(a, c.abs() as u32);
            if c < 0.0 { self.recip(power) } else { power }
        }
    }

    /// The angle of a point: `(x y' - y x') / (x^2 + y^2)` is the sum of two integrals.
    fn angle(&mut self, y: usize, x: usize) -> usize {
        let (yy, xx) = (self.product(y, y), self.product(x, x));
        let square = match (self.moves[yy], self.moves[xx]) {
            (true, _) => self.sum(xx, yy, 1.0),
            (false, _) => self.sum(yy, xx, 1.0),
        };
        let (along_y, along_x) = (self.quotient(x, square), self.quotient(y, square));
        let turned = self.negated(along_x);
        let first = self.rule(Rule::Integral { of: y, start: Start::Atan2(x), by: None });
        let second = self.rule(Rule::Integral { of: x, start: Start::Zero, by: None });
        // The second is of one point alone: with another ordinate it has another slope.
        let second = if *self.slopes.entry(second).or_insert(turned) == turned {
            second
        } else {
            self.rules.push(Rule::Integral { of: x, start: Start::Zero, by: None });
            self.moves.push(true);
            self.rules.len() - 1
        };
        self.slopes.insert(first, along_y);
        self.slopes.insert(second, turned);
        self.sum(first, second, 1.0)
    }

    fn unary(&mut self, f: Unary, a: usize) -> Option<usize> {
        use Unary::*;
        Some(match f {
            Neg => self.negated(a),
            Sqrt => match self.powers.get(&a) {
                Some(&(base, c)) => self.power(base, 0.5 * c),
                None => self.power(a, 0.5),
            },
            Cbrt => {
                self.rule(Rule::Power { of: a, exponent: 1.0 / 3.0, start: Start::Unary(Cbrt), by: None })
            }
            Recip => self.recip(a),
            Exp => self.integral(f, a, |_, y| y),
            Ln => self.integral(f, a, |s, _| s.recip(a)),
            Sin => self.integral(f, a, |s, y| s.integral(Cos, a, |s, _| s.negated(y))),
            Cos => {
                self.unary(Sin, a)?;
                self.rule(Rule::Integral { of: a, start: Start::Unary(Cos), by: None })
            }
            Sinh => self.integral(f, a, |s, y| s.integral(Cosh, a, |_, _| y)),
            Cosh => {
                self.unary(Sinh, a)?;
                self.rule(Rule::Integral { of: a, start: Start::Unary(Cosh), by: None })
            }
            Tan | Tanh => self.integral(f, a, |s, y| {
                let square = s.square(y);
                s.affine(1.0, square, if f == Tan { 1.0 } else { -1.0 })
            }),
            Atan | Atanh => self.integral(f, a, |s, _| {
                let square = s.square(a);
                let denominator = s.affine(1.0, square, if f == Atan { 1.0 } else { -1.0 });
                s.recip(denominator)
            }),
            Asin | Acos | Asinh | Acosh => self.integral(f, a, |s, _| {
                let square = s.square(a);
                let (offset, factor) = match f {
                    Asinh => (1.0, 1.0),
                    Acosh => (-1.0, 1.0),
                    _ => (1.0, -1.0),
                };
                let radicand = s.affine(offset, square, factor);
                let slope = s.power(radicand, -0.5);
                if f == Acos { s.negated(slope) } else { slope }
            }),
            Abs | Sign => return None,
        })
    }
}

fn refusal(operation: usize, refused: Operation) -> TaylorError {
    let name = match refused {
        Operation::Unary(f, _) => f.name(),
        Operation::Binary(f, ..) => f.name(),
        Operation::Curve(..) => "curve",
        Operation::Surface(..) => "surface",
        _ => "select",
    };
    TaylorError::NoRecurrence { operation, name }
}
