//! Formulas made operation by operation, for models that are not written as text.

use crate::function::{Binary, Unary};
use crate::syntax::{Expression, Operator, Part};
use crate::token::Comparison;

/// Makes a formula part by part. A part is known by its index and may be an operand of several others, so that what is used twice is
/// stated once.
///
/// ```
/// use apsides_expressions::build::ExpressionBuilder;
/// use apsides_expressions::function::{Binary, Unary};
/// use apsides_expressions::{Compiler, Library, Numbers};
///
/// let mut b = ExpressionBuilder::new(0);
/// let (two, g0) = (b.number(2.0), b.name("g0"));
/// let twice = b.binary(Binary::Multiply, two, g0);
/// let speed = b.unary(Unary::Sqrt, twice);
/// let library = Library::default();
/// let found = Compiler::new(Numbers, &library, false).compile(&b.expression(speed), None, "speed")?;
/// assert_eq!(found.number(), Some((2.0_f64 * 9.80665).sqrt()));
/// # Ok::<(), apsides_expressions::ExpressionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ExpressionBuilder {
    whole: Expression,
}

impl ExpressionBuilder {
    /// An empty formula. `number` tells it from others in messages, as of a text.
    #[must_use]
    pub fn new(number: usize) -> Self {
        Self { whole: Expression { text: number, parts: Vec::new() } }
    }

    /// A number.
    pub fn number(&mut self, number: f64) -> usize {
        self.push(Part::Number(number))
    }

    /// A quantity by its name.
    pub fn name(&mut self, name: &str) -> usize {
        self.push(Part::Name(name.to_owned()))
    }

    /// A function of one value.
    pub fn unary(&mut self, function: Unary, x: usize) -> usize {
        match function.name() {
            Some(name) => self.call(name, &[x]),
            None => self.push(Part::Negate(x)),
        }
    }

    /// A function of two values.
    pub fn binary(&mut self, function: Binary, x: usize, y: usize) -> usize {
        let operator = match function {
            Binary::Add => Operator::Add,
            Binary::Subtract => Operator::Subtract,
            Binary::Multiply => Operator::Multiply,
            Binary::Divide => Operator::Divide,
            Binary::Power => Operator::Power,
            Binary::Atan2 => return self.call("atan2", &[x, y]),
            Binary::Min => return self.call("min", &[x, y]),
            Binary::Max => return self.call("max", &[x, y]),
        };
        self.push(Part::Binary(operator, x, y))
    }

    /// `then` where `left` and `right` compare so, else `otherwise`.
    pub fn choose(
        &mut self,
        comparison: Comparison,
        [left, right]: [usize; 2],
        then: usize,
        otherwise: usize,
    ) -> usize {
        let condition = self.push(Part::Binary(Operator::Compare(comparison), left, right));
        self.call("if", &[condition, then, otherwise])
    }

    /// A function, a definition or a table by its name, at arguments.
    pub fn call(&mut self, name: &str, arguments: &[usize]) -> usize {
        self.push(Part::Call(name.to_owned(), arguments.to_vec()))
    }

    /// The formula of a part.
    #[must_use]
    pub fn expression(&self, part: usize) -> Expression {
        self.whole.part(part)
    }

    fn push(&mut self, part: Part) -> usize {
        self.whole.parts.push((part, 0..0));
        self.whole.parts.len() - 1
    }
}
