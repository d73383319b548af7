//! Straight-line programs: vector functions as data.
//!
//! A [`Formula`] comes from a [`FormulaBuilder`](crate::FormulaBuilder), from a model
//! ([`NodeFunction::formula`](crate::NodeFunction::formula)) or from a list of operations ([`Formula::new`]).
//! [`formula_node`](crate::formula_node) evaluates it with its derivatives, and [`Formula::to_json`] writes it for other tools.

use std::fmt;
use std::fmt::Write;
use std::sync::Arc;

use crate::Scalar;
use crate::error::{AdError, Taker};
use crate::table::Table;

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
    /// Cube root.
    Cbrt,
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
    /// Inverse hyperbolic sine.
    Asinh,
    /// Inverse hyperbolic cosine.
    Acosh,
    /// Inverse hyperbolic tangent.
    Atanh,
    /// Reciprocal.
    Recip,
    /// Absolute value.
    Abs,
    /// Sign: -1, 0 or 1.
    Sign,
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
    /// First operand, not negative, to the power of the second.
    Pow,
    /// The smaller operand.
    Min,
    /// The larger operand.
    Max,
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
    /// The second value where the first one is at least zero, else the third.
    Select(usize, usize, usize),
    /// The table with the index of the first number at a value.
    Curve(usize, usize),
    /// The table with the index of the first number at two values.
    Surface(usize, usize, usize),
}

/// A straight-line program. Each operation reaches an output.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    inputs: usize,
    operations: Vec<Operation>,
    tables: Vec<Arc<Table>>,
    outputs: Vec<usize>,
}

/// Most values of a formula: their places are 32-bit numbers.
pub(crate) const MAX_VALUES: usize = 1 << 31;

impl Unary {
    /// All of them.
    pub const ALL: [Self; 20] = [
        Self::Neg,
        Self::Sin,
        Self::Cos,
        Self::Tan,
        Self::Asin,
        Self::Acos,
        Self::Atan,
        Self::Sqrt,
        Self::Cbrt,
        Self::Exp,
        Self::Ln,
        Self::Sinh,
        Self::Cosh,
        Self::Tanh,
        Self::Asinh,
        Self::Acosh,
        Self::Atanh,
        Self::Recip,
        Self::Abs,
        Self::Sign,
    ];

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
            Self::Cbrt => "cbrt",
            Self::Exp => "exp",
            Self::Ln => "ln",
            Self::Sinh => "sinh",
            Self::Cosh => "cosh",
            Self::Tanh => "tanh",
            Self::Asinh => "asinh",
            Self::Acosh => "acosh",
            Self::Atanh => "atanh",
            Self::Recip => "recip",
            Self::Abs => "abs",
            Self::Sign => "sign",
        }
    }

    /// The function at `x`.
    #[inline]
    pub fn apply<S: Scalar>(self, x: S) -> S {
        match self {
            Self::Neg => -x,
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Sqrt => x.sqrt(),
            Self::Cbrt => x.cbrt(),
            Self::Exp => x.exp(),
            Self::Ln => x.ln(),
            Self::Sinh => x.sinh(),
            Self::Cosh => x.cosh(),
            Self::Tanh => x.tanh(),
            Self::Asinh => x.asinh(),
            Self::Acosh => x.acosh(),
            Self::Atanh => x.atanh(),
            Self::Recip => x.recip(),
            Self::Abs => x.abs(),
            Self::Sign => x.sign(),
        }
    }
}

impl Binary {
    /// All of them.
    pub const ALL: [Self; 8] =
        [Self::Add, Self::Sub, Self::Mul, Self::Div, Self::Atan2, Self::Pow, Self::Min, Self::Max];

    /// Name in the JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Add => "add",
            Self::Sub => "sub",
            Self::Mul => "mul",
            Self::Div => "div",
            Self::Atan2 => "atan2",
            Self::Pow => "pow",
            Self::Min => "min",
            Self::Max => "max",
        }
    }

    /// The function at the operands.
    #[inline]
    pub fn apply<S: Scalar>(self, x: S, y: S) -> S {
        match self {
            Self::Add => x + y,
            Self::Sub => x - y,
            Self::Mul => x * y,
            Self::Div => x / y,
            Self::Atan2 => x.atan2(y),
            Self::Pow => x.pow(y),
            Self::Min => x.min(y),
            Self::Max => x.max(y),
        }
    }
}

