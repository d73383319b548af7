//! Subtrees that are alike, factored together: one in each lane of a vector.
//!
//! The rows of a bundle come first in the elimination order, those of its lanes next to each other: row `r` of lane `l`
//! of a bundle that begins at `base` has place `base + LANES * r + l`.

use std::ops::Range;

use pulp::Simd;

use crate::Inertia;
use crate::dense::{GROUP, clear};
use crate::lane_entries::{Columns, LaneEntries, Outside};
use crate::lanes;
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
    /// Contributions within the bundle in work; rows of `D L^T`; a right-hand side.
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
            x: vec![0.0; largest(|shape| shape.rows + shape.outer)],
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

    /// Factors with these values of the pattern and shifts of the diagonal. `None` after an overflow.
    #[inline(always)]
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
        for bundle in list {
            let shape = &shapes[bundle.shape];
            let entries = &mut entries[bundle.entries..bundle.entries + shape.entries * LANES];
            let outer = &mut outer[bundle.outer..bundle.outer + shape.outer.pow(2) * LANES];
            let shifts = &shifts[bundle.places(shape)];
            clear(simd, entries);
            clear(simd, outer);
            clear(simd, &mut work[..shape.work * LANES]);
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
                for c in 0..width {
                    let at = (c * stride + c) * LANES;
                    let shifts = &shifts[(front.first + c) * LANES..][..LANES];
                    let pivots = &mut block[at..at + LANES];
                    for lane in 0..LANES {
                        pivots[lane] += shifts[lane];
                    }
                }
                lanes::eliminate(simd, block, (width, stride), unit, factors, inertia)?;
                let Some((parent, relative)) = &front.parent else {
                    lanes::subtract_square(simd, outer, block, (width, stride), factors);
                    lanes::invert_pivots(simd, block, (width, stride));
                    continue;
                };
                let (own, to) = work.split_at_mut(front.contribution * LANES);
                // Contributions of parents come first.
                let contribution = &mut to[..order * order * LANES];
                if front.is_leaf {
                    clear(simd, contribution);
                }
                lanes::subtract_square(simd, contribution, block, (width, stride), factors);
                lanes::invert_pivots(simd, block, (width, stride));
                let parent = &shape.fronts[*parent];
                let target = &mut later[parent.block * LANES - start - block.len()..];
                let square = match parent.parent {
                    Some(_) => &mut own[parent.contribution * LANES..],
                    None => &mut *outer,
                };
                take_in::<S>(simd, contribution, order, relative, target, parent.size(), square);
            }
        }
        Some(())
    }

    /// Solves with L within the bundles and takes their rows off those outside.
    #[inline(always)]
    pub(crate) fn forward<S: Simd>(&mut self, simd: S, right: &mut [f64]) {
        let Self { shapes, list, entries, x, .. } = self;
        for bundle in list {
            let shape = &shapes[bundle.shape];
            let places = bundle.places(shape);
            let x = shape.take_rows(x, &right[places.clone()]);
            clear(simd, &mut x[places.len()..]);
            for front in &shape.fronts {
                let block = &entries[bundle.entries + front.block * LANES..];
                lanes::forward(simd, block, front.size(), front.first, &front.below, x);
            }
            let (inner, outside) = x.split_at(places.len());
            right[places].copy_from_slice(inner);
            for (rows, values) in bundle.outer_rows.iter().zip(outside.chunks_exact(LANES)) {
                for (&row, value) in rows.iter().zip(values) {
                    right[row as usize] += value;
                }
            }
        }
    }

    /// Solves with D and the transpose of L within the bundles.
    #[inline(always)]
    pub(crate) fn backward<S: Simd>(&mut self, simd: S, right: &mut [f64]) {
        let Self { shapes, list, entries, x, .. } = self;
        for bundle in list {
            let shape = &shapes[bundle.shape];
            let places = bundle.places(shape);
            let x = shape.take_rows(x, &right[places.clone()]);
            let outside = x[places.len()..].chunks_exact_mut(LANES);
            for (rows, values) in bundle.outer_rows.iter().zip(outside) {
                for (&row, value) in rows.iter().zip(values) {
                    *value = right[row as usize];
                }
            }
            for front in shape.fronts.iter().rev() {
                let block = &entries[bundle.entries + front.block * LANES..];
                lanes::backward(simd, block, front.size(), front.first, &front.below, x);
            }
            right[places.clone()].copy_from_slice(&x[..places.len()]);
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
    fn take_rows<'a>(&self, x: &'a mut [f64], rows: &[f64]) -> &'a mut [f64] {
        let x = &mut x[..rows.len() + self.outer * LANES];
        x[..rows.len()].copy_from_slice(rows);
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
            });
        }
        for s in (first..root).rev() {
            let Some(parent) = supernodes.parent(s).map(|parent| parent - first) else { continue };
            let relative = fronts[s - first].below.iter().map(|code| fronts[parent].row(*code)).collect();
            fronts[s - first].parent = Some((parent, relative));
            fronts[parent].is_leaf = false;
        }
        // Parents before their children; leaves share what is left.
        let mut work = 0;
        for front in fronts.iter_mut().rev().filter(|front| !front.is_leaf && front.parent.is_some()) {
            front.contribution = work;
            work += front.below.len().pow(2);
        }
        let mut largest = 0;
        for front in fronts.iter_mut().filter(|front| front.is_leaf && front.parent.is_some()) {
            front.contribution = work;
            largest = largest.max(front.below.len().pow(2));
        }
        Self { fronts, rows, outer: outer.len(), entries, work: work + largest }
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

