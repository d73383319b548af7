//! The landing of Chang'e-3 on elevation maps: sites, diverts, what is said where there is none. Maps are smaller than those of the mission file.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use apsides::Outcome;
use apsides::terrain::interpolation::{Smoothness, Surface};
use apsides::terrain::io::{GeoTiffOptions, write_geotiff};
use apsides::terrain::site::selection::SiteSelection;
use apsides::terrain::{ElevationMap, Geometry};
use apsides_tests::shared;

/// Discretisation: stationarity where the tilt leaves its limit; 1e-5 elsewhere.
const STATIONARITY: f64 = 1e-4;
/// Solver: a divert that is prescribed, m.
const DIVERT_M: f64 = 1e-6;
/// Discretisation: the convex plan, in uniform gravity and with 20 intervals, against the flight, relative.
const UNIFORM_GRAVITY: f64 = 5e-3;
/// Discretisation: the height at which the engine is cut off, m.
const TOUCHDOWN_M: f64 = 1e-2;
/// Discretisation: the speed at touchdown, m/s.
const TOUCHDOWN_M_S: f64 = 1e-3;
/// Discretisation: the same stages as part of two missions, kg and s.
const SAME_PLAN: f64 = 1e-4;
/// Published: the last digit of safe fractions.
const PUBLISHED_FRACTION: f64 = 1e-5;

/// Discretisation: the height above a map that is held, between the points too, m.
const CLEARANCE_M: f64 = 1e-2;
/// Height of the hover above a ridge's far side, m.
const HOVER_M: f64 = 30.0;

/// Maps of 400 m and 50 m.
const SMALL: [&str; 3] = ["terrain.coarse_width_m=400", "terrain.fine_width_m=50", "terrain.candidates=8"];

/// Discretisation: the distance on the ground against that in space, relative; the Moon turns by less than half a
/// degree.
const TURN_OF_THE_MOON: f64 = 0.01;

fn mission(overrides: &[&str]) -> apsides::Pipeline {
    let overrides: Vec<String> = SMALL.iter().chain(overrides).map(|o| (*o).to_owned()).collect();
    apsides::load("chang-e-3", &overrides).unwrap()
}

fn landed(overrides: &[&str]) -> Outcome {
    let outcome = flown(overrides);
    let failures: Vec<_> = outcome.summary.certificate.failures().collect();
    assert!(failures.is_empty(), "{failures:#?}");
    outcome
}

/// Feasible; where the tilt leaves its limit, the stationarity is met to 1e-4 instead of 1e-5.
fn flown(overrides: &[&str]) -> Outcome {
    let outcome = mission(overrides).solve(None, &mut ()).unwrap();
    assert_eq!(outcome.summary.status, "optimal", "{:?}", outcome.explanation);
    for check in outcome.summary.certificate.failures() {
        assert!(check.name.contains("stationarity") && check.value < STATIONARITY, "{check:#?}");
    }
    outcome
}

fn refused(overrides: &[&str]) -> String {
    mission(overrides).solve(None, &mut ()).map(|o| o.summary.status).unwrap_err().to_string()
}

