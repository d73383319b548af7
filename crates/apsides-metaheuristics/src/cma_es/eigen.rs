//! Eigenvalues and eigenvectors of a symmetric matrix: Householder's tridiagonal form, then the QL algorithm with implicit
//! shifts (Golub and Van Loan, Matrix Computations, 4th ed., sections 8.3.1 and 8.3.3).

use super::vectors::{add, dot};

/// Iterations for each eigenvalue; two or three are usual.
const ITERATIONS: usize = 60;

/// Eigenvalues into `values` and eigenvectors into the rows of `vectors`, in no particular order.
///
/// `vectors` has the symmetric `n x n` matrix on entry, row after row, of which the lower triangle is read. `work` has `n` numbers.
/// Returns whether it succeeded; it does not where the matrix is not finite.
#[must_use]
pub(super) fn decompose(vectors: &mut [f64], values: &mut [f64], work: &mut [f64]) -> bool {
    let n = values.len();
    debug_assert_eq!(vectors.len(), n * n);
    tridiagonal(vectors, values, work, n);
    values.iter().chain(&*work).all(|v| v.is_finite()) && diagonal(vectors, values, work, n)
}

/// `A = Q T Q'`: the diagonal of `T` into `d`, what is below into `e[1..]`, and `Q'` into `a`.
fn tridiagonal(a: &mut [f64], d: &mut [f64], e: &mut [f64], n: usize) {
    e[0] = 0.0;
    for k in (1..n).rev() {
        // Row k left of the diagonal becomes a multiple of its last entry.
        let (above, row) = a.split_at_mut(k * n);
        let row = &mut row[..k];
        let scale: f64 = row.iter().map(|v| v.abs()).sum();
        d[k] = 0.0;
        if k == 1 || scale == 0.0 {
            e[k] = row[k - 1];
            continue;
        }
        row.iter_mut().for_each(|v| *v /= scale);
        let square = dot(row, row);
        let last = row[k - 1];
        let length = if last > 0.0 { -square.sqrt() } else { square.sqrt() };
        e[k] = scale * length;
        let h = square - last * length;
        row[k - 1] = last - length;
        // p = A u / h from the lower triangle, q = p - u (u'p) / 2 h, A - u q' - q u'.
        let p = &mut e[..k];
        p.fill(0.0);
        for i in 0..k {
            let line = &above[i * n..i * n + i];
            add(&mut p[..i], row[i], line);
            p[i] += above[i * n + i] * row[i] + dot(line, &row[..i]);
        }
        p.iter_mut().for_each(|v| *v /= h);
        let along = dot(p, row) / (2.0 * h);
        add(p, -along, row);
        for i in 0..k {
            let line = &mut above[i * n..=i * n + i];
            let (u, q) = (row[i], p[i]);
            for ((a, p), r) in line.iter_mut().zip(&p[..=i]).zip(&row[..=i]) {
                *a -= u * p + q * r;
            }
        }
        d[k] = h;
    }
    // d has h of each reflection, rows have u; the entries of e at the diagonal's left were overwritten on the way.
    accumulate(a, d, n);
}

/// Multiplies the reflections, whose vectors are in the rows of `a` and whose `h` in `d`, and puts the diagonal into `d`.
fn accumulate(a: &mut [f64], d: &mut [f64], n: usize) {
    d[0] = 0.0;
    for k in 0..n {
        let diagonal = a[k * n + k];
        // Rows 0..k have the transposed product so far in their first k columns.
        if d[k] != 0.0 {
            let (above, row) = a.split_at_mut(k * n);
            for line in above.chunks_exact_mut(n) {
                let along = dot(&line[..k], &row[..k]) / d[k];
                add(&mut line[..k], -along, &row[..k]);
            }
        }
        d[k] = diagonal;
        a[k * n..k * n + k].fill(0.0);
        a[k * n + k] = 1.0;
        (0..k).for_each(|i| a[i * n + k] = 0.0);
    }
}

