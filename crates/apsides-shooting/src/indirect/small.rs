//! Dense systems of a handful of unknowns, in the caller's slices.

/// Solves `a x = b` for several right-hand sides by elimination with row pivoting: `a` is `n x n` and `b` is `n x columns`, both
/// row-major; `b` is replaced by the solution. False where a pivot is negligible against the largest entry.
pub(super) fn solve(n: usize, a: &mut [f64], b: &mut [f64], columns: usize) -> bool {
    let largest = a[..n * n].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs())).unwrap_or(k);
        let value = a[pivot * n + k].abs();
        if value.is_nan() || value <= 1e-14 * largest {
            return false;
        }
        if pivot != k {
            (0..n).for_each(|j| a.swap(k * n + j, pivot * n + j));
            (0..columns).for_each(|j| b.swap(k * columns + j, pivot * columns + j));
        }
        for i in k + 1..n {
            let factor = a[i * n + k] / a[k * n + k];
            if factor != 0.0 {
                (k..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
                (0..columns).for_each(|j| b[i * columns + j] -= factor * b[k * columns + j]);
            }
        }
    }
    for k in (0..n).rev() {
        for j in 0..columns {
            let known: f64 = (k + 1..n).map(|i| a[k * n + i] * b[i * columns + j]).sum();
            b[k * columns + j] = (b[k * columns + j] - known) / a[k * n + k];
        }
    }
    true
}

/// Says whether a symmetric `n x n` matrix is positive definite, by the square-root method in place.
pub(super) fn is_positive_definite(n: usize, a: &mut [f64]) -> bool {
    let largest = (0..n).fold(0.0_f64, |m, i| m.max(a[i * n + i].abs()));
    for k in 0..n {
        let inner: f64 = (0..k).map(|j| a[k * n + j] * a[k * n + j]).sum();
        let pivot = a[k * n + k] - inner;
        if pivot.is_nan() || pivot <= 1e-13 * largest {
            return false;
        }
        let root = pivot.sqrt();
        a[k * n + k] = root;
        for i in k + 1..n {
            let inner: f64 = (0..k).map(|j| a[i * n + j] * a[k * n + j]).sum();
            a[i * n + k] = (a[i * n + k] - inner) / root;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-13;

    #[test]
    fn solves_with_pivoting() {
        let mut a = [0.0, 2.0, 1.0, 1.0];
        let mut b = [4.0, 2.0, 3.0, 1.0];
        assert!(solve(2, &mut a, &mut b, 2));
        assert_eq!(b, [1.0, 0.0, 2.0, 1.0]);
        assert!(!solve(2, &mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0], 1));
    }

    #[test]
    fn definite_or_not() {
        assert!(is_positive_definite(2, &mut [2.0, 1.0, 1.0, 2.0]));
        assert!(!is_positive_definite(2, &mut [1.0, 2.0, 2.0, 1.0]));
        assert!(!is_positive_definite(1, &mut [f64::NAN]));
    }

    proptest! {
        /// The residual of elimination with row pivoting is of the order of rounding, whatever the condition.
        #[test]
        fn solutions_satisfy_the_system(
            n in 1_usize..7,
            columns in 1_usize..4,
            entries in prop::collection::vec(-1.0..1.0, 36),
            right in prop::collection::vec(-1.0..1.0, 18),
        ) {
            let (a, b) = (&entries[..n * n], &right[..n * columns]);
            let (mut work, mut x) = (a.to_vec(), b.to_vec());
            prop_assume!(solve(n, &mut work, &mut x, columns));
            for i in 0..n {
                for j in 0..columns {
                    let product: f64 = (0..n).map(|k| a[i * n + k] * x[k * columns + j]).sum();
                    let size = (0..n).fold(1.0_f64, |m, k| m.max(x[k * columns + j].abs()));
                    prop_assert!((product - b[i * columns + j]).abs() < ROUNDING * size);
                }
            }
        }

        /// One row a multiple of another: refused wherever it stands. With a power of two elimination keeps the multiple exactly; with
        /// other factors rounding can leave a pivot above the limit.
        #[test]
        fn dependent_rows_are_refused(
            n in 2_usize..6,
            rows in (0_usize..5, 0_usize..5),
            factor in prop::sample::select(vec![-2.0, -1.0, 0.0, 0.5, 1.0, 4.0]),
            entries in prop::collection::vec(-1.0..1.0, 25),
        ) {
            let from = rows.0 % n;
            let to = (from + 1 + rows.1 % (n - 1)) % n;
            let mut a = entries[..n * n].to_vec();
            for k in 0..n {
                a[to * n + k] = factor * a[from * n + k];
            }
            prop_assert!(!solve(n, &mut a, &mut vec![1.0; n], 1));
        }
    }
}
