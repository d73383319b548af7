//! A map larger than the memory allowed for it.

use std::io::{BufWriter, Seek, SeekFrom};

use apsides_terrain::Geometry;
use apsides_terrain::io::{GeoTiffOptions, GeoTiffWriter, ReadOptions, Windows};

const SIDE: usize = 20_000;

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
    let geometry = Geometry::square(SIDE, SIDE, 0.5).unwrap();
    let begin = std::time::Instant::now();
    let file = BufWriter::new(tempfile::tempfile().unwrap());
    let options = GeoTiffOptions { deflate, ..GeoTiffOptions::default() };
    let mut writer = GeoTiffWriter::new(file, geometry, options).unwrap();
    let mut band = vec![0.0; SIDE * 10];
    for first in (0..SIDE).step_by(10) {
        for (k, z) in band.iter_mut().enumerate() {
            *z = height(first + k / SIDE, k % SIDE);
        }
        writer.write_rows(&band).unwrap();
    }
    let mut file = writer.finish().unwrap().into_inner().unwrap();
    let size = file.seek(SeekFrom::End(0)).unwrap();
    let written = begin.elapsed().as_secs_f64();

    let begin = std::time::Instant::now();
    let mut windows = Windows::open(file, &ReadOptions::default()).unwrap();
    let mut seen = 0;
    for row in (0..SIDE).step_by(2000) {
        for col in (0..SIDE).step_by(4000) {
            let window = windows.window(row, col, 2000, 4000).unwrap();
            for r in (0..2000).step_by(37) {
                for c in (0..4000).step_by(41) {
                    assert_eq!(window.height(r, c), Some(f64::from(height(row + r, col + c))));
                }
            }
            seen += window.geometry().pixels();
        }
    }
    assert_eq!(seen, SIDE * SIDE);
    println!(
        "deflate {deflate}: {:.2} GB written in {written:.1} s, read in windows in {:.1} s, peak memory {:?} MB",
        size as f64 * 1e-9,
        begin.elapsed().as_secs_f64(),
        peak().map(|p| p / 1_000_000)
    );
    assert!(peak().is_none_or(|p| p < 1_000_000_000));
}

/// 1.6 GB on the disk.
#[test]
#[ignore = "writes 1.6 GB"]
fn four_hundred_million_pixels_in_windows() {
    in_windows(false);
    in_windows(true);
}