impl Operation {
    /// The values that the operation takes.
    pub fn operands(self) -> impl Iterator<Item = usize> {
        let operands = match self {
            Self::Constant(_) => [None; 3],
            Self::Unary(_, a) | Self::Powi(a, _) | Self::Powf(a, _) | Self::Curve(_, a) => {
                [Some(a), None, None]
            }
            Self::Binary(_, a, b) | Self::Surface(_, a, b) => [Some(a), Some(b), None],
            Self::Select(c, a, b) => [Some(c), Some(a), Some(b)],
        };
        operands.into_iter().flatten()
    }

    /// The table that the operation looks up, and the number of its variables.
    pub(crate) fn table(self) -> Option<(usize, usize)> {
        match self {
            Self::Curve(t, _) => Some((t, 1)),
            Self::Surface(t, _, _) => Some((t, 2)),
            _ => None,
        }
    }

    /// The operation with other operands, and tables at other indices.
    #[must_use]
    pub fn with_operands(self, value: impl Fn(usize) -> usize, table: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::Constant(c) => Self::Constant(c),
            Self::Unary(op, a) => Self::Unary(op, value(a)),
            Self::Binary(op, a, b) => Self::Binary(op, value(a), value(b)),
            Self::Powi(a, n) => Self::Powi(value(a), n),
            Self::Powf(a, n) => Self::Powf(value(a), n),
            Self::Select(c, a, b) => Self::Select(value(c), value(a), value(b)),
            Self::Curve(t, a) => Self::Curve(table(t), value(a)),
            Self::Surface(t, a, b) => Self::Surface(table(t), value(a), value(b)),
        }
    }

    /// The result, given the values before it.
    pub(crate) fn apply<S: Scalar>(self, value: impl Fn(usize) -> S, tables: &[Arc<Table>]) -> S {
        match self {
            Self::Constant(c) => S::from(c),
            Self::Unary(op, a) => op.apply(value(a)),
            Self::Binary(op, a, b) => op.apply(value(a), value(b)),
            Self::Powi(a, n) => value(a).powi(n),
            Self::Powf(a, n) => value(a).powf(n),
            Self::Select(c, a, b) => value(c).select(value(a), value(b)),
            Self::Curve(t, a) => tables[t].curve(value(a)),
            Self::Surface(t, a, b) => tables[t].surface(value(a), value(b)),
        }
    }
}

impl Formula {
    /// The formula of a list of operations; those that reach no output are dropped.
    ///
    /// # Errors
    /// An operation takes a value or a table that does not stand before it, or is not a number; an output is no value.
    pub fn new(
        inputs: usize,
        operations: Vec<Operation>,
        tables: Vec<Table>,
        outputs: Vec<usize>,
    ) -> Result<Self, AdError> {
        if inputs > MAX_VALUES || operations.len() > MAX_VALUES - inputs {
            return Err(AdError::TooLarge);
        }
        for (k, operation) in operations.iter().enumerate() {
            if let Some(value) = operation.operands().find(|&a| a >= inputs + k) {
                return Err(AdError::Operand { taker: Taker::Operation(k), value });
            }
            if let Some((table, variables)) = operation.table()
                && tables.get(table).is_none_or(|t| t.variables() != variables)
            {
                return Err(AdError::Table { operation: k, table });
            }
            if let Operation::Constant(c) | Operation::Powf(_, c) = operation
                && c.is_nan()
            {
                return Err(AdError::NotANumber { operation: k });
            }
        }
        let values = inputs + operations.len();
        if let Some((output, &value)) = outputs.iter().enumerate().find(|(_, v)| **v >= values) {
            return Err(AdError::Operand { taker: Taker::Output(output), value });
        }
        Ok(Self::pruned(inputs, &operations, &tables.into_iter().map(Arc::new).collect::<Vec<_>>(), &outputs))
    }

    /// Drops the operations and tables that reach no output; what is given is known to be well formed.
    pub(crate) fn pruned(
        inputs: usize,
        operations: &[Operation],
        tables: &[Arc<Table>],
        outputs: &[usize],
    ) -> Self {
        let mut needed = vec![false; inputs + operations.len()];
        for &k in outputs {
            needed[k] = true;
        }
        let mut looked_up = vec![false; tables.len()];
        for (k, operation) in operations.iter().enumerate().rev() {
            if needed[inputs + k] {
                operation.operands().for_each(|a| needed[a] = true);
                operation.table().into_iter().for_each(|(t, _)| looked_up[t] = true);
            }
        }
        let table_place: Vec<usize> = places(&looked_up);
        let kept_tables = tables.iter().zip(&looked_up).filter(|(_, l)| **l).map(|(t, _)| Arc::clone(t));
        let mut place: Vec<usize> = (0..inputs).collect();
        let mut kept = Vec::new();
        for (k, operation) in operations.iter().enumerate() {
            place.push(inputs + kept.len());
            if needed[inputs + k] {
                kept.push(operation.with_operands(|a| place[a], |t| table_place[t]));
            }
        }
        Self {
            inputs,
            operations: kept,
            tables: kept_tables.collect(),
            outputs: outputs.iter().map(|&k| place[k]).collect(),
        }
    }

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

