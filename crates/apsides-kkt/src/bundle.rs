//! Subtrees that are alike, factored together: one in each lane of a vector.
//!
//! The rows of a bundle come first in the elimination order, those of its lanes next to each other: row `r` of lane `l`
//! of a bundle that begins at `base` has place `base + LANES * r + l`.

mod places;

use std::ops::Range;

use places::Places;
use pulp::Simd;

use crate::Inertia;
use crate::columns::MOST_COLUMNS;
use crate::dense::{GROUP, clear};
use crate::lanes;
use crate::pivot::Diagonal;
use crate::room::Room;
use crate::supernodes::Supernodes;
use crate::twins::{LANES, Twins, are_alike};

/// All bundles: structure, factor and work space.
pub(crate) struct Bundles {
    shapes: Vec<Shape>,
    list: Vec<Bundle>,
    /// Value of the blocks of a bundle that each inner and each outer entry stands for.
    inner_value: Vec<u32>,
    outer_value: Vec<u32>,
    /// Blocks of L, with the inverse of D in place of its unit diagonal.
    entries: Vec<f64>,
    /// The contribution of each bundle to the rows outside: a lower triangle in a square.
    outer: Vec<f64>,
    /// Contributions within the bundle in work; rows of `D L^T`; right-hand sides.
    work: Vec<f64>,
    factors: Vec<f64>,
    x: Vec<f64>,
}

/// Structure that bundles share.
struct Shape {
    fronts: Vec<Front>,
    /// Rows of a lane.
    rows: usize,
    /// Rows outside that those of a lane are coupled with.
    outer: usize,
    /// Values of the blocks, per lane.
    entries: usize,
    /// Values of the contributions that stay within a bundle, per lane.
    work: usize,
}

/// A supernode of a shape.
struct Front {
    /// First row.
    first: usize,
    width: usize,
    /// Rows below: rows of the lane, then `rows + k` for row `k` outside.
    below: Vec<u32>,
    /// First value of the block, per lane.
    block: usize,
    /// The front that the contribution goes to, and the row there of each row below.
    parent: Option<(usize, Vec<u32>)>,
    /// First value of the contribution in the work space; unused at the root.
    contribution: usize,
    is_leaf: bool,
    /// The first of its parent's children.
    is_first: bool,
}

impl Front {
    fn size(&self) -> (usize, usize) {
        (self.width, self.width + self.below.len())
    }
}

/// One bundle.
struct Bundle {
    shape: usize,
    /// Place of its first row.
    base: usize,
    /// Places of the rows outside, by lane.
    outer_rows: Vec<[u32; LANES]>,
    /// First value in `entries` and in `outer`.
    entries: usize,
    outer: usize,
    /// Its inner and outer entries.
    inner_entries: Range<usize>,
    outer_entries: Range<usize>,
}

impl Bundle {
    /// Places of its rows.
    fn places(&self, shape: &Shape) -> Range<usize> {
        self.base..self.base + shape.rows * LANES
    }
}

impl Bundles {
    /// The bundles of these twins of the supernodes of a postorder, placed one after the other from place 0. `place` is
    /// the final place of each row; rows of twins have theirs.
    pub(crate) fn new(supernodes: &Supernodes, twins: &[Twins], place: &[u32]) -> Self {
        let mut shapes: Vec<Shape> = Vec::new();
        // Size and first root of each.
        let mut examples: Vec<(usize, usize)> = Vec::new();
        let mut list = Vec::with_capacity(twins.len());
        let (mut base, mut entries, mut outer) = (0, 0, 0);
        for &Twins { size, roots } in twins {
            let alike = |&(other, root): &(usize, usize)| {
                other == size && are_alike(supernodes, root, roots[0], size)
            };
            let index = examples.iter().position(alike).unwrap_or(shapes.len());
            if index == shapes.len() {
                shapes.push(Shape::new(supernodes, roots[0], size));
                examples.push((size, roots[0]));
            }
            let shape = &shapes[index];
            let outer_rows = (0..shape.outer)
                .map(|k| roots.map(|root| place[supernodes.below(root)[k] as usize]))
                .collect();
            list.push(Bundle {
                shape: index,
                base,
                outer_rows,
                entries,
                outer,
                inner_entries: 0..0,
                outer_entries: 0..0,
            });
            base += shape.rows * LANES;
            entries += shape.entries * LANES;
            outer += shape.outer * shape.outer * LANES;
        }
        let largest = |value: fn(&Shape) -> usize| shapes.iter().map(value).max().unwrap_or(0) * LANES;
        let widest =
            shapes.iter().flat_map(|shape| &shape.fronts).map(|front| front.width).max().unwrap_or(0);
        Self {
            work: vec![0.0; largest(|shape| shape.work)],
            x: vec![0.0; largest(|shape| shape.rows + shape.outer) * MOST_COLUMNS],
            factors: vec![0.0; widest * GROUP * LANES],
            entries: vec![0.0; entries],
            outer: vec![0.0; outer],
            inner_value: Vec::new(),
            outer_value: Vec::new(),
            shapes,
            list,
        }
    }

