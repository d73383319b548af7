//! ASCII grids, `.npy`, PDS3, PDS4 and grey PNG.

use std::io::Cursor;

use apsides_terrain::io::{Format, ReadOptions, Windows, read, read_labelled, write_ascii_grid, write_npy};
use apsides_terrain::{ElevationMap, Geometry, MapUnit, TerrainError};

use super::samples::{ASCII, PDS3_IMAGE, PDS4, npy, pds3, pds4_data, png};
use super::{assert_same, heights, message, read_at_1m, read_bytes};

/// Round-off of single precision, in which rasters are stored.
const SINGLE: f64 = 1e-7;

fn some(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().map(|&v| Some(v)).collect()
}

#[test]
fn formats_are_known_by_their_first_bytes() {
    for (start, format) in [
        (&b"II*\0...."[..], Format::Tiff),
        (b"MM\0+", Format::Tiff),
        (b"\x93NUMPY\x01\0", Format::Npy),
        (b"\x89PNG\r\n\x1a\n", Format::Png),
        (b"  NCOLS 3", Format::AsciiGrid),
        (b"PDS_VERSION_ID = PDS3", Format::Pds3),
        (b"<?xml version", Format::Pds4),
    ] {
        assert_eq!(Format::detect(start), Some(format));
    }
    for start in [&b""[..], b"II", b"\x7fELF", b"1 2 3"] {
        assert_eq!(Format::detect(start), None);
    }
    assert!(message(read_bytes(b"")).contains("the file is empty"));
    assert!(message(read_bytes(b"hello")).contains("not the beginning"));
}

#[test]
fn an_ascii_grid_with_corner_and_with_centre() {
    let map = read_bytes(ASCII.as_bytes()).unwrap();
    assert_eq!(map.geometry(), &Geometry::new(2, 3, [2.0; 2], [101.0, 53.0], MapUnit::Metre).unwrap());
    assert_eq!(heights(&map), [Some(1.0), Some(2.5), Some(3.0), None, Some(5.0), Some(-6.0)]);
    let centre = ASCII.replace("corner", "center");
    assert_eq!(read_bytes(centre.as_bytes()).unwrap().geometry().north_west(), [100.0, 52.0]);
    let oblong = ASCII.replace("cellsize 2", "dx 2\ndy 4").replace('\n', "\r\n");
    assert_eq!(read_bytes(oblong.as_bytes()).unwrap().geometry().pixel(), [2.0, 4.0]);
}

#[test]
fn damaged_ascii_grids_are_refused() {
    for (from, to, expected) in [
        ("-6e0\n", "", "ends early"),
        ("-6e0", "-6e0 7", "more than 6 heights"),
        ("2.5", "2,5", "row 0, column 1: \"2,5\" is not a number"),
        ("nrows 2", "nrows 0", "nrows: 0"),
        ("nrows 2", "nrows -2", "nrows: -2"),
        ("nrows 2", "nrows 2147483648", "more than the limit"),
        ("nrows 2", "nrows 2000000", "do not fit"),
        ("cellsize 2", "cellsize -2", "must be positive"),
        ("cellsize 2\n", "", "cellsize or dx and dy"),
        ("xllcorner 100", "xllcorner nan", "not a finite number"),
        ("nrows 2", "ncols 2", "stated twice"),
    ] {
        let text = message(read_bytes(ASCII.replace(from, to).as_bytes()));
        assert!(text.contains(expected), "{from:?} to {to:?}: {text}");
    }
}

#[test]
fn a_written_ascii_grid_is_read_back() {
    let map = read_bytes(ASCII.as_bytes()).unwrap();
    let mut bytes = Vec::new();
    write_ascii_grid(&mut bytes, &map, -9999.0).unwrap();
    assert_same(&read_bytes(&bytes).unwrap(), &map);
    assert!(matches!(write_ascii_grid(&mut bytes, &map, 5.0), Err(TerrainError::Number { .. })));
}

#[test]
fn numpy_arrays_of_every_type_order_and_version() {
    let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let transposed = [1.0, 4.0, 2.0, 5.0, 3.0, 6.0];
    for kind in ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"] {
        for version in [1, 2, 3] {
            for (sign, big) in [("<", false), (">", true)] {
                for fortran in [false, true] {
                    let encode = |v: &f64| {
                        let mut bytes = match kind {
                            "f4" => (*v as f32).to_le_bytes().to_vec(),
                            "f8" => v.to_le_bytes().to_vec(),
                            _ => (*v as i64).to_le_bytes()[..usize::from(kind.as_bytes()[1] - b'0')].to_vec(),
                        };
                        if big {
                            bytes.reverse();
                        }
                        bytes
                    };
                    let stored = if fortran { &transposed } else { &values };
                    let data: Vec<u8> = stored.iter().flat_map(encode).collect();
                    let bytes = npy(version, &format!("{sign}{kind}"), fortran, "(2, 3)", &data);
                    let map = read_at_1m(&bytes).unwrap();
                    assert_eq!(heights(&map), some(&values), "{kind} {version} {sign} {fortran}");
                    let options = ReadOptions { pixel_m: Some(1.0), ..ReadOptions::default() };
                    let mut windows = Windows::open(Cursor::new(bytes), &options).unwrap();
                    assert_eq!(heights(&windows.window(0, 1, 2, 2).unwrap()), some(&[2.0, 3.0, 5.0, 6.0]));
                }
            }
        }
    }
}

