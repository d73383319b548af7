//! Compressed strips and tiles.

use std::io::{Read, Seek};

use tiff::decoder::{Decoder, Limits};

use super::super::malformed;
use super::super::sample::{Order, Sample};
use super::{Compression, NAME};
use crate::TerrainError;

/// Most bytes of one decoded strip or tile.
const LARGEST: u64 = 1 << 28;
/// Bytes of decoded strips and tiles that are kept.
const KEPT: usize = 1 << 26;

/// Rows, columns and compressed sizes of the strips or tiles of a raster.
pub(in super::super) struct Grid {
    pub(super) rows: u64,
    pub(super) cols: u64,
    pub(super) chunk_rows: u64,
    pub(super) chunk_cols: u64,
    /// Compressed bytes of each; zero for a chunk of gaps.
    pub(super) sizes: Vec<u64>,
}

/// Strips or tiles that the `tiff` crate decodes when they are needed.
pub(in super::super) struct Chunks<R: Read + Seek> {
    decoder: Decoder<R>,
    sample: Sample,
    compression: Compression,
    grid: Grid,
    /// Decoded chunks, the latest used last.
    kept: Vec<(usize, Vec<u8>)>,
}

impl<R: Read + Seek> Chunks<R> {
    /// The directory of `reader` has been checked.
    pub(super) fn new(
        reader: R,
        sample: Sample,
        compression: Compression,
        grid: Grid,
    ) -> Result<Chunks<R>, TerrainError> {
        // Tiles are decoded with the columns beyond the edge of the map.
        let bytes = grid
            .chunk_cols
            .checked_mul(sample.size() as u64)
            .and_then(|row| row.checked_mul(grid.chunk_rows.min(grid.rows)));
        if bytes.is_none_or(|b| b > LARGEST) {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: format!(
                    "compressed strips or tiles of {} x {} pixels",
                    grid.chunk_rows, grid.chunk_cols
                ),
                supported: "at most 256 MiB in one strip or tile",
            });
        }
        let mut limits = Limits::default();
        limits.decoding_buffer_size = LARGEST as usize;
        limits.intermediate_buffer_size = LARGEST as usize;
        let decoder = Decoder::new(reader).map_err(|e| malformed(NAME, "directory", e.to_string()))?;
        Ok(Chunks { decoder: decoder.with_limits(limits), sample, compression, grid, kept: Vec::new() })
    }

    /// Most bytes that can come out of one compressed byte.
    pub(in super::super) fn expansion(&self) -> u64 {
        self.compression.expansion()
    }

    /// Fills `out`, rows of `cols` numbers, from the window whose first pixel is (`row`, `col`). The window is inside the raster.
    pub(in super::super) fn fill(
        &mut self,
        row: usize,
        col: usize,
        cols: usize,
        out: &mut [f64],
    ) -> Result<(), TerrainError> {
        let (height, width) = (self.grid.chunk_rows as usize, self.grid.chunk_cols as usize);
        let across = (self.grid.cols as usize).div_ceil(width);
        let (end_row, end_col) = (row + out.len() / cols, col + cols);
        let size = self.sample.size();
        for cr in row / height..=(end_row - 1) / height {
            for cc in col / width..=(end_col - 1) / width {
                let index = cr * across + cc;
                if self.grid.sizes[index] == 0 {
                    continue;
                }
                let sample = self.sample;
                let (first_row, first_col) = (cr * height, cc * width);
                let stride = width.min(self.grid.cols as usize - first_col) * size;
                let rows_here = row.max(first_row)..end_row.min(first_row + height);
                let cols_here = col.max(first_col)..end_col.min(first_col + width);
                let bytes = self.chunk(index, first_row, stride)?;
                for r in rows_here {
                    let from = (r - first_row) * stride + (cols_here.start - first_col) * size;
                    let to = (r - row) * cols + cols_here.start - col;
                    let out = &mut out[to..to + cols_here.len()];
                    sample.decode(&bytes[from..from + cols_here.len() * size], Order::NATIVE, out);
                }
            }
        }
        Ok(())
    }

    /// The decoded bytes of a chunk.
    fn chunk(&mut self, index: usize, first_row: usize, stride: usize) -> Result<&[u8], TerrainError> {
        if let Some(at) = self.kept.iter().position(|(i, _)| *i == index) {
            let found = self.kept.remove(at);
            self.kept.push(found);
        } else {
            let rows = (self.grid.chunk_rows as usize).min(self.grid.rows as usize - first_row);
            let place = || format!("strip or tile {index}");
            let most = self.grid.sizes[index].saturating_mul(self.expansion());
            if (rows * stride) as u64 > most {
                let problem = format!("{} bytes cannot hold {rows} rows", self.grid.sizes[index]);
                return Err(malformed(NAME, place(), problem));
            }
            let mut held: usize = self.kept.iter().map(|(_, b)| b.len()).sum();
            while held + rows * stride > KEPT && !self.kept.is_empty() {
                held -= self.kept.remove(0).1.len();
            }
            let mut bytes = vec![0; rows * stride];
            let read = self.decoder.read_chunk_bytes(index as u32, &mut bytes);
            read.map_err(|e| malformed(NAME, place(), e.to_string()))?;
            self.kept.push((index, bytes));
        }
        Ok(self.kept.last().map_or(&[], |(_, bytes)| bytes))
    }
}
