//! GeoTIFFs of other programs: GDAL 3.10.3 (by rasterio 1.4.4) and tifffile 2026.3.3, written by `written_elsewhere/make.py`.

use std::io::Cursor;

use apsides_terrain::io::{ReadOptions, Windows, read};
use apsides_terrain::{ElevationMap, MapUnit};

use super::{assert_same, message, read_bytes};

/// Largest error that LERC was allowed, `MAX_Z_ERROR=0.04`, with the rounding of single precision at 1600 m.
const LERC_LOSS: f64 = 0.04 + 2e-4;
/// Rounding of single precision at the height of a map above its datum.
const SINGLE: f64 = 2e-5;
/// Rounding of places on a sphere.
const ROUNDING: f64 = 1e-12;

const ROWS: usize = 37;
const COLS: usize = 41;

/// Heights of all files, m.
fn height(row: usize, col: usize) -> f64 {
    let (r, c) = (row as f64, col as f64);
    -1500.0 + 3.0 * r - 2.0 * c + ((row * 37 + col * 11) % 17) as f64 * 0.25
}

/// Greatest miss of the heights of a file, and its gaps.
fn miss(map: &ElevationMap, expected: impl Fn(usize, usize) -> f64) -> (f64, usize) {
    assert_eq!((map.geometry().rows(), map.geometry().cols()), (ROWS, COLS));
    let places = (0..ROWS).flat_map(|r| (0..COLS).map(move |c| (r, c)));
    let misses = places.filter_map(|(r, c)| Some((map.height(r, c)? - expected(r, c)).abs()));
    (misses.fold(0.0, f64::max), map.gaps())
}

macro_rules! file {
    ($name:literal) => {
        ($name, include_bytes!(concat!("written_elsewhere/", $name, ".tif")).as_slice())
    };
}