#[test]
fn sites_are_safe_and_the_flight_ends_above_the_second() {
    let outcome = landed(&[]);
    let sites: Vec<&SiteSelection> = outcome.decisions.sites.iter().filter_map(|s| s.choice_as()).collect();
    let [coarse, fine] = sites[..] else { panic!("two sites") };
    for site in [coarse, fine] {
        let chosen = site.site();
        let criteria = site.hazards.criteria();
        assert!(chosen.site.clearance_m >= criteria.clearance_min_m);
        for (layer, value) in &chosen.site.layers {
            assert!(criteria.limit(*layer).is_none_or(|limit| *value <= limit), "{layer:?} {value}");
        }
        assert!(chosen.tilt.unwrap().to_degrees() <= 8.0);
        // The cheapest that stands on its pads.
        assert!(site.candidates[..site.chosen].iter().all(|c| c.cost <= chosen.cost));
    }
    let results = &outcome.summary.results;
    for (site, key) in [(coarse, "coarse_divert_m"), (fine, "fine_divert_m")] {
        let [east, north, _] = site.site().offset;
        assert!((results[key] - east.hypot(north)).abs() < DIVERT_M, "{key}");
    }
    // The convex plan, in uniform gravity and with 20 intervals, and the flight: the rule that thrust never falls below its least upward part
    // costs the flight a little more.
    let flown = results["avoidance_propellant_kg"];
    let planned = coarse.site().divert.propellant.unwrap();
    assert!((flown / planned - 1.0).abs() < UNIFORM_GRAVITY, "{flown} {planned}");
    // 4 m above the ground at the site.
    let rise: f64 = [coarse, fine].map(|s| s.site().offset[2]).iter().sum();
    let last = outcome.trajectory.phases.last().unwrap().final_state();
    assert!((last[0] - 1_737_013.0 - rise - 4.0).abs() < TOUCHDOWN_M);
    assert!((results["touchdown_speed_m_s"] - 3.6055).abs() < TOUCHDOWN_M_S);
    distance_on_the_ground(&outcome, results["coarse_divert_m"] + results["fine_divert_m"]);
}

/// The profile goes forward to above the site that is aimed at; from there diverts lead anywhere, by their length at most.
fn distance_on_the_ground(outcome: &Outcome, diverts: f64) {
    let title = "Altitude over distance on the ground";
    let profile = outcome.curves.iter().find(|c| c.title == title).unwrap();
    assert_eq!(profile.series.len(), 6);
    let distances = |k: std::ops::Range<usize>| -> Vec<f64> {
        profile.series[k].iter().flat_map(|(_, points)| points).map(|[distance, _]| *distance).collect()
    };
    let (steered, vertical) = (distances(0..2), distances(2..6));
    assert!(steered.windows(2).all(|pair| pair[1] >= pair[0]), "{steered:?}");
    let aimed = steered[steered.len() - 1];
    let off = vertical.iter().map(|distance| (distance - aimed).abs()).fold(0.0, f64::max);
    assert!(off <= diverts + TOUCHDOWN_M, "{off} {diverts}");
    // The Moon turns by less than half a degree: 440 km in inertial space.
    let downrange = outcome.summary.results["downrange_km"];
    assert!((aimed / 1e3 - downrange).abs() < TURN_OF_THE_MOON * downrange, "{aimed} {downrange}");
}

/// By the rule of the contest each site is the first safe pixel on the spiral that a divert reaches; a warning names each map whose criteria
/// are unsafe, and none where they are not.
#[test]
fn the_rule_of_the_contest_flies_to_the_first_safe_site() {
    let spiral = "terrain.rule=spiral";
    let contest = ["terrain.coarse_criteria=contest-coarse", "terrain.fine_criteria=contest-fine"];
    for (criteria, warnings) in [(&contest[..], 2), (&[], 0)] {
        let outcome = flown(&[&[spiral], criteria].concat());
        let said: Vec<_> =
            outcome.summary.warnings.iter().filter(|w| w.contains("criteria are unsafe")).collect();
        assert_eq!(said.len(), warnings, "{said:?}");
        let sites: Vec<&SiteSelection> =
            outcome.decisions.sites.iter().filter_map(|s| s.choice_as()).collect();
        assert_eq!(sites.len(), 2);
        for selection in sites {
            let chosen = selection.site();
            let [rows, cols] = [selection.map.geometry().rows(), selection.map.geometry().cols()];
            let first = apsides::terrain::site::spiral(selection.below, rows, cols).find(|&[row, col]| {
                let safe =
                    selection.hazards.verdict().get(row, col) == apsides::terrain::hazard::Verdict::Safe;
                let clearance = f64::from(selection.hazards.clearance().get(row, col));
                safe && clearance >= selection.hazards.criteria().clearance_min_m
            });
            assert_eq!(first, Some([chosen.site.row, chosen.site.col]), "{}", selection.name);
        }
    }
}

