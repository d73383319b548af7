//! Kernels on dense blocks of which several of one shape are treated at once, one in each lane of a vector.
//!
//! Value `i` of the block in lane `l` stands at `LANES * i + l`. Blocks are slices of columns, `stride` values in each.
//! A vector of the machine may hold fewer lanes than there are: a *part* is what fits into one.
//!
//! Loops of the kernels run over indices: `zip` and the like are calls where a crate is built in several units without link-time optimisation,
//! and `map` of an array is one always, without the vector instructions.

use pulp::Simd;

use crate::Inertia;
use crate::dense::{GROUP, for_columns};
use crate::pivot::{Diagonal, pivot};
use crate::twins::LANES;

/// Vectors that hold all lanes of one value.
#[inline(always)]
pub(crate) fn parts<S: Simd>() -> usize {
    const { assert!(LANES.is_multiple_of(S::F64_LANES)) };
    LANES / S::F64_LANES
}

/// Factors the first `width` columns of a block of `stride` rows into L D L^T: L below the diagonal, D on it. Signs of D
/// are counted. `None` after an overflow.
#[inline(always)]
pub(crate) fn eliminate<S: Simd>(
    simd: S,
    block: &mut [f64],
    (width, stride): (usize, usize),
    diagonal: Diagonal<'_>,
    factors: &mut [f64],
    inertia: &mut Inertia,
) -> Option<()> {
    for first in (0..width).step_by(GROUP) {
        for_columns!(
            width - first,
            eliminate_group::<S>(simd, block, stride, first, diagonal, factors, inertia)
        )?;
    }
    Some(())
}

/// Eliminates the `C` columns from `first`.
#[inline(always)]
fn eliminate_group<S: Simd, const C: usize>(
    simd: S,
    block: &mut [f64],
    stride: usize,
    first: usize,
    diagonal: Diagonal<'_>,
    factors: &mut [f64],
    inertia: &mut Inertia,
) -> Option<()> {
    let parts = parts::<S>();
    let (done, group) = block.split_at_mut(first * stride * LANES);
    if first > 0 {
        fill_factors::<S, C>(simd, done, stride, first, first, factors);
        subtract::<S, C>(
            simd,
            &mut group[first * LANES..],
            stride,
            stride - first,
            &done[first * LANES..],
            stride,
            &factors[..first * GROUP * LANES],
        );
    }
    for part in 0..parts {
        let at = |c: usize, row: usize| (c * stride + row) * parts + part;
        let mut inverses = [simd.splat_f64s(0.0); C];
        let mut triangle = [[simd.splat_f64s(0.0); C]; C];
        for c in 0..C {
            let lanes = ((c * stride + first + c) * parts + part) * S::F64_LANES;
            let shifts = &diagonal.shifts[(first + c) * LANES + part * S::F64_LANES..];
            for (value, shift) in group[lanes..lanes + S::F64_LANES].iter_mut().zip(shifts) {
                pivot(value, *shift, diagonal.unit, inertia)?;
            }
            let (values, _) = S::as_mut_simd_f64s(group);
            let inverse = simd.div_f64s(simd.splat_f64s(1.0), values[at(c, first + c)]);
            inverses[c] = inverse;
            for k in c + 1..C {
                let factor = values[at(c, first + k)];
                triangle[c][k] = factor;
                let value = simd.mul_f64s(factor, inverse);
                values[at(c, first + k)] = value;
                for column in c + 1..=k {
                    let target = &mut values[at(column, first + k)];
                    *target = simd.negate_mul_add_e_f64s(triangle[c][column], value, *target);
                }
            }
        }
        let (values, _) = S::as_mut_simd_f64s(group);
        for row in first + C..stride {
            let mut row_values = [simd.splat_f64s(0.0); C];
            for (c, value) in row_values.iter_mut().enumerate() {
                *value = values[at(c, row)];
            }
            for c in 0..C {
                let value = simd.mul_f64s(row_values[c], inverses[c]);
                for k in c + 1..C {
                    row_values[k] = simd.negate_mul_add_e_f64s(triangle[c][k], value, row_values[k]);
                }
                values[at(c, row)] = value;
            }
        }
    }
    Some(())
}

