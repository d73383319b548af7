//! Models as formulas: a straight-line program that other tools can read.
//!
//! [`NodeFunction::formula`](crate::NodeFunction::formula) runs a model once on a scalar that records every operation.
//! The result is a [`Formula`], which evaluates to the same numbers as the model on `f64` and is written as JSON by
//! [`Formula::to_json`]. A composition with a closure ([`Scalar::map`], [`Scalar::map2`]) has no formula.
//!
//! ```
//! use apsides_ad::{Scalar, VectorFunction, vector_node};
//!
//! struct Area;
//! impl VectorFunction<2, 1> for Area {
//!     fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
//!         [z[0] * z[1].sin() * 0.5]
//!     }
//! }
//!
//! let formula = vector_node(Area).formula()?;
//! let json = r#"{"inputs":2,"operations":[["sin",1],["mul",0,2],["constant",0.5],["mul",3,4]],"outputs":[5]}"#;
//! assert_eq!(formula.to_json(), json);
//! # Ok::<(), apsides_ad::trace::OpaqueFunction>(())
//! ```

use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Scalar, derived_operators};

/// Functions of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// Opposite number.
    Neg,
    /// Sine (argument in rad).
    Sin,
    /// Cosine (argument in rad).
    Cos,
    /// Tangent (argument in rad).
    Tan,
    /// Arc sine, in rad.
    Asin,
    /// Arc cosine, in rad.
    Acos,
    /// Arc tangent, in rad.
    Atan,
    /// Square root.
    Sqrt,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Reciprocal.
    Recip,
}

/// Functions of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binary {
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Product.
    Mul,
    /// Quotient.
    Div,
    /// Angle of the point (second, first operand) in (-pi, pi].
    Atan2,
}

/// One operation of a [`Formula`]. Operands are values: value `k` is input `k` for `k` below the number of inputs, then
/// the results of the operations in their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    /// A number.
    Constant(f64),
    /// A function of one value.
    Unary(Unary, usize),
    /// A function of two values.
    Binary(Binary, usize, usize),
    /// Integer power of a value.
    Powi(usize, i32),
    /// Power of a value with a constant real exponent.
    Powf(usize, f64),
}

/// A straight-line program. No operation is written twice, and each one reaches an output.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    inputs: usize,
    operations: Vec<Operation>,
    outputs: Vec<usize>,
}

/// A model contains a function that is known by its values alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpaqueFunction {
    /// Path of the closure in its crate.
    pub name: String,
}

