//! GeoTIFF: types of numbers, compression, layout, place.

use std::io::Cursor;

use apsides_terrain::io::{ReadOptions, Windows, read};
use apsides_terrain::{MapUnit, TerrainError};

use super::samples::{Tag, Tiff, keys, place};
use super::{heights, message, read_at_1m, read_bytes};

/// Round-off of single precision, in which rasters are stored.
const SINGLE: f64 = 1e-7;

fn ramp(rows: usize, cols: usize) -> Vec<f64> {
    (0..rows * cols).map(|k| ((k * 37) % 101) as f64 + (k % cols / 4) as f64).collect()
}

fn some(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().map(|&v| Some(v)).collect()
}

#[test]
fn every_type_compression_layout_and_byte_order_gives_the_same_heights() {
    let (rows, cols) = (21, 19);
    let values = ramp(rows, cols);
    let mut count = 0;
    for kind in [(8, 1), (8, 2), (16, 1), (16, 2), (32, 1), (32, 2), (32, 3), (64, 3)] {
        for (compression, predictor) in [
            (1, 1),
            (8, 1),
            (32946, 1),
            (32773, 1),
            (5, 1),
            (5, 2),
            (5, 3),
            (8, 2),
            (8, 3),
            (1, 2),
            (1, 3),
            (32773, 2),
        ] {
            if (predictor == 2 && kind.1 == 3) || (predictor == 3 && kind.1 != 3) {
                continue;
            }
            for tile in [(rows, None), (4, None), (1, None), (16, Some(16)), (32, Some(16))] {
                for (big_endian, big) in [(false, false), (true, false), (false, true), (true, true)] {
                    let file = Tiff {
                        kind,
                        compression,
                        predictor,
                        tile,
                        big_endian,
                        big,
                        ..Tiff::new(rows, cols, values.clone())
                    };
                    let map = read_bytes(&file.bytes()).unwrap_or_else(|e| {
                        panic!("{kind:?} {compression} {predictor} {tile:?} {big_endian} {big}: {e}")
                    });
                    assert_eq!(heights(&map), some(&values), "{kind:?} {compression} {predictor} {tile:?}");
                    count += 1;
                }
            }
        }
    }
    assert_eq!(count, 20 * (6 * 9 + 2 * 8));
}

#[test]
fn lzw_strips_of_another_encoder_are_read() {
    use tiff::encoder::{Compression, Predictor, TiffEncoder, colortype::GrayI16};
    let values: Vec<i16> = ramp(40, 31).iter().map(|&v| v as i16 - 50).collect();
    for predictor in [Predictor::None, Predictor::Horizontal] {
        let mut bytes = Cursor::new(Vec::new());
        let encoder = TiffEncoder::new(&mut bytes).unwrap();
        let mut encoder = encoder.with_compression(Compression::Lzw).with_predictor(predictor);
        encoder.write_image::<GrayI16>(31, 40, &values).unwrap();
        let map = read_at_1m(bytes.get_ref()).unwrap();
        assert_eq!(heights(&map), values.iter().map(|&v| Some(f64::from(v))).collect::<Vec<_>>());
    }
}

#[test]
fn signed_numbers_nodata_scale_and_offset() {
    let mut file = Tiff::new(2, 2, vec![-32767.0, -2.0, 3.0, 8.0]);
    file.kind = (16, 2);
    file.tags.push(Tag::Text(42113, "-32767"));
    let map = read_bytes(&file.bytes()).unwrap();
    assert_eq!(heights(&map), [None, Some(-2.0), Some(3.0), Some(8.0)]);
    // The caller's gap beside the file's; the caller's scale after the file's.
    file.tags.push(Tag::Text(
        42112,
        "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.5</Item>\
         <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">10</Item></GDALMetadata>",
    ));
    let options = ReadOptions { nodata: Some(3.0), z_scale: 2.0, z_offset: -1.0, ..ReadOptions::default() };
    let map = read(Cursor::new(file.bytes()), &options).unwrap();
    assert_eq!(heights(&map), [None, Some(17.0), None, Some(27.0)]);
    // The decimal form of a single-precision number for gaps.
    let mut file = Tiff::new(1, 2, vec![f64::from(f32::from_bits(0xff7f_fffb)), 1.0]);
    file.tags.push(Tag::Text(42113, "-3.4028226550889045e+38 "));
    assert_eq!(heights(&read_bytes(&file.bytes()).unwrap()), [None, Some(1.0)]);
}