/// `factors[q][c] = d_q L[row + c][q]` for the first `columns` columns.
#[inline(always)]
fn fill_factors<S: Simd, const C: usize>(
    simd: S,
    block: &[f64],
    stride: usize,
    columns: usize,
    row: usize,
    factors: &mut [f64],
) {
    let parts = parts::<S>();
    let (block, _) = S::as_simd_f64s(block);
    let (factors, _) = S::as_mut_simd_f64s(factors);
    for q in 0..columns {
        let column = &block[q * stride * parts..][..stride * parts];
        let factors = &mut factors[q * GROUP * parts..][..GROUP * parts];
        for part in 0..parts {
            let pivot = column[q * parts + part];
            for c in 0..C {
                factors[c * parts + part] = simd.mul_f64s(column[(row + c) * parts + part], pivot);
            }
        }
    }
}

/// Puts the inverse of D in place of D.
#[inline(always)]
pub(crate) fn invert_pivots<S: Simd>(simd: S, block: &mut [f64], (width, stride): (usize, usize)) {
    for c in 0..width {
        let at = (c * stride + c) * LANES;
        let (pivots, _) = S::as_mut_simd_f64s(&mut block[at..at + LANES]);
        for pivot in pivots {
            *pivot = simd.div_f64s(simd.splat_f64s(1.0), *pivot);
        }
    }
}

/// Takes what `width` eliminated columns leave off the lower triangle of a square of the rows below.
#[inline(always)]
pub(crate) fn subtract_square<S: Simd>(
    simd: S,
    square: &mut [f64],
    block: &[f64],
    (width, stride): (usize, usize),
    factors: &mut [f64],
) {
    let order = stride - width;
    for column in (0..order).step_by(GROUP) {
        for_columns!(
            order - column,
            subtract_columns::<S>(simd, square, block, (width, stride), column, factors)
        );
    }
}

#[inline(always)]
fn subtract_columns<S: Simd, const C: usize>(
    simd: S,
    square: &mut [f64],
    block: &[f64],
    (width, stride): (usize, usize),
    column: usize,
    factors: &mut [f64],
) {
    let order = stride - width;
    fill_factors::<S, C>(simd, block, stride, width, width + column, factors);
    subtract::<S, C>(
        simd,
        &mut square[(column * order + column) * LANES..],
        order,
        order - column,
        &block[(width + column) * LANES..],
        stride,
        &factors[..width * GROUP * LANES],
    );
}

/// `target_c[i] -= sum over q of factors[q][c] * source_q[i]` for `C` columns and the first `rows` rows.
#[inline(always)]
fn subtract<S: Simd, const C: usize>(
    simd: S,
    target: &mut [f64],
    target_stride: usize,
    rows: usize,
    source: &[f64],
    source_stride: usize,
    factors: &[f64],
) {
    let (target, _) = S::as_mut_simd_f64s(target);
    let (source, _) = S::as_simd_f64s(source);
    let (factors, _) = S::as_simd_f64s(factors);
    for part in 0..parts::<S>() {
        let mut at = 0;
        while at + 2 <= rows {
            subtract_tile::<S, C, 2>(simd, part, target, target_stride, at, source, source_stride, factors);
            at += 2;
        }
        if at < rows {
            subtract_tile::<S, C, 1>(simd, part, target, target_stride, at, source, source_stride, factors);
        }
    }
}

/// `R` rows, with the sums in registers.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn subtract_tile<S: Simd, const C: usize, const R: usize>(
    simd: S,
    part: usize,
    target: &mut [S::f64s],
    target_stride: usize,
    at: usize,
    source: &[S::f64s],
    source_stride: usize,
    factors: &[S::f64s],
) {
    let parts = parts::<S>();
    let mut sums = [[simd.splat_f64s(0.0); R]; C];
    for q in 0..factors.len() / (GROUP * parts) {
        let column = &source[(q * source_stride + at) * parts..][..R * parts];
        let factors = &factors[q * GROUP * parts..][..GROUP * parts];
        for c in 0..C {
            let factor = factors[c * parts + part];
            for r in 0..R {
                sums[c][r] = simd.mul_add_e_f64s(factor, column[r * parts + part], sums[c][r]);
            }
        }
    }
    for c in 0..C {
        let target = &mut target[(c * target_stride + at) * parts..][..R * parts];
        for r in 0..R {
            let target = &mut target[r * parts + part];
            *target = simd.sub_f64s(*target, sums[c][r]);
        }
    }
}

