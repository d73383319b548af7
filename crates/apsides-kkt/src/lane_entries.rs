//! Entries of the matrix that bundles have, each as a vector of all lanes.

use std::ops::Range;

use crate::twins::LANES;

/// All entries of bundles.
pub(crate) struct LaneEntries {
    pub(crate) inner: Columns,
    pub(crate) outer: Columns,
    pub(crate) bundles: Vec<Outside>,
    pub(crate) outer_rows: Vec<[u32; LANES]>,
    /// Position of the first lane of each value that has been met.
    pub(crate) position: Vec<u32>,
}

/// Entries of bundles by column.
#[derive(Default)]
pub(crate) struct Columns {
    /// First entry of each column, and their number.
    pub(crate) start: Vec<u32>,
    /// For inner entries the place of the row in the first lane, else its index among the rows outside of the bundle.
    pub(crate) row: Vec<u32>,
}

/// The columns of a bundle, and its rows outside.
pub(crate) struct Outside {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
}

impl Columns {
    /// Entries of a column.
    pub(crate) fn column(&self, column: usize) -> Range<usize> {
        self.start[column] as usize..self.start[column + 1] as usize
    }

    /// Column and index of every entry.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.start.len().saturating_sub(1))
            .flat_map(|column| self.column(column).map(move |e| (column, e)))
    }
}
