//! Layers, verdicts and sites on two maps, against an independent implementation in NumPy and SciPy (`f64`, written from the definitions):
//! `hazard_reference` of `truth.json`.
//!
//! Maps and reference are not part of the project; without their folder the tests are ignored.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::fs;
use std::io::Cursor;

use apsides_terrain::ElevationMap;
use apsides_terrain::hazard::{
    HazardMap, HazardOptions, Layer, LayerChoice, Plane, RobustFit, SiteCriteria, hazard_map,
    hazard_map_with, median_normal_angle,
};
use apsides_terrain::io::{ReadOptions, read};
use apsides_terrain::site::{SiteRequest, SiteRule, choose_sites};
use serde_json::Value;

use apsides_tests::shared;

/// Published: digits of the reference program, whose maps are stored in single precision.
const PUBLISHED: f64 = 1e-4;

/// Heights of a file, m. The last column of the boulder scene is none.
fn load(file: &str, pixel_m: f64) -> ElevationMap {
    let bytes = fs::read(shared(&format!("terrain/{file}"))).unwrap();
    let options = ReadOptions { pixel_m: Some(pixel_m), ..ReadOptions::default() };
    let map = read(Cursor::new(bytes), &options).unwrap();
    let (rows, cols) = (map.geometry().rows(), map.geometry().cols());
    let cols = if file.ends_with(".npy") { cols - 1 } else { cols };
    map.window(0, 0, rows, cols).unwrap()
}

fn truth(name: &str) -> Value {
    let path = shared("reference/change3-landing/truth.json");
    // The reference has NaN where a ratio has no denominator, which JSON has not.
    let text = fs::read_to_string(path).unwrap().replace("NaN", "null");
    serde_json::from_str::<Value>(&text).unwrap()["hazard_reference"][name].clone()
}

const LAYERS: [(Layer, &str); 4] = [
    (Layer::Slope, "slope"),
    (Layer::Roughness, "rough"),
    (Layer::FootpadSlope, "foot_max"),
    (Layer::FootpadSlopeLeast, "foot_min"),
];

/// A value in the unit of the reference, with what it may be off: 1e-3 deg, 1e-4 m.
fn in_unit(layer: Layer, value: f32) -> (f64, f64) {
    let value = f64::from(value);
    if layer.is_angle() { (value.to_degrees(), 1e-3) } else { (value, 1e-4) }
}

fn check(map: &ElevationMap, criteria: &SiteCriteria, name: &str) -> HazardMap {
    let truth = truth(name);
    let options = HazardOptions { layers: LayerChoice::All, plane: None };
    let hazards = hazard_map_with(map, criteria, &options).unwrap();
    let counts = hazards.counts();
    assert_eq!(counts.safe + counts.unsafe_, truth["evaluable"].as_u64().unwrap());
    assert_eq!(counts.safe, truth["safe_pixels"].as_u64().unwrap());
    assert_eq!(counts.safe_fraction(), truth["safe_fraction_of_evaluable"].as_f64().unwrap());

    let mut worst = [0.0_f64; 2];
    for (layer, key) in LAYERS {
        let raster = hazards.layer(layer).unwrap();
        for probe in truth["probes"].as_array().unwrap().iter().chain([&truth["spiral_site"]]) {
            let at = |key: &str| probe[key].as_u64().unwrap() as usize;
            let (value, tolerance) = in_unit(layer, raster.get(at("row"), at("col")));
            let off = (value - probe[key].as_f64().unwrap()).abs();
            worst[usize::from(layer.is_angle())] = worst[usize::from(layer.is_angle())].max(off);
            assert!(off < tolerance, "{layer} at {probe}: {value}");
        }
        // Percentiles over the pixels with a verdict, by linear interpolation.
        let verdicts = hazards.verdict().data();
        let known = verdicts
            .iter()
            .zip(raster.data())
            .filter(|(v, _)| **v != apsides_terrain::hazard::Verdict::Unknown);
        let mut values: Vec<f64> = known.map(|(_, value)| f64::from(*value)).collect();
        values.sort_by(f64::total_cmp);
        for (k, percent) in [1.0, 5.0, 25.0, 50.0, 75.0, 95.0, 99.0, 100.0].into_iter().enumerate() {
            let place = percent / 100.0 * (values.len() - 1) as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            let value = values[low] + part * (values[(low + 1).min(values.len() - 1)] - values[low]);
            let (value, tolerance) = in_unit(layer, value as f32);
            let off = (value - truth[format!("{key}_pct")][k].as_f64().unwrap()).abs();
            worst[usize::from(layer.is_angle())] = worst[usize::from(layer.is_angle())].max(off);
            assert!(off < tolerance, "{layer}, percentile {percent}: {value}");
        }
    }
    println!("{name}: off by {:.1e} m and {:.1e} deg at most", worst[0], worst[1]);

    let clearance = hazards.clearance();
    let (best, largest) = clearance
        .data()
        .iter()
        .enumerate()
        .fold((0, 0.0), |(best, largest), (k, &c)| if c > largest { (k, c) } else { (best, largest) });
    assert!((f64::from(largest) - truth["max_clearance_m"].as_f64().unwrap()).abs() < PUBLISHED);
    let cols = map.geometry().cols();
    assert_eq!(truth["site_max_clearance"], serde_json::json!([best / cols, best % cols]));
    let site = &truth["spiral_site"];
    let at = |key: &str| site[key].as_u64().unwrap() as usize;
    let there = f64::from(clearance.get(at("row"), at("col")));
    assert!((there - site["clearance_m"].as_f64().unwrap()).abs() < PUBLISHED);

    let spiral = choose_sites(map, &hazards, &SiteRequest::default()).unwrap();
    let found = &spiral.sites[0];
    assert_eq!((found.row, found.col), (at("row"), at("col")));
    assert_eq!(found.visited, site["visited"].as_u64().unwrap());
    assert!((found.height_m - site["z"].as_f64().unwrap()).abs() < PUBLISHED);
    assert_eq!(spiral.passed_over.iter().map(|(_, count)| count).sum::<u64>() + 1, found.visited);
    let request = SiteRequest { rule: SiteRule::Clearance, ..SiteRequest::default() };
    let roomy = &choose_sites(map, &hazards, &request).unwrap().sites[0];
    assert_eq!(truth["site_max_clearance"], serde_json::json!([roomy.row, roomy.col]));

    // The short cuts of verdicts alone change none.
    let options = HazardOptions { layers: LayerChoice::None, plane: None };
    let quick = hazard_map_with(map, criteria, &options).unwrap();
    assert_eq!(quick.verdict(), hazards.verdict());
    assert_eq!(hazard_map(map, criteria).unwrap().verdict(), hazards.verdict());
    hazards
}