#[test]
fn zstd_lerc_and_predictors_of_reals_give_the_heights_that_were_written() {
    for (name, bytes) in [
        file!("gdal_zstd"),
        file!("gdal_zstd_p2"),
        file!("gdal_zstd_p3"),
        file!("gdal_deflate_p2"),
        file!("gdal_deflate_p2_f64_be"),
        file!("gdal_deflate_p3"),
        file!("gdal_deflate_p3_f64_be"),
        file!("gdal_lzw_p2"),
        file!("gdal_lzw_p3"),
        file!("gdal_lerc"),
        file!("gdal_lerc_deflate"),
        file!("tifffile_zstd_p3"),
        file!("tifffile_lerc"),
    ] {
        let map = read_bytes(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(miss(&map, height), (0.0, 0), "{name}");
        assert_eq!(
            (map.geometry().pixel(), map.geometry().north_west()),
            ([2.0; 2], [1001.0, 1999.0]),
            "{name}"
        );
    }
    for (name, bytes) in [file!("gdal_zstd_p2_i16"), file!("gdal_lerc_i16_be")] {
        // NumPy rounds halves to even.
        let expected = |r, c| height(r, c).round_ties_even();
        assert_eq!(miss(&read_bytes(bytes).unwrap(), expected), (0.0, 0), "{name}");
    }
    let (_, bytes) = file!("gdal_lerc_lossy");
    let (miss, gaps) = miss(&read_bytes(bytes).unwrap(), height);
    assert!(miss > 0.0 && miss <= LERC_LOSS && gaps == 0, "{miss}");
}

#[test]
fn pixels_that_lerc_masks_are_gaps() {
    for (name, bytes) in [file!("gdal_lerc_gaps"), file!("gdal_lerc_zstd")] {
        let map = read_bytes(bytes).unwrap();
        assert_eq!(miss(&map, height), (0.0, 18), "{name}");
        assert!((5..8).all(|r| (30..36).all(|c| map.height(r, c).is_none())), "{name}");
    }
}

#[test]
fn a_compression_that_is_not_read_is_told_with_the_command_that_converts_it() {
    let (_, bytes) = file!("gdal_lzma");
    let text = message(read_bytes(bytes));
    assert!(text.contains("compression 34925 (LZMA)"), "{text}");
    assert!(text.contains("gdal_translate -co COMPRESS=DEFLATE"), "{text}");
}

#[test]
fn cut_and_altered_streams_are_refused() {
    for (name, bytes) in [
        file!("gdal_zstd"),
        file!("gdal_zstd_p3"),
        file!("gdal_lerc"),
        file!("gdal_lerc_gaps"),
        file!("gdal_lerc_deflate"),
        file!("gdal_lerc_zstd"),
        file!("gdal_lerc_i16_be"),
    ] {
        for end in (0..bytes.len()).step_by(7) {
            let _ = read_bytes(&bytes[..end]).err();
        }
        assert!(read_bytes(&bytes[..bytes.len() - 90]).is_err(), "{name}");
        for at in 0..bytes.len() {
            for flip in [0xff, 0x01, 0x80] {
                let mut altered = bytes.to_vec();
                altered[at] ^= flip;
                // Any answer, no panic; pixels are bounded, so that memory is.
                let options = ReadOptions { max_pixels: 1 << 14, ..ReadOptions::default() };
                let _ = read(Cursor::new(altered), &options).err();
            }
        }
    }
}

#[test]
fn degrees_become_square_metres_on_the_body() {
    const MOON: f64 = 1_737_400.0;
    let on = |bytes: &'static [u8], radius| {
        let options = ReadOptions { body_radius_m: radius, ..ReadOptions::default() };
        Windows::open(Cursor::new(bytes), &options)
    };
    let (_, bytes) = file!("gdal_degrees_moon");
    let plain = on(bytes, None).unwrap();
    assert_eq!((plain.geometry().unit(), plain.stated_radius_m()), (MapUnit::Degree, Some(MOON)));
    assert!(plain.projection().is_none());

    let mut map = on(bytes, Some(MOON)).unwrap();
    let (geometry, projection) = (*map.geometry(), map.projection().unwrap());
    let pixel = MOON * (1.0_f64 / 512.0).to_radians();
    assert!((geometry.square_pixel().unwrap() - pixel).abs() < ROUNDING * MOON, "{pixel}");
    let middle = 26.0 - 0.5 * ROWS as f64 / 512.0;
    assert!((projection.latitude_deg - middle).abs() < ROUNDING);
    // Half a pixel from the corner at 3.6 W, 26 N.
    let corner = projection.degrees(geometry.north_west());
    assert!(
        (corner[0] + 3.6 - 0.5 / 512.0).abs() < ROUNDING && (corner[1] - 26.0 + 0.5 / 512.0).abs() < ROUNDING
    );
    let back = projection.metres(corner);
    assert!((back[0] - geometry.north_west()[0]).abs() < ROUNDING * MOON);
    // As many metres to the east as before: 41 columns of cos(latitude) of the size of a row.
    let cos = middle.to_radians().cos();
    assert_eq!((geometry.rows(), geometry.cols()), (ROWS, (40.0 * cos) as usize + 1));
    let whole = map.window(0, 0, geometry.rows(), geometry.cols()).unwrap();
    assert_eq!(whole.gaps(), 0);
    for row in 0..ROWS {
        for col in 0..geometry.cols() {
            let (x, west) = (col as f64 / cos, (col as f64 / cos) as usize);
            let east = (west + 1).min(COLS - 1);
            let expected = height(row, west) * (1.0 - x.fract()) + height(row, east) * x.fract();
            assert!((whole.height(row, col).unwrap() - expected).abs() < SINGLE, "{row} {col}");
        }
    }
    // Parts are those of the whole.
    let part = map.window(3, 5, 7, 11).unwrap();
    for (row, col) in (0..7).flat_map(|r| (0..11).map(move |c| (r, c))) {
        let (a, b) = (part.height(row, col).unwrap(), whole.height(3 + row, 5 + col).unwrap());
        assert!((a - b).abs() < SINGLE);
    }
    assert_same(&map.window(0, 0, ROWS, geometry.cols()).unwrap(), &whole);
    assert!(map.geo_keys().is_none());

    // Another body than that of the file, and radii that are none.
    let text = message(on(bytes, Some(6_371_000.0)));
    assert!(text.contains("1737.4 km") && text.contains("6371 km"), "{text}");
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(message(on(bytes, Some(radius))).contains("radius of the body"));
    }
    let (_, earth) = file!("gdal_degrees_wgs84");
    let plain = on(earth, None).unwrap();
    assert_eq!((plain.geometry().unit(), plain.stated_radius_m()), (MapUnit::Degree, Some(6_378_137.0)));
    assert!(on(earth, Some(6_371_000.0)).unwrap().projection().is_some());
    let (_, bare) = file!("tifffile_degrees");
    let plain = on(bare, None).unwrap();
    assert_eq!((plain.geometry().unit(), plain.stated_radius_m()), (MapUnit::Degree, None));
    assert!(on(bare, Some(1.0)).unwrap().projection().is_some());
}

#[test]
fn degrees_over_too_many_latitudes_or_on_long_pixels_are_refused() {
    use super::samples::{Tag, Tiff, keys};
    let at = |corner: f64, east: f64, south: f64, cols: usize| {
        let mut file = Tiff::new(4, cols, vec![1.0; 4 * cols]);
        file.tags = vec![
            Tag::Real(33550, vec![east, south, 0.0]),
            Tag::Real(33922, vec![0.0, 0.0, 0.0, 10.0, corner, 0.0]),
            keys(&[(1024, 2), (1025, 1), (2054, 9102)]),
        ];
        let options = ReadOptions { body_radius_m: Some(1_737_400.0), ..ReadOptions::default() };
        read(Cursor::new(file.bytes()), &options)
    };
    assert!(at(1.0, 0.5, 0.5, 8).is_ok());
    assert_eq!(at(1.0, 0.5, 0.5, 1).unwrap().geometry().cols(), 1);
    for corner in [62.0, 90.0, 91.0, -60.0, 1e300] {
        assert!(message(at(corner, 0.5, 0.5, 8)).contains("gdal_translate -projwin"), "{corner}");
    }
    assert!(message(at(80.0, 1e-4, 1e-4, 8)).contains("gdalwarp -t_srs"));
    assert!(message(at(1.0, 1e-3, 1e-1, 8)).contains("gdalwarp -t_srs"));
}
