//! Choice of the scaling factors (Waechter and Biegler, section 3.8).

use apsides_iteration::ScalingFactors;

use crate::error::NlpError;
use crate::problem::{Nlp, Pattern, Scaling};

/// Factors below this are raised to it.
const LEAST_FACTOR: f64 = 1e-8;

/// Factors from the user's units; ones where there are none.
pub(crate) fn choose_units(scaling: Option<Scaling>, n: usize, m: usize) -> Result<ScalingFactors, NlpError> {
    let Some(Scaling { objective, variables, constraints }) = scaling else {
        return Ok(ScalingFactors { objective: 1.0, variables: vec![1.0; n], constraints: vec![1.0; m] });
    };
    if variables.len() != n {
        return Err(NlpError::Length {
            what: "scaling of the variables",
            found: variables.len(),
            expected: n,
        });
    }
    if constraints.len() != m {
        let found = constraints.len();
        return Err(NlpError::Length { what: "scaling of the constraints", found, expected: m });
    }
    Ok(ScalingFactors {
        objective: inverse("objective", 0, objective)?,
        variables: inverses("variable", &variables)?,
        constraints: inverses("constraint", &constraints)?,
    })
}

fn inverses(kind: &'static str, units: &[f64]) -> Result<Vec<f64>, NlpError> {
    units.iter().enumerate().map(|(index, &unit)| inverse(kind, index, unit)).collect()
}

fn inverse(kind: &'static str, index: usize, value: f64) -> Result<f64, NlpError> {
    let inverse = 1.0 / value;
    if value > 0.0 && value.is_finite() && inverse.is_finite() {
        Ok(inverse)
    } else {
        Err(NlpError::Scale { kind, index, value })
    }
}

/// Multiplies the factors of objective and constraints so that no entry of a gradient at `x` exceeds `max`. Functions
/// that cannot be evaluated there keep their factor.
pub(crate) fn gradient_factors(
    nlp: &mut dyn Nlp,
    x: &[f64],
    free: &[usize],
    pattern: &Pattern,
    max: f64,
    factors: &mut ScalingFactors,
) {
    let mut gradient = vec![0.0; x.len()];
    nlp.gradient(x, &mut gradient);
    let objective = factors.objective;
    let largest =
        free.iter().map(|&i| (gradient[i] * objective / factors.variables[i]).abs()).fold(0.0, nan_max);
    factors.objective *= reduction(largest, max);

    let mut values = vec![0.0; pattern.len()];
    nlp.jacobian(x, &mut values);
    let mut is_free = vec![false; x.len()];
    free.iter().for_each(|&i| is_free[i] = true);
    let mut largest = vec![0.0; factors.constraints.len()];
    for ((&row, &col), value) in pattern.rows.iter().zip(&pattern.cols).zip(&values) {
        if is_free[col] {
            let scaled = value * factors.constraints[row] / factors.variables[col];
            largest[row] = nan_max(largest[row], scaled.abs());
        }
    }
    for (factor, largest) in factors.constraints.iter_mut().zip(largest) {
        *factor *= reduction(largest, max);
    }
}

/// The larger number, NaN if one is NaN.
fn nan_max(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

fn reduction(largest: f64, max: f64) -> f64 {
    if largest.is_finite() && largest > max { (max / largest).max(LEAST_FACTOR) } else { 1.0 }
}