impl std::fmt::Display for OpaqueFunction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` is known by its values alone and cannot be written as a formula", self.name)
    }
}

impl std::error::Error for OpaqueFunction {}

impl Unary {
    /// Name in the JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Neg => "neg",
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Asin => "asin",
            Self::Acos => "acos",
            Self::Atan => "atan",
            Self::Sqrt => "sqrt",
            Self::Exp => "exp",
            Self::Ln => "ln",
            Self::Sinh => "sinh",
            Self::Cosh => "cosh",
            Self::Tanh => "tanh",
            Self::Recip => "recip",
        }
    }

    /// The function at `x`.
    pub(crate) fn apply<S: Scalar>(self, x: S) -> S {
        match self {
            Self::Neg => -x,
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Sqrt => x.sqrt(),
            Self::Exp => x.exp(),
            Self::Ln => x.ln(),
            Self::Sinh => x.sinh(),
            Self::Cosh => x.cosh(),
            Self::Tanh => x.tanh(),
            Self::Recip => x.recip(),
        }
    }
}

impl Binary {
    /// Name in the JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Add => "add",
            Self::Sub => "sub",
            Self::Mul => "mul",
            Self::Div => "div",
            Self::Atan2 => "atan2",
        }
    }

    /// The function at the operands.
    pub(crate) fn apply(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Add => x + y,
            Self::Sub => x - y,
            Self::Mul => x * y,
            Self::Div => x / y,
            Self::Atan2 => x.atan2(y),
        }
    }
}

impl Operation {
    fn operands(self) -> impl Iterator<Item = usize> {
        let (a, b) = match self {
            Self::Constant(_) => (None, None),
            Self::Unary(_, a) | Self::Powi(a, _) | Self::Powf(a, _) => (Some(a), None),
            Self::Binary(_, a, b) => (Some(a), Some(b)),
        };
        a.into_iter().chain(b)
    }

    fn map_operands(self, f: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::Constant(c) => Self::Constant(c),
            Self::Unary(op, a) => Self::Unary(op, f(a)),
            Self::Binary(op, a, b) => Self::Binary(op, f(a), f(b)),
            Self::Powi(a, n) => Self::Powi(f(a), n),
            Self::Powf(a, n) => Self::Powf(f(a), n),
        }
    }
}

impl Formula {
    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// The operations in the order of evaluation.
    #[must_use]
    pub fn operations(&self) -> &[Operation] {
        &self.operations
    }

    /// The value that each output is.
    #[must_use]
    pub fn outputs(&self) -> &[usize] {
        &self.outputs
    }

    /// The outputs at `z`, of length [`inputs`](Self::inputs); bit for bit those of the model on `f64`.
    #[must_use]
    pub fn evaluate(&self, z: &[f64]) -> Vec<f64> {
        let mut values = z[..self.inputs].to_vec();
        for operation in &self.operations {
            values.push(match *operation {
                Operation::Constant(c) => c,
                Operation::Unary(op, a) => op.apply(values[a]),
                Operation::Binary(op, a, b) => op.apply(values[a], values[b]),
                Operation::Powi(a, n) => values[a].powi(n),
                Operation::Powf(a, n) => values[a].powf(n),
            });
        }
        self.outputs.iter().map(|&k| values[k]).collect()
    }

    /// One JSON object: `inputs`, their number; `operations`, each a list of its name, operands and exponent (`["add", 0, 1]`,
    /// `["powf", 2, 1.5]`, `["constant", 0.25]`); `outputs`, the value that each is. Numbers that are not finite are
    /// the strings `"inf"`, `"-inf"` and `"NaN"`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let operations = self.operations.iter().map(|operation| match *operation {
            Operation::Constant(c) => format!(r#"["constant",{}]"#, json_number(c)),
            Operation::Unary(op, a) => format!(r#"["{}",{a}]"#, op.name()),
            Operation::Binary(op, a, b) => format!(r#"["{}",{a},{b}]"#, op.name()),
            Operation::Powi(a, n) => format!(r#"["powi",{a},{n}]"#),
            Operation::Powf(a, n) => format!(r#"["powf",{a},{}]"#, json_number(n)),
        });
        format!(
            r#"{{"inputs":{},"operations":[{}],"outputs":[{}]}}"#,
            self.inputs,
            joined(operations),
            joined(&self.outputs)
        )
    }

    /// Drops the operations that reach no output.
    fn pruned(self) -> Self {
        let Self { inputs, operations, mut outputs } = self;
        let mut needed = vec![false; inputs + operations.len()];
        for &k in &outputs {
            needed[k] = true;
        }
        for (k, operation) in operations.iter().enumerate().rev() {
            if needed[inputs + k] {
                operation.operands().for_each(|a| needed[a] = true);
            }
        }
        let mut place: Vec<usize> = (0..inputs).collect();
        let mut kept = Vec::new();
        for (k, operation) in operations.into_iter().enumerate() {
            place.push(inputs + kept.len());
            if needed[inputs + k] {
                kept.push(operation.map_operands(|a| place[a]));
            }
        }
        for k in &mut outputs {
            *k = place[*k];
        }
        Self { inputs, operations: kept, outputs }
    }
}

fn json_number(x: f64) -> String {
    if x.is_finite() { format!("{x:?}") } else { format!(r#""{x}""#) }
}

fn joined<T: std::fmt::Display>(items: impl IntoIterator<Item = T>) -> String {
    let mut list = String::new();
    for item in items {
        let comma = if list.is_empty() { "" } else { "," };
        // Writing to a string does not fail.
        let _ = write!(list, "{comma}{item}");
    }
    list
}

/// The operations that a recording has seen so far.
#[derive(Default)]
struct Tape {
    inputs: usize,
    operations: Vec<Operation>,
    /// Value of each operation, so that none is written twice; numbers by their bits.
    known: HashMap<Key, usize>,
    opaque: Option<OpaqueFunction>,
}

#[derive(PartialEq, Eq, Hash)]
enum Key {
    Constant(u64),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
    Powi(usize, i32),
    Powf(usize, u64),
}

impl Tape {
    fn push(&mut self, operation: Operation) -> usize {
        let key = match operation {
            Operation::Constant(c) => Key::Constant(c.to_bits()),
            Operation::Unary(op, a) => Key::Unary(op, a),
            Operation::Binary(op, a, b) => Key::Binary(op, a, b),
            Operation::Powi(a, n) => Key::Powi(a, n),
            Operation::Powf(a, n) => Key::Powf(a, n.to_bits()),
        };
        let next = self.inputs + self.operations.len();
        let value = *self.known.entry(key).or_insert(next);
        if value == next {
            self.operations.push(operation);
        }
        value
    }
}

thread_local! {
    // A scalar is `Copy` and cannot hold its tape.
    static TAPE: RefCell<Tape> = RefCell::default();
}

/// A value of the recording that runs on this thread. It exists inside [`record`] alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trace(usize);

/// Runs `model`, which takes its inputs one by one and returns its outputs, and keeps what it did.
pub(crate) fn record(
    inputs: usize,
    model: impl FnOnce(&dyn Fn(usize) -> Trace) -> Vec<Trace>,
) -> Result<Formula, OpaqueFunction> {
    // A model may itself ask for the formula of another one.
    let outer = TAPE.replace(Tape { inputs, ..Tape::default() });
    let outputs = model(&Trace);
    let Tape { operations, opaque, .. } = TAPE.replace(outer);
    match opaque {
        Some(function) => Err(function),
        None => Ok(Formula { inputs, operations, outputs: outputs.iter().map(|v| v.0).collect() }.pruned()),
    }
}

impl Trace {
    fn push(operation: Operation) -> Self {
        TAPE.with_borrow_mut(|tape| Self(tape.push(operation)))
    }

    fn unary(self, op: Unary) -> Self {
        Self::push(Operation::Unary(op, self.0))
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        Self::push(Operation::Binary(op, self.0, other.0))
    }

    fn opaque<G>(self, _: &G) -> Self {
        TAPE.with_borrow_mut(|tape| {
            tape.opaque.get_or_insert_with(|| OpaqueFunction { name: std::any::type_name::<G>().into() });
        });
        self
    }
}

impl From<f64> for Trace {
    fn from(c: f64) -> Self {
        Self::push(Operation::Constant(c))
    }
}

impl Neg for Trace {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(Unary::Neg)
    }
}

macro_rules! recorded_operators {
    ($($trait:ident<$other:ty> $method:ident),*) => {$(
        impl $trait<$other> for Trace {
            type Output = Self;
            fn $method(self, other: $other) -> Self {
                self.binary(Binary::$trait, other.into())
            }
        }
    )*};
}
recorded_operators!(
    Add<Trace> add, Sub<Trace> sub, Mul<Trace> mul, Div<Trace> div, Add<f64> add, Mul<f64> mul, Div<f64> div
);

derived_operators!([] Trace);

/// Functions of one operand, by their variant.
macro_rules! recorded_functions {
    ($($method:ident $variant:ident),*) => {$(
        fn $method(self) -> Self {
            self.unary(Unary::$variant)
        }
    )*};
}

impl Scalar for Trace {
    fn map(self, g: impl Fn(f64) -> [f64; 3]) -> Self {
        self.opaque(&g)
    }

    fn map2(self, _: Self, g: impl Fn(f64, f64) -> [f64; 6]) -> Self {
        self.opaque(&g)
    }

    recorded_functions!(
        sin Sin, cos Cos, tan Tan, asin Asin, acos Acos, atan Atan, sqrt Sqrt, exp Exp, ln Ln, sinh Sinh, cosh Cosh,
        tanh Tanh, recip Recip
    );

    fn atan2(self, x: Self) -> Self {
        self.binary(Binary::Atan2, x)
    }

    fn powi(self, n: i32) -> Self {
        match n {
            0 => Self::from(1.0),
            1 => self,
            _ => Self::push(Operation::Powi(self.0, n)),
        }
    }

    fn powf(self, n: f64) -> Self {
        Self::push(Operation::Powf(self.0, n))
    }
}

#[cfg(test)]
mod tests;