#[test]
fn pixels_are_areas_or_points() {
    // Corner of the first pixel at (100, 50), pixels of 2 m.
    let mut file = Tiff::new(2, 3, vec![0.0; 6]);
    file.tags = place(2.0, 100.0, 50.0);
    let north_west = |f: &Tiff| read_bytes(&f.bytes()).unwrap().geometry().north_west();
    assert_eq!(north_west(&file), [101.0, 49.0]);
    file.tags.push(keys(&[(1024, 1), (1025, 1), (3076, 9001)]));
    assert_eq!(north_west(&file), [101.0, 49.0]);
    file.tags[2] = keys(&[(1024, 1), (1025, 2)]);
    assert_eq!(north_west(&file), [100.0, 50.0]);
    // A tie point inside the raster.
    file.tags[1] = Tag::Real(33922, vec![2.0, 1.0, 0.0, 104.0, 48.0, 0.0]);
    assert_eq!(north_west(&file), [100.0, 50.0]);
}

#[test]
fn degrees_feet_and_user_units() {
    let mut file = Tiff::new(2, 2, vec![1.0, 2.0, 3.0, 4.0]);
    file.tags = place(0.5, 10.0, 20.0);
    file.tags.push(keys(&[(1024, 2), (1025, 1), (2054, 9102)]));
    let g = *read_bytes(&file.bytes()).unwrap().geometry();
    assert_eq!((g.unit(), g.pixel(), g.north_west()), (MapUnit::Degree, [0.5; 2], [10.25, 19.75]));
    file.tags[2] = keys(&[(1024, 1), (3076, 9002), (4099, 9002)]);
    let map = read_bytes(&file.bytes()).unwrap();
    assert_eq!(map.geometry().pixel(), [0.1524; 2]);
    assert!((map.height(0, 1).unwrap() - 0.6096).abs() < SINGLE);
    file.tags[2] = keys(&[(1024, 1), (3076, 9999)]);
    assert!(message(read_bytes(&file.bytes())).contains("linear unit 9999"));
    file.tags[2] = keys(&[(1024, 3)]);
    assert!(message(read_bytes(&file.bytes())).contains("geocentric"));
}

