//! Reading and writing of elevation maps.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod formats;
mod hostile;
mod pictures;
mod samples;
mod tiff_read;
mod tiff_write;
mod written_elsewhere;

use std::io::Cursor;

use apsides_terrain::io::{ReadOptions, read};
use apsides_terrain::{ElevationMap, TerrainError};

/// A map read with the options of the file alone.
fn read_bytes(bytes: &[u8]) -> Result<ElevationMap, TerrainError> {
    read(Cursor::new(bytes), &ReadOptions::default())
}

/// A map read with pixels of one metre.
fn read_at_1m(bytes: &[u8]) -> Result<ElevationMap, TerrainError> {
    read(Cursor::new(bytes), &ReadOptions { pixel_m: Some(1.0), ..ReadOptions::default() })
}

/// Heights row by row; none in a gap.
fn heights(map: &ElevationMap) -> Vec<Option<f64>> {
    let g = map.geometry();
    (0..g.rows()).flat_map(|r| (0..g.cols()).map(move |c| map.height(r, c))).collect()
}

/// Asserts that two maps are equal; a gap equals a gap.
fn assert_same(map: &ElevationMap, other: &ElevationMap) {
    assert_eq!((map.geometry(), map.datum()), (other.geometry(), other.datum()));
    assert_eq!(heights(map), heights(other));
}

fn message<T>(result: Result<T, TerrainError>) -> String {
    result.err().expect("an error").to_string()
}
