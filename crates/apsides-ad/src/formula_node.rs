//! Formulas as node functions.

use std::sync::Arc;

use crate::formula::Formula;
use crate::node::NodeFunction;
use crate::pattern::NodePattern;
use crate::plan::Plan;
use crate::trace::OpaqueFunction;

/// A formula with the programs of its derivatives.
struct FormulaNode {
    formula: Formula,
    pattern: NodePattern,
    plan: Plan,
}

/// The node function of a formula: any number of inputs and operations.
///
/// Its programs run in a workspace of the calling thread, which grows once to what the largest of them needs.
#[must_use]
pub fn formula_node(formula: Formula) -> Arc<dyn NodeFunction> {
    let (plan, pattern) = Plan::with_pattern(&formula);
    Arc::new(FormulaNode { formula, pattern, plan })
}

impl NodeFunction for FormulaNode {
    fn inputs(&self) -> usize {
        self.formula.inputs()
    }

    fn outputs(&self) -> usize {
        self.formula.outputs().len()
    }

    fn pattern(&self) -> &NodePattern {
        &self.pattern
    }

    fn value(&self, z: &[f64], out: &mut [f64]) {
        self.plan.values(1, z, out);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        self.plan.jacobians(1, z, out, entries);
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        self.plan.hessians(1, z, weights, entries);
    }

    fn values(&self, points: usize, z: &[f64], out: &mut [f64]) {
        self.plan.values(points, z, out);
    }

    fn jacobians(&self, points: usize, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        self.plan.jacobians(points, z, out, entries);
    }

    fn hessians(&self, points: usize, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        self.plan.hessians(points, z, weights, entries);
    }

    fn formula(&self) -> Result<Formula, OpaqueFunction> {
        Ok(self.formula.clone())
    }
}

#[cfg(test)]
pub(crate) mod tests;
