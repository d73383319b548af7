//! Tables of pixels.

use std::fmt::Write as _;
use std::io::Write;

use super::unwritable;
use crate::{MapUnit, Raster, TerrainError};

/// Writes a table with one line for each pixel that has a value: row, column, map coordinates of its centre (east and north, metres or
/// degrees as the heading says) and the value under the heading `value`. Gaps (NaN) are left out.
///
/// # Errors
/// The writer's; a heading with a comma, a quotation mark or a line end.
pub fn write_csv<W: Write>(mut writer: W, raster: &Raster<f32>, value: &str) -> Result<(), TerrainError> {
    if value.is_empty() || value.contains([',', '"', '\n', '\r']) {
        return Err(TerrainError::Unsupported {
            format: "CSV",
            feature: format!("the heading {value:?}"),
            supported: "headings without commas, quotation marks and line ends",
        });
    }
    let g = raster.geometry();
    let unit = if g.unit() == MapUnit::Metre { "m" } else { "deg" };
    let mut text = format!("row,col,east_{unit},north_{unit},{value}\n");
    for row in 0..g.rows() {
        for (col, z) in raster.row(row).iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            let [east, north] = g.position(row as f64, col as f64);
            // A `String` takes every text.
            let _ = writeln!(text, "{row},{col},{east},{north},{z}");
        }
        writer.write_all(text.as_bytes()).map_err(unwritable)?;
        text.clear();
    }
    writer.flush().map_err(unwritable)
}
