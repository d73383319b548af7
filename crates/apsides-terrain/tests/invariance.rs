//! Hazard maps of any map turn with it, ignore its height, recover planes, never call a gap safe, and are the same in bands.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::sync::atomic::{AtomicUsize, Ordering};

use apsides_terrain::hazard::{
    Belly, HazardBand, HazardMap, HazardOptions, HazardSink, Layer, LayerChoice, Normals, Plane,
    SiteCriteria, Verdict, hazard_bands, hazard_map_watched, hazard_map_with,
};
use apsides_terrain::site::{SiteRequest, SiteRule, choose_sites};
use apsides_terrain::{ElevationMap, Geometry, TerrainError};
use proptest::prelude::*;

/// Round-off of single precision, in which rasters are stored.
const SINGLE: f32 = 1e-5;

/// Everything is tested, and about half of a rough map is safe.
const CRITERIA: SiteCriteria = SiteCriteria {
    footprint_radius_m: 2.3,
    footpad_circle_radius_m: 1.7,
    footpad_radius_m: 1.1,
    headings: 6,
    slope_max_deg: Some(8.0),
    footpad_slope_max_deg: Some(16.0),
    roughness_max_m: Some(0.5),
    roughness_rms_max_m: Some(0.3),
    step_max_m: Some(1.1),
    belly: Some(Belly { radius_m: 1.5, height_m: 0.6, clearance_min_m: 0.3 }),
    relative_elevation_max_m: Some(0.8),
    normals: Some(Normals { radius_m: 2.2, slope_max_deg: 40.0 }),
    edges_max: None,
    clearance_min_m: 1.0,
};

const PLANE: Plane = Plane { origin_m: [0.0, 0.0], height_m: 0.0, east: 0.0, north: 0.0 };

fn all() -> HazardOptions {
    HazardOptions { layers: LayerChoice::All, plane: Some(PLANE) }
}

fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Waves and noise, some of it gaps.
fn rough(rows: usize, cols: usize, gaps: f64, seed: u64) -> Vec<f64> {
    let mut random = numbers(seed);
    let phases = [random(), random(), random()].map(|p| 6.0 * p);
    (0..rows * cols)
        .map(|k| {
            let (row, col) = ((k / cols) as f64, (k % cols) as f64);
            let wave = (0.21 * col + phases[0]).sin() * (0.17 * row + phases[1]).cos()
                + (0.05 * row * col / 9.0 + phases[2]).sin();
            let height = 0.3 * wave + 0.4 * random();
            if random() < gaps { f64::NAN } else { height }
        })
        .collect()
}

fn map_of(rows: usize, cols: usize, heights: &[f64]) -> ElevationMap {
    ElevationMap::from_heights(Geometry::square(rows, cols, 1.0).unwrap(), heights).unwrap()
}

fn hazards(rows: usize, cols: usize, heights: &[f64]) -> HazardMap {
    hazard_map_with(&map_of(rows, cols, heights), &CRITERIA, &all()).unwrap()
}