/// Eigenvalues of the tridiagonal matrix into `d`, and the rows of `z` turned with it.
fn diagonal(z: &mut [f64], d: &mut [f64], e: &mut [f64], n: usize) -> bool {
    e.copy_within(1.., 0);
    e[n - 1] = 0.0;
    for l in 0..n {
        for iteration in 0.. {
            let small = |k: &usize| e[*k].abs() <= f64::EPSILON * (d[*k].abs() + d[*k + 1].abs());
            let m = (l..n - 1).find(small).unwrap_or(n - 1);
            if m == l {
                break;
            }
            if iteration == ITERATIONS {
                return false;
            }
            let g = (d[l + 1] - d[l]) / (2.0 * e[l]);
            let mut g = d[m] - d[l] + e[l] / (g + (g * g + 1.0).sqrt().copysign(g));
            let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
            let mut split = false;
            for i in (l..m).rev() {
                let (f, b) = (s * e[i], c * e[i]);
                let r = (f * f + g * g).sqrt();
                e[i + 1] = r;
                if r == 0.0 {
                    d[i + 1] -= p;
                    e[m] = 0.0;
                    split = true;
                    break;
                }
                (s, c) = (f / r, g / r);
                g = d[i + 1] - p;
                let t = (d[i] - g) * s + 2.0 * c * b;
                p = s * t;
                d[i + 1] = g + p;
                g = c * t - b;
                let (first, second) = z[i * n..(i + 2) * n].split_at_mut(n);
                for (low, high) in first.iter_mut().zip(second) {
                    let h = *high;
                    *high = s * *low + c * h;
                    *low = c * *low - s * h;
                }
            }
            if !split {
                d[l] -= p;
                e[l] = g;
                e[m] = 0.0;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Generator;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-14;

    fn check(matrix: &[f64], n: usize) -> Vec<f64> {
        let (mut vectors, mut values, mut work) = (matrix.to_vec(), vec![0.0; n], vec![0.0; n]);
        assert!(decompose(&mut vectors, &mut values, &mut work));
        let size = matrix.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        for (v, value) in vectors.chunks_exact(n).zip(&values) {
            for i in 0..n {
                let product: f64 = (0..n).map(|j| matrix[i * n + j] * v[j]).sum();
                assert!((product - value * v[i]).abs() <= ROUNDING * n as f64 * size, "{n}");
            }
            for (k, w) in vectors.chunks_exact(n).enumerate() {
                let product: f64 = v.iter().zip(w).map(|(a, b)| a * b).sum();
                let same = f64::from(u8::from(std::ptr::eq(v, w)));
                assert!((product - same).abs() < ROUNDING * n as f64, "{n} {k} {product}");
            }
        }
        values.sort_by(f64::total_cmp);
        values
    }

    #[test]
    fn random_matrices() {
        let mut generator = Generator::new(1);
        for n in [1, 2, 3, 4, 10, 31] {
            let mut matrix = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..=i {
                    let v = generator.normal();
                    (matrix[i * n + j], matrix[j * n + i]) = (v, v);
                }
            }
            check(&matrix, n);
        }
    }

    #[test]
    fn known_eigenvalues() {
        // Second differences: 2 - 2 cos(k pi / (n + 1)).
        let n = 12;
        let mut matrix = vec![0.0; n * n];
        for i in 0..n {
            matrix[i * n + i] = 2.0;
            if i > 0 {
                (matrix[i * n + i - 1], matrix[(i - 1) * n + i]) = (-1.0, -1.0);
            }
        }
        for (k, value) in check(&matrix, n).iter().enumerate() {
            let exact = 2.0 - 2.0 * ((k + 1) as f64 * std::f64::consts::PI / (n + 1) as f64).cos();
            assert!((value - exact).abs() < ROUNDING);
        }
    }

    #[test]
    fn special_matrices() {
        assert_eq!(check(&[3.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 3.0], 3), [-1.0, 3.0, 3.0]);
        check(&[1.0; 25], 5);
        check(&[0.0; 9], 3);
        // Sizes far apart.
        check(&[1e-20, 1e-11, 0.0, 1e-11, 1.0, 1e6, 0.0, 1e6, 1e14], 3);
        let (mut vectors, mut values, mut work) = (vec![f64::NAN; 4], vec![0.0; 2], vec![0.0; 2]);
        assert!(!decompose(&mut vectors, &mut values, &mut work));
    }
}
