//! Scales that a problem leaves open, from what its functions do at the start.

use apsides_nlp::{Nlp, Pattern};
use apsides_ocp::Ocp;

use crate::discretisation::Discretisation;
use crate::phase::PhaseLayout;
use crate::transcription::Transcription;

/// A change by the gradient that is less than this part of that by the second derivatives is rounding.
const STATIONARY: f64 = 1e-8;

/// The changes of rows and objective at the start of a solve.
#[derive(Clone, Debug, PartialEq)]
pub struct Changes {
    /// The largest change of each row when one variable moves by its scale.
    pub rows: Vec<f64>,
    /// The change of the objective when all variables of one quantity move by their scales, the largest of all quantities.
    pub objective: f64,
}

/// The largest change of each row of a Jacobian, given by its entries, when one variable moves by its scale.
#[must_use]
pub fn row_changes(rows: usize, pattern: &Pattern, entries: &[f64], variable_scales: &[f64]) -> Vec<f64> {
    let mut changes = vec![0.0_f64; rows];
    for ((&r, &c), v) in pattern.rows.iter().zip(&pattern.cols).zip(entries) {
        changes[r] = changes[r].max(v.abs() * variable_scales[c]);
    }
    changes
}

/// A change as a scale: 1 where it is zero or no finite number.
#[must_use]
pub fn as_scale(change: f64) -> f64 {
    if change > 0.0 && change.is_finite() { change } else { 1.0 }
}

impl<D: Discretisation> Transcription<D> {
    /// Replaces the scales that are NaN by the changes at the start.
    pub(crate) fn complete_scales(&mut self) {
        let is_complete = |scale: &f64| !scale.is_nan();
        if self.scales.constraints.iter().chain([&self.scales.objective]).all(is_complete) {
            return;
        }
        let Changes { rows, objective } = self.changes();
        for (scale, change) in self.scales.constraints.iter_mut().zip(rows) {
            if scale.is_nan() {
                *scale = as_scale(change);
            }
        }
        if self.scales.objective.is_nan() {
            self.scales.objective = as_scale(objective);
        }
    }

    /// Lets the second derivatives tell the scale of an objective that states none, for a start at a stationary point that is to be left.
    pub fn scale_as_stationary(&mut self, ocp: &Ocp) {
        self.weighs_curvature = true;
        if ocp.objective.scale.is_none() {
            self.scales.objective = f64::NAN;
            self.complete_scales();
        }
    }

    /// The changes of rows and objective at the start.
    pub fn changes(&mut self) -> Changes {
        let pattern = self.jacobian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        let start = self.start.clone();
        self.jacobian(&start, &mut entries);
        let rows = row_changes(self.layout.constraints, &pattern, &entries, &self.scales.variables);
        let mut gradient = vec![0.0; self.layout.variables];
        self.gradient(&start, &mut gradient);
        let quantities = self.quantities();
        let change = |c: &usize| gradient[*c].abs() * self.scales.variables[*c];
        let slope = largest(quantities.iter().map(|columns| columns.iter().map(change).sum()));
        let bend = if self.weighs_curvature { self.bend(&start, &quantities) } else { 0.0 };
        Changes { rows, objective: if slope < STATIONARY * bend { bend } else { slope } }
    }

    /// The change of the objective by the second derivatives.
    fn bend(&mut self, start: &[f64], quantities: &[Vec<usize>]) -> f64 {
        let mut quantity_of = vec![usize::MAX; self.layout.variables];
        for (k, columns) in quantities.iter().enumerate() {
            columns.iter().for_each(|&c| quantity_of[c] = k);
        }
        let pattern = self.hessian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        let none = vec![0.0; self.layout.constraints];
        self.hessian(start, 1.0, &none, &mut entries);
        let scales = &self.scales.variables;
        let mut bends = vec![0.0; quantities.len()];
        for ((&i, &j), h) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
            if quantity_of[i] == quantity_of[j] {
                let times = if i == j { 0.5 } else { 1.0 };
                bends[quantity_of[i]] += times * h.abs() * scales[i] * scales[j];
            }
        }
        largest(bends.into_iter())
    }

    /// The columns of each quantity: a state or a control of a phase, a time, a parameter.
    fn quantities(&self) -> Vec<Vec<usize>> {
        let mut quantities = Vec::new();
        for p in &self.layout.phases {
            quantities.extend(p.quantities());
            quantities.extend([vec![p.ends().initial_time], vec![p.ends().final_time]]);
        }
        quantities.extend(self.layout.parameter_columns().map(|c| vec![c]));
        quantities
    }
}

fn largest(changes: impl Iterator<Item = f64>) -> f64 {
    changes.filter(|c| c.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_change_of_each_row_counts() {
        let pattern = Pattern::from_pairs([(0, 0), (0, 1), (2, 1)]);
        assert_eq!(row_changes(3, &pattern, &[1.0, -3.0, 0.5], &[10.0, 2.0]), [10.0, 0.0, 1.0]);
    }

    #[test]
    fn a_change_that_is_none_is_no_scale() {
        assert_eq!([0.0, -1.0, f64::INFINITY, f64::NAN, 1e-9].map(as_scale), [1.0, 1.0, 1.0, 1.0, 1e-9]);
    }
}
