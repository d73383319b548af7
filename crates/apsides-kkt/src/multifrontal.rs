//! Multifrontal LDL^T without pivoting (Duff and Reid, ACM TOMS 9 (1983) 302, doi 10.1145/356044.356047): each supernode
//! gathers its columns and the contributions of its children in dense blocks, eliminates its columns and leaves a
//! contribution to its parent.

use pulp::{Arch, Simd, WithSimd};

use crate::assembly::{Extent, TwinChildren, place_contributions, place_entries, relative_rows};
use crate::bundle::Bundles;
use crate::columns::MOST_COLUMNS;
use crate::dense::{GROUP, Triangle, clear, eliminate_below, for_columns, products, subtract_products};
use crate::norms::all_finite;
use crate::pivot::{Diagonal, pivot};
use crate::refine::Substitution;
use crate::structure::Structure;
use crate::supernodes::Supernodes;
use crate::twins::LANES;
use crate::{Inertia, KktError};

/// Structure, factor and work space. Nothing is allocated after construction.
///
/// The block of a supernode has a row for each of its columns, then those below; both parts are filled up with zeros
/// to a multiple of [`GROUP`]. A contribution has the rows below on both sides.
pub(crate) struct Multifrontal {
    /// Subtrees that are alike; their rows come first.
    bundles: Bundles,
    /// The supernodes of the other rows.
    supernodes: Supernodes,
    extents: Vec<Extent>,
    /// Start of each block in `entries`, and the end.
    block_start: Vec<usize>,
    /// Entries of the pattern by supernode: index, and place in the block.
    loads: Vec<(u32, u32)>,
    /// Start of each supernode in `loads`, and the end.
    load_start: Vec<u32>,
    /// Row in the parent's block of each row below, laid out as `supernodes.rows`.
    relative: Vec<u32>,
    /// Children of supernode `s` are `children[child_start[s]..child_start[s + 1]]`.
    children: Vec<u32>,
    child_start: Vec<u32>,
    twins: TwinChildren,
    /// Place of each contribution in `contributions`; a place is used again after the parent has taken it in.
    contribution_start: Vec<usize>,
    /// Blocks of L, with D in place of its unit diagonal.
    entries: Vec<f64>,
    contributions: Vec<f64>,
    /// Rows of `D L^T` for one group of columns.
    factors: Vec<[f64; GROUP]>,
    /// The rows of a block in each right-hand side.
    gathered: Vec<f64>,
    arch: Arch,
    complete: bool,
}

impl Multifrontal {
    /// The factor of a matrix with the rows of bundles first, and the supernodes of the others.
    pub(crate) fn new(
        structure: &Structure,
        supernodes: Supernodes,
        bundles: Bundles,
    ) -> Result<Self, KktError> {
        let count = supernodes.count();
        let (child_start, children) = supernodes.children();
        let parents = TwinChildren::parents(&supernodes, &bundles);
        let mut is_leaf: Vec<bool> = (0..count).map(|s| child_start[s] == child_start[s + 1]).collect();
        for &(parent, ..) in &parents {
            is_leaf[parent] = false;
        }
        let extents: Vec<_> = (0..count).map(|s| Extent::of(&supernodes, s, is_leaf[s])).collect();
        let mut block_start = vec![0; count + 1];
        for s in 0..count {
            block_start[s + 1] = block_start[s] + extents[s].width * extents[s].stride;
        }
        if (0..count).any(|s| block_start[s + 1] - block_start[s] > u32::MAX as usize) {
            return Err(KktError::TooLarge { n: structure.n });
        }
        let (load_start, loads) = place_entries(structure, &supernodes, &extents);
        let (contribution_start, contributions) = place_contributions(&extents, &children, &child_start);
        let widest = extents.iter().map(|extent| extent.width).max().unwrap_or(0);
        let highest = extents.iter().map(|extent| extent.stride).max().unwrap_or(0);
        Ok(Self {
            relative: relative_rows(&supernodes, &extents),
            twins: TwinChildren::new(&supernodes, &extents, &bundles, &parents),
            bundles,
            entries: vec![0.0; block_start[count]],
            contributions: vec![0.0; contributions],
            factors: vec![[0.0; GROUP]; widest],
            gathered: vec![0.0; highest * MOST_COLUMNS],
            supernodes,
            extents,
            block_start,
            loads,
            load_start,
            children,
            child_start,
            contribution_start,
            arch: Arch::new(),
            complete: false,
        })
    }

