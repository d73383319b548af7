//! Formulas as programs of `apsides-ad`.

use apsides_ad::formula::{Binary as AdBinary, Unary as AdUnary};
use apsides_ad::{FormulaBuilder, Table, Value};
use apsides_expressions::function::{Binary, Unary};
use apsides_expressions::{Comparison, Recorder};

/// Records the operations of formulas over common inputs.
#[derive(Debug)]
pub struct Program {
    /// The operations so far.
    pub builder: FormulaBuilder,
    /// Index in the builder and number of variables of each table.
    tables: Vec<(usize, usize)>,
}

impl Program {
    /// A program of so many inputs; tables are known by their index.
    #[must_use]
    pub fn new(inputs: usize, tables: &[Table]) -> Self {
        let mut builder = FormulaBuilder::new(inputs);
        let tables = tables.iter().map(|t| (builder.table(t.clone()), t.variables())).collect();
        Self { builder, tables }
    }
}

impl Recorder for Program {
    type Value = Value;

    fn constant(&mut self, number: f64) -> Value {
        self.builder.constant(number)
    }

    fn unary(&mut self, function: Unary, x: Value) -> Value {
        let function = match function {
            Unary::Negate => AdUnary::Neg,
            Unary::Abs => AdUnary::Abs,
            Unary::Sign => AdUnary::Sign,
            Unary::Sqrt => AdUnary::Sqrt,
            Unary::Exp => AdUnary::Exp,
            Unary::Ln => AdUnary::Ln,
            Unary::Sin => AdUnary::Sin,
            Unary::Cos => AdUnary::Cos,
            Unary::Tan => AdUnary::Tan,
            Unary::Asin => AdUnary::Asin,
            Unary::Acos => AdUnary::Acos,
            Unary::Atan => AdUnary::Atan,
            Unary::Sinh => AdUnary::Sinh,
            Unary::Cosh => AdUnary::Cosh,
            Unary::Tanh => AdUnary::Tanh,
            Unary::Asinh => AdUnary::Asinh,
            Unary::Acosh => AdUnary::Acosh,
            Unary::Atanh => AdUnary::Atanh,
            Unary::Cbrt => AdUnary::Cbrt,
        };
        self.builder.unary(function, x)
    }

    fn binary(&mut self, function: Binary, x: Value, y: Value) -> Value {
        let function = match function {
            Binary::Add => AdBinary::Add,
            Binary::Subtract => AdBinary::Sub,
            Binary::Multiply => AdBinary::Mul,
            Binary::Divide => AdBinary::Div,
            Binary::Power => return self.builder.pow(x, y),
            Binary::Atan2 => AdBinary::Atan2,
            Binary::Min => AdBinary::Min,
            Binary::Max => AdBinary::Max,
        };
        self.builder.binary(function, x, y)
    }

    fn power(&mut self, x: Value, exponent: f64) -> Value {
        self.builder.powf(x, exponent)
    }

    fn select(
        &mut self,
        comparison: Comparison,
        left: Value,
        right: Value,
        then: Value,
        otherwise: Value,
    ) -> Value {
        // A selection takes the first value from zero on: `<` and `>` are the other side of `>=` and `<=`.
        match comparison {
            Comparison::AtLeast | Comparison::Equal => {
                let margin = self.builder.sub(left, right);
                self.builder.select(margin, then, otherwise)
            }
            Comparison::AtMost => {
                let margin = self.builder.sub(right, left);
                self.builder.select(margin, then, otherwise)
            }
            Comparison::Less => {
                let margin = self.builder.sub(left, right);
                self.builder.select(margin, otherwise, then)
            }
            Comparison::Greater => {
                let margin = self.builder.sub(right, left);
                self.builder.select(margin, otherwise, then)
            }
        }
    }

    fn table(&mut self, index: usize, at: &[Value]) -> Value {
        let (table, variables) = self.tables[index];
        match (variables, at) {
            (1, [x]) => self.builder.curve(table, *x),
            (_, [x, y, ..]) => self.builder.surface(table, *x, *y),
            // The compiler counts the arguments.
            _ => self.builder.constant(f64::NAN),
        }
    }
}
