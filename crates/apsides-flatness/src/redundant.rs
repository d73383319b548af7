//! Rows that say nothing new: constraints on what the flat map makes constant, and equalities between times and parameters that
//! follow from others.
//!
//! Where a flat map gives a state as a function of time, such as the mass at constant thrust, its start value is met by
//! construction and its linkage follows from that of the times. Kept, such rows would make the Jacobian singular everywhere.

use std::collections::BTreeSet;

use apsides_nlp::Nlp;

use crate::FlatnessError;
use crate::rows::Row;

/// Relative size below which a difference is rounding.
const ROUNDING: f64 = 1e-9;
/// Relative step that tells whether a row is linear.
const STEP: f64 = 0.03;

/// Finds the rows to drop. `global` are the columns of times and parameters, `x` is the start and `scales` are those of the variables.
///
/// # Errors
/// [`FlatnessError::Contradiction`] where such a row is not met.
pub(crate) fn rows(
    nlp: &mut impl Nlp,
    rows: &[Row],
    global: &BTreeSet<usize>,
    x: &[f64],
    scales: &[f64],
) -> Result<Vec<bool>, FlatnessError> {
    let m = rows.len();
    let mut columns = vec![BTreeSet::new(); m];
    let pattern = nlp.jacobian_pattern();
    for (&r, &c) in pattern.rows.iter().zip(&pattern.cols) {
        columns[r].insert(c);
    }
    let candidates: Vec<usize> = (0..m).filter(|&r| columns[r].is_subset(global)).collect();
    let mut dropped = vec![false; m];
    if candidates.is_empty() {
        return Ok(dropped);
    }
    let moved: Vec<f64> = x
        .iter()
        .zip(scales)
        .enumerate()
        .map(|(c, (v, s))| if global.contains(&c) { v + STEP * s } else { *v })
        .collect();
    let mut values = vec![0.0; m];
    nlp.constraint_values(x, &mut values);
    let gradients = dense(nlp, x, &candidates, global, scales);
    let elsewhere = dense(nlp, &moved, &candidates, global, scales);
    // Orthonormal rows, each with what it must be equal to.
    let mut known: Vec<(Vec<f64>, f64)> = Vec::new();
    for (k, &r) in candidates.iter().enumerate() {
        let row = &rows[r];
        let scale = if row.scale.is_nan() { 1.0 } else { row.scale };
        let contradiction = || FlatnessError::Contradiction {
            row: row.to_string(),
            value: values[r],
            lower: row.bounds.lower,
            upper: row.bounds.upper,
            unit: row.origin.unit.clone(),
        };
        let size = norm(&gradients[k]);
        let change: Vec<f64> = gradients[k].iter().zip(&elsewhere[k]).map(|(a, b)| a - b).collect();
        let linear = norm(&change) <= ROUNDING * size;
        // Times that share a variable leave a difference without derivative.
        if columns[r].is_empty() || (linear && size == 0.0) {
            if row.bounds.excess(values[r]) > ROUNDING * scale || values[r].is_nan() {
                return Err(contradiction());
            }
            dropped[r] = true;
            continue;
        }
        if !row.bounds.is_fixed() || !linear {
            continue;
        }
        // By how much the left side must grow, per unit of the gradient.
        let mut demand = (row.bounds.lower - values[r]) / size;
        let mut rest: Vec<f64> = gradients[k].iter().map(|g| g / size).collect();
        for (direction, amount) in &known {
            let share: f64 = rest.iter().zip(direction).map(|(a, b)| a * b).sum();
            rest.iter_mut().zip(direction).for_each(|(a, b)| *a -= share * b);
            demand -= share * amount;
        }
        let left = norm(&rest);
        if left > ROUNDING {
            known.push((rest.iter().map(|v| v / left).collect(), demand / left));
        } else if demand.abs() * size > ROUNDING * scale.max(values[r].abs()) {
            return Err(contradiction());
        } else {
            dropped[r] = true;
        }
    }
    Ok(dropped)
}

/// Rows of the Jacobian at times and parameters, each column times the scale of its variable.
fn dense(
    nlp: &mut impl Nlp,
    x: &[f64],
    rows: &[usize],
    columns: &BTreeSet<usize>,
    scales: &[f64],
) -> Vec<Vec<f64>> {
    let pattern = nlp.jacobian_pattern();
    let mut entries = vec![0.0; pattern.len()];
    nlp.jacobian(x, &mut entries);
    let place: Vec<usize> = columns.iter().copied().collect();
    let mut dense = vec![vec![0.0; place.len()]; rows.len()];
    for ((r, c), v) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
        if let (Ok(i), Ok(j)) = (rows.binary_search(r), place.binary_search(c)) {
            dense[i][j] += v * scales[*c];
        }
    }
    dense
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|a| a * a).sum::<f64>().sqrt()
}
