//! Elimination with row pivoting for the Newton matrix of a boundary value problem, without the work on its zeros.
//!
//! A node appears in the equations of its own segment and of the one before, and times, parameters and multipliers in a few more: most entries of a
//! column are zero, and stay so (G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., 2013, sections 3.2 and 3.4).

use nalgebra::{DMatrix, DVector};

/// The factors of a matrix with its rows in another order.
pub(super) struct Elimination {
    /// Multipliers below the diagonal, the upper factor on it and above; columns one after another.
    factors: Vec<f64>,
    /// The row of the matrix, per row of the factors.
    rows: Vec<usize>,
}

impl Elimination {
    /// Factors a square matrix of one row at least; a pivot of zero shows in the solutions, which are not finite then.
    pub(super) fn new(matrix: &DMatrix<f64>) -> Self {
        let n = matrix.nrows();
        let mut factors = matrix.as_slice().to_vec();
        let mut rows: Vec<usize> = (0..n).collect();
        let mut below = Vec::with_capacity(n);
        for k in 0..n {
            let (left, right) = factors.split_at_mut((k + 1) * n);
            let column = &mut left[k * n..];
            let mut pivot = k;
            for i in k + 1..n {
                if column[i].abs() > column[pivot].abs() {
                    pivot = i;
                }
            }
            if pivot != k {
                rows.swap(k, pivot);
                column.swap(k, pivot);
            }
            let by_pivot = 1.0 / column[k];
            below.clear();
            for i in k + 1..n {
                if column[i] != 0.0 {
                    column[i] *= by_pivot;
                    below.push((i, column[i]));
                }
            }
            for other in right.chunks_exact_mut(n) {
                other.swap(k, pivot);
                let factor = other[k];
                if factor != 0.0 {
                    for &(i, multiplier) in &below {
                        other[i] -= multiplier * factor;
                    }
                }
            }
            if pivot != k {
                left[..k * n].chunks_exact_mut(n).for_each(|before| before.swap(k, pivot));
            }
        }
        Self { factors, rows }
    }

    /// The solution for a right-hand side, where it is finite.
    pub(super) fn solve(&self, right: &DVector<f64>) -> Option<DVector<f64>> {
        let n = self.rows.len();
        let mut x = DVector::from_iterator(n, self.rows.iter().map(|&row| right[row]));
        for (k, column) in self.factors.chunks_exact(n).enumerate() {
            let known = x[k];
            if known != 0.0 {
                for i in k + 1..n {
                    x[i] -= column[i] * known;
                }
            }
        }
        for (k, column) in self.factors.chunks_exact(n).enumerate().rev() {
            let known = x[k] / column[k];
            x[k] = known;
            for i in 0..k {
                x[i] -= column[i] * known;
            }
        }
        x.iter().all(|v| v.is_finite()).then_some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-13;

    /// Bands and a border, with zeros on the diagonal: rows have to change places.
    #[test]
    fn a_bordered_band_is_solved() {
        let n = 23;
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let number = ((7 * i + 13 * j) % 11) as f64 / 11.0 - 0.4;
            if i == j {
                0.0
            } else if i.abs_diff(j) <= 3 || j + 2 >= n || i + 2 >= n {
                number
            } else {
                0.0
            }
        });
        let expected = DVector::from_fn(n, |i, _| (i as f64 - 9.5) / 7.0);
        let found = Elimination::new(&matrix).solve(&(&matrix * &expected)).unwrap();
        let reference = matrix.clone().lu().solve(&(&matrix * &expected)).unwrap();
        let size = 1.0 + reference.amax();
        assert!((&found - &expected).amax() < ROUNDING * size * 1e2, "{found} {expected}");
        assert!((&found - &reference).amax() < ROUNDING * size * 1e2);
    }

    #[test]
    fn a_singular_matrix_and_what_is_no_number_have_no_solution() {
        let right = DVector::from_element(2, 1.0);
        let singular = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]);
        assert!(Elimination::new(&singular).solve(&right).is_none());
        let unknown = DMatrix::from_row_slice(2, 2, &[1.0, f64::NAN, 2.0, 4.0]);
        assert!(Elimination::new(&unknown).solve(&right).is_none());
    }
}
