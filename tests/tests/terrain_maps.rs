//! Maps from public archives, which are not part of the project: the tests are ignored where the folder does not have them.
#![allow(clippy::unwrap_used)]

use std::fs::File;

use apsides_terrain::MapUnit;
use apsides_terrain::io::{ReadOptions, Windows, read};

use apsides_tests::shared;

/// Published: digits that the labels of the maps print.
const PUBLISHED: f64 = 1e-3;

/// Published: half a unit of the last digit of heights, m.
const PUBLISHED_M: f64 = 0.005;

/// The same for the part of a map that has heights.
const PUBLISHED_PART: f64 = 0.005;

fn open(name: &str) -> File {
    File::open(shared(&format!("terrain/{name}"))).unwrap()
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn gale_from_hirise() {
    let file = open("gale_hirise_1m.tif");
    let map = read(file, &ReadOptions::default()).unwrap();
    let g = map.geometry();
    assert_eq!((g.rows(), g.cols(), g.square_pixel().unwrap(), map.gaps()), (337, 348, 1.0, 0));
    // Tie point of the corner in the file: 8142406 m, -276455 m.
    assert_eq!(g.north_west(), [8142406.5, -276455.5]);
    let [low, high] = map.range().unwrap();
    assert!((low + 4472.67).abs() < PUBLISHED_M && (high + 4437.88).abs() < PUBLISHED_M, "{low} {high}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn gale_from_ctx() {
    let file = open("gale_ctx_20m.tif");
    let map = read(file, &ReadOptions::default()).unwrap();
    let g = map.geometry();
    assert_eq!((g.rows(), g.cols()), (2100, 504));
    assert!((g.square_pixel().unwrap() - 20.0).abs() < PUBLISHED);
    let valid = 1.0 - map.gaps() as f64 / g.pixels() as f64;
    assert!((valid - 0.53).abs() < PUBLISHED_PART, "{valid}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn boulders_as_an_array() {
    let file = open("rocky_scene_0p1m.npy");
    let options = ReadOptions { pixel_m: Some(0.1), ..ReadOptions::default() };
    let map = read(file, &options).unwrap();
    assert_eq!((map.geometry().rows(), map.geometry().cols()), (501, 502));
    let [low, high] = map.range().unwrap();
    assert!(low.abs() < 1e-3 * PUBLISHED && (high - 3.981).abs() < 0.5 * PUBLISHED, "{low} {high}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn the_moon_in_degrees() {
    let file = open("moon_global_0p35deg.tif");
    let options = ReadOptions { z_scale: 0.5, ..ReadOptions::default() };
    let mut windows = Windows::open(file, &options).unwrap();
    let g = *windows.geometry();
    assert_eq!((g.rows(), g.cols(), g.unit()), (512, 1024, MapUnit::Degree));
    assert!((g.pixel()[0] - 0.3516).abs() < 0.1 * PUBLISHED);
    let window = windows.window(100, 200, 50, 60).unwrap();
    // Lunar heights stay within 11 km of the sphere.
    let [low, high] = window.range().unwrap();
    assert!(low > -11_000.0 && high < 11_000.0, "{low} {high}");
}