    /// Values stored for L and D.
    pub(crate) fn nonzeros(&self) -> usize {
        self.entries.len() + self.bundles.nonzeros()
    }

    /// Factors the matrix with these values of the pattern and the shifts of pivots. Signs of D are counted;
    /// pivots that are zero to rounding in rows of size `unit` count as zero. After an overflow all do.
    pub(crate) fn factor(&mut self, values: &[f64], shifts: &[f64], unit: f64) -> Inertia {
        let inertia = self.arch.dispatch(Factorise { factor: self, values, shifts, unit });
        self.complete = inertia.is_some();
        inertia.unwrap_or(Inertia { zero: self.supernodes.of_column.len(), ..Inertia::default() })
    }
}

impl Substitution for Multifrontal {
    fn solve(&mut self, x: &mut [f64]) -> bool {
        let [finite] = self.solve_columns([x]);
        finite
    }

    fn solve_columns<const R: usize>(&mut self, mut x: [&mut [f64]; R]) -> [bool; R] {
        if !self.complete {
            return [false; R];
        }
        self.arch.dispatch(Substitute { factor: self, x: &mut x });
        x.map(|x| all_finite(x))
    }
}

/// Answers the signs of D; `None` after an overflow.
struct Factorise<'a> {
    factor: &'a mut Multifrontal,
    values: &'a [f64],
    shifts: &'a [f64],
    /// Size of a row.
    unit: f64,
}

impl WithSimd for Factorise<'_> {
    type Output = Option<Inertia>;

    #[inline(always)]
    #[expect(clippy::expect_used, reason = "invariant: a place is in use until its parent has one")]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Inertia> {
        let Multifrontal {
            bundles,
            twins,
            supernodes,
            extents,
            block_start,
            loads,
            load_start,
            relative,
            children,
            child_start,
            contribution_start,
            entries,
            contributions,
            factors,
            ..
        } = self.factor;
        let mut inertia = Inertia::default();
        bundles.factor(simd, self.values, self.shifts, self.unit, &mut inertia)?;
        for s in 0..supernodes.count() {
            let extent = extents[s];
            let (earlier, block) = entries[..block_start[s + 1]].split_at_mut(block_start[s]);
            clear(simd, block);
            for &(p, place) in &loads[load_start[s] as usize..load_start[s + 1] as usize] {
                block[place as usize] = self.values[p as usize];
            }
            let columns = supernodes.first[s] as usize..supernodes.first[s + 1] as usize;
            let diagonal = Diagonal { shifts: &self.shifts[columns], unit: self.unit };
            if extent.single_leaf {
                let inverse = 1.0 / pivot(&mut block[0], diagonal.shifts[0], self.unit, &mut inertia)?;
                block[extent.top..].iter_mut().for_each(|value| *value *= inverse);
                continue;
            }
            let order = extent.order();
            let place = contribution_start[s]..contribution_start[s] + order * order;
            clear(simd, &mut contributions[place.clone()]);
            for &child in &children[child_start[s] as usize..child_start[s + 1] as usize] {
                let child = child as usize;
                let (rows, child_extent) = (&relative[supernodes.row_range(child)], extents[child]);
                if child_extent.single_leaf {
                    let column = &earlier[block_start[child]..block_start[child + 1]];
                    take_in_column(
                        column,
                        child_extent.top,
                        rows,
                        block,
                        extent,
                        &mut contributions[place.clone()],
                    );
                    continue;
                }
                let child_order = child_extent.order();
                let taken = contribution_start[child]..contribution_start[child] + child_order * child_order;
                let [from, to] = contributions
                    .get_disjoint_mut([taken, place.clone()])
                    .expect("invariant: a child's place is in use until its parent has one");
                take_in(from, child_order, rows, block, extent, to);
            }
            for child in &twins.list[twins.start[s] as usize..twins.start[s + 1] as usize] {
                let (from, _) = bundles.contribution(child.bundle as usize).as_chunks();
                let order = bundles.outer_rows(child.bundle as usize).len();
                let rows = &twins.relative[child.relative as usize..][..order];
                take_in_lane(
                    from,
                    child.lane as usize,
                    rows,
                    block,
                    extent,
                    &mut contributions[place.clone()],
                );
            }
            let mut first = 0;
            while first < extent.width {
                for_columns!(
                    extent.width - first,
                    eliminate::<S>(simd, block, extent, first, diagonal, factors, &mut inertia)
                )?;
                first += GROUP;
            }
            let contribution = &mut contributions[place];
            for column in (0..order).step_by(GROUP) {
                let row = extent.top + column;
                let factors = &mut factors[..extent.width];
                fill_factors::<GROUP>(block, extent.stride, row, factors);
                subtract_products::<S, GROUP>(
                    simd,
                    &mut contribution[column * order + column..],
                    order,
                    order - column,
                    &block[row..],
                    extent.stride,
                    factors,
                );
            }
        }
        Some(inertia)
    }
}