#[test]
fn arrays_that_are_no_maps_are_refused() {
    let data = [0; 64];
    for (bytes, expected) in [
        (npy(1, "<f4", false, "(16,)", &data), "1 dimensions"),
        (npy(1, "<f4", false, "(2, 2, 4)", &data), "3 dimensions"),
        (npy(1, "<c8", false, "(2, 4)", &data), "element type"),
        (npy(1, "<f4", false, "(0, 4)", &data), "at least one pixel"),
        (npy(1, "<f4", false, "(-1, 4)", &data), "whole numbers"),
        (npy(1, "<f4", false, "(4, 5)", &data), "do not fit"),
        (npy(1, "<f4", false, "(4, 3)", &data), "16 bytes after the end of the array"),
        (npy(1, "<f4", false, "(4294967296, 4294967296)", &data), "do not fit"),
        (npy(1, "<f4", false, "(18446744073709551615, 2)", &data), "do not fit"),
        (npy(9, "<f4", false, "(4, 4)", &data), "version 9"),
    ] {
        let text = message(read_at_1m(&bytes));
        assert!(text.contains(expected), "{expected}: {text}");
    }
    assert!(message(read_bytes(&npy(1, "<f4", false, "(4, 4)", &data))).contains("pixel_m"));
}

#[test]
fn heights_of_no_ground_are_refused_with_their_place() {
    let heights = |spike: f64| {
        let data: Vec<u8> =
            [10.0, 11.0, 12.0, 13.0, 14.0, spike].iter().flat_map(|z: &f64| z.to_le_bytes()).collect();
        read_at_1m(&npy(1, "<f8", false, "(2, 3)", &data))
    };
    for spike in [1e300, -1e30, 1.001e6] {
        let text = message(heights(spike));
        assert!(text.contains("row 1, column 2") && text.contains("nodata"), "{text}");
    }
    let map = heights(-9.999e5).unwrap();
    assert_eq!(map.height(0, 1), Some(11.0));
    // What is no number is a gap.
    assert_eq!(heights(f64::INFINITY).unwrap().height(1, 2), None);
}

#[test]
fn a_written_array_is_read_back() {
    let map = ElevationMap::from_heights(
        Geometry::square(2, 2, 1.0).unwrap(),
        &[-4450.25, f64::NAN, -4440.5, -4449.0],
    )
    .unwrap();
    let mut bytes = Vec::new();
    write_npy(&mut bytes, &map).unwrap();
    assert_eq!(bytes.len() % 64, 16);
    assert_same(&read_at_1m(&bytes).unwrap(), &map);
}

#[test]
fn a_pds3_label_before_and_apart_from_its_raster() {
    let expected =
        [Some(1737401.0), Some(1737402.0), Some(1737403.0), None, Some(1737399.0), Some(1737400.0)];
    let map = read_bytes(&pds3()).unwrap();
    assert_eq!(heights(&map), expected);
    let g = map.geometry();
    assert_eq!((g.pixel(), g.unit()), ([118.0; 2], MapUnit::Metre));
    assert_eq!(g.north_west(), [-20.5 * 118.0, 10.5 * 118.0]);

    let label = format!("PDS_VERSION_ID = PDS3\n^IMAGE = (\"LDEM.IMG\", 5 <BYTES>)\n{PDS3_IMAGE}");
    assert!(message(read_bytes(label.as_bytes())).contains("read_labelled"));
    let data = [b"....".to_vec(), pds3()[1024..].to_vec()].concat();
    let apart = read_labelled(label.as_bytes(), Cursor::new(data), &ReadOptions::default()).unwrap();
    assert_same(&apart, &map);
    let label = label.replace("(\"LDEM.IMG\", 5 <BYTES>)", "\"LDEM.IMG\"");
    let data = pds3()[1024..].to_vec();
    let apart = read_labelled(label.as_bytes(), Cursor::new(data), &ReadOptions::default()).unwrap();
    assert_same(&apart, &map);
}

