//! Functions of symbols that are no operators, units, and formulas of the problem's language.

use apsides_expressions::build::ExpressionBuilder;
use apsides_expressions::function::{Binary, Unary};
use apsides_expressions::{Comparison, Expression, Unit};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::error::ProblemError;
use crate::symbol::{Condition, Leaf, Operand, Operation, Symbol};
use crate::table::Tables;

/// An elementary function by its name.
#[pyfunction]
pub(crate) fn unary(name: &str, x: Symbol) -> PyResult<Symbol> {
    let f = match name {
        "sign" => Unary::Sign,
        "abs" => Unary::Abs,
        _ => return Err(PyValueError::new_err(format!("no function is named `{name}`"))),
    };
    Ok(Symbol::new(Operation::Unary(f, x)))
}

/// A function of two values by its name.
#[pyfunction]
pub(crate) fn binary(name: &str, x: Operand, y: Operand) -> PyResult<Symbol> {
    let f = match name {
        "min" => Binary::Min,
        "max" => Binary::Max,
        "arctan2" => Binary::Atan2,
        _ => return Err(PyValueError::new_err(format!("no function is named `{name}`"))),
    };
    Ok(Symbol::new(Operation::Binary(f, x.symbol(), y.symbol())))
}

/// `then` where the condition holds, else `otherwise`.
#[pyfunction]
pub(crate) fn choose(condition: &Condition, then: Operand, otherwise: Operand) -> PyResult<Symbol> {
    if condition.comparison == Comparison::Equal {
        return Err(PyTypeError::new_err(
            "`==` in `where` holds at single points alone: write <, <=, > or >=",
        ));
    }
    let sides = [condition.left.clone(), condition.right.clone(), then.symbol(), otherwise.symbol()];
    Ok(Symbol::new(Operation::Choose(condition.comparison, sides)))
}

/// The size of a unit in the coherent SI unit.
#[pyfunction]
pub(crate) fn unit_factor(name: &str) -> PyResult<f64> {
    let unit = Unit::parse(name);
    unit.map(|u| u.factor).map_err(|e| ProblemError::new_err(format!("the unit \"{name}\": {}", e.reason)))
}

/// True of a name of letters, digits and underscores that begins with a letter.
#[pyfunction]
pub(crate) fn is_name(name: &str) -> bool {
    apsides_expressions::is_name(name)
}

/// A formula of the problem's language; `name` says what a leaf is called where the formula stands.
pub(crate) fn expression(
    formula: &Symbol,
    number: usize,
    tables: &mut Tables,
    name: &dyn Fn(&Leaf) -> PyResult<String>,
) -> PyResult<Expression> {
    let mut b = ExpressionBuilder::new(number);
    let whole = Symbol::fold(std::slice::from_ref(formula), |operation, at: &[usize]| {
        Ok(match operation {
            Operation::Number(number) => b.number(*number),
            Operation::Leaf(leaf) => b.name(&name(leaf)?),
            Operation::Unary(f, _) => b.unary(*f, at[0]),
            Operation::Binary(f, ..) => b.binary(*f, at[0], at[1]),
            Operation::Choose(c, _) => b.choose(*c, [at[0], at[1]], at[2], at[3]),
            Operation::Table(table, _) => b.call(&Tables::of(tables.index(table)), at),
        })
    })?;
    Ok(b.expression(whole[0]))
}