/// Adds a child's contribution to the block and the contribution of its parent.
#[inline(always)]
fn take_in(from: &[f64], order: usize, rows: &[u32], block: &mut [f64], extent: Extent, to: &mut [f64]) {
    for (j, &row) in rows.iter().enumerate() {
        let (rows, values) = (&rows[j..], &from[j * order + j..][..rows.len() - j]);
        let (target, first) = extent.column(row, block, to);
        for (i, &row) in rows.iter().enumerate() {
            target[row as usize - first] += values[i];
        }
    }
}

/// Adds the contribution of one lane of a bundle.
#[inline(always)]
fn take_in_lane(
    from: &[[f64; LANES]],
    lane: usize,
    rows: &[u32],
    block: &mut [f64],
    extent: Extent,
    to: &mut [f64],
) {
    let order = rows.len();
    for (j, &row) in rows.iter().enumerate() {
        let values = &from[j * order..];
        let (target, first) = extent.column(row, block, to);
        for (i, &row) in rows.iter().enumerate().skip(j) {
            target[row as usize - first] += values[i][lane];
        }
    }
}

/// Adds what a single column of L leaves to the block and the contribution of its parent.
#[inline(always)]
fn take_in_column(
    column: &[f64],
    top: usize,
    rows: &[u32],
    block: &mut [f64],
    extent: Extent,
    to: &mut [f64],
) {
    let (pivot, values) = (column[0], &column[top..top + rows.len()]);
    for (j, &row) in rows.iter().enumerate() {
        let factor = pivot * values[j];
        let (target, first) = extent.column(row, block, to);
        let (rows, values) = (&rows[j..], &values[j..]);
        for (i, &row) in rows.iter().enumerate() {
            target[row as usize - first] -= factor * values[i];
        }
    }
}

/// `factors[q][c] = d_q L[row + c][q]`.
#[inline(always)]
fn fill_factors<const C: usize>(block: &[f64], stride: usize, row: usize, factors: &mut [[f64; GROUP]]) {
    for (q, factors) in factors.iter_mut().enumerate() {
        let pivot = block[q * stride + q];
        let values = &block[q * stride + row..][..C];
        for c in 0..C {
            factors[c] = pivot * values[c];
        }
    }
}

/// Eliminates the `C` columns from `first`, the last ones of their group. `None` after an overflow.
#[inline(always)]
fn eliminate<S: Simd, const C: usize>(
    simd: S,
    block: &mut [f64],
    extent: Extent,
    first: usize,
    diagonal: Diagonal<'_>,
    factors: &mut [[f64; GROUP]],
    inertia: &mut Inertia,
) -> Option<()> {
    let stride = extent.stride;
    let (done, group) = block.split_at_mut(first * stride);
    let factors = &mut factors[..first];
    fill_factors::<C>(done, stride, first, factors);
    if first > 0 {
        let target = &mut group[first..];
        subtract_products::<S, C>(simd, target, stride, stride - first, &done[first..], stride, factors);
    }
    let mut triangle = Triangle { inverse_pivots: [0.0; C], factors: [[0.0; C]; C] };
    for c in 0..C {
        let value = &mut group[c * stride + first + c];
        let inverse = 1.0 / pivot(value, diagonal.shifts[first + c], diagonal.unit, inertia)?;
        triangle.inverse_pivots[c] = inverse;
        for k in c + 1..C {
            let factor = group[c * stride + first + k];
            triangle.factors[c][k] = factor;
            group[c * stride + first + k] = factor * inverse;
            for column in c + 1..=k {
                group[column * stride + first + k] -= triangle.factors[c][column] * factor * inverse;
            }
        }
    }
    eliminate_below(simd, group, stride, first + GROUP, triangle);
    Some(())
}

/// Solves with L, D and L^T.
struct Substitute<'a, 'b, const R: usize> {
    factor: &'a mut Multifrontal,
    x: &'a mut [&'b mut [f64]; R],
}