#[test]
fn pds3_types_prefixes_bits_for_gaps_and_degrees() {
    let label = "PDS_VERSION_ID = PDS3\n^IMAGE = \"A.IMG\"\nOBJECT = IMAGE\nLINES = 2\nLINE_SAMPLES = 2\n\
        SAMPLE_TYPE = PC_REAL\nSAMPLE_BITS = 32\nLINE_PREFIX_BYTES = 3\nLINE_SUFFIX_BYTES = 1\n\
        MISSING_CONSTANT = 16#FF7FFFFB#\nEND_OBJECT = IMAGE\nOBJECT = IMAGE_MAP_PROJECTION\n\
        MAP_RESOLUTION = 4.0 <PIX/DEG>\nEND_OBJECT = IMAGE_MAP_PROJECTION\nEND\n";
    let mut data = Vec::new();
    for row in [[1.5f32, f32::from_bits(0xff7f_fffb)], [2.5, -3.5]] {
        data.extend([9, 9, 9]);
        row.iter().for_each(|v| data.extend(v.to_le_bytes()));
        data.push(9);
    }
    let map = read_labelled(label.as_bytes(), Cursor::new(&data), &ReadOptions::default()).unwrap();
    assert_eq!(heights(&map), [Some(1.5), None, Some(2.5), Some(-3.5)]);
    assert_eq!((map.geometry().pixel(), map.geometry().unit()), ([0.25; 2], MapUnit::Degree));
    for (from, to, expected) in [
        ("PC_REAL", "VAX_REAL", "VAX_REAL"),
        ("LINES = 2", "LINES = 3", "do not fit"),
        ("LINES = 2", "LINES = 0", "at least one pixel"),
        ("LINES = 2\n", "", "LINES: missing"),
        ("LINES = 2", "LINES = 18446744073709551615", "do not fit"),
        ("SAMPLE_BITS = 32", "SAMPLE_BITS = 12", "12 bits"),
        ("LINES = 2", "LINES = 2\nBANDS = 3", "3 bands"),
        ("MAP_RESOLUTION = 4.0", "MAP_RESOLUTION = -4.0", "must be positive"),
        ("MAP_RESOLUTION = 4.0", "MAP_RESOLUTION = 0", "must be positive and finite"),
    ] {
        let label = label.replace(from, to);
        let text = message(read_labelled(label.as_bytes(), Cursor::new(&data), &ReadOptions::default()));
        assert!(text.contains(expected), "{to}: {text}");
    }
}

#[test]
fn a_pds4_label_with_its_raster() {
    let read =
        |label: &str| read_labelled(label.as_bytes(), Cursor::new(pds4_data()), &ReadOptions::default());
    let map = read(PDS4).unwrap();
    assert_eq!(heights(&map), [Some(3.0), Some(5.0), Some(7.0), None, Some(11.0), Some(13.0)]);
    assert_eq!(map.geometry(), &Geometry::new(2, 3, [2.0; 2], [101.0, -51.0], MapUnit::Metre).unwrap());
    let turned = read(&PDS4.replace("Top to Bottom", "Bottom to Top")).unwrap();
    assert_eq!(heights(&turned), [None, Some(11.0), Some(13.0), Some(3.0), Some(5.0), Some(7.0)]);
    assert!(message(read_bytes(PDS4.as_bytes())).contains("read_labelled"));
    for (from, to, expected) in [
        ("IEEE754LSBSingle", "ComplexLSB8", "ComplexLSB8"),
        ("<elements>2", "<elements>3", "do not fit"),
        ("<elements>2", "<elements>0", "at least one pixel"),
        ("m/pixel\">2.0", "m/pixel\">-2.0", "must be positive"),
        ("m/pixel", "furlong/pixel", "unit"),
        ("Left to Right", "Right to Left", "Right to Left"),
        ("</axes>", "", "PDS4, label"),
        ("<axis_name>Line", "<axis_name>Band", "axis band"),
    ] {
        let text = message(read(&PDS4.replace(from, to)));
        assert!(text.contains(expected), "{to}: {text}");
    }
}

#[test]
fn pds4_types_in_both_byte_orders() {
    for (name, bytes, value) in [
        ("SignedMSB2", vec![0xff, 0xfe], -2.0),
        ("UnsignedLSB2", vec![1, 2], 513.0),
        ("SignedLSB4", vec![0xfe, 0xff, 0xff, 0xff], -2.0),
        ("IEEE754MSBSingle", 1.5f32.to_be_bytes().to_vec(), 1.5),
        ("IEEE754LSBDouble", 0.1f64.to_le_bytes().to_vec(), 0.1),
        ("UnsignedByte", vec![200], 200.0),
    ] {
        let label = PDS4
            .replace("IEEE754LSBSingle", name)
            .replace("<missing_constant>0xFF7FFFFB</missing_constant>", "");
        let data = [vec![0; 8], bytes.repeat(6)].concat();
        let map = read_labelled(label.as_bytes(), Cursor::new(data), &ReadOptions::default()).unwrap();
        assert!((map.height(1, 2).unwrap() - (2.0 * value + 1.0)).abs() < SINGLE, "{name}");
    }
}

#[test]
fn grey_pictures_of_8_and_16_bits() {
    let map = read_at_1m(&png(2, 2, false, &[0, 1, 128, 255])).unwrap();
    assert_eq!(heights(&map), some(&[0.0, 1.0, 128.0, 255.0]));
    let bytes = png(1, 2, true, &[0x12, 0x34, 0xff, 0xff]);
    let options = ReadOptions {
        pixel_m: Some(20.0),
        z_scale: 0.5,
        z_offset: -100.0,
        nodata: Some(65535.0),
        ..ReadOptions::default()
    };
    let map = read(Cursor::new(bytes), &options).unwrap();
    assert_eq!(heights(&map), [Some(2230.0), None]);
}
