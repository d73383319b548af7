//! The functions of a phase over lengths and directions.

use std::sync::Arc;

use apsides_ad::{AdError, Formula, FormulaBuilder, NodeFunction, Value, formula_node};

use super::ControlVector;
use super::lengths::{Lengths, Measure};
use crate::rewrite::rewrite;
use crate::{Bounds, PathConstraint, Phase, Variable};

/// Writes the functions of a phase again.
pub(super) struct Writer<'a> {
    pub(super) lengths: &'a Lengths<'a>,
    pub(super) vectors: &'a [ControlVector],
    /// Number of controls with the lengths.
    pub(super) controls: usize,
}

impl Writer<'_> {
    fn phase(&self) -> &Phase {
        self.lengths.phase
    }

    /// A formula with the lengths and directions in place of vectors.
    pub(super) fn function(&self, formula: &Formula) -> Result<Arc<dyn NodeFunction>, AdError> {
        let (nx, nu) = (self.phase().states.len(), self.phase().controls.len());
        let mut b = FormulaBuilder::new(formula.inputs() + self.controls - nu);
        let input = |b: &mut FormulaBuilder, i: usize| {
            let of = |v: &&ControlVector| i.checked_sub(nx).is_some_and(|j| v.components.contains(&j));
            match self.vectors.iter().find(of) {
                Some(v) => {
                    let (d, s) = (b.input(i), b.input(nx + v.length));
                    b.mul(s, d)
                }
                None => b.input(if i < nx + nu { i } else { i + self.controls - nu }),
            }
        };
        let vector = |components: Option<Vec<usize>>| {
            let components = components?;
            self.vectors.iter().find(|v| v.components == components)
        };
        let replace = |b: &mut FormulaBuilder, k: usize, _: &[Value]| {
            if let Some(v) = vector(self.lengths.length(formula, k)) {
                return Some(b.input(nx + v.length));
            }
            let v = vector(self.lengths.square(formula, formula.inputs() + k))?;
            let length = b.input(nx + v.length);
            Some(b.square(length))
        };
        let values = rewrite(formula, &mut b, input, replace);
        let outputs: Vec<Value> = formula.outputs().iter().map(|k| values[*k]).collect();
        Ok(formula_node(b.formula(&outputs)?))
    }

    /// A formula of the controls as they were posed, with the lengths of vectors without their kinks.
    pub(super) fn rounded(
        &self,
        formula: &Formula,
        rounding: &[f64],
    ) -> Result<Arc<dyn NodeFunction>, AdError> {
        let mut b = FormulaBuilder::new(formula.inputs());
        let replace = |b: &mut FormulaBuilder, k: usize, values: &[Value]| {
            let components = self.lengths.length(formula, k)?;
            let v = self.vectors.iter().position(|v| v.components == components)?;
            let square = formula.operations()[k].operands().next()?;
            let least = b.constant(rounding[v] * rounding[v]);
            let square = b.add(values[square], least);
            Some(b.sqrt(square))
        };
        let values = rewrite(formula, &mut b, |b, i| b.input(i), replace);
        let outputs: Vec<Value> = formula.outputs().iter().map(|k| values[*k]).collect();
        Ok(formula_node(b.formula(&outputs)?))
    }

    /// `d . d = 1`.
    pub(super) fn unit(&self, v: &ControlVector) -> Result<PathConstraint, AdError> {
        let row = Variable::new("length of a direction", "-").equal_to(1.0);
        Ok(PathConstraint { rows: vec![row], function: self.square(&v.components, 1)? })
    }

    /// Bounds of a component of a vector.
    pub(super) fn component(&self, v: &ControlVector, control: usize) -> Result<PathConstraint, AdError> {
        let mut b = self.builder();
        let nx = self.phase().states.len();
        let (d, s) = (b.input(nx + control), b.input(nx + v.length));
        let component = b.mul(s, d);
        let function = formula_node(b.formula(&[component])?);
        Ok(PathConstraint { rows: vec![self.phase().controls[control].clone()], function })
    }

    /// Limits of the length of a vector that stays as it is, as limits of its square.
    pub(super) fn squared(
        &self,
        constraint: &PathConstraint,
        components: &[usize],
        measures: &[Measure],
    ) -> Result<PathConstraint, AdError> {
        let rows = constraint.rows.iter().zip(measures).map(|(row, measure)| match measure {
            Measure::Square => row.clone(),
            Measure::Length => Variable {
                name: format!("square of {}", row.name),
                // No length is less than nothing.
                bounds: Bounds::new(square_of_bound(row.bounds.lower), square_of_bound(row.bounds.upper)),
                scale: row.scale.map(|s| s * s),
                ..row.clone()
            },
        });
        let function = self.square(components, constraint.rows.len())?;
        Ok(PathConstraint { rows: rows.collect(), function })
    }

    /// The sum of the squares of controls, as so many outputs.
    fn square(&self, controls: &[usize], outputs: usize) -> Result<Arc<dyn NodeFunction>, AdError> {
        let mut b = self.builder();
        let mut sum = b.constant(0.0);
        for j in controls {
            let d = b.input(self.phase().states.len() + j);
            let square = b.square(d);
            sum = b.add(sum, square);
        }
        Ok(formula_node(b.formula(&vec![sum; outputs])?))
    }

    /// A builder of a function without parameters.
    fn builder(&self) -> FormulaBuilder {
        FormulaBuilder::new(self.phase().states.len() + self.controls + 1)
    }
}

/// The square of a bound of a length, which is none below zero.
fn square_of_bound(bound: f64) -> f64 {
    if bound < 0.0 { if bound.is_finite() { -bound * bound } else { bound } } else { bound * bound }
}
