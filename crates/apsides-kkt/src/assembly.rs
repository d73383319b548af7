//! The assembly of fronts: sizes of blocks, and where entries and contributions go.

use crate::bundle::Bundles;
use crate::dense::padded;
use crate::room::Room;
use crate::structure::Structure;
use crate::supernodes::Supernodes;

/// Sizes of a block.
#[derive(Clone, Copy)]
pub(crate) struct Extent {
    /// Columns.
    pub(crate) width: usize,
    /// Row of the first row below.
    pub(crate) top: usize,
    /// Rows, and values from one column to the next.
    pub(crate) stride: usize,
    /// A single column without children: its rows are not filled up, and its parent takes it in without a stored
    /// contribution.
    pub(crate) single_leaf: bool,
}

impl Extent {
    pub(crate) fn of(supernodes: &Supernodes, s: usize, is_leaf: bool) -> Self {
        let (width, below) = (supernodes.width(s), supernodes.below(s).len());
        if width == 1 && is_leaf {
            return Self { width, top: 1, stride: 1 + below, single_leaf: true };
        }
        let top = padded(width);
        Self { width, top, stride: top + padded(below), single_leaf: false }
    }

    /// Rows, columns and stride of the contribution.
    pub(crate) fn order(self) -> usize {
        self.stride - self.top
    }

    /// The column of a row, in the block or in the contribution, and the row with which it begins.
    pub(crate) fn column<'a>(
        self,
        row: u32,
        block: &'a mut [f64],
        contribution: &'a mut [f64],
    ) -> (&'a mut [f64], usize) {
        let column = row as usize;
        if column < self.width {
            (&mut block[column * self.stride..][..self.stride], 0)
        } else {
            (&mut contribution[(column - self.top) * self.order()..][..self.order()], self.top)
        }
    }

    /// The same of the contribution that is stored.
    pub(crate) fn stored_order(self) -> usize {
        if self.single_leaf { 0 } else { self.order() }
    }
}

/// The subtrees of bundles that leave their contributions to each supernode.
pub(crate) struct TwinChildren {
    /// Those of supernode `s` are `list[start[s]..start[s + 1]]`.
    pub(crate) start: Vec<u32>,
    pub(crate) list: Vec<TwinChild>,
    /// Row in the parent's block of each row outside.
    pub(crate) relative: Vec<u32>,
}

/// A lane of a bundle, and the start of its rows.
#[derive(Clone, Copy)]
pub(crate) struct TwinChild {
    pub(crate) bundle: u32,
    pub(crate) lane: u32,
    pub(crate) relative: u32,
}

/// Entries of the pattern by supernode, with their place in the block.
pub(crate) fn place_entries(
    structure: &Structure,
    supernodes: &Supernodes,
    extents: &[Extent],
) -> (Vec<u32>, Vec<(u32, u32)>) {
    let count = supernodes.count();
    let (begin, pattern) = (supernodes.first[0], &structure.rest);
    let mut start = vec![0u32; count + 1];
    for &column in &pattern.row_idx {
        start[supernodes.of_column[(begin + column) as usize] as usize + 1] += 1;
    }
    for s in 0..count {
        start[s + 1] += start[s];
    }
    let mut next = start.clone();
    let mut loads = vec![(0, 0); pattern.nonzeros()];
    // Rows ascend, so the row below of a supernode that is wanted next is never before the last one.
    let mut at = vec![0; count];
    for index in 0..pattern.n {
        let row = begin as usize + index;
        for p in pattern.column(index) {
            let column = begin + pattern.row_idx[p];
            let s = supernodes.of_column[column as usize] as usize;
            let extent = extents[s];
            let (first, end) = (supernodes.first[s], supernodes.first[s + 1]);
            let place = if row < end as usize {
                row - first as usize
            } else {
                let below = supernodes.below(s);
                while (below[at[s]] as usize) < row {
                    at[s] += 1;
                }
                extent.top + at[s]
            };
            let load = &mut next[s];
            loads[*load as usize] =
                ((structure.rest_at + p) as u32, ((column - first) as usize * extent.stride + place) as u32);
            *load += 1;
        }
    }
    (start, loads)
}

/// Row in the parent's block of each row below.
pub(crate) fn relative_rows(supernodes: &Supernodes, extents: &[Extent]) -> Vec<u32> {
    let mut relative = Vec::with_capacity(supernodes.rows.len());
    for s in 0..supernodes.count() {
        if let Some(parent) = supernodes.parent(s) {
            add_relative_rows(
                supernodes,
                extents,
                parent,
                supernodes.below(s).iter().copied(),
                &mut relative,
            );
        }
    }
    relative
}

impl TwinChildren {
    /// The supernode that each lane of a bundle leaves a contribution to: `(supernode, bundle, lane)`, ascending.
    pub(crate) fn parents(supernodes: &Supernodes, bundles: &Bundles) -> Vec<(usize, usize, usize)> {
        let mut parents = Vec::new();
        for bundle in 0..bundles.count() {
            for (lane, &row) in bundles.outer_rows(bundle).first().into_iter().flatten().enumerate() {
                parents.push((supernodes.of_column[row as usize] as usize, bundle, lane));
            }
        }
        parents.sort_unstable();
        parents
    }

    pub(crate) fn new(
        supernodes: &Supernodes,
        extents: &[Extent],
        bundles: &Bundles,
        parents: &[(usize, usize, usize)],
    ) -> Self {
        let mut twins =
            Self { start: vec![0; supernodes.count() + 1], list: Vec::new(), relative: Vec::new() };
        for &(parent, bundle, lane) in parents {
            twins.start[parent + 1] += 1;
            let relative = twins.relative.len() as u32;
            twins.list.push(TwinChild { bundle: bundle as u32, lane: lane as u32, relative });
            let rows = bundles.outer_rows(bundle).iter().map(|rows| rows[lane]);
            add_relative_rows(supernodes, extents, parent, rows, &mut twins.relative);
        }
        for s in 0..supernodes.count() {
            twins.start[s + 1] += twins.start[s];
        }
        twins
    }
}

/// Adds the row in the parent's block of each of these rows, which ascend.
fn add_relative_rows(
    supernodes: &Supernodes,
    extents: &[Extent],
    parent: usize,
    rows: impl Iterator<Item = u32>,
    relative: &mut Vec<u32>,
) {
    let (first, end) = (supernodes.first[parent], supernodes.first[parent + 1]);
    let (below, top) = (supernodes.below(parent), extents[parent].top);
    let mut at = 0;
    relative.extend(rows.map(|row| {
        if row < end {
            return row - first;
        }
        while below[at] < row {
            at += 1;
        }
        (top + at) as u32
    }));
}

/// Start of each contribution in one array, and its length.
pub(crate) fn place_contributions(
    extents: &[Extent],
    children: &[u32],
    child_start: &[u32],
) -> (Vec<usize>, usize) {
    let size = |s: usize| extents[s].stored_order().pow(2);
    let mut room = Room::default();
    let mut start = vec![0; extents.len()];
    for s in 0..extents.len() {
        start[s] = room.take(size(s));
        for &child in &children[child_start[s] as usize..child_start[s + 1] as usize] {
            room.give_back(start[child as usize], size(child as usize));
        }
    }
    (start, room.length())
}