    /// The places of entries in blocks, to be found out.
    pub(crate) fn places(&mut self) -> Places<'_> {
        Places::new(self)
    }

    /// Rows of all bundles.
    pub(crate) fn rows(&self) -> usize {
        self.list.last().map_or(0, |bundle| bundle.places(&self.shapes[bundle.shape]).end)
    }

    pub(crate) fn count(&self) -> usize {
        self.list.len()
    }

    /// Values stored for L and D.
    pub(crate) fn nonzeros(&self) -> usize {
        self.entries.len()
    }

    /// Places of the rows outside that a bundle is coupled with, by lane.
    pub(crate) fn outer_rows(&self, bundle: usize) -> &[[u32; LANES]] {
        &self.list[bundle].outer_rows
    }

    /// The contribution of a bundle to the rows outside: `(row, column)` of a lower triangle at `LANES * (order * column + row)`.
    pub(crate) fn contribution(&self, bundle: usize) -> &[f64] {
        let Bundle { shape, outer, .. } = self.list[bundle];
        &self.outer[outer..outer + self.shapes[shape].outer.pow(2) * LANES]
    }

    /// Factors with these values of the pattern and shifts of pivots. `None` after an overflow.
    #[inline(always)]
    #[expect(clippy::expect_used, reason = "invariant: a place is in use until its parent has taken it in")]
    pub(crate) fn factor<S: Simd>(
        &mut self,
        simd: S,
        values: &[f64],
        shifts: &[f64],
        unit: f64,
        inertia: &mut Inertia,
    ) -> Option<()> {
        let Self { shapes, list, inner_value, outer_value, entries, outer, work, factors, .. } = self;
        let (values, _) = values.as_chunks::<LANES>();
        let (inner_values, outer_values) = values.split_at(inner_value.len());
        let place = |front: &Front| {
            let start = front.contribution * LANES;
            start..start + front.below.len().pow(2) * LANES
        };
        for bundle in list {
            let shape = &shapes[bundle.shape];
            let entries = &mut entries[bundle.entries..bundle.entries + shape.entries * LANES];
            let outer = &mut outer[bundle.outer..bundle.outer + shape.outer.pow(2) * LANES];
            let shifts = &shifts[bundle.places(shape)];
            clear(simd, entries);
            clear(simd, outer);
            let (blocks, _) = entries.as_chunks_mut::<LANES>();
            for entry in bundle.inner_entries.clone() {
                blocks[inner_value[entry] as usize] = inner_values[entry];
            }
            for entry in bundle.outer_entries.clone() {
                blocks[outer_value[entry] as usize] = outer_values[entry];
            }
            for front in &shape.fronts {
                let (width, stride) = front.size();
                let order = stride - width;
                let start = front.block * LANES;
                let (block, later) = entries[start..].split_at_mut(width * stride * LANES);
                let diagonal = Diagonal { shifts: &shifts[front.first * LANES..], unit };
                lanes::eliminate(simd, block, (width, stride), diagonal, factors, inertia)?;
                let Some((parent, relative)) = &front.parent else {
                    lanes::subtract_square(simd, outer, block, (width, stride), factors);
                    lanes::invert_pivots(simd, block, (width, stride));
                    continue;
                };
                let parent = &shape.fronts[*parent];
                let own = place(front);
                let (contribution, square) = match parent.parent {
                    Some(_) => {
                        let [own, square] = work
                            .get_disjoint_mut([own, place(parent)])
                            .expect("invariant: a place is in use until its parent has taken it in");
                        if front.is_first {
                            clear(simd, square);
                        }
                        (own, square)
                    }
                    None => (&mut work[own], &mut *outer),
                };
                if front.is_leaf {
                    clear(simd, contribution);
                }
                lanes::subtract_square(simd, contribution, block, (width, stride), factors);
                lanes::invert_pivots(simd, block, (width, stride));
                let target = &mut later[parent.block * LANES - start - block.len()..];
                take_in::<S>(simd, contribution, order, relative, target, parent.size(), square);
            }
        }
        Some(())
    }

    /// Solves with L within the bundles and takes their rows off those outside.
    #[inline(always)]
    pub(crate) fn forward<S: Simd, const R: usize>(&mut self, simd: S, right: &mut [&mut [f64]; R]) {
        let Self { shapes, list, entries, x, .. } = self;
        for bundle in list {
            let shape = &shapes[bundle.shape];
            let places = bundle.places(shape);
            let x = shape.take_rows(x, right, places.clone());
            clear(simd, &mut x[places.len() * R..]);
            for front in &shape.fronts {
                let block = &entries[bundle.entries + front.block * LANES..];
                lanes::forward::<S, R>(simd, block, front.size(), front.first, &front.below, x);
            }
            let (inside, outside) = x.split_at(places.len() * R);
            give_back(inside, right, places);
            let (outside, _) = outside.as_chunks::<LANES>();
            for (rows, values) in bundle.outer_rows.iter().zip(outside.chunks_exact(R)) {
                for (right, values) in right.iter_mut().zip(values) {
                    for (&row, value) in rows.iter().zip(values) {
                        right[row as usize] += value;
                    }
                }
            }
        }
    }

    /// Solves with D and the transpose of L within the bundles.
    #[inline(always)]
    pub(crate) fn backward<S: Simd, const R: usize>(&mut self, simd: S, right: &mut [&mut [f64]; R]) {
        let Self { shapes, list, entries, x, .. } = self;
        for bundle in list {
            let shape = &shapes[bundle.shape];
            let places = bundle.places(shape);
            let x = shape.take_rows(x, right, places.clone());
            let (outside, _) = x[places.len() * R..].as_chunks_mut::<LANES>();
            for (rows, values) in bundle.outer_rows.iter().zip(outside.chunks_exact_mut(R)) {
                for (right, values) in right.iter().zip(values) {
                    for lane in 0..LANES {
                        values[lane] = right[rows[lane] as usize];
                    }
                }
            }
            for front in shape.fronts.iter().rev() {
                let block = &entries[bundle.entries + front.block * LANES..];
                lanes::backward::<S, R>(simd, block, front.size(), front.first, &front.below, x);
            }
            give_back(&x[..places.len() * R], right, places);
        }
    }
}

