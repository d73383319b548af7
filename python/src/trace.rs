//! Functions traced from Python as node functions with exact derivatives.

use std::sync::Arc;

use apsides::ad::{NodeFunction, formula_node};
use apsides_expressions::Recorder;
use apsides_problem_file::{Program, statement::curve};
use pyo3::prelude::*;

use crate::error::Error;
use crate::symbol::{Leaf, Operation, Scope, Symbol};
use crate::table::Tables;

/// The function of formulas over so many inputs of one owner.
pub(crate) fn function(owner: u64, inputs: usize, outputs: &[Symbol]) -> PyResult<Arc<dyn NodeFunction>> {
    let mut tables = Tables::default();
    Symbol::fold(outputs, |operation, _: &[()]| {
        if let Operation::Table(table, _) = operation {
            tables.index(table);
        }
        Ok(())
    })?;
    let curves = tables.0.iter().map(|t| curve(t)).collect::<Result<Vec<_>, _>>();
    let curves = curves.map_err(|e| Error::new_err(format!("a table: {e}")))?;
    let mut program = Program::new(inputs, &curves);
    let values = Symbol::fold(outputs, |operation, at: &[apsides::ad::Value]| {
        Ok(match operation {
            Operation::Number(number) => program.constant(*number),
            Operation::Leaf(leaf) => program.builder.input(input(leaf, owner)?),
            Operation::Unary(f, _) => program.unary(*f, at[0]),
            Operation::Binary(f, ..) => program.binary(*f, at[0], at[1]),
            Operation::Choose(c, _) => program.select(*c, at[0], at[1], at[2], at[3]),
            Operation::Table(table, _) => program.table(tables.index(table), at),
        })
    })?;
    let formula =
        program.builder.formula(&values).map_err(|e| Error::new_err(format!("the function: {e}")))?;
    Ok(formula_node(formula))
}

fn input(leaf: &Leaf, owner: u64) -> PyResult<usize> {
    match leaf.scope {
        Scope::Input(k) if leaf.owner == owner => Ok(k),
        _ => Err(Error::new_err(format!(
            "`{}` is no argument of this function: it belongs to another one",
            leaf.name
        ))),
    }
}

/// The arguments of a function that is traced: `x[0]`, `x[1]`, ..
#[pyfunction]
pub(crate) fn arguments(owner: u64, names: Vec<String>) -> Vec<Symbol> {
    names.iter().enumerate().map(|(k, name)| Symbol::leaf(owner, Scope::Input(k), name)).collect()
}
