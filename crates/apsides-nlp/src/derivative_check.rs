//! Comparison of a problem's derivatives with central differences.

use crate::error::NlpError;
use crate::problem::{Nlp, Pattern};

/// Relative step of the differences: near the cube root of the rounding unit, best for central differences.
const STEP: f64 = 6e-6;

/// One entry of a derivative beside its finite difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DerivativeEntry {
    /// Row; zero for the gradient.
    pub row: usize,
    /// Column: the variable.
    pub col: usize,
    /// The derivative that the problem returns; zero outside the pattern.
    pub given: f64,
    /// The central difference.
    pub difference: f64,
    /// `|given - difference| / max(1, largest difference in the column)`.
    pub error: f64,
}

/// The worst entry of each derivative. Differences are good to about 1e-8 in the gradient and the Jacobian, and in the
/// Hessian, where gradients are differenced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DerivativeReport {
    /// Gradient of the objective.
    pub gradient: DerivativeEntry,
    /// Constraint Jacobian; entries outside the pattern count.
    pub jacobian: DerivativeEntry,
    /// Hessian of the Lagrangian with all multipliers different from zero; entries outside the pattern count.
    pub hessian: DerivativeEntry,
}

impl DerivativeReport {
    /// Returns true if no entry is off by more than `tolerance`; 1e-5 suits well-scaled problems. A NaN is never within it.
    pub fn is_within(&self, tolerance: f64) -> bool {
        [self.gradient, self.jacobian, self.hessian].iter().all(|entry| entry.error <= tolerance)
    }
}

impl DerivativeEntry {
    const NONE: Self = Self { row: 0, col: 0, given: 0.0, difference: 0.0, error: 0.0 };

    fn keep_worse(&mut self, row: usize, col: usize, given: f64, difference: f64, scale: f64) {
        let error = (given - difference).abs() / scale.max(1.0);
        if error > self.error || (error.is_nan() && !self.error.is_nan()) {
            *self = Self { row, col, given, difference, error };
        }
    }
}

/// Compares gradient, Jacobian and Hessian of `nlp` at `x` with central differences, at the cost of `2 n` evaluations
/// of the functions and of the first derivatives.
///
/// # Errors
/// `x` is not of length `n`, or a pattern names a position outside its matrix.
pub fn check_derivatives<N: Nlp + ?Sized>(nlp: &mut N, x: &[f64]) -> Result<DerivativeReport, NlpError> {
    let (n, m) = (nlp.variables(), nlp.constraints());
    if x.len() != n {
        return Err(NlpError::Length { what: "x", found: x.len(), expected: n });
    }
    let jacobian_pattern = nlp.jacobian_pattern();
    let hessian_pattern = nlp.hessian_pattern();
    jacobian_pattern.check("Jacobian", m, n)?;
    hessian_pattern.check("Hessian", n, n)?;

    let mut gradient = vec![0.0; n];
    nlp.gradient(x, &mut gradient);
    let mut jacobian = vec![0.0; jacobian_pattern.len()];
    nlp.jacobian(x, &mut jacobian);
    let multipliers: Vec<f64> = (0..m).map(|i| 1.0 + 0.37 * (i % 5) as f64).collect();
    let objective_factor = 0.7;
    let mut hessian = vec![0.0; hessian_pattern.len()];
    nlp.hessian(x, objective_factor, &multipliers, &mut hessian);
    let jacobian_columns = columns(&jacobian_pattern, n, false);
    let hessian_columns = columns(&hessian_pattern, n, true);

    let mut report = DerivativeReport {
        gradient: DerivativeEntry::NONE,
        jacobian: DerivativeEntry::NONE,
        hessian: DerivativeEntry::NONE,
    };
    let mut point = x.to_vec();
    let mut values = [vec![0.0; m], vec![0.0; m]];
    let mut lagrangian = [vec![0.0; n], vec![0.0; n]];
    let mut work = vec![0.0; jacobian_pattern.len()];
    for col in 0..n {
        let step = STEP * x[col].abs().max(1.0);
        let mut objective = [0.0; 2];
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            point[col] = x[col] + sign * step;
            objective[side] = nlp.objective(&point);
            nlp.constraint_values(&point, &mut values[side]);
            nlp.gradient(&point, &mut lagrangian[side]);
            lagrangian[side].iter_mut().for_each(|g| *g *= objective_factor);
            nlp.jacobian(&point, &mut work);
            for ((&row, &col), value) in jacobian_pattern.rows.iter().zip(&jacobian_pattern.cols).zip(&work) {
                lagrangian[side][col] += multipliers[row] * value;
            }
        }
        let width = (x[col] + step) - (x[col] - step);
        point[col] = x[col];
        let difference = (objective[0] - objective[1]) / width;
        report.gradient.keep_worse(0, col, gradient[col], difference, difference.abs());
        compare(&mut report.jacobian, col, &jacobian_columns[col], &jacobian, &values, width);
        compare(&mut report.hessian, col, &hessian_columns[col], &hessian, &lagrangian, width);
    }
    Ok(report)
}

/// Entries `(row, position)` of each column; with `mirror` those of the full symmetric matrix.
fn columns(pattern: &Pattern, cols: usize, mirror: bool) -> Vec<Vec<(usize, usize)>> {
    let mut columns = vec![Vec::new(); cols];
    for (entry, (&row, &col)) in pattern.rows.iter().zip(&pattern.cols).enumerate() {
        columns[col].push((row, entry));
        if mirror && row != col {
            columns[row].push((col, entry));
        }
    }
    columns
}

fn compare(
    worst: &mut DerivativeEntry,
    col: usize,
    entries: &[(usize, usize)],
    given: &[f64],
    sides: &[Vec<f64>; 2],
    width: f64,
) {
    let mut column = vec![0.0; sides[0].len()];
    for &(row, entry) in entries {
        column[row] += given[entry];
    }
    let difference = |row: usize| (sides[0][row] - sides[1][row]) / width;
    let scale = (0..column.len()).map(|row| difference(row).abs()).fold(0.0, f64::max);
    for (row, &given) in column.iter().enumerate() {
        worst.keep_worse(row, col, given, difference(row), scale);
    }
}
