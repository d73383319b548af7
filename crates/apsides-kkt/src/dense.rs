//! Kernels on dense blocks of columns, in the vector instructions of the machine.
//!
//! A block is a slice of columns, each `stride` values after the one before. Columns are treated in groups of
//! [`GROUP`]; rows begin and strides end at multiples of it, so that vectors of this length leave no rest.
//!
//! Loops of the kernels run over indices: `zip` and the like are calls where a crate is built in several units without link-time optimisation,
//! and `map` of an array is one always, without the vector instructions.

use pulp::Simd;

/// Columns that are treated together, and the unit of lengths.
pub(crate) const GROUP: usize = 4;

/// Calls a kernel with the number of columns that are left as a constant, at most [`GROUP`].
macro_rules! for_columns {
    ($left:expr, $kernel:ident::<S $(, $more:ident)?>($($argument:expr),* $(,)?)) => {
        match $left {
            1 => $kernel::<S, 1 $(, $more)?>($($argument),*),
            2 => $kernel::<S, 2 $(, $more)?>($($argument),*),
            3 => $kernel::<S, 3 $(, $more)?>($($argument),*),
            _ => $kernel::<S, { $crate::dense::GROUP } $(, $more)?>($($argument),*),
        }
    };
}
pub(crate) use for_columns;

/// The least multiple of [`GROUP`] that is not below `n`.
pub(crate) fn padded(n: usize) -> usize {
    n.next_multiple_of(GROUP)
}

/// Sets all values to zero; short slices do not pay for a call.
#[inline(always)]
pub(crate) fn clear<S: Simd>(simd: S, values: &mut [f64]) {
    let (vectors, rest) = S::as_mut_simd_f64s(values);
    for vector in vectors {
        *vector = simd.splat_f64s(0.0);
    }
    for value in rest {
        *value = 0.0;
    }
}

/// `target_c[i] -= sum over q of factors[q][c] * source_q[i]` for `C` columns and the first `rows` rows.
#[inline(always)]
pub(crate) fn subtract_products<S: Simd, const C: usize>(
    simd: S,
    target: &mut [f64],
    target_stride: usize,
    rows: usize,
    source: &[f64],
    source_stride: usize,
    factors: &[[f64; GROUP]],
) {
    let lanes = S::F64_LANES;
    let mut at = 0;
    while at + 3 * lanes <= rows {
        subtract_tile::<S, C, 3>(simd, target, target_stride, at, source, source_stride, factors);
        at += 3 * lanes;
    }
    while at + lanes <= rows {
        subtract_tile::<S, C, 1>(simd, target, target_stride, at, source, source_stride, factors);
        at += lanes;
    }
    for row in at..rows {
        for c in 0..C {
            let mut sum = 0.0;
            for (q, factors) in factors.iter().enumerate() {
                sum += factors[c] * source[q * source_stride + row];
            }
            target[c * target_stride + row] -= sum;
        }
    }
}

/// `V` vectors of rows, with the sums in registers.
#[inline(always)]
fn subtract_tile<S: Simd, const C: usize, const V: usize>(
    simd: S,
    target: &mut [f64],
    target_stride: usize,
    at: usize,
    source: &[f64],
    source_stride: usize,
    factors: &[[f64; GROUP]],
) {
    let height = V * S::F64_LANES;
    let mut sums = [[simd.splat_f64s(0.0); V]; C];
    for (q, factors) in factors.iter().enumerate() {
        let (values, _) = S::as_simd_f64s(&source[q * source_stride + at..][..height]);
        for c in 0..C {
            let factor = simd.splat_f64s(factors[c]);
            for v in 0..V {
                sums[c][v] = simd.mul_add_e_f64s(factor, values[v], sums[c][v]);
            }
        }
    }
    for c in 0..C {
        let (values, _) = S::as_mut_simd_f64s(&mut target[c * target_stride + at..][..height]);
        for v in 0..V {
            values[v] = simd.sub_f64s(values[v], sums[c][v]);
        }
    }
}

/// The pivots of a group of columns and what stands below them in the group, times the pivot of its column.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<const C: usize> {
    pub(crate) inverse_pivots: [f64; C],
    /// `factors[c][k]`, `k > c`: `d_c L_kc`.
    pub(crate) factors: [[f64; C]; C],
}

/// Turns rows `from..stride` of `C` columns into those of L: from the left, each column is divided by its pivot and
/// taken off the columns to its right.
#[inline(always)]
pub(crate) fn eliminate_below<S: Simd, const C: usize>(
    simd: S,
    block: &mut [f64],
    stride: usize,
    from: usize,
    triangle: Triangle<C>,
) {
    let lanes = S::F64_LANES;
    let Triangle { inverse_pivots, factors } = triangle;
    let mut at = from;
    while at + lanes <= stride {
        let mut values = [simd.splat_f64s(0.0); C];
        for (c, value) in values.iter_mut().enumerate() {
            *value = S::as_simd_f64s(&block[c * stride + at..][..lanes]).0[0];
        }
        for c in 0..C {
            let value = simd.mul_f64s(values[c], simd.splat_f64s(inverse_pivots[c]));
            for k in c + 1..C {
                values[k] = simd.negate_mul_add_e_f64s(simd.splat_f64s(factors[c][k]), value, values[k]);
            }
            S::as_mut_simd_f64s(&mut block[c * stride + at..][..lanes]).0[0] = value;
        }
        at += lanes;
    }
    for row in at..stride {
        for c in 0..C {
            block[c * stride + row] *= inverse_pivots[c];
            let value = block[c * stride + row];
            for k in c + 1..C {
                block[k * stride + row] -= factors[c][k] * value;
            }
        }
    }
}

/// Inner products of rows `from..stride` of `C` columns with each of `R` vectors of `stride` rows in `x`.
#[inline(always)]
pub(crate) fn products<S: Simd, const C: usize, const R: usize>(
    simd: S,
    block: &[f64],
    stride: usize,
    from: usize,
    x: &[f64],
) -> [[f64; C]; R] {
    let lanes = S::F64_LANES;
    let mut sums = [[simd.splat_f64s(0.0); C]; R];
    let mut at = from;
    while at + lanes <= stride {
        for c in 0..C {
            let value = S::as_simd_f64s(&block[c * stride + at..][..lanes]).0[0];
            for k in 0..R {
                let x = S::as_simd_f64s(&x[k * stride + at..][..lanes]).0[0];
                sums[k][c] = simd.mul_add_e_f64s(value, x, sums[k][c]);
            }
        }
        at += lanes;
    }
    let mut results = [[0.0; C]; R];
    for k in 0..R {
        for c in 0..C {
            results[k][c] = simd.reduce_sum_f64s(sums[k][c]);
            for row in at..stride {
                results[k][c] += block[c * stride + row] * x[k * stride + row];
            }
        }
    }
    results
}