impl<const R: usize> WithSimd for Substitute<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Multifrontal { bundles, supernodes, extents, block_start, entries, gathered, .. } = self.factor;
        let right = self.x;
        bundles.forward(simd, right);
        for s in 0..supernodes.count() {
            let extent = extents[s];
            let (start, rows) = (supernodes.first[s] as usize, supernodes.below(s));
            let block = &entries[block_start[s]..block_start[s + 1]];
            if extent.width == 1 {
                let l = &block[extent.top..];
                for x in &mut *right {
                    let value = x[start];
                    for (i, &row) in rows.iter().enumerate() {
                        x[row as usize] -= l[i] * value;
                    }
                }
                continue;
            }
            let (width, stride) = (extent.width, extent.stride);
            let gathered = &mut gathered[..stride * R];
            clear(simd, gathered);
            for (x, gathered) in right.iter().zip(gathered.chunks_exact_mut(stride)) {
                gathered[..width].copy_from_slice(&x[start..start + width]);
            }
            for first in (0..width).step_by(GROUP) {
                for_columns!(width - first, forward::<S, R>(simd, block, stride, first, gathered));
            }
            for (x, gathered) in right.iter_mut().zip(gathered.chunks_exact(stride)) {
                x[start..start + width].copy_from_slice(&gathered[..width]);
                let below = &gathered[extent.top..];
                for (i, &row) in rows.iter().enumerate() {
                    x[row as usize] += below[i];
                }
            }
        }
        for s in (0..supernodes.count()).rev() {
            let extent = extents[s];
            let (start, rows) = (supernodes.first[s] as usize, supernodes.below(s));
            let block = &entries[block_start[s]..block_start[s + 1]];
            if extent.width == 1 {
                let l = &block[extent.top..];
                for x in &mut *right {
                    let mut sum = 0.0;
                    for (i, &row) in rows.iter().enumerate() {
                        sum += l[i] * x[row as usize];
                    }
                    x[start] = x[start] / block[0] - sum;
                }
                continue;
            }
            let (width, stride) = (extent.width, extent.stride);
            let gathered = &mut gathered[..stride * R];
            clear(simd, gathered);
            for (x, gathered) in right.iter().zip(gathered.chunks_exact_mut(stride)) {
                gathered[..width].copy_from_slice(&x[start..start + width]);
                let below = &mut gathered[extent.top..];
                for (i, &row) in rows.iter().enumerate() {
                    below[i] = x[row as usize];
                }
            }
            for first in (0..width).step_by(GROUP).rev() {
                for_columns!(width - first, backward::<S, R>(simd, block, stride, first, gathered));
            }
            for (x, gathered) in right.iter_mut().zip(gathered.chunks_exact(stride)) {
                x[start..start + width].copy_from_slice(&gathered[..width]);
            }
        }
        bundles.backward(simd, right);
    }
}

/// Solves with the triangle of `C` columns from `first` and takes them off the rows below, in `R` right-hand sides of
/// `stride` rows.
#[inline(always)]
fn forward<S: Simd, const C: usize, const R: usize>(
    simd: S,
    block: &[f64],
    stride: usize,
    first: usize,
    x: &mut [f64],
) {
    let group = &block[first * stride..];
    let mut factors = [[0.0; GROUP]; C];
    for (k, x) in x.chunks_exact_mut(stride).enumerate() {
        for c in 0..C {
            let value = x[first + c];
            factors[c][k] = value;
            for later in c + 1..C {
                x[first + later] -= group[c * stride + first + later] * value;
            }
        }
    }
    let next = first + GROUP;
    if next < stride {
        subtract_products::<S, R>(
            simd,
            &mut x[next..],
            stride,
            stride - next,
            &group[next..],
            stride,
            &factors,
        );
    }
}

/// Divides `C` rows from `first` by their pivots and solves with the transpose of their columns, in `R` right-hand
/// sides of `stride` rows.
#[inline(always)]
fn backward<S: Simd, const C: usize, const R: usize>(
    simd: S,
    block: &[f64],
    stride: usize,
    first: usize,
    x: &mut [f64],
) {
    let group = &block[first * stride..];
    let sums: [[f64; C]; R] = products(simd, group, stride, first + GROUP, x);
    for (x, sums) in x.chunks_exact_mut(stride).zip(sums) {
        for c in (0..C).rev() {
            let column = &group[c * stride + first..];
            let mut later = 0.0;
            for k in c + 1..C {
                later += column[k] * x[first + k];
            }
            x[first + c] = x[first + c] / column[c] - sums[c] - later;
        }
    }
}
