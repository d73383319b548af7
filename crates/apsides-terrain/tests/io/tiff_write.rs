//! Written GeoTIFF read again.

use std::io::Cursor;

use apsides_terrain::io::{GeoTiffOptions, GeoTiffWriter, ReadOptions, Windows, read, write_geotiff};
use apsides_terrain::{ElevationMap, Geometry, MapUnit, TerrainError};

use super::read_bytes;
use super::samples::{Tag, Tiff, keys, place};

fn map() -> ElevationMap {
    let geometry = Geometry::new(300, 401, [0.5, 0.25], [1234.25, -77.5], MapUnit::Metre).unwrap();
    let heights: Vec<f64> = (0..300 * 401)
        .map(|k| if k % 17 == 0 { f64::NAN } else { -4450.0 + f64::from((k * 7919 % 1000) as f32 / 64.0) })
        .collect();
    ElevationMap::from_heights(geometry, &heights).unwrap()
}

#[test]
fn a_written_map_is_read_back() {
    let map = map();
    for deflate in [false, true] {
        for nodata in [None, Some(-32767.0)] {
            let options = GeoTiffOptions { deflate, nodata, ..GeoTiffOptions::default() };
            let bytes = write_geotiff(Cursor::new(Vec::new()), &map, options).unwrap().into_inner();
            let again = read_bytes(&bytes).unwrap();
            assert_eq!(again.geometry(), map.geometry());
            assert_eq!(again.gaps(), map.gaps());
            for (row, col) in [(0, 1), (299, 400), (150, 201)] {
                assert_eq!(again.height(row, col).unwrap() as f32, map.height(row, col).unwrap() as f32);
            }
        }
    }
}

#[test]
fn degrees_and_geokeys_survive() {
    let geometry = Geometry::new(2, 2, [0.5; 2], [10.25, 19.75], MapUnit::Degree).unwrap();
    let map = ElevationMap::from_heights(geometry, &[1.0, 2.0, 3.0, 4.0]).unwrap();
    let bytes = write_geotiff(Cursor::new(Vec::new()), &map, GeoTiffOptions::default()).unwrap().into_inner();
    assert_eq!(read_bytes(&bytes).unwrap(), map);

    // Keys of a map whose pixels are points: written as areas, at the same place.
    let mut file = Tiff::new(2, 2, vec![1.0, 2.0, 3.0, 4.0]);
    file.tags = place(2.0, 100.0, 50.0);
    file.tags.push(keys(&[(1024, 1), (1025, 2), (3072, 32767), (3076, 9001)]));
    file.tags.push(Tag::Text(34737, "Mars2000 Equidistant Cylindrical|"));
    let source = read_bytes(&file.bytes()).unwrap();
    let windows = Windows::open(Cursor::new(file.bytes()), &ReadOptions::default()).unwrap();
    let geo_keys = windows.geo_keys().cloned();
    assert_eq!(geo_keys.as_ref().unwrap().text, "Mars2000 Equidistant Cylindrical|");
    let options = GeoTiffOptions { geo_keys, ..GeoTiffOptions::default() };
    let bytes = write_geotiff(Cursor::new(Vec::new()), &source, options).unwrap().into_inner();
    assert_eq!(read_bytes(&bytes).unwrap(), source);
    let again = Windows::open(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
    let kept = again.geo_keys().unwrap();
    assert_eq!((kept.short(1025), kept.short(3072)), (Some(1), Some(32767)));
    assert_eq!(kept.text, "Mars2000 Equidistant Cylindrical|");
}

#[test]
fn bands_of_any_height_make_the_same_file() {
    let geometry = Geometry::square(1000, 300, 1.0).unwrap();
    let heights: Vec<f32> = (0..300_000).map(|k| (k % 977) as f32).collect();
    let write = |rows: usize| {
        let mut file =
            GeoTiffWriter::new(Cursor::new(Vec::new()), geometry, GeoTiffOptions::default()).unwrap();
        heights.chunks(300 * rows).for_each(|band| file.write_rows(band).unwrap());
        file.finish().unwrap().into_inner()
    };
    assert_eq!(write(1), write(333));
    let map = read(Cursor::new(write(7)), &ReadOptions::default()).unwrap();
    assert_eq!(map.height(999, 299), Some(f64::from(heights[299_999])));
}

#[test]
fn rows_too_many_or_too_few_are_refused() {
    let geometry = Geometry::square(2, 3, 1.0).unwrap();
    let new = || GeoTiffWriter::new(Cursor::new(Vec::new()), geometry, GeoTiffOptions::default()).unwrap();
    let mut file = new();
    assert!(matches!(file.write_rows(&[0.0; 4]), Err(TerrainError::Shape { .. })));
    assert!(matches!(file.write_rows(&[0.0; 9]), Err(TerrainError::Shape { .. })));
    file.write_rows(&[0.0; 3]).unwrap();
    assert!(matches!(file.finish(), Err(TerrainError::Shape { .. })));
}
