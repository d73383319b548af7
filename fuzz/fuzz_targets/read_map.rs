//! Any bytes are read as a map, and as a label with its raster: an error or a map, never a panic.

#![no_main]

use std::io::Cursor;

use apsides_terrain::io::{ReadOptions, Windows, read, read_labelled};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let options = ReadOptions { pixel_m: Some(1.0), max_pixels: 1 << 20, ..ReadOptions::default() };
    let _ = read(Cursor::new(bytes), &options);
    let own_pixel = ReadOptions { pixel_m: None, ..options };
    if let Ok(mut windows) = Windows::open(Cursor::new(bytes), &own_pixel) {
        let g = *windows.geometry();
        let _ = windows.window(g.rows() / 2, g.cols() / 2, 1, 1);
    }
    let (label, data) = bytes.split_at(bytes.len() / 2);
    let _ = read_labelled(label, Cursor::new(data), &own_pixel);
});