/// The robust plane depends on the draws: the reference has a spread over three seeds, beyond which other draws may lie by as much.
fn check_plane(map: &ElevationMap, name: &str) {
    let truth = truth(name);
    let spread: Vec<f64> =
        truth["lmeds_seed_spread"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let least = spread.iter().copied().fold(f64::INFINITY, f64::min);
    let most = spread.iter().copied().fold(0.0, f64::max);
    for seed in 0..3 {
        let fit = RobustFit { seed, ..RobustFit::default() }.fit(map).unwrap();
        let slope = fit.plane.slope().to_degrees();
        println!(
            "{name}, seed {seed}: {slope:.4} deg, {} inliers; reference {least:.4} to {most:.4}",
            fit.inliers
        );
        assert!(slope > least - (most - least) && slope < most + (most - least));
    }
}

/// The plane of the reference: `z = a x + b y + c` with `x` along columns; its rows run as the sign says.
fn plane_of(truth: &Value, map: &ElevationMap) -> Plane {
    let number = |key: &str| truth["plane"][key].as_f64().unwrap();
    Plane {
        origin_m: map.geometry().north_west(),
        height_m: number("c"),
        east: number("a"),
        north: number("b"),
    }
}

fn check_normals(map: &ElevationMap, name: &str) {
    let truth = truth(name);
    let published = &truth["paper_median_normal_slope_at_probes"];
    let plane = plane_of(&truth, map);
    let options =
        HazardOptions { layers: LayerChoice::These(vec![Layer::RelativeElevation]), plane: Some(plane) };
    let hazards = hazard_map_with(map, &SiteCriteria::CHANG_E_3_COARSE, &options).unwrap();
    let relative = hazards.layer(Layer::RelativeElevation).unwrap().data();
    let largest = relative.iter().fold(0.0, |largest: f32, z| largest.max(z.abs()));
    assert!((f64::from(largest) - truth["rel_abs_max"].as_f64().unwrap()).abs() < PUBLISHED);
    for (probe, degrees) in
        truth["probes"].as_array().unwrap().iter().zip(published["deg"].as_array().unwrap())
    {
        let at = |key: &str| probe[key].as_u64().unwrap() as usize;
        let radius = published["rho_m"].as_f64().unwrap();
        let angle = median_normal_angle(map, &plane, at("row"), at("col"), radius).unwrap().unwrap();
        assert!((angle.to_degrees() - degrees.as_f64().unwrap()).abs() < 10.0 * PUBLISHED, "{probe}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn gale() {
    let map = load("gale_hirise_1m.tif", 1.0);
    check(&map, &SiteCriteria::CHANG_E_3_COARSE, "gale");
    check_plane(&map, "gale");
    check_normals(&map, "gale");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn boulders() {
    let map = load("rocky_scene_0p1m.npy", 0.1);
    check(&map, &SiteCriteria::CHANG_E_3_FINE, "moonx");
    check_plane(&map, "moonx");
    check_normals(&map, "moonx");
}
