//! `apsides terrain` and `apsides hazard` as a user meets them.
#![allow(clippy::unwrap_used)]

mod support;

use std::io::Cursor;
use std::path::Path;
use std::process::Output;

use apsides::terrain::ElevationMap;
use apsides::terrain::detect::{BoulderSearch, CraterSearch, boulders, craters};
use apsides::terrain::hazard::{SiteCriteria, hazard_map};
use apsides::terrain::io::{ReadOptions, read};
use apsides::terrain::probability::{Criteria, safe_landing, with_navigation_error};
use apsides::terrain::site::{SiteRequest, choose_sites};
use apsides::terrain::synthetic::{Synthetic, Terrain};

use support::{apsides, path, stderr};

/// Single precision of heights and probabilities in files.
const SINGLE: f64 = 1e-6;

/// Round-off of degrees from radians.
const ROUNDING_DEG: f64 = 1e-9;

fn json(o: &Output) -> serde_json::Value {
    serde_json::from_slice(&o.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(o)))
}

/// A generated map and its path.
fn generate(dir: &Path, rows: usize, cols: usize) -> (ElevationMap, String) {
    let file = path(&dir.join("map.tif"));
    let (r, c) = (rows.to_string(), cols.to_string());
    let o = apsides(&["terrain", "gen", &file, "--rows", &r, "--cols", &c, "--seed", "3", "--quiet"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    (read(Cursor::new(std::fs::read(&file).unwrap()), &ReadOptions::default()).unwrap(), file)
}

#[test]
fn a_generated_map_is_the_library_s_and_has_its_truth() {
    let dir = tempfile::tempdir().unwrap();
    let (file, truth) = (path(&dir.path().join("map.tif")), dir.path().join("truth"));
    let o = apsides(&[
        "terrain",
        "gen",
        &file,
        "--preset",
        "coarse",
        "--rows",
        "90",
        "--cols",
        "120",
        "--pixel",
        "2",
        "--seed",
        "9",
        "--truth",
        &path(&truth),
    ]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(o.stderr.is_empty());
    let written = read(Cursor::new(std::fs::read(&file).unwrap()), &ReadOptions::default()).unwrap();
    let terrain = Terrain { rows: 90, cols: 120, pixel: 2.0, ..Terrain::coarse() };
    let ground = Synthetic::new(terrain, 9).unwrap();
    let expected = ground.map().unwrap();
    for row in 0..90 {
        for col in 0..120 {
            assert_eq!(written.height(row, col), expected.height(row, col).map(|z| f64::from(z as f32)));
        }
    }
    let lines = |name: &str| std::fs::read_to_string(truth.join(name)).unwrap().lines().count() - 1;
    assert_eq!(lines("craters.csv"), ground.craters(0, 0, 90, 120).unwrap().len());
    assert_eq!(lines("boulders.csv"), ground.boulders(0, 0, 90, 120).unwrap().len());
    let v: serde_json::Value =
        serde_json::from_slice(&std::fs::read(truth.join("terrain.json")).unwrap()).unwrap();
    assert_eq!((&v["seed"], &v["terrain"]["rows"]), (&9.into(), &90.into()));
    assert!(truth.join("hazards.tif").is_file());

    let o = apsides(&["terrain", "info", &file, "--json"]);
    let v = json(&o);
    assert_eq!((&v["rows"], &v["cols"], &v["gaps"]), (&90.into(), &120.into(), &0.into()));
    assert_eq!(v["pixel"], serde_json::json!([2.0, 2.0]));
    let [low, high] = written.range().unwrap();
    assert!((v["height_min_m"].as_f64().unwrap() - low).abs() < SINGLE);
    assert!((v["height_max_m"].as_f64().unwrap() - high).abs() < SINGLE);
    let o = apsides(&["terrain", "info", &file]);
    let text = String::from_utf8_lossy(&o.stdout).into_owned();
    assert!(
        text.contains("90 x 120 pixels of 2 m, 240 m from west to east, 180 m from north to south"),
        "{text}"
    );
}

#[test]
fn hazards_and_sites_are_the_library_s() {
    let dir = tempfile::tempdir().unwrap();
    let (map, file) = generate(dir.path(), 330, 210);
    let out = dir.path().join("out");
    let arguments = ["hazard", &file, "--start", "100,40", "--sites", "3", "--separation", "2", "--json"];
    let o = apsides(&[&arguments[..], &["--out", &path(&out), "--threads", "2"]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(o.stderr.is_empty());
    let v = json(&o);
    let hazards = hazard_map(&map, &SiteCriteria::CHANG_E_3_FINE).unwrap();
    let counts = hazards.counts();
    assert_eq!(v["criteria_name"], "chang-e-3-fine");
    assert_eq!(v["safe_fraction"].as_f64().unwrap(), counts.safe_fraction());
    assert_eq!(v["pixels"]["safe"].as_u64().unwrap(), counts.safe);
    assert_eq!(v["pixels"]["unsafe"].as_u64().unwrap(), counts.unsafe_);
    assert_eq!(v["pixels"]["unknown"].as_u64().unwrap(), counts.unknown);
    let by: u64 = v["unsafe_by"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(by, counts.unsafe_);
    let request =
        SiteRequest { start: Some([100, 40]), count: 3, separation_m: 2.0, ..SiteRequest::default() };
    let sites = choose_sites(&map, &hazards, &request).unwrap().sites;
    assert!(!sites.is_empty());
    assert_eq!(v["sites"].as_array().unwrap().len(), sites.len());
    for (found, expected) in v["sites"].as_array().unwrap().iter().zip(&sites) {
        assert_eq!(found["row"].as_u64().unwrap(), expected.row as u64);
        assert_eq!(found["col"].as_u64().unwrap(), expected.col as u64);
        assert_eq!(found["clearance_m"].as_f64().unwrap(), expected.clearance_m);
        let (layer, value) = &expected.layers[0];
        assert_eq!(layer.name(), "slope");
        assert!((found["layers"]["slope_deg"].as_f64().unwrap() - value.to_degrees()).abs() < ROUNDING_DEG);
    }
    let table = std::fs::read_to_string(out.join("sites.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + sites.len());
    for name in ["slope_deg", "footpad_slope_deg", "roughness_m", "clearance_m"] {
        let bytes = std::fs::read(out.join(format!("{name}.tif"))).unwrap();
        let layer = read(Cursor::new(bytes), &ReadOptions::default()).unwrap();
        assert_eq!(layer.geometry(), map.geometry());
        let png = std::fs::read(out.join(format!("{name}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG"));
    }
    assert!(std::fs::read(out.join("map.png")).unwrap().starts_with(b"\x89PNG"));
    let saved: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("hazard.json")).unwrap()).unwrap();
    assert_eq!(saved, v);
    assert_eq!(v["files"].as_array().unwrap().len(), std::fs::read_dir(&out).unwrap().count());

    let o = apsides(&["hazard", &file, "--rule", "clearance", "--sites", "1"]);
    let text = String::from_utf8_lossy(&o.stdout).into_owned();
    assert!(text.contains("sites by clearance from row 165, column 105"), "{text}");
}

/// The presets of the contest are taken by name, say that they are unsafe in text, JSON and page, and write their layers.
#[test]
fn the_rules_of_the_contest_say_that_they_are_unsafe() {
    let dir = tempfile::tempdir().unwrap();
    let (map, file) = generate(dir.path(), 140, 120);
    let out = path(&dir.path().join("out"));
    let o = apsides(&["hazard", &file, "--criteria", "contest-fine", "--out", &out, "--json"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let v = json(&o);
    let hazards = hazard_map(&map, &SiteCriteria::CONTEST_FINE).unwrap();
    assert_eq!(v["pixels"]["safe"].as_u64().unwrap(), hazards.counts().safe);
    assert_eq!(v["warning"].as_str().unwrap(), SiteCriteria::CONTEST_FINE.unsafe_because().unwrap());
    assert!(v["sites"][0]["layers"]["edges"].as_f64().unwrap() < 0.4);
    assert!(v["sites"][0]["layers"]["median_normal_slope_deg"].as_f64().unwrap() <= 2.0);
    let page = std::fs::read_to_string(dir.path().join("out/hazard.html")).unwrap();
    assert!(page.contains("Warning: these criteria are unsafe"));
    for name in ["edges.tif", "edges.png", "median_normal_slope_deg.tif", "relative_elevation_m.tif"] {
        assert!(dir.path().join("out").join(name).is_file(), "{name}");
    }
    let text = |criteria: &str| {
        String::from_utf8_lossy(&apsides(&["hazard", &file, "--criteria", criteria]).stdout).into_owned()
    };
    assert!(text("contest-fine").contains("20 to 47 % breaks a limit"));
    assert!(
        !text("chang-e-3-fine").contains("unsafe:")
            && json(&apsides(&["hazard", &file, "--json"]))["warning"].is_null()
    );
    let (_, large) = generate(dir.path(), 700, 150);
    let o = apsides(&["hazard", &large, "--criteria", "contest-fine", "--memory", "3"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("`relative_elevation_max_m`: needs the whole map"), "{}", stderr(&o));
    assert!(stderr(&o).contains("give more with --memory"), "{}", stderr(&o));
}

#[test]
fn craters_boulders_and_probabilities_are_the_library_s() {
    let dir = tempfile::tempdir().unwrap();
    let (map, file) = generate(dir.path(), 330, 210);
    let out = dir.path().join("out");
    let asked = ["--craters", "2,20", "--boulders", "0.2", "--boulder-diameter", "2", "--noise", "0.02"];
    let directory = path(&out);
    let rest = ["--navigation-error", "0.5", "--out", &directory, "--json"];
    let o = apsides(&[&["hazard", &file][..], &asked, &rest].concat());
    assert!(matches!(o.status.code(), Some(0 | 3)), "{}", stderr(&o));
    let v = json(&o);
    let found = craters(&map, &CraterSearch { diameters: [2.0, 20.0], depth: 0.05 }).unwrap();
    assert_eq!(v["craters"].as_array().unwrap().len(), found.len());
    for (shown, crater) in v["craters"].as_array().unwrap().iter().zip(&found) {
        assert_eq!(shown["diameter_m"].as_f64().unwrap(), crater.diameter);
        assert_eq!(shown["depth_m"].as_f64().unwrap(), crater.depth);
    }
    let found = boulders(&map, &BoulderSearch { height: 0.2, diameter: 2.0 }, &|_| true).unwrap();
    assert_eq!(v["boulders"].as_array().unwrap().len(), found.len());
    let table = std::fs::read_to_string(out.join("boulders.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + found.len());
    // The limits of chang-e-3-fine.
    let limits =
        Criteria { radius: 2.5, slope: 8f64.to_radians(), roughness: 0.15, footpads: Some(2.5), noise: 0.02 };
    let expected =
        with_navigation_error(&safe_landing(&map, &limits, &|_| true).unwrap(), 0.5, &|_| true).unwrap();
    let bytes = std::fs::read(out.join("probability.tif")).unwrap();
    let written = read(Cursor::new(bytes), &ReadOptions::default()).unwrap();
    for row in [0, 100, 165] {
        for col in [0, 60, 105] {
            let (p, q) = (expected.get(row, col), written.height(row, col));
            assert!(p.is_nan() && q.is_none() || q.is_some_and(|q| (q - f64::from(p)).abs() < SINGLE));
        }
    }
    assert!(v["probability"]["largest"].as_f64().unwrap() <= 1.0);
    let o = apsides(&["hazard", &file, "--noise", "0.02", "--memory", "1"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("--noise"), "{}", stderr(&o));
}

#[test]
fn a_map_in_bands_has_the_same_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let (_, file) = generate(dir.path(), 700, 150);
    let run = |memory: &str, name: &str| {
        let out = path(&dir.path().join(name));
        let o = apsides(&["hazard", &file, "--memory", memory, "--json", "--out", &out]);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let mut v = json(&o);
        v["files"] = serde_json::Value::Null;
        v
    };
    let (whole, bands) = (run("1024", "whole"), run("3", "bands"));
    assert_eq!(whole["pixels"], bands["pixels"]);
    assert_eq!(whole["unsafe_by"], bands["unsafe_by"]);
    for (a, b) in whole["sites"].as_array().unwrap().iter().zip(bands["sites"].as_array().unwrap()) {
        assert_eq!((&a["row"], &a["col"], &a["visited"]), (&b["row"], &b["col"], &b["visited"]));
        assert_eq!(a["clearance_m"], b["clearance_m"]);
    }
    for name in ["verdict.tif", "clearance_m.tif"] {
        let bytes = |run: &str| std::fs::read(dir.path().join(run).join(name)).unwrap();
        assert!(bytes("whole") == bytes("bands"), "{name}");
    }
    assert!(dir.path().join("bands/map.png").is_file());
    assert!(!dir.path().join("bands/slope_deg.png").exists());
    let o = apsides(&["hazard", &file, "--memory", "3", "--rule", "score"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("--rule"), "{}", stderr(&o));
}

#[test]
fn criteria_come_from_a_file_and_no_site_is_said_so() {
    let dir = tempfile::tempdir().unwrap();
    let (map, file) = generate(dir.path(), 200, 200);
    let criteria = dir.path().join("mine.toml");
    std::fs::write(&criteria, "preset = \"chang-e-3-fine\"\nslope_max_deg = 0.001\n").unwrap();
    let o = apsides(&["hazard", &file, "--criteria", &path(&criteria), "--json"]);
    assert_eq!(o.status.code(), Some(3), "{}", stderr(&o));
    let v = json(&o);
    let mine = SiteCriteria { slope_max_deg: Some(0.001), ..SiteCriteria::CHANG_E_3_FINE };
    assert_eq!(v["pixels"]["safe"].as_u64().unwrap(), hazard_map(&map, &mine).unwrap().counts().safe);
    assert_eq!(v["criteria"]["slope_max_deg"], 0.001);
    assert_eq!(v["sites"].as_array().unwrap().len(), 0);
    let o = apsides(&["hazard", &file, "--criteria", &path(&criteria)]);
    assert!(String::from_utf8_lossy(&o.stdout).contains("no safe site"));
}

#[test]
fn bad_input_is_refused_with_status_2() {
    let dir = tempfile::tempdir().unwrap();
    let (_, file) = generate(dir.path(), 60, 80);
    let place = |name: &str| path(&dir.path().join(name));
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(place("short.tif"), &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(place("text.tif"), "not a map").unwrap();
    std::fs::write(place("misspelt.toml"), "preset = \"alhat\"\nslope_mx_deg = 3\n").unwrap();
    std::fs::write(place("range.toml"), "preset = \"alhat\"\nslope_max_deg = 120\n").unwrap();
    let refused = |arguments: &[&str], part: &str| {
        let o = apsides(arguments);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {}", stderr(&o));
        assert!(stderr(&o).contains(part), "{arguments:?}: {}", stderr(&o));
        assert!(o.stdout.is_empty());
    };
    refused(&["hazard", &place("none.tif")], "none.tif: no such file");
    refused(&["terrain", "info", &place("none.tif")], "none.tif: no such file");
    refused(&["hazard", &path(dir.path())], "is a directory");
    // More craters than memory holds: said before anything is written.
    let large = place("large.tif");
    refused(
        &["terrain", "gen", &large, "--rows", "20", "--cols", "20", "--pixel", "1e18"],
        "at most 2e7 are drawn at once: take smaller pixels, or fewer of them at once",
    );
    assert!(!Path::new(&large).exists());
    refused(&["terrain", "info", &place("short.tif")], "short.tif: ");
    refused(&["hazard", &place("text.tif")], "not the beginning of a GeoTIFF");
    refused(&["hazard", &file, "--criteria", &place("misspelt.toml")], "the nearest is `slope_max_deg`");
    refused(&["hazard", &file, "--criteria", &place("range.toml")], "above 0 and below 90");
    refused(&["hazard", &file, "--criteria", "alhatt"], "`alhat`");
    refused(&["hazard", &file, "--pixel", "-1"], "size of a pixel is -1: it must be positive");
    refused(&["hazard", &file, "--z-scale", "0"], "scale of heights is 0");
    refused(&["hazard", &file, "--start", "60,0"], "row 60, column 0 is outside the map of 60 x 80 pixels");
    refused(&["hazard", &file, "--start", "-1,0"], "row,column");
    refused(&["hazard", &file, "--separation", "-2"], "--separation");
    refused(&["hazard", &file, "--out", &file], "is a file");
    refused(&["terrain", "gen", &place("a.tif"), "--rows", "0"], "at least one pixel");
    refused(&["terrain", "gen", &place("a.tif"), "--pixel", "-0.1"], "size of a pixel is -0.1");
    refused(&["terrain", "gen", &place("no/such/a.tif"), "--rows", "9", "--cols", "9"], "no/such/a.tif");
    // A map without a size of its pixels: the program says how to give one.
    let npy = {
        let mut header = String::from("{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4), }");
        header.push_str(&" ".repeat(127 - 10 - header.len()));
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend([0; 64]);
        bytes
    };
    std::fs::write(place("flat.npy"), npy).unwrap();
    refused(&["terrain", "info", &place("flat.npy")], "--pixel");
    let o = apsides(&["terrain", "info", &place("flat.npy"), "--pixel", "0.5", "--json"]);
    assert_eq!((o.status.code(), &json(&o)["rows"]), (Some(0), &4.into()));
}

/// A map of GDAL in degrees on the Moon, and one that states no radius.
const IN_DEGREES: [&str; 2] = ["gdal_degrees_moon.tif", "tifffile_degrees.tif"];

/// Criteria that pixels of 60 m are not too large for.
const CRITERIA_AT_60_M: &str = "footprint_radius_m = 150\nfootpad_circle_radius_m = 120\nfootpad_radius_m = 0\n\
                                slope_max_deg = 20\nclearance_min_m = 0\n";

#[test]
fn a_map_in_degrees_is_read_with_the_radius_of_its_body() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../apsides-terrain/tests/io/written_elsewhere");
    let [moon, bare] = IN_DEGREES.map(|name| path(&folder.join(name)));
    let info = |arguments: &[&str]| apsides(&[&["terrain", "info"], arguments].concat());
    assert!(String::from_utf8_lossy(&info(&[&moon]).stdout).contains("pixels of 0.001953125 deg"));
    let on_moon = json(&info(&[&moon, "--body", "moon", "--json"]));
    let pixel = 1_737_400.0 * (1.0_f64 / 512.0).to_radians();
    assert_eq!(
        (on_moon["unit"].as_str(), on_moon["projection"]["radius_m"].as_f64()),
        (Some("m"), Some(1_737_400.0))
    );
    assert!((on_moon["pixel"][0].as_f64().unwrap() / pixel - 1.0).abs() < ROUNDING_DEG);
    assert!(
        String::from_utf8_lossy(&info(&[&moon, "--body", "moon"]).stdout)
            .contains("in degrees on a sphere of 1737.4 km")
    );
    // The body is asked for where the file states no radius, and contradicted where it states another.
    let dir = tempfile::tempdir().unwrap();
    let criteria = path(&dir.path().join("criteria.toml"));
    std::fs::write(&criteria, CRITERIA_AT_60_M).unwrap();
    let hazard = |map: &str, more: &[&str]| {
        apsides(&[&["hazard", map, "--criteria", &criteria, "--json"], more].concat())
    };
    for (arguments, said) in [
        (&[&bare as &str][..], "states no radius: name its body, as with --body moon"),
        (&[&moon, "--body", "earth"], "the file states 1737.4 km, and the body that is given has 6378"),
        (&[&moon, "--body", "pluto"], "moon"),
    ] {
        let o = hazard(arguments[0], &arguments[1..]);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&o).contains(said), "{}", stderr(&o));
    }
    let o = info(&[&generate(dir.path(), 9, 9).1, "--body", "moon"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("needs no body"), "{}", stderr(&o));
    // The radius of the file, and the same body by name, give the same sites, with their longitudes and latitudes.
    let [by_file, by_name] = [&[][..], &["--body", "moon"]].map(|more| json(&hazard(&moon, more)));
    assert_eq!(by_file["sites"], by_name["sites"]);
    let site = &by_file["sites"][0];
    let [row, latitude] = ["row", "latitude_deg"].map(|key| site[key].as_f64().unwrap());
    assert!((latitude - (26.0 - (row + 0.5) / 512.0)).abs() < ROUNDING_DEG, "{site}");
    assert_eq!(hazard(&bare, &["--body", "moon"]).status.code(), Some(0));
    // Its layers are in metres.
    let out = path(&dir.path().join("out"));
    assert_eq!(hazard(&moon, &["--out", &out]).status.code(), Some(0));
    let table = std::fs::read_to_string(dir.path().join("out/sites.csv")).unwrap();
    assert!(table.lines().next().unwrap().ends_with("longitude_deg,latitude_deg"), "{table}");
    let layer = read(
        Cursor::new(std::fs::read(dir.path().join("out/verdict.tif")).unwrap()),
        &ReadOptions::default(),
    );
    assert!((layer.unwrap().geometry().pixel()[0] / pixel - 1.0).abs() < ROUNDING_DEG);
}