/// Solves with the triangle of a block and takes its columns off the rows below, which stand at `below`. Row `r` of
/// right-hand side `k` of `R` is vector `r * R + k` of `x`.
#[inline(always)]
pub(crate) fn forward<S: Simd, const R: usize>(
    simd: S,
    block: &[f64],
    (width, stride): (usize, usize),
    first: usize,
    below: &[u32],
    x: &mut [f64],
) {
    /// Rows whose sums are in registers.
    const ROWS: usize = 4;
    let parts = parts::<S>();
    let (block, _) = S::as_simd_f64s(block);
    let (x, _) = S::as_mut_simd_f64s(x);
    for part in 0..parts {
        let entry = |c: usize, row: usize| (c * stride + row) * parts + part;
        let place = |row: usize, k: usize| (row * R + k) * parts + part;
        for c in 0..width {
            let mut values = [simd.splat_f64s(0.0); R];
            for k in 0..R {
                values[k] = x[place(first + c, k)];
            }
            for row in c + 1..width {
                let factor = block[entry(c, row)];
                for k in 0..R {
                    let target = &mut x[place(first + row, k)];
                    *target = simd.negate_mul_add_e_f64s(factor, values[k], *target);
                }
            }
        }
        let (groups, rest) = below.as_chunks::<ROWS>();
        for (group, rows) in groups.iter().enumerate() {
            let mut sums = [[simd.splat_f64s(0.0); R]; ROWS];
            for c in 0..width {
                let mut values = [simd.splat_f64s(0.0); R];
                for k in 0..R {
                    values[k] = x[place(first + c, k)];
                }
                let at = entry(c, width + group * ROWS);
                let column = &block[at..at + (ROWS - 1) * parts + 1];
                for (r, sums) in sums.iter_mut().enumerate() {
                    for k in 0..R {
                        sums[k] = simd.mul_add_e_f64s(column[r * parts], values[k], sums[k]);
                    }
                }
            }
            for r in 0..ROWS {
                for k in 0..R {
                    let target = &mut x[place(rows[r] as usize, k)];
                    *target = simd.sub_f64s(*target, sums[r][k]);
                }
            }
        }
        for (r, &row) in rest.iter().enumerate() {
            let mut sums = [simd.splat_f64s(0.0); R];
            for c in 0..width {
                let factor = block[entry(c, stride - rest.len() + r)];
                for k in 0..R {
                    sums[k] = simd.mul_add_e_f64s(factor, x[place(first + c, k)], sums[k]);
                }
            }
            for k in 0..R {
                let target = &mut x[place(row as usize, k)];
                *target = simd.sub_f64s(*target, sums[k]);
            }
        }
    }
}

/// Multiplies the rows of the columns of a block by the inverse of D, which stands on its diagonal, and solves with the
/// transpose of L. `x` is laid out as in [`forward`].
#[inline(always)]
pub(crate) fn backward<S: Simd, const R: usize>(
    simd: S,
    block: &[f64],
    (width, stride): (usize, usize),
    first: usize,
    below: &[u32],
    x: &mut [f64],
) {
    for column in (0..width).step_by(GROUP).rev() {
        for_columns!(
            width - column,
            backward_group::<S, R>(simd, block, (width, stride), first, column, below, x)
        );
    }
}

#[inline(always)]
fn backward_group<S: Simd, const C: usize, const R: usize>(
    simd: S,
    block: &[f64],
    (width, stride): (usize, usize),
    first: usize,
    column: usize,
    below: &[u32],
    x: &mut [f64],
) {
    let parts = parts::<S>();
    let (block, _) = S::as_simd_f64s(&block[column * stride * LANES..]);
    let (x, _) = S::as_mut_simd_f64s(x);
    for part in 0..parts {
        let entry = |c: usize, row: usize| (c * stride + row) * parts + part;
        let place = |row: usize, k: usize| (row * R + k) * parts + part;
        let mut sums = [[simd.splat_f64s(0.0); R]; C];
        for row in column + C..stride {
            let from = if row < width { first + row } else { below[row - width] as usize };
            let mut values = [simd.splat_f64s(0.0); R];
            for k in 0..R {
                values[k] = x[place(from, k)];
            }
            for c in 0..C {
                let factor = block[entry(c, row)];
                for k in 0..R {
                    sums[c][k] = simd.mul_add_e_f64s(factor, values[k], sums[c][k]);
                }
            }
        }
        for c in (0..C).rev() {
            let pivot = block[entry(c, column + c)];
            for k in 0..R {
                let mut sum = sums[c][k];
                for later in c + 1..C {
                    sum = simd.mul_add_e_f64s(
                        block[entry(c, column + later)],
                        x[place(first + column + later, k)],
                        sum,
                    );
                }
                let target = &mut x[place(first + column + c, k)];
                *target = simd.sub_f64s(simd.mul_f64s(*target, pivot), sum);
            }
        }
    }
}