/// The flight before the decision is the plan without maps.
#[test]
fn what_was_flown_before_stays() {
    let flat =
        apsides::load("chang-e-3-flat", &["hover_time_s=5".into()]).unwrap().solve(None, &mut ()).unwrap();
    let outcome = landed(&["terrain.seed=3"]);
    for key in ["braking_propellant_kg", "adjustment_propellant_kg", "braking_time_s", "adjustment_time_s"] {
        let (a, b) = (outcome.summary.results[key], flat.summary.results[key]);
        assert!((a - b).abs() < SAME_PLAN, "{key}: {a} {b}");
    }
    let more = outcome.summary.results["propellant_kg"] - flat.summary.results["propellant_kg"];
    assert!(more > 0.0 && more < 5.0, "{more}");
}

/// A result can be asked for again with the sites that were chosen.
#[test]
fn a_site_can_be_given() {
    let sites = ["coarse_site_east_m=120", "coarse_site_north_m=-50", "coarse_site_up_m=3"];
    let fine = ["fine_site_east_m=0", "fine_site_north_m=0", "fine_site_up_m=0"];
    let given: Vec<String> = sites.iter().chain(&fine).map(|k| format!("decided.{k}")).collect();
    let given: Vec<&str> = given.iter().map(String::as_str).collect();
    let outcome = landed(&given);
    assert!(outcome.decisions.sites.is_empty());
    assert!((outcome.summary.results["coarse_divert_m"] - 130.0).abs() < DIVERT_M);
    assert!(!outcome.summary.results.contains_key("fine_divert_m"));
}

#[test]
fn what_cannot_be_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let criteria = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let smooth = criteria("smooth.toml", "preset = \"chang-e-3-coarse\"\nroughness_max_m = 0.001\n");
    let error = refused(&[&format!("terrain.coarse_criteria={smooth}")]);
    assert!(error.contains("coarse map: no safe site among") && error.contains("roughness"), "{error}");
    assert!(error.contains("would allow it"), "{error}");
    let wide = criteria("wide.toml", "preset = \"chang-e-3-fine\"\nclearance_min_m = 40\n");
    let error = refused(&[&format!("terrain.fine_criteria={wide}")]);
    assert!(error.contains("fine map: no site") && error.contains("the widest place"), "{error}");
    let error = refused(&["terrain.coarse=nowhere.tif"]);
    assert!(error.contains("nowhere.tif") && error.contains("`terrain.coarse` takes"), "{error}");
}

/// A map that is safe only far from where the lander is.
#[test]
fn out_of_reach_is_said_with_the_nearest_site() {
    let geometry = apsides::terrain::Geometry::square(801, 801, 1.0).unwrap();
    let height = |k: usize| {
        let (row, col) = (k / 801, k % 801);
        // Smooth in the south-eastern corner alone.
        if row > 740 && col > 740 { 0.0 } else { ((row * 7 + col * 13) % 5) as f64 }
    };
    let heights: Vec<f64> = (0..801 * 801).map(height).collect();
    let map = apsides::terrain::ElevationMap::from_heights(geometry, &heights).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("corner.tif");
    let file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    apsides::terrain::io::write_geotiff(file, &map, apsides::terrain::io::GeoTiffOptions::default()).unwrap();
    let coarse = format!("terrain.coarse={}", path.display());
    let error = refused(&[&coarse, "terrain.coarse_tilt_limit_deg=1", "dry_mass_kg=1250"]);
    for words in
        ["none of 8 safe sites is within reach", "m away", "out of reach by", "terrain.coarse_tilt_limit_deg"]
    {
        assert!(error.contains(words), "{words}: {error}");
    }
    // With the tilt of the mission it is.
    let outcome = flown(&[&coarse]);
    assert!(outcome.summary.sites[0].below.starts_with("unsafe"), "{:?}", outcome.summary.sites[0]);
    assert!(outcome.summary.results["coarse_divert_m"] > 480.0);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]
fn real_maps() {
    let [coarse, fine] =
        ["gale_hirise_1m.tif", "rocky_scene_0p1m.npy"].map(|name| shared(&format!("terrain/{name}")));
    let (coarse, fine) =
        (format!("terrain.coarse={}", coarse.display()), format!("terrain.fine={}", fine.display()));
    let outcome = flown(&[&coarse, &fine, "terrain.coarse_pixel_m=1", "terrain.fine_pixel_m=0.1"]);
    // Those of tests/terrain_reference.rs, where the second map has lost its last column.
    let safe: Vec<f64> = outcome.summary.sites.iter().map(|s| s.safe_fraction).collect();
    assert!(
        (safe[0] - 0.47716).abs() < PUBLISHED_FRACTION && (safe[1] - 0.23524).abs() < PUBLISHED_FRACTION,
        "{safe:?}"
    );
}