    /// The tables that operations look up.
    #[must_use]
    pub fn tables(&self) -> &[Arc<Table>] {
        &self.tables
    }

    /// The value that each output is.
    #[must_use]
    pub fn outputs(&self) -> &[usize] {
        &self.outputs
    }

    /// The formula with the results of some of its operations as further outputs, after its own.
    #[must_use]
    pub fn with_results_of(&self, those: impl Fn(Operation) -> bool) -> Self {
        let results = self.operations.iter().enumerate().filter(|(_, operation)| those(**operation));
        let places = results.map(|(k, _)| self.inputs + k);
        Self { outputs: self.outputs.iter().copied().chain(places).collect(), ..self.clone() }
    }

    /// The outputs at `z`, of length [`inputs`](Self::inputs); for `f64` bit for bit those of the model that the formula comes from.
    #[must_use]
    pub fn evaluate<S: Scalar>(&self, z: &[S]) -> Vec<S> {
        let mut values = z[..self.inputs].to_vec();
        for operation in &self.operations {
            values.push(operation.apply(|k| values[k], &self.tables));
        }
        self.outputs.iter().map(|&k| values[k]).collect()
    }

    /// One JSON object: `inputs`, their number; `operations`, each a list of its name, operands and exponent (`["add", 0, 1]`,
    /// `["powf", 2, 1.5]`, `["constant", 0.25]`, `["select", 0, 1, 2]`; `["curve", 0, 3]` and `["surface", 1, 3, 4]` begin with the
    /// index of a table); `outputs`, the value that each is; `tables`, if there are any, each an object with its `kind`, knots and
    /// values. Numbers that are not finite are the strings `"inf"`, `"-inf"` and `"NaN"`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let operations = self.operations.iter().map(|operation| match *operation {
            Operation::Constant(c) => format!(r#"["constant",{}]"#, json_number(c)),
            Operation::Unary(op, a) => format!(r#"["{}",{a}]"#, op.name()),
            Operation::Binary(op, a, b) => format!(r#"["{}",{a},{b}]"#, op.name()),
            Operation::Powi(a, n) => format!(r#"["powi",{a},{n}]"#),
            Operation::Powf(a, n) => format!(r#"["powf",{a},{}]"#, json_number(n)),
            Operation::Select(c, a, b) => format!(r#"["select",{c},{a},{b}]"#),
            Operation::Curve(t, a) => format!(r#"["curve",{t},{a}]"#),
            Operation::Surface(t, a, b) => format!(r#"["surface",{t},{a},{b}]"#),
        });
        let tables = match self.tables.as_slice() {
            [] => String::new(),
            tables => format!(r#","tables":[{}]"#, joined(tables.iter().map(|t| t.to_json()))),
        };
        format!(
            r#"{{"inputs":{},"operations":[{}],"outputs":[{}]{tables}}}"#,
            self.inputs,
            joined(operations),
            joined(&self.outputs)
        )
    }
}

/// Place of each item among those that are kept.
fn places(kept: &[bool]) -> Vec<usize> {
    kept.iter()
        .scan(0, |next, kept| {
            let place = *next;
            *next += usize::from(*kept);
            Some(place)
        })
        .collect()
}

fn json_number(x: f64) -> String {
    if x.is_finite() { format!("{x:?}") } else { format!(r#""{x}""#) }
}

fn joined<T: fmt::Display>(items: impl IntoIterator<Item = T>) -> String {
    let mut list = String::new();
    for item in items {
        let comma = if list.is_empty() { "" } else { "," };
        // Writing to a string does not fail.
        let _ = write!(list, "{comma}{item}");
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FormulaBuilder;

    #[test]
    fn results_of_operations_are_further_outputs() {
        let mut f = FormulaBuilder::new(2);
        let (x, y) = (f.input(0), f.input(1));
        let peak = f.exp(x);
        let product = f.mul(peak, y);
        let formula = f.formula(&[product]).expect("well formed");
        let more = formula.with_results_of(|operation| matches!(operation, Operation::Unary(Unary::Exp, _)));
        // What the other factor leaves of the product does not matter.
        assert_eq!(more.evaluate(&[0.5, 0.0]), [0.0, 0.5_f64.exp()]);
        assert_eq!(formula.with_results_of(|_| false), formula);
    }
}
