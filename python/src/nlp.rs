//! Nonlinear programs of traced functions.

use std::sync::Arc;

use apsides::ad::NodeFunction;
use apsides::nlp::{InteriorPoint, Nlp, NlpSettings, Pattern};
use apsides_expressions::Comparison;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Error, SettingError, SolveError};
use crate::symbol::{Condition, Symbol};
use crate::trace::function;
use crate::watch::Watch;

/// Objective and constraints as one function; the objective is its first output.
struct Traced {
    function: Arc<dyn NodeFunction>,
    start: Vec<f64>,
    bounds: [Vec<f64>; 2],
    limits: [Vec<f64>; 2],
    out: Vec<f64>,
    entries: Vec<f64>,
    weights: Vec<f64>,
}

impl Nlp for Traced {
    fn variables(&self) -> usize {
        self.start.len()
    }
    fn constraints(&self) -> usize {
        self.limits[0].len()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.bounds[0]);
        upper.copy_from_slice(&self.bounds[1]);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.limits[0]);
        upper.copy_from_slice(&self.limits[1]);
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }
    fn jacobian_pattern(&self) -> Pattern {
        let entries = self.function.pattern().jacobian_entries().filter(|(row, _)| *row > 0);
        Pattern::from_pairs(entries.map(|(row, column)| (row - 1, column)))
    }
    fn hessian_pattern(&self) -> Pattern {
        Pattern::from_pairs(self.function.pattern().hessian.iter().map(|&(i, j)| (i.max(j), i.min(j))))
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        self.function.value(x, &mut self.out);
        self.out[0]
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.function.jacobian(x, &mut self.out, &mut self.entries);
        gradient.fill(0.0);
        for ((row, column), value) in self.function.pattern().jacobian_entries().zip(&self.entries) {
            if row == 0 {
                gradient[column] += value;
            }
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        self.function.value(x, &mut self.out);
        values.copy_from_slice(&self.out[1..]);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.function.jacobian(x, &mut self.out, &mut self.entries);
        let rows = self.function.pattern().jacobian_entries().zip(&self.entries);
        let of_constraints = rows.filter(|((row, _), _)| *row > 0);
        values.iter_mut().zip(of_constraints).for_each(|(value, (_, entry))| *value = *entry);
    }
    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        self.weights[0] = objective_factor;
        self.weights[1..].copy_from_slice(multipliers);
        self.function.hessian(x, &self.weights, values);
    }
}

/// Solves a nonlinear program: the objective and constraints `(formula, lower, upper)` over the arguments of `owner`.
#[pyfunction]
pub(crate) fn minimize<'py>(
    py: Python<'py>,
    owner: u64,
    objective: Symbol,
    constraints: Vec<(Symbol, f64, f64)>,
    start: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    options: (Option<f64>, Option<usize>),
    callback: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let outputs: Vec<Symbol> =
        std::iter::once(objective).chain(constraints.iter().map(|c| c.0.clone())).collect();
    let function = function(owner, start.len(), &outputs)?;
    let mut settings = NlpSettings::default();
    if let Some(tolerance) = options.0 {
        if !(tolerance > 0.0 && tolerance < 1.0) {
            return Err(SettingError::new_err(format!(
                "`tolerance` is {tolerance}, allowed is a number between 0 and 1"
            )));
        }
        settings.tolerance = tolerance;
    }
    if let Some(most) = options.1 {
        settings.max_iterations = most;
    }
    let mut nlp = Traced {
        out: vec![0.0; outputs.len()],
        entries: vec![0.0; function.pattern().jacobian_len()],
        weights: vec![0.0; outputs.len()],
        limits: [constraints.iter().map(|c| c.1).collect(), constraints.iter().map(|c| c.2).collect()],
        bounds: [lower, upper],
        function,
        start,
    };
    let mut watch = Watch::new(callback);
    let found = py.detach(|| InteriorPoint::new(settings).solve_observed(&mut nlp, &mut watch));
    let report = watch.finish(found)?.map_err(|e| SolveError::new_err(e.to_string()))?;
    let result = PyDict::new(py);
    result.set_item("x", PyArray1::from_slice(py, &report.x))?;
    result.set_item("fun", report.objective)?;
    result.set_item("success", report.status.is_success())?;
    result.set_item("status", report.status.word())?;
    result.set_item("message", report.status.to_string())?;
    result.set_item("constraint_values", PyArray1::from_slice(py, &report.constraint_values))?;
    result.set_item("multipliers", PyArray1::from_slice(py, &report.constraint_multipliers))?;
    result.set_item("lower_multipliers", PyArray1::from_slice(py, &report.lower_multipliers))?;
    result.set_item("upper_multipliers", PyArray1::from_slice(py, &report.upper_multipliers))?;
    result.set_item("nit", report.counters.iterations)?;
    Ok(result)
}

/// Values and Jacobian (row by row) of traced formulas at a point.
#[pyfunction]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    owner: u64,
    outputs: Vec<Symbol>,
    at: Vec<f64>,
) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
    if outputs.is_empty() {
        return Err(Error::new_err("a function of no outputs"));
    }
    let function = function(owner, at.len(), &outputs)?;
    let (mut values, mut entries) = (vec![0.0; outputs.len()], vec![0.0; function.pattern().jacobian_len()]);
    function.jacobian(&at, &mut values, &mut entries);
    let mut dense = vec![0.0; outputs.len() * at.len()];
    for ((row, column), entry) in function.pattern().jacobian_entries().zip(&entries) {
        dense[row * at.len() + column] += entry;
    }
    Ok([values, dense].map(|v| PyArray1::from_vec(py, v)))
}

/// A comparison as a formula with its bounds.
#[pyfunction]
pub(crate) fn bounded(condition: &Condition) -> (Symbol, f64, f64) {
    let difference = condition.difference();
    match condition.comparison {
        Comparison::Less | Comparison::AtMost => (difference, f64::NEG_INFINITY, 0.0),
        Comparison::Greater | Comparison::AtLeast => (difference, 0.0, f64::INFINITY),
        Comparison::Equal => (difference, 0.0, 0.0),
    }
}
