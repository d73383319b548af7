//! Functions through data, and the numbers by which formulas know them.

use std::sync::Arc;

use apsides_problem_file::model::{Shape, TableData};
use pyo3::prelude::*;

use crate::error::Error;
use crate::symbol::{Operand, Operation, Symbol};

/// A function through data, with two continuous derivatives or with the shape of the data. Call it with numbers, arrays or symbols.
#[pyclass(frozen, module = "apsides")]
pub(crate) struct Table {
    data: Arc<TableData>,
    curve: apsides::ad::Table,
}

#[pymethods]
impl Table {
    #[new]
    fn new(name: String, x: Vec<f64>, y: Vec<f64>, values: Vec<f64>, shape: &str) -> PyResult<Self> {
        let shape = match shape {
            "spline" => Shape::Spline,
            "monotone" if y.is_empty() => Shape::Monotone,
            "monotone" => {
                return Err(Error::new_err("a table of two variables has the shape \"spline\" alone"));
            }
            other => {
                return Err(Error::new_err(format!(
                    "the shape of a table is \"spline\" or \"monotone\", not \"{other}\""
                )));
            }
        };
        let data = TableData { name, x, y, values, shape, csv: None, at: 0..0 };
        let curve = apsides_problem_file::statement::curve(&data)
            .map_err(|e| Error::new_err(format!("a table: {e}")))?;
        Ok(Self { data: Arc::new(data), curve })
    }

    /// Name in messages.
    #[getter]
    fn name(&self) -> &str {
        &self.data.name
    }

    /// Number of variables.
    #[getter]
    fn variables(&self) -> usize {
        self.curve.variables()
    }

    #[pyo3(signature = (x, y=None))]
    fn number(&self, x: f64, y: Option<f64>) -> f64 {
        match &self.curve {
            apsides::ad::Table::Cubic(curve) => curve.at(x),
            apsides::ad::Table::Pchip(curve) => curve.at(x),
            apsides::ad::Table::Bicubic(surface) => surface.at(x, y.unwrap_or(f64::NAN)),
        }
    }

    #[pyo3(signature = (x, y=None))]
    fn symbol(&self, x: Operand, y: Option<Operand>) -> Symbol {
        let at = [Some(x), y].into_iter().flatten().map(Operand::symbol).collect();
        Symbol::new(Operation::Table(Arc::clone(&self.data), at))
    }
}

/// Tables that formulas use, by their number.
#[derive(Default)]
pub(crate) struct Tables(pub(crate) Vec<Arc<TableData>>);

impl Tables {
    /// The number of a table, which it gets here the first time.
    pub(crate) fn index(&mut self, table: &Arc<TableData>) -> usize {
        let known = self.0.iter().position(|t| Arc::ptr_eq(t, table));
        known.unwrap_or_else(|| {
            self.0.push(Arc::clone(table));
            self.0.len() - 1
        })
    }

    /// No name of Python's, so that it hides none.
    pub(crate) fn of(index: usize) -> String {
        format!("table {}", index + 1)
    }
}
