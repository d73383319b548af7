//! Everything of a nonlinear program that is a number, for a peer that brings its own formulas.

use apsides::nlp::{Nlp, Scaling};
use serde::Serialize;

/// Start, bounds and units, and values that the peer's formulas must have. Bounds of 1e20 stand for none.
#[derive(Debug, Serialize)]
pub struct Numbers {
    /// Starting point.
    pub start: Vec<f64>,
    /// Bounds on the variables.
    pub lower: Vec<f64>,
    /// The same.
    pub upper: Vec<f64>,
    /// Bounds on the constraints.
    pub row_lower: Vec<f64>,
    /// The same.
    pub row_upper: Vec<f64>,
    /// Units of the variables.
    pub variable_units: Vec<f64>,
    /// Units of the constraints.
    pub row_units: Vec<f64>,
    /// Unit of the objective.
    pub objective_unit: f64,
    /// Values at the start and next to it.
    pub samples: Vec<Sample>,
}

/// Values at one point.
#[derive(Debug, Serialize)]
pub struct Sample {
    /// The point.
    pub point: Vec<f64>,
    /// Constraints.
    pub rows: Vec<f64>,
    /// Objective.
    pub objective: f64,
}

impl Numbers {
    /// Reads everything from the program; units are 1 where it states none.
    pub fn new(nlp: &mut dyn Nlp) -> Self {
        let (n, m) = (nlp.variables(), nlp.constraints());
        let (mut start, mut lower, mut upper) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let (mut row_lower, mut row_upper) = (vec![0.0; m], vec![0.0; m]);
        nlp.initial_point(&mut start);
        nlp.variable_bounds(&mut lower, &mut upper);
        nlp.constraint_bounds(&mut row_lower, &mut row_upper);
        // JSON has no infinity.
        for bound in [&mut lower, &mut upper, &mut row_lower, &mut row_upper].into_iter().flatten() {
            *bound = bound.clamp(-1e20, 1e20);
        }
        let Scaling { objective: objective_unit, variables: variable_units, constraints: row_units } =
            nlp.scaling().unwrap_or_else(|| Scaling {
                objective: 1.0,
                variables: vec![1.0; n],
                constraints: vec![1.0; m],
            });
        // Every variable by another small part of its unit: a column in the wrong place shows.
        let moved: Vec<f64> = (start.iter().zip(&variable_units).enumerate())
            .map(|(k, (x, unit))| x + 0.01 * unit * (1.0 + k as f64).sin())
            .collect();
        let samples = [start.clone(), moved].map(|point| Sample::new(nlp, point)).into();
        Self { start, lower, upper, row_lower, row_upper, variable_units, row_units, objective_unit, samples }
    }
}

impl Sample {
    fn new(nlp: &mut dyn Nlp, point: Vec<f64>) -> Self {
        let mut rows = vec![0.0; nlp.constraints()];
        nlp.constraint_values(&point, &mut rows);
        Self { objective: nlp.objective(&point), rows, point }
    }
}
