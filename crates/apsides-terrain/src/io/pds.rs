//! Functions that both versions of PDS labels use.

use std::io::{Read, Seek};

use super::raw::{Layout, Raw};
use super::sample::Order;
use super::source::{Head, Store};
use crate::TerrainError;

/// Longest label, bytes.
pub(super) const LONGEST_LABEL: u64 = 1 << 20;

/// The places of the rows of a raster in its file.
pub(super) struct RowLayout {
    pub(super) order: Order,
    /// First byte of the first number.
    pub(super) start: u64,
    /// Bytes from a row to the next.
    pub(super) stride: u64,
}

/// The raster that `head` and `rows` describe.
pub(super) fn raster<R: Read + Seek>(
    head: Head,
    rows: RowLayout,
    data: R,
    len: u64,
) -> Result<(Head, Store<R>), TerrainError> {
    if head.rows == 0 || head.cols == 0 {
        let (rows, cols) = (head.rows as usize, head.cols as usize);
        return Err(TerrainError::Shape { rows, cols, values: 0 });
    }
    let sides = [head.rows, head.cols];
    let layout = Layout::rows(head.format, sides, head.sample, rows.order, rows.start, rows.stride);
    let raw = Raw::new(data, len, layout)?;
    Ok((head, Store::Raw(raw)))
}
