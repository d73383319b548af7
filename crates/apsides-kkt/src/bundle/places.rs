//! Where the entries of bundles stand in their blocks.

use super::{Bundles, Shape};
use crate::lane_entries::{Columns, LaneEntries, Outside};
use crate::twins::LANES;

/// Rows of the lane that a front looks up in a table; those farther from its first are few.
const WIDEST_WINDOW: usize = 256;

/// Finds where entries stand in the blocks.
pub(crate) struct Places<'a> {
    bundles: &'a mut Bundles,
    columns: Vec<ColumnPlaces>,
    /// Rows in the blocks of all fronts of all shapes, by the code of a row: windows.
    rows: Vec<u32>,
    /// The values that have been met, and then the positions of their entries.
    position: Vec<u32>,
}

/// Where the entries of a column of a bundle stand.
struct ColumnPlaces {
    /// Place of the first row of the bundle.
    base: u32,
    bundle: u32,
    /// First value of the column, per lane.
    value: u32,
    /// First row of its front, and the front.
    first: u32,
    front: u32,
    /// Start and width of its window in the rows by code.
    rows: u32,
    window: u32,
}

impl<'a> Places<'a> {
    pub(super) fn new(bundles: &'a mut Bundles) -> Self {
        let mut rows = Vec::new();
        let windows: Vec<Vec<(u32, u32)>> =
            bundles.shapes.iter().map(|shape| shape.add_rows_by_code(&mut rows)).collect();
        let mut columns = Vec::with_capacity(bundles.rows() / LANES);
        let mut values = 0;
        for (b, bundle) in bundles.list.iter().enumerate() {
            let shape = &bundles.shapes[bundle.shape];
            for (f, (front, &(rows, window))) in shape.fronts.iter().zip(&windows[bundle.shape]).enumerate() {
                let (width, stride) = front.size();
                columns.extend((0..width).map(|c| ColumnPlaces {
                    base: bundle.base as u32,
                    bundle: b as u32,
                    value: (values + front.block + c * stride) as u32,
                    first: front.first as u32,
                    front: f as u32,
                    rows,
                    window,
                }));
            }
            values += shape.entries;
        }
        Self { columns, rows, position: vec![0; values], bundles }
    }

    /// Marks the value of a row and a later one, the first of which is in a bundle, and answers its number.
    pub(crate) fn touch(&mut self, first: usize, second: usize) -> u32 {
        let column = &self.columns[first / LANES];
        let row = if second < self.columns.len() * LANES {
            let code = (second - column.base as usize) / LANES;
            let in_window = code - column.first as usize;
            if in_window < column.window as usize {
                self.rows[column.rows as usize + in_window]
            } else {
                let shape = self.bundles.list[column.bundle as usize].shape;
                self.bundles.shapes[shape].fronts[column.front as usize].row(code as u32)
            }
        } else {
            let lane = first % LANES;
            let outer_rows = &self.bundles.list[column.bundle as usize].outer_rows;
            let outside = outer_rows.partition_point(|rows| (rows[lane] as usize) < second);
            self.rows[(column.rows + column.window) as usize + outside]
        };
        let value = column.value + row;
        self.position[value as usize] = 1;
        value
    }

    /// Numbers the values that have been met: inner ones by column, then outer ones.
    pub(crate) fn finish(self) -> LaneEntries {
        let Self { bundles, mut position, .. } = self;
        let (mut inner, mut outer) = (Columns::default(), Columns::default());
        inner.start.push(0);
        outer.start.push(0);
        let (mut outside, mut outer_rows) = (Vec::new(), Vec::new());
        let mut outer_positions = Vec::new();
        let mut first = 0;
        for bundle in &mut bundles.list {
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
            first += shape.entries;
        }
        for (k, value) in outer_positions.into_iter().enumerate() {
            position[value] = ((inner.row.len() + k) * LANES) as u32;
        }
        LaneEntries { inner, outer, bundles: outside, outer_rows, position }
    }
}

impl Shape {
    /// Adds the row in the block of each front by the code of a row: of the rows of the lane those in a window from the first of the front,
    /// then those outside. Answers start and width of the window of each front.
    fn add_rows_by_code(&self, rows: &mut Vec<u32>) -> Vec<(u32, u32)> {
        let windows = self.fronts.iter().map(|front| {
            let start = rows.len();
            let inside = |code: &&u32| (**code as usize) < self.rows;
            let last = front.below.iter().rev().find(inside).map_or(front.first, |code| *code as usize);
            let window = (last.max(front.first + front.width) + 1 - front.first).min(WIDEST_WINDOW);
            rows.resize(start + window + self.outer, 0);
            let rows = &mut rows[start..];
            for c in 0..front.width.min(window) {
                rows[c] = c as u32;
            }
            for (k, &code) in front.below.iter().enumerate() {
                let row = (front.width + k) as u32;
                match (code as usize).checked_sub(self.rows) {
                    Some(outside) => rows[window + outside] = row,
                    None if code as usize - front.first < window => rows[code as usize - front.first] = row,
                    None => {}
                }
            }
            (start as u32, window as u32)
        });
        windows.collect()
    }
}