/// Compares a map with another whose pixel is `to(row, col)`. Layers are `f32`.
fn agree(one: &HazardMap, other: &HazardMap, to: impl Fn(usize, usize) -> (usize, usize), tolerance: f32) {
    let geometry = one.geometry();
    for row in 0..geometry.rows() {
        for col in 0..geometry.cols() {
            let (r, c) = to(row, col);
            let mut open = false;
            for (layer, raster) in one.layers() {
                let (a, b) = (raster.get(row, col), other.layer(layer).unwrap().get(r, c));
                assert!(
                    (a.is_nan() && b.is_nan()) || (a - b).abs() <= tolerance,
                    "{layer} at {row} {col}: {a} {b}"
                );
                let limit = CRITERIA.limit(layer).map_or(f32::MAX, |limit| limit as f32);
                open |= (a.abs() - limit).abs() <= tolerance;
            }
            // A value that is its threshold within rounding may fall on either side.
            assert!(
                open || one.verdict().get(row, col) == other.verdict().get(r, c),
                "verdict at {row} {col}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn turns_and_mirrors_change_nothing(seed in any::<u64>(), gaps in prop_oneof![Just(0.0), 0.0..0.01]) {
        let (rows, cols) = (41, 70);
        let heights = rough(rows, cols, gaps, seed);
        let one = hazards(rows, cols, &heights);
        let mut turned = vec![0.0; rows * cols];
        let mut mirrored = turned.clone();
        for row in 0..rows {
            for col in 0..cols {
                // A quarter turn clockwise: the first row becomes the last column.
                turned[col * rows + rows - 1 - row] = heights[row * cols + col];
                mirrored[row * cols + cols - 1 - col] = heights[row * cols + col];
            }
        }
        agree(&one, &hazards(cols, rows, &turned), |row, col| (col, rows - 1 - row), SINGLE);
        agree(&one, &hazards(rows, cols, &mirrored), |row, col| (row, cols - 1 - col), SINGLE);
    }

    #[test]
    fn height_of_the_whole_map_changes_nothing(seed in any::<u64>(), constant in -5000.0..5000.0_f64) {
        let heights = rough(40, 40, 0.003, seed);
        let higher: Vec<f64> = heights.iter().map(|z| z + constant).collect();
        let plane = Plane { height_m: constant, ..PLANE };
        let options = HazardOptions { plane: Some(plane), ..all() };
        let other = hazard_map_with(&map_of(40, 40, &higher), &CRITERIA, &options).unwrap();
        agree(&hazards(40, 40, &heights), &other, |row, col| (row, col), SINGLE);
    }

    #[test]
    fn planes_are_recovered(east in -0.5..0.5_f64, north in -0.5..0.5_f64, height in -5000.0..5000.0_f64) {
        let (rows, cols) = (30, 33);
        let heights: Vec<f64> = (0..rows * cols)
            .map(|k| height + east * (k % cols) as f64 - north * (k / cols) as f64)
            .collect();
        let plane = Plane { origin_m: [0.0, 0.0], height_m: height, east, north };
        let options = HazardOptions { plane: Some(plane), ..all() };
        let found = hazard_map_with(&map_of(rows, cols, &heights), &CRITERIA, &options).unwrap();
        // Without width a footpad finds the plane itself.
        let points = SiteCriteria { footpad_radius_m: 0.0, ..CRITERIA };
        let points = hazard_map_with(&map_of(rows, cols, &heights), &points, &options).unwrap();
        let slope = east.hypot(north).atan() as f32;
        // Heights are rounded to 2^-21 m or less, over lengths of 1 m or more.
        let near = |layer: Layer, map: &HazardMap, value: f32| {
            map.layer(layer).unwrap().data().iter().all(|z| z.is_nan() || (z - value).abs() < 0.5 * SINGLE)
        };
        prop_assert!(near(Layer::Slope, &found, slope));
        prop_assert!(near(Layer::Roughness, &found, 0.0));
        prop_assert!(near(Layer::RoughnessRms, &found, 0.0));
        prop_assert!(near(Layer::RelativeElevation, &found, 0.0));
        prop_assert!(near(Layer::FootpadSlope, &points, slope));
        prop_assert!(near(Layer::FootpadSlopeLeast, &points, slope));
        prop_assert!(near(Layer::BellyClearance, &points, 0.6));
    }

    #[test]
    fn gaps_are_never_safe(seed in any::<u64>(), gaps in 0.0..0.05_f64) {
        let (rows, cols) = (50, 60);
        let heights = rough(rows, cols, gaps, seed);
        let found = hazards(rows, cols, &heights);
        let quick = HazardOptions { layers: LayerChoice::None, ..all() };
        let quick = hazard_map_with(&map_of(rows, cols, &heights), &CRITERIA, &quick).unwrap();
        prop_assert_eq!(quick.verdict(), found.verdict());
        for row in 0..rows {
            for col in 0..cols {
                let near = |r: usize, c: usize| {
                    let square = row.abs_diff(r).pow(2) + col.abs_diff(c).pow(2);
                    square as f64 <= CRITERIA.footprint_radius_m.powi(2)
                };
                let holes = (0..rows * cols).filter(|&k| heights[k].is_nan() && near(k / cols, k % cols)).count();
                if holes > 0 {
                    prop_assert_eq!(found.verdict().get(row, col), Verdict::Unknown);
                    prop_assert_eq!(found.clearance().get(row, col), 0.0);
                    prop_assert!(found.layer(Layer::Slope).unwrap().get(row, col).is_nan());
                }
            }
        }
    }
}

/// Puts a hazard map together again.
#[derive(Default)]
struct Together {
    layers: Vec<(Layer, Vec<f32>)>,
    verdict: Vec<Verdict>,
    clearance: Vec<f32>,
}

impl HazardSink for Together {
    fn band(&mut self, band: &HazardBand) -> Result<(), TerrainError> {
        for layer in Layer::ALL {
            // Edges are of whole maps.
            let Some(rows) = band.layer(layer) else { continue };
            match self.layers.iter_mut().find(|(l, _)| *l == layer) {
                Some((_, all)) => all.extend_from_slice(rows),
                None => self.layers.push((layer, rows.to_vec())),
            }
        }
        self.verdict.extend_from_slice(band.verdict);
        Ok(())
    }

    fn clearance(&mut self, _: usize, clearance: &[f32]) -> Result<(), TerrainError> {
        self.clearance.extend_from_slice(clearance);
        Ok(())
    }
}

#[test]
fn bands_and_threads_give_the_same_bits() {
    let (rows, cols) = (700, 300);
    let map = map_of(rows, cols, &rough(rows, cols, 1e-4, 7));
    let whole = hazard_map_with(&map, &CRITERIA, &all()).unwrap();
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    for (threads, band_rows) in [(1, 1), (2, 300), (3, 10_000)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut sink = Together::default();
        let counts = pool
            .install(|| hazard_bands(&mut &map, &CRITERIA, &all(), band_rows, &mut sink, &|_| true))
            .unwrap();
        assert_eq!(counts, whole.counts());
        assert_eq!(sink.verdict, whole.verdict().data());
        assert_eq!(bits(&sink.clearance), bits(whole.clearance().data()));
        for (layer, values) in &sink.layers {
            assert_eq!(bits(values), bits(whole.layer(*layer).unwrap().data()), "{layer}");
        }
    }
    assert!(whole.counts().safe > 1000, "{:?}", whole.counts());
}

/// Work that is ended leaves what is assessed as it is, and the rest unknown, on a whole map and in bands.
#[test]
fn ground_that_was_not_come_to_is_unknown() {
    let (rows, cols) = (700, 300);
    let map = map_of(rows, cols, &rough(rows, cols, 1e-4, 7));
    let whole = hazard_map_with(&map, &CRITERIA, &all()).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for allowed in [0, rows * cols / 2] {
        let (left, passed) = (AtomicUsize::new(allowed), AtomicUsize::new(0));
        let watch = |pixels: usize| {
            let take = |left: usize| left.checked_sub(pixels).filter(|_| left > 0);
            let passes = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok();
            passed.fetch_add(if passes { pixels } else { 0 }, Ordering::Relaxed);
            if !passes {
                left.store(0, Ordering::Relaxed);
            }
            passes
        };
        let part = pool.install(|| hazard_map_watched(&map, &CRITERIA, &all(), &watch)).unwrap();
        let assessed = passed.swap(0, Ordering::Relaxed);
        left.store(allowed, Ordering::Relaxed);
        assert!(assessed <= allowed && (assessed > 0) == (allowed > 0));
        let (mut same, mut unknown) = (0, 0);
        for (k, (part, whole)) in part.verdict().data().iter().zip(whole.verdict().data()).enumerate() {
            assert!(part == whole || *part == Verdict::Unknown, "pixel {k}");
            same += usize::from(part == whole);
            unknown += usize::from(*part == Verdict::Unknown);
        }
        assert!(same >= assessed && unknown >= rows * cols - assessed, "{same} {unknown} {assessed}");
        for (clear, whole) in part.clearance().data().iter().zip(whole.clearance().data()) {
            assert!(clear <= whole);
        }
        let mut sink = Together::default();
        let bands = || hazard_bands(&mut &map, &CRITERIA, &all(), 128, &mut sink, &watch);
        let counts = pool.install(bands).unwrap();
        let assessed = passed.load(Ordering::Relaxed);
        assert_eq!(counts.safe + counts.unsafe_ + counts.unknown, sink.verdict.len() as u64);
        assert!(counts.safe + counts.unsafe_ <= assessed as u64 && sink.verdict.len() < rows * cols);
        assert!((sink.verdict.len()..=sink.verdict.len() + 128 * cols).contains(&sink.clearance.len()));
        for (clear, whole) in sink.clearance.iter().zip(whole.clearance().data()) {
            assert!(clear <= whole);
        }
    }
}

#[test]
fn maps_of_gaps_and_of_one_pixel_have_no_site() {
    for (rows, cols, height) in [(1, 1, 0.0), (20, 30, f64::NAN), (3, 200, 1.0)] {
        let map = map_of(rows, cols, &vec![height; rows * cols]);
        let found = hazard_map_with(&map, &CRITERIA, &all()).unwrap();
        assert_eq!(found.counts().unknown, (rows * cols) as u64);
        assert!(found.clearance().data().iter().all(|c| *c == 0.0));
        for rule in [SiteRule::Spiral, SiteRule::Clearance, SiteRule::Score(Default::default())] {
            let choice = choose_sites(&map, &found, &SiteRequest { rule, ..Default::default() }).unwrap();
            assert!(choice.sites.is_empty() && choice.to_string().starts_with("no site"));
        }
    }
}

#[test]
fn sites_keep_their_distance_and_the_best_comes_first() {
    let (rows, cols) = (200, 220);
    let map = map_of(rows, cols, &rough(rows, cols, 0.0, 3));
    let found = hazard_map_with(&map, &CRITERIA, &all()).unwrap();
    for rule in [SiteRule::Spiral, SiteRule::Clearance, SiteRule::Score(Default::default())] {
        let request = SiteRequest { rule, start: Some([50, 60]), count: 4, separation_m: 15.0, rivals: 3 };
        let choice = choose_sites(&map, &found, &request).unwrap();
        assert_eq!((choice.sites.len(), choice.rivals.len()), (4, 3));
        let all: Vec<_> = choice.sites.iter().chain(choice.rivals.iter().map(|r| &r.site)).collect();
        for (k, site) in all.iter().enumerate() {
            assert_eq!(found.verdict().get(site.row, site.col), Verdict::Safe);
            assert!(site.clearance_m >= CRITERIA.clearance_min_m);
            for other in &all[..k] {
                let apart = (site.row as f64 - other.row as f64).hypot(site.col as f64 - other.col as f64);
                assert!(apart >= 15.0 && site.value <= other.value);
            }
        }
        assert!(choice.rivals.iter().all(|rival| rival.lost_to == 3 && rival.by >= 0.0));
        let text = choice.to_string();
        assert!(
            text.contains("site 4: row")
                && text.contains("lost to site 4 by")
                && text.contains("passed over")
        );
    }
    let outside = SiteRequest { start: Some([200, 0]), ..SiteRequest::default() };
    assert!(matches!(choose_sites(&map, &found, &outside), Err(TerrainError::Outside { .. })));
}

#[test]
fn criteria_are_checked_against_the_pixels() {
    let map = map_of(10, 10, &[0.0; 100]);
    let name = |criteria: SiteCriteria| match hazard_map_with(&map, &criteria, &all()) {
        Err(TerrainError::Number { name, .. }) => name,
        other => panic!("{:?}", other.map(|m| m.counts())),
    };
    assert_eq!(name(SiteCriteria { footprint_radius_m: 0.9, ..CRITERIA }), "footprint_radius_m");
    assert_eq!(name(SiteCriteria { footpad_circle_radius_m: 1e6, ..CRITERIA }), "footpad_circle_radius_m");
    // What is said is in metres, with what to do.
    let said = |footprint_radius_m: f64| {
        let criteria = SiteCriteria { footprint_radius_m, ..CRITERIA };
        hazard_map_with(&map, &criteria, &all()).err().unwrap().to_string()
    };
    assert_eq!(
        said(0.5),
        "footprint_radius_m is 0.5: pixels of 1 m are too coarse for it; take a map with pixels of at most 0.5 m, or criteria with at \
         least 1 m"
    );
    assert_eq!(
        said(1001.0),
        "footprint_radius_m is 1001: on pixels of 1 m it may be 1000 m at most, 1000 pixels; take criteria with less, or a coarser map"
    );
    let plane = HazardOptions { plane: None, ..all() };
    let found = hazard_bands(&mut &map, &CRITERIA, &plane, 64, &mut Together::default(), &|_| true);
    assert!(matches!(found, Err(TerrainError::Number { name: "relative_elevation_max_m", .. })));
    for edges_max in [0.4, f64::NAN] {
        let criteria = SiteCriteria { edges_max: Some(edges_max), ..CRITERIA };
        let found = hazard_bands(&mut &map, &criteria, &all(), 64, &mut Together::default(), &|_| true);
        assert!(matches!(found, Err(TerrainError::Number { name: "edges_max", .. })));
    }
    for radius_m in [1.9, 10.1] {
        let normals = Some(Normals { radius_m, slope_max_deg: 2.0 });
        assert_eq!(name(SiteCriteria { normals, ..CRITERIA }), "normals.radius_m");
    }
}
