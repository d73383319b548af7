//! Polyhedral cones of directions: the projection onto one, and a direction inside it.
//!
//! Both are least-squares problems with unknowns that are not negative (C. L. Lawson, R. J. Hanson, Solving Least Squares Problems,
//! SIAM 1995, chapter 23: the problems NNLS and LDP).

use nalgebra::{DMatrix, DVector};

/// Slopes of the square sum, relative to it, that are none.
const ROUNDING: f64 = 1e-12;
/// A residual of a system without a solution, else rounding.
const NO_SOLUTION: f64 = 1e-9;
/// Steps per unknown.
const STEPS: usize = 10;

/// The direction of the cone `rows d >= 0` that is closest to `target`.
pub(super) fn projection(rows: &[DVector<f64>], target: &DVector<f64>) -> DVector<f64> {
    if rows.is_empty() {
        return target.clone();
    }
    let columns = DMatrix::from_columns(rows);
    let weights = not_negative(&columns, &-target);
    target + columns * weights
}

/// The shortest direction with `rows d >= 1` for the inner rows and `rows d >= 0` for the others; none if there is none.
pub(super) fn inside(inner: &[DVector<f64>], others: &[DVector<f64>]) -> Option<DVector<f64>> {
    let n = inner.first()?.len();
    let all: Vec<&DVector<f64>> = inner.iter().chain(others).collect();
    let mut columns = DMatrix::zeros(n + 1, all.len());
    for (k, row) in all.iter().enumerate() {
        columns.view_mut((0, k), (n, 1)).copy_from(*row);
        columns[(n, k)] = if k < inner.len() { 1.0 } else { 0.0 };
    }
    let mut unit = DVector::zeros(n + 1);
    unit[n] = 1.0;
    let weights = not_negative(&columns, &unit);
    let residual = columns * weights - unit;
    (residual.norm() > NO_SOLUTION).then(|| -residual.rows(0, n) / residual[n])
}

/// The unknowns `x >= 0` of the least `|columns x - rhs|`.
fn not_negative(columns: &DMatrix<f64>, rhs: &DVector<f64>) -> DVector<f64> {
    let n = columns.ncols();
    let mut x = DVector::zeros(n);
    let mut free: Vec<usize> = Vec::new();
    let sizes: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
    for _ in 0..STEPS * n {
        let residual = rhs - columns * &x;
        let least = ROUNDING * rhs.norm().max(residual.norm());
        let slope = |k: usize| columns.column(k).dot(&residual);
        let held = (0..n).filter(|k| !free.contains(k) && slope(*k) > least * sizes[*k]);
        let Some(next) = held.max_by(|a, b| (slope(*a) / sizes[*a]).total_cmp(&(slope(*b) / sizes[*b])))
        else {
            break;
        };
        free.push(next);
        loop {
            let some = columns.select_columns(&free);
            let Ok(best) = some.svd(true, true).solve(rhs, ROUNDING) else { return x };
            // As far as all stay above zero; what comes to zero is held there.
            let overshot = free.iter().zip(best.iter()).filter(|(_, v)| **v <= 0.0);
            let part = overshot
                .map(|(k, v)| if x[*k] > 0.0 { x[*k] / (x[*k] - v) } else { 0.0 })
                .fold(1.0_f64, f64::min);
            for (k, v) in free.iter().zip(best.iter()) {
                x[*k] += part * (v - x[*k]);
            }
            if part >= 1.0 {
                break;
            }
            free.retain(|k| x[*k] > 0.0);
            (0..n).filter(|k| !free.contains(k)).for_each(|k| x[k] = 0.0);
            if free.is_empty() {
                break;
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    #[test]
    fn projections_are_those_of_a_quadrant_and_of_a_narrow_cone() {
        let quadrant = [vector(&[1.0, 0.0]), vector(&[0.0, 1.0])];
        let onto = |target: &[f64]| projection(&quadrant, &vector(target));
        assert!((onto(&[2.0, -3.0]) - vector(&[2.0, 0.0])).norm() < NO_SOLUTION);
        assert!((onto(&[-2.0, -3.0]) - vector(&[0.0, 0.0])).norm() < NO_SOLUTION);
        assert!((onto(&[2.0, 3.0]) - vector(&[2.0, 3.0])).norm() < NO_SOLUTION);
        // Around the direction (1, 0.3), a thirtieth wide: both edges by their normals.
        let narrow = [vector(&[0.35, -1.0]), vector(&[-0.25, 1.0])];
        let edge = vector(&[1.0, 0.35]);
        let expected = &edge * (edge.dot(&vector(&[0.0, 1.0])) / edge.norm_squared());
        assert!((projection(&narrow, &vector(&[0.0, 1.0])) - expected).norm() < NO_SOLUTION);
        assert_eq!(projection(&[], &vector(&[1.0, 2.0])), vector(&[1.0, 2.0]));
    }

    #[test]
    fn a_direction_inside_is_found_where_there_is_one() {
        let narrow = [vector(&[0.35, -1.0]), vector(&[-0.25, 1.0])];
        let found = inside(&narrow, &[vector(&[1.0, 0.0])]).unwrap();
        assert!(narrow.iter().all(|row| row.dot(&found) > 1.0 - NO_SOLUTION));
        assert!(inside(&narrow, &[vector(&[-1.0, 0.0])]).is_none());
        assert!(inside(&[vector(&[1.0, 0.0]), vector(&[-1.0, 0.0])], &[]).is_none());
        assert!(inside(&[], &[]).is_none());
    }
}