/// A ridge of 140 m, its top 360 m east of the middle, in front of a site 400 m east.
fn ridge() -> ElevationMap {
    let geometry = Geometry::square(301, 901, 1.0).unwrap();
    let height = |k: usize| {
        let [east, _] = geometry.position((k / 901) as f64, (k % 901) as f64);
        let [middle, _] = geometry.position(150.0, 450.0);
        let way = (east - middle - 360.0) / 30.0;
        if way.abs() < 1.0 { 140.0 * (std::f64::consts::FRAC_PI_2 * way).cos().powi(2) } else { 0.0 }
    };
    ElevationMap::from_heights(geometry, &(0..301 * 901).map(height).collect::<Vec<_>>()).unwrap()
}

/// Least height above the map along the coarse avoidance, m: its start is above the middle of the map, its course is to the east.
fn least_height(outcome: &Outcome, map: &ElevationMap) -> f64 {
    let body_radius = outcome_radius(outcome);
    let surface = Surface::new(map, Smoothness::C2).unwrap();
    let middle = map.geometry().position(150.0, 450.0);
    let phase = outcome.trajectory.phases.iter().find(|p| p.name == "avoidance").unwrap();
    let height = |k: usize| {
        let mut x = [0.0; 5];
        phase.state.evaluate(phase.time_at(k as f64 / 1000.0), &mut x);
        let [radius, angle, ..] = x;
        radius - body_radius - surface.height_at([middle[0] + angle * body_radius, middle[1]]).unwrap()
    };
    (0..=1000).map(height).fold(f64::INFINITY, f64::min)
}

/// Distance from the centre of the ground below the start: the hover is 100 m above ground of that height.
fn outcome_radius(outcome: &Outcome) -> f64 {
    let phase = outcome.trajectory.phases.iter().find(|p| p.name == "avoidance").unwrap();
    let mut x = [0.0; 5];
    phase.state.evaluate(phase.final_time, &mut x);
    x[0] - HOVER_M
}

/// Over a ridge the shortest way is too low; held above the map it costs propellant and keeps the height that is asked for.
#[test]
fn the_height_above_a_map_is_held_on_the_way() {
    let dir = tempfile::tempdir().unwrap();
    let (path, map) = (dir.path().join("ridge.tif"), ridge());
    write_geotiff(std::fs::File::create(&path).unwrap(), &map, GeoTiffOptions::default()).unwrap();
    let file = format!("terrain.coarse={}", path.display());
    let hover = format!("hover_altitude_m={HOVER_M}");
    let decided = [
        &file,
        &hover,
        "decided.coarse_site_east_m=400",
        "decided.coarse_site_north_m=0",
        "decided.coarse_site_up_m=0",
        "terrain.fine=none",
        "fine_avoidance_end_altitude_m=20",
    ];
    let free = flown(&decided);
    let lowest = least_height(&free, &map);
    let wanted = 0.5 * (lowest + HOVER_M);
    assert!(lowest < HOVER_M - 5.0, "{lowest}");
    let held = flown(&[&decided[..], &[&format!("terrain.coarse_clearance_m={wanted}")]].concat());
    let kept = least_height(&held, &map);
    assert!((kept - wanted).abs() < CLEARANCE_M, "{kept} {wanted}");
    assert!(held.summary.results["final_mass_kg"] < free.summary.results["final_mass_kg"]);
    let high = decided.iter().chain(&["terrain.coarse_clearance_m=100"]).map(|o| (*o).to_owned());
    let refused = apsides::load("chang-e-3", &high.collect::<Vec<_>>()).unwrap_err().to_string();
    assert!(
        refused.contains("`terrain.coarse_clearance_m` is 100, it must be below `hover_altitude_m`"),
        "{refused}"
    );
}