/// Copies the rows of a bundle back into the right-hand sides.
#[inline(always)]
fn give_back<const R: usize>(x: &[f64], right: &mut [&mut [f64]; R], places: Range<usize>) {
    let (rows, _) = x.as_chunks::<LANES>();
    for (k, right) in right.iter_mut().enumerate() {
        let (targets, _) = right[places.clone()].as_chunks_mut::<LANES>();
        for (row, target) in targets.iter_mut().enumerate() {
            *target = rows[row * R + k];
        }
    }
}

/// Adds a contribution to the block and the contribution of its parent.
#[inline(always)]
fn take_in<S: Simd>(
    simd: S,
    from: &[f64],
    order: usize,
    rows: &[u32],
    block: &mut [f64],
    (width, stride): (usize, usize),
    square: &mut [f64],
) {
    let parts = lanes::parts::<S>();
    let (from, _) = S::as_simd_f64s(from);
    for (j, &column) in rows.iter().enumerate() {
        let column = column as usize;
        let (target, first) = if column < width {
            (&mut block[column * stride * LANES..][..stride * LANES], 0)
        } else {
            let order = stride - width;
            (&mut square[(column - width) * order * LANES..][..order * LANES], width)
        };
        let (target, _) = S::as_mut_simd_f64s(target);
        for (i, &row) in rows.iter().enumerate().skip(j) {
            let to = (row as usize - first) * parts;
            let at = (j * order + i) * parts;
            let (target, from) = (&mut target[to..to + parts], &from[at..at + parts]);
            for part in 0..parts {
                target[part] = simd.add_f64s(target[part], from[part]);
            }
        }
    }
}