#[test]
fn transformations_along_the_axes_and_maps_that_begin_in_the_south() {
    let mut file = Tiff::new(2, 3, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let matrix = |e: f64, south: f64, h: f64| {
        let mut m = vec![0.0; 16];
        (m[0], m[3], m[4], m[5], m[7], m[15]) = (2.0, 100.0, e, south, h, 1.0);
        Tag::Real(34264, m)
    };
    file.tags = vec![matrix(0.0, -2.0, 50.0)];
    let north_up = read_bytes(&file.bytes()).unwrap();
    assert_eq!(north_up.geometry().north_west(), [101.0, 49.0]);
    assert_eq!(north_up.height(0, 0), Some(1.0));
    // The first stored row is the southernmost: rows are turned over.
    file.tags = vec![matrix(0.0, 2.0, 46.0)];
    let turned = read_bytes(&file.bytes()).unwrap();
    assert_eq!(turned.geometry().north_west(), [101.0, 49.0]);
    assert_eq!(heights(&turned), some(&[4.0, 5.0, 6.0, 1.0, 2.0, 3.0]));
    let mut windows = Windows::open(Cursor::new(file.bytes()), &ReadOptions::default()).unwrap();
    assert_eq!(heights(&windows.window(0, 1, 1, 2).unwrap()), some(&[5.0, 6.0]));
    file.tags = vec![matrix(0.5, -2.0, 50.0)];
    assert!(message(read_bytes(&file.bytes())).contains("rotated or sheared"));
    file.tags = vec![matrix(0.0, 0.0, 50.0)];
    assert!(matches!(read_bytes(&file.bytes()), Err(TerrainError::Malformed { .. })));
}

#[test]
fn pixel_sizes_that_are_not_positive_are_refused() {
    let mut file = Tiff::new(2, 2, vec![0.0; 4]);
    for scale in [[-1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]] {
        file.tags[0] = Tag::Real(33550, scale.to_vec());
        assert!(message(read_bytes(&file.bytes())).contains("must be positive"));
    }
    file.tags[0] = Tag::Real(33550, vec![f64::NAN, 1.0, 0.0]);
    assert!(message(read_bytes(&file.bytes())).contains("finite DOUBLE"));
}

#[test]
fn a_plain_tiff_takes_its_pixel_from_the_caller() {
    // Grey levels of 0.1 m, as of a hazard map from 100 m.
    let mut file = Tiff::new(2, 2, vec![0.0, 10.0, 20.0, 255.0]);
    file.kind = (8, 1);
    file.tags.clear();
    assert!(message(read_bytes(&file.bytes())).contains("ReadOptions::pixel_m"));
    let options = ReadOptions { pixel_m: Some(0.1), z_scale: 0.1, ..ReadOptions::default() };
    let map = read(Cursor::new(file.bytes()), &options).unwrap();
    assert_eq!(map.geometry().square_pixel().unwrap(), 0.1);
    assert!((map.height(1, 1).unwrap() - 25.5).abs() < 100.0 * SINGLE);
    for pixel in [0.0, -1.0, f64::NAN] {
        let options = ReadOptions { pixel_m: Some(pixel), ..options };
        assert!(matches!(read(Cursor::new(file.bytes()), &options), Err(TerrainError::Number { .. })));
    }
    let options = ReadOptions { z_scale: 0.0, ..options };
    assert!(matches!(read(Cursor::new(file.bytes()), &options), Err(TerrainError::Number { .. })));
}

#[test]
fn what_is_not_supported_is_refused_by_name() {
    let base = Tiff::new(2, 2, vec![0.0; 4]);
    for (tag, expected) in [
        (Tag::Short(277, vec![3]), "3 bands"),
        (Tag::Short(259, vec![7]), "compression 7 (JPEG)"),
        (Tag::Short(262, vec![0]), "photometric interpretation 0"),
        (Tag::Short(258, vec![16]), "16 bits and sample format 3"),
        (Tag::Short(317, vec![4]), "predictor 4 of F32"),
        (Tag::Short(259, vec![34887]), "parameters of LERC"),
    ] {
        let mut file = base.clone();
        file.tags.push(tag);
        assert!(message(read_bytes(&file.bytes())).contains(expected), "{expected}");
    }
}

#[test]
fn windows_equal_parts_of_the_whole() {
    let (rows, cols) = (45, 37);
    let values = ramp(rows, cols);
    for (compression, tile) in [(1, (7, None)), (8, (7, None)), (1, (16, Some(16))), (8, (16, Some(16)))] {
        let file = Tiff { compression, tile, ..Tiff::new(rows, cols, values.clone()) };
        let whole = read_bytes(&file.bytes()).unwrap();
        let mut windows = Windows::open(Cursor::new(file.bytes()), &ReadOptions::default()).unwrap();
        for (r, c, h, w) in [(0, 0, 45, 37), (44, 36, 1, 1), (6, 15, 2, 3), (13, 0, 20, 37), (0, 16, 45, 16)]
        {
            let window = windows.window(r, c, h, w).unwrap();
            assert_eq!(heights(&window), heights(&whole.window(r, c, h, w).unwrap()));
            assert_eq!(window.geometry().north_west(), whole.geometry().position(r as f64, c as f64));
        }
        assert!(matches!(windows.window(40, 0, 6, 1), Err(TerrainError::Outside { .. })));
        assert!(matches!(windows.window(0, 0, 0, 1), Err(TerrainError::Shape { .. })));
    }
}

#[test]
fn a_strip_of_no_bytes_is_a_gap() {
    for compression in [1, 8] {
        let mut file = Tiff { compression, tile: (1, None), ..Tiff::new(2, 2, vec![1.0, 2.0, 3.0, 4.0]) };
        let bytes = file.bytes();
        let mut windows = Windows::open(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
        assert_eq!(windows.window(0, 0, 2, 2).unwrap().gaps(), 0);
        let size = if compression == 1 { 8 } else { 16 };
        file.tags.push(Tag::Long(279, vec![size, 0]));
        assert_eq!(heights(&read_bytes(&file.bytes()).unwrap()), [Some(1.0), Some(2.0), None, None]);
    }
}
