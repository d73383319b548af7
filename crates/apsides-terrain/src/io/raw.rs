//! Rasters of uncompressed numbers.

use std::io::{Read, Seek, SeekFrom};

use super::sample::{Order, Sample};
use super::{malformed, unreadable};
use crate::TerrainError;

/// Most bytes read at once, beside a single row.
const BLOCK: usize = 1 << 20;

/// The layout of uncompressed numbers in a file: chunks of `chunk_rows` x `chunk_cols` numbers, numbered row by row.
pub(super) struct Layout {
    pub(super) format: &'static str,
    pub(super) sample: Sample,
    pub(super) order: Order,
    pub(super) rows: u64,
    pub(super) cols: u64,
    pub(super) chunk_rows: u64,
    pub(super) chunk_cols: u64,
    /// Bytes from one row of a chunk to the next.
    pub(super) stride: u64,
    /// First byte of each chunk; none for a chunk of gaps.
    pub(super) starts: Vec<Option<u64>>,
    /// Numbers go column by column: rows and columns above are exchanged.
    pub(super) by_column: bool,
}

impl Layout {
    /// Rows one after the other from byte `start`, `stride` bytes apart.
    pub(super) fn rows(
        format: &'static str,
        [rows, cols]: [u64; 2],
        sample: Sample,
        order: Order,
        start: u64,
        stride: u64,
    ) -> Layout {
        Layout {
            format,
            sample,
            order,
            rows,
            cols,
            chunk_rows: rows,
            chunk_cols: cols,
            stride,
            starts: vec![Some(start)],
            by_column: false,
        }
    }
}

/// A reader with a layout.
pub(super) struct Raw<R> {
    reader: R,
    len: u64,
    layout: Layout,
    buffer: Vec<u8>,
}

impl<R: Read + Seek> Raw<R> {
    /// # Errors
    /// A raster that goes beyond the end of the file of `len` bytes, or whose sizes overflow.
    pub(super) fn new(reader: R, len: u64, layout: Layout) -> Result<Raw<R>, TerrainError> {
        let size = layout.sample.size() as u64;
        let row = layout.chunk_cols.checked_mul(size);
        let last = |start: u64| {
            let rows = layout.rows.min(layout.chunk_rows).saturating_sub(1);
            rows.checked_mul(layout.stride)?.checked_add(row?)?.checked_add(start)
        };
        let single = layout.starts.len() == 1;
        let sound = layout.starts.iter().flatten().all(|&start| {
            last(start).is_some_and(|end| !single || end <= len) && row.is_some_and(|r| r <= layout.stride)
        });
        if !sound {
            return Err(malformed(
                layout.format,
                "size of the map",
                format!(
                    "{} x {} pixels do not fit into the {len} bytes of the file",
                    layout.rows, layout.cols
                ),
            ));
        }
        Ok(Raw { reader, len, layout, buffer: Vec::new() })
    }

    /// Fills `out`, rows of `cols` numbers, from the window whose first pixel is (`row`, `col`). The window is inside the raster.
    pub(super) fn fill(
        &mut self,
        row: usize,
        col: usize,
        cols: usize,
        out: &mut [f64],
    ) -> Result<(), TerrainError> {
        if !self.layout.by_column {
            return self.fill_stored(row, col, cols, out);
        }
        let rows = out.len() / cols;
        // Columns in blocks, so that the transposed copy stays small.
        let step = (BLOCK / 8 / rows).clamp(1, cols);
        let mut columns = vec![f64::NAN; rows * step];
        for first in (0..cols).step_by(step) {
            let count = step.min(cols - first);
            self.fill_stored(col + first, row, rows, &mut columns[..rows * count])?;
            for c in 0..count {
                for r in 0..rows {
                    out[r * cols + first + c] = columns[c * rows + r];
                }
            }
        }
        Ok(())
    }

    fn fill_stored(
        &mut self,
        row: usize,
        col: usize,
        cols: usize,
        out: &mut [f64],
    ) -> Result<(), TerrainError> {
        let rows = out.len() / cols;
        let (row, col) = (row as u64, col as u64);
        let (end_row, end_col) = (row + rows as u64, col + cols as u64);
        let l = &self.layout;
        let across = l.cols.div_ceil(l.chunk_cols);
        let (chunk_rows, chunk_cols, stride, size) =
            (l.chunk_rows, l.chunk_cols, l.stride, l.sample.size() as u64);
        for cr in row / chunk_rows..=(end_row - 1) / chunk_rows {
            let rows_here = row.max(cr * chunk_rows)..end_row.min((cr + 1).saturating_mul(chunk_rows));
            for cc in col / chunk_cols..=(end_col - 1) / chunk_cols {
                let cols_here = col.max(cc * chunk_cols)..end_col.min((cc + 1).saturating_mul(chunk_cols));
                let Some(start) = self.layout.starts[(cr * across + cc) as usize] else { continue };
                let width = cols_here.end - cols_here.start;
                // Whole rows that follow each other are read together.
                let together = if width * size == stride { (BLOCK as u64 / stride).max(1) } else { 1 };
                let mut r = rows_here.start;
                while r < rows_here.end {
                    let count = together.min(rows_here.end - r);
                    let at = (r - cr * chunk_rows) * stride + (cols_here.start - cc * chunk_cols) * size;
                    self.load(start.saturating_add(at), (count * width * size) as usize)?;
                    for i in 0..count {
                        let to = ((r + i - row) * cols as u64 + cols_here.start - col) as usize;
                        let from = (i * width * size) as usize;
                        let bytes = &self.buffer[from..from + (width * size) as usize];
                        let l = &self.layout;
                        l.sample.decode(bytes, l.order, &mut out[to..to + width as usize]);
                    }
                    r += count;
                }
            }
        }
        Ok(())
    }

    /// Reads `count` bytes from `at` into the buffer.
    fn load(&mut self, at: u64, count: usize) -> Result<(), TerrainError> {
        let format = self.layout.format;
        if at.checked_add(count as u64).is_none_or(|end| end > self.len) {
            return Err(malformed(format, format!("byte {at}"), "the file ends early"));
        }
        self.buffer.resize(count, 0);
        let read =
            self.reader.seek(SeekFrom::Start(at)).and_then(|_| self.reader.read_exact(&mut self.buffer));
        read.map_err(|e| unreadable(format, format!("byte {at}"), e))
    }
}