impl Shape {
    /// The room of a solve with the rows of a bundle taken in, and those outside behind them as they were left.
    #[inline(always)]
    fn take_rows<'a, const R: usize>(
        &self,
        x: &'a mut [f64],
        right: &[&mut [f64]; R],
        places: Range<usize>,
    ) -> &'a mut [f64] {
        let x = &mut x[..(places.len() + self.outer * LANES) * R];
        let (targets, _) = x.as_chunks_mut::<LANES>();
        for (k, right) in right.iter().enumerate() {
            let (rows, _) = right[places.clone()].as_chunks::<LANES>();
            for (row, values) in rows.iter().enumerate() {
                targets[row * R + k] = *values;
            }
        }
        x
    }

    /// The structure of the subtree of a root.
    fn new(supernodes: &Supernodes, root: usize, size: usize) -> Self {
        let first = root + 1 - size;
        let start = supernodes.first[first];
        let rows = (supernodes.first[root + 1] - start) as usize;
        let outer = supernodes.below(root);
        let mut fronts: Vec<Front> = Vec::with_capacity(size);
        let mut entries = 0;
        for s in first..=root {
            let mut at = 0;
            let code = |&row: &u32| {
                if row < start + rows as u32 {
                    return row - start;
                }
                while outer[at] != row {
                    at += 1;
                }
                (rows + at) as u32
            };
            let below: Vec<u32> = supernodes.below(s).iter().map(code).collect();
            let width = supernodes.width(s);
            let block = entries;
            entries += width * (width + below.len());
            fronts.push(Front {
                first: (supernodes.first[s] - start) as usize,
                width,
                below,
                block,
                parent: None,
                contribution: 0,
                is_leaf: true,
                is_first: false,
            });
        }
        for s in (first..root).rev() {
            let Some(parent) = supernodes.parent(s).map(|parent| parent - first) else { continue };
            let relative = fronts[s - first].below.iter().map(|code| fronts[parent].row(*code)).collect();
            fronts[s - first].parent = Some((parent, relative));
            fronts[parent].is_leaf = false;
        }
        // A contribution is in use from the first child to the parent.
        let mut room = Room::default();
        let mut is_begun = vec![false; size];
        for s in 0..size {
            let Some(parent) = fronts[s].parent.as_ref().map(|(parent, _)| *parent) else { continue };
            let order = |s: usize| fronts[s].below.len().pow(2);
            let (own, parents) = (order(s), order(parent));
            if fronts[s].is_leaf {
                fronts[s].contribution = room.take(own);
            }
            if !std::mem::replace(&mut is_begun[parent], true) {
                fronts[s].is_first = true;
                if fronts[parent].parent.is_some() {
                    fronts[parent].contribution = room.take(parents);
                }
            }
            room.give_back(fronts[s].contribution, own);
        }
        Self { fronts, rows, outer: outer.len(), entries, work: room.length() }
    }
}

impl Front {
    /// Row in the block of a row of the lane or outside, by its code.
    fn row(&self, code: u32) -> u32 {
        let row = code as usize;
        if row >= self.first && row < self.first + self.width {
            return (row - self.first) as u32;
        }
        (self.width + self.below.partition_point(|&below| below < code)) as u32
    }
}
