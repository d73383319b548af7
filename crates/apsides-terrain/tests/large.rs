//! A map larger than the memory allowed for it, in a process of its own.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::io::{BufWriter, Seek, SeekFrom};

use apsides_terrain::Geometry;
use apsides_terrain::io::{GeoTiffOptions, GeoTiffWriter, ReadOptions, Windows};

/// Rows and columns of the map, a multiple of 20: 256 MB on the disk, or those that `APSIDES_MAP_SIDE` asks for; 20000 are 1.6 GB.
fn side() -> usize {
    std::env::var("APSIDES_MAP_SIDE").map_or(8000, |side| side.parse().unwrap())
}

/// Memory that the process may take relative to the heights as `f32`: 1 GB for 1.6 GB.
const MEMORY: f64 = 0.625;

/// A height in quarters of a metre that tells pixels apart.
fn height(row: usize, col: usize) -> f32 {
    ((row * 31 + col * 7) % 4001) as f32 * 0.25
}

/// Largest resident memory of this process so far, bytes; none where the system does not tell.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

fn in_windows(deflate: bool) {
    let side = side();
    let (rows, cols) = (side / 10, side / 5);
    let geometry = Geometry::square(side, side, 0.5).unwrap();
    let begin = std::time::Instant::now();
    let file = BufWriter::new(tempfile::tempfile().unwrap());
    let options = GeoTiffOptions { deflate, ..GeoTiffOptions::default() };
    let mut writer = GeoTiffWriter::new(file, geometry, options).unwrap();
    let mut band = vec![0.0; side * 10];
    for first in (0..side).step_by(10) {
        for (k, z) in band.iter_mut().enumerate() {
            *z = height(first + k / side, k % side);
        }
        writer.write_rows(&band).unwrap();
    }
    let mut file = writer.finish().unwrap().into_inner().unwrap();
    let size = file.seek(SeekFrom::End(0)).unwrap();
    let written = begin.elapsed().as_secs_f64();

    let begin = std::time::Instant::now();
    let mut windows = Windows::open(file, &ReadOptions::default()).unwrap();
    let mut seen = 0;
    for row in (0..side).step_by(rows) {
        for col in (0..side).step_by(cols) {
            let window = windows.window(row, col, rows, cols).unwrap();
            for r in (0..rows).step_by(37) {
                for c in (0..cols).step_by(41) {
                    assert_eq!(window.height(r, c), Some(f64::from(height(row + r, col + c))));
                }
            }
            seen += window.geometry().pixels();
        }
    }
    assert_eq!(seen, side * side);
    println!(
        "deflate {deflate}: {:.2} GB written in {written:.1} s, read in windows in {:.1} s, peak memory {:?} MB",
        size as f64 * 1e-9,
        begin.elapsed().as_secs_f64(),
        peak().map(|p| p / 1_000_000)
    );
    assert!(peak().is_none_or(|p| (p as f64) < MEMORY * (4 * side * side) as f64));
}

#[test]
fn a_map_in_windows_takes_less_memory_than_the_map() {
    in_windows(false);
    in_windows(true);
}