/// Finds where entries stand in the blocks.
pub(crate) struct Places<'a> {
    bundles: &'a mut Bundles,
    /// Bundle of each vector of rows.
    bundle_of: Vec<u32>,
    shapes: Vec<ShapePlaces>,
    /// First value of the blocks of each bundle, per lane.
    first: Vec<usize>,
    /// The values that have been met, and then the positions of their entries.
    position: Vec<u32>,
}

/// Where the entries of a shape stand in its blocks.
struct ShapePlaces {
    /// Front of each column.
    front: Vec<usize>,
    /// For each front, the row in the block by the code of a row.
    rows: Vec<Vec<u32>>,
}

impl<'a> Places<'a> {
    fn new(bundles: &'a mut Bundles) -> Self {
        let mut bundle_of = Vec::with_capacity(bundles.rows() / LANES);
        let (mut first, mut values) = (Vec::with_capacity(bundles.list.len()), 0);
        for (b, bundle) in bundles.list.iter().enumerate() {
            let shape = &bundles.shapes[bundle.shape];
            bundle_of.extend(std::iter::repeat_n(b as u32, shape.rows));
            first.push(values);
            values += shape.entries;
        }
        let shapes = bundles.shapes.iter().map(ShapePlaces::new).collect();
        Self { bundle_of, shapes, first, position: vec![0; values], bundles }
    }

    /// Marks the value of a row and a later one, the first of which is in a bundle, and answers its number.
    pub(crate) fn touch(&mut self, first: usize, second: usize) -> u32 {
        let b = self.bundle_of[first / LANES] as usize;
        let bundle = &self.bundles.list[b];
        let shape = &self.bundles.shapes[bundle.shape];
        let column = (first - bundle.base) / LANES;
        let code = if second < self.bundle_of.len() * LANES {
            (second - bundle.base) / LANES
        } else {
            let lane = first % LANES;
            shape.rows + bundle.outer_rows.partition_point(|rows| (rows[lane] as usize) < second)
        };
        let places = &self.shapes[bundle.shape];
        let front = &shape.fronts[places.front[column]];
        let row = places.rows[places.front[column]][code] as usize;
        let value = self.first[b] + front.block + (column - front.first) * front.size().1 + row;
        self.position[value] = 1;
        value as u32
    }

    /// Numbers the values that have been met: inner ones by column, then outer ones.
    pub(crate) fn finish(self) -> LaneEntries {
        let Self { bundles, first, mut position, .. } = self;
        let (mut inner, mut outer) = (Columns::default(), Columns::default());
        inner.start.push(0);
        outer.start.push(0);
        let (mut outside, mut outer_rows) = (Vec::new(), Vec::new());
        let mut outer_positions = Vec::new();
        for (bundle, &first) in bundles.list.iter_mut().zip(&first) {
            let shape = &bundles.shapes[bundle.shape];
            let (inner_first, outer_first) = (inner.row.len(), outer.row.len());
            for front in &shape.fronts {
                for c in 0..front.width {
                    let at = front.block + c * front.size().1;
                    let own = (front.first..front.first + front.width).map(|row| row as u32);
                    for (k, code) in own.chain(front.below.iter().copied()).enumerate() {
                        let position = &mut position[first + at + k];
                        if *position == 0 {
                            continue;
                        }
                        let code = code as usize;
                        if code < shape.rows {
                            *position = (inner.row.len() * LANES) as u32;
                            inner.row.push((bundle.base + code * LANES) as u32);
                            bundles.inner_value.push((at + k) as u32);
                        } else {
                            outer_positions.push(first + at + k);
                            outer.row.push((code - shape.rows) as u32);
                            bundles.outer_value.push((at + k) as u32);
                        }
                    }
                    inner.start.push(inner.row.len() as u32);
                    outer.start.push(outer.row.len() as u32);
                }
            }
            let columns = bundle.base / LANES..bundle.base / LANES + shape.rows;
            outside.push(Outside { columns, rows: outer_rows.len()..outer_rows.len() + shape.outer });
            outer_rows.extend_from_slice(&bundle.outer_rows);
            bundle.inner_entries = inner_first..inner.row.len();
            bundle.outer_entries = outer_first..outer.row.len();
        }
        for (k, value) in outer_positions.into_iter().enumerate() {
            position[value] = ((inner.row.len() + k) * LANES) as u32;
        }
        LaneEntries { inner, outer, bundles: outside, outer_rows, position }
    }
}

impl ShapePlaces {
    fn new(shape: &Shape) -> Self {
        let mut places = Self { front: Vec::with_capacity(shape.rows), rows: Vec::new() };
        for (f, front) in shape.fronts.iter().enumerate() {
            places.front.extend(std::iter::repeat_n(f, front.width));
            let mut rows = vec![0; shape.rows + shape.outer];
            for c in 0..front.width {
                rows[front.first + c] = c as u32;
            }
            for (k, &code) in front.below.iter().enumerate() {
                rows[code as usize] = (front.width + k) as u32;
            }
            places.rows.push(rows);
        }
        places
    }
}
