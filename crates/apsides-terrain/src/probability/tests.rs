use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use super::*;
use crate::Geometry;
use crate::synthetic::{Synthetic, Terrain};

/// Discretisation: a normal distribution on pixels of a quarter of its deviation.
const EDGE: f64 = 2e-3;

/// Discretisation: the same at the edge of the map, half of a row of pixels.
const EDGE_OF_MAP: f64 = 0.01;

/// Published: the error that Abramowitz and Stegun give, 1.5e-7, in the last digit.
const PUBLISHED: f64 = 2e-7;

/// A map with white noise.
fn noisy(map: &ElevationMap, noise: f64, seed: u64) -> ElevationMap {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut relative = map.relative().clone();
    for z in relative.data_mut() {
        let error: f64 = StandardNormal.sample(&mut random);
        *z += (noise * error) as f32;
    }
    ElevationMap::from_relative(relative, map.datum()).unwrap()
}

/// The plain method: both limits on the heights as they are.
fn plain(map: &ElevationMap, criteria: &Criteria) -> Vec<Option<bool>> {
    let pixel = map.geometry().square_pixel().unwrap();
    let heights = map.relative();
    let (disk, sums) = (Disk::new(criteria.radius, pixel), RowSums::new(heights));
    let cols = map.geometry().cols();
    let judge = |k: usize| {
        let (row, col) = (k / cols, k % cols);
        let plane = sums.plane(&disk, row, col)?;
        let [east, south] = plane.rise;
        let slope = east.hypot(south) / pixel;
        let mut largest: f64 = 0.0;
        for (i, &w) in disk.half.iter().enumerate() {
            let line = heights.row(row + i - disk.reach);
            let first = plane.height + south * (i as f64 - disk.reach as f64) - east * w as f64;
            for (j, z) in line[col - w..=col + w].iter().enumerate() {
                largest = largest.max((f64::from(*z) - first - east * j as f64).abs());
            }
        }
        Some(slope <= criteria.slope.tan() && largest / (1.0 + slope * slope).sqrt() <= criteria.roughness)
    };
    (0..map.geometry().pixels()).into_par_iter().map(judge).collect()
}

/// Declared-safe pixels that are not, over the declared-safe, and safe pixels not declared, over the safe.
#[derive(Clone, Copy, Default)]
struct Rates {
    declared: usize,
    falsely: usize,
    safe: usize,
    missed: usize,
}

impl Rates {
    fn count(&mut self, truth: &[Option<bool>], declared: impl Fn(usize) -> bool) {
        for (k, truth) in truth.iter().enumerate() {
            let Some(truth) = *truth else { continue };
            let declared = declared(k);
            self.declared += usize::from(declared);
            self.falsely += usize::from(declared && !truth);
            self.safe += usize::from(truth);
            self.missed += usize::from(truth && !declared);
        }
    }

    fn false_safe(&self) -> f64 {
        self.falsely as f64 / self.declared.max(1) as f64
    }

    fn missed_safe(&self) -> f64 {
        self.missed as f64 / self.safe as f64
    }
}

/// A kind of ground, its criteria, and for each noise the largest part of safe ground that may be missed.
struct Case {
    name: &'static str,
    terrain: Terrain,
    size: usize,
    radius: f64,
    roughness: f64,
    missed: [f64; 3],
}

/// Noise of 0.02, 0.05 and 0.10 m on four seeds of both kinds of ground, truth by the plain method without noise: of the ground
/// declared safe at the decision threshold less than 1 % is not, and at 0.05 m at least half of the safe ground is kept.
#[test]
fn rates_of_false_and_missed_safe_ground() {
    let cases = [
        Case {
            name: "1 m pixels",
            terrain: Terrain::coarse(),
            size: 400,
            radius: 5.0,
            roughness: 0.30,
            missed: [0.12, 0.4, 0.75],
        },
        Case {
            name: "0.1 m pixels",
            terrain: Terrain::fine(),
            size: 400,
            radius: 2.5,
            roughness: 0.15,
            missed: [0.4, 0.5, 1.0],
        },
    ];
    for case in cases {
        let mut rates = [[Rates::default(); 2]; 3];
        for seed in 1..=4 {
            let terrain = Terrain { rows: case.size, cols: case.size, ..case.terrain };
            let map = Synthetic::new(terrain, seed).unwrap().map().unwrap();
            let mut truth = Vec::new();
            for (noise, [by_limits, by_probability]) in [0.02, 0.05, 0.10].into_iter().zip(&mut rates) {
                let criteria = Criteria {
                    radius: case.radius,
                    slope: 8.0_f64.to_radians(),
                    roughness: case.roughness,
                    footpads: None,
                    noise,
                };
                if truth.is_empty() {
                    truth = plain(&map, &criteria);
                }
                let seen = noisy(&map, noise, 100 + seed);
                let limits = plain(&seen, &criteria);
                by_limits.count(&truth, |k| limits[k] == Some(true));
                let safe = safe_landing(&seen, &criteria, &|_| true).unwrap();
                by_probability.count(&truth, |k| f64::from(safe.data()[k]) >= DECISION);
            }
        }
        for (([a, b], missed), noise) in rates.iter().zip(case.missed).zip([0.02, 0.05, 0.10]) {
            println!(
                "{}, noise {noise:.2} m: limits {:.4} false, {:.4} missed; probability {:.4} false, {:.4} missed",
                case.name,
                a.false_safe(),
                a.missed_safe(),
                b.false_safe(),
                b.missed_safe()
            );
            assert!(b.false_safe() < 0.01 && b.missed_safe() <= missed);
        }
    }
}

fn ground(size: usize) -> ElevationMap {
    Synthetic::new(Terrain { rows: size, cols: size, ..Terrain::coarse() }, 3).unwrap().map().unwrap()
}

const CRITERIA: Criteria =
    Criteria { radius: 5.0, slope: 0.14, roughness: 0.3, footpads: Some(2.5), noise: 0.05 };

#[test]
fn the_same_on_any_number_of_threads_and_unknown_beside_gaps() {
    let mut relative = ground(90).relative().clone();
    relative.data_mut()[40 * 90 + 50] = f32::NAN;
    let map = ElevationMap::from_relative(relative, 0.0).unwrap();
    let results: Vec<Vec<u32>> = [1, 3]
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let safe = pool.install(|| safe_landing(&map, &CRITERIA, &|_| true)).unwrap();
            let aimed = pool.install(|| with_navigation_error(&safe, 2.0, &|_| true)).unwrap();
            safe.data().iter().chain(aimed.data()).map(|p| p.to_bits()).collect()
        })
        .into();
    assert_eq!(results[0], results[1]);
    let safe = safe_landing(&map, &CRITERIA, &|_| true).unwrap();
    for row in 0..90_usize {
        for col in 0..90_usize {
            let inside = (5..85).contains(&row) && (5..85).contains(&col);
            let near = row.abs_diff(40).pow(2) + col.abs_diff(50).pow(2) <= 25;
            assert_eq!(safe.get(row, col).is_nan(), !inside || near, "{row} {col}");
        }
    }
}

#[test]
fn planes_under_and_over_the_limit() {
    let geometry = Geometry::square(40, 40, 1.0).unwrap();
    for (tangent, least, most) in [(0.0, 0.999, 1.0), (0.10, 0.99, 1.0), (0.1409, 0.1, 0.5), (0.2, 0.0, 1e-6)]
    {
        let heights: Vec<f64> =
            (0..1600).map(|k| tangent * (0.6 * f64::from(k % 40) + 0.8 * f64::from(k / 40))).collect();
        let map = ElevationMap::from_heights(geometry, &heights).unwrap();
        let p = f64::from(
            safe_landing(&map, &Criteria { noise: 0.02, ..CRITERIA }, &|_| true).unwrap().get(20, 20),
        );
        assert!((least..=most).contains(&p), "{tangent}: {p}");
        // Footpads can only take away.
        let without = Criteria { noise: 0.02, footpads: None, ..CRITERIA };
        assert!(f64::from(safe_landing(&map, &without, &|_| true).unwrap().get(20, 20)) >= p);
    }
}

/// Noise that would hide a rock as high as the limit: nothing is declared safe.
#[test]
fn noise_that_hides_rocks_leaves_nothing_safe() {
    let map = ElevationMap::from_heights(Geometry::square(30, 30, 1.0).unwrap(), &[0.0; 900]).unwrap();
    for (noise, least, most) in [(0.05, 0.99, 1.0), (0.1, 0.98, 1.0), (0.2, 0.0, 0.5), (0.5, 0.0, 0.01)] {
        let p = f64::from(
            safe_landing(&map, &Criteria { noise, footpads: None, ..CRITERIA }, &|_| true)
                .unwrap()
                .get(15, 15),
        );
        assert!((least..=most).contains(&p), "{noise}: {p}");
    }
}

/// A half plane of safe ground: the probability falls across its edge like the normal distribution.
#[test]
fn navigation_error_across_an_edge() {
    let geometry = Geometry::square(61, 61, 0.5).unwrap();
    let half: Vec<f32> = (0..61 * 61).map(|k| if k % 61 >= 30 { 1.0 } else { 0.0 }).collect();
    let mut safe = Raster::new(geometry, half).unwrap();
    safe.data_mut()[0] = f32::NAN;
    let aimed = with_navigation_error(&safe, 2.0, &|_| true).unwrap();
    for col in 16..45_usize {
        // Half a pixel beyond the last centre, in standard deviations of 4 pixels.
        let expected = normal((col as f64 - 29.5) / 4.0);
        assert!((f64::from(aimed.get(30, col)) - expected).abs() < EDGE, "{col}");
    }
    assert!(aimed.data()[0].is_nan());
    // Half of the landings aimed at the edge of the map end outside.
    assert!((f64::from(aimed.get(30, 60)) - 0.55).abs() < EDGE_OF_MAP);
    // Errors without measure take more memory than there is; one that is wider than the map leaves little of it.
    for error in [1e9, 1e15, 1e300, f64::INFINITY] {
        assert!(with_navigation_error(&safe, error, &|_| true).is_err(), "{error}");
    }
    let wide = with_navigation_error(&safe, 5e3, &|_| true).unwrap();
    assert!(wide.data().iter().all(|p| p.is_nan() || (0.0..1e-2).contains(p)));
    let same = with_navigation_error(&safe, 0.0, &|_| true).unwrap();
    assert!(same.data()[1..] == safe.data()[1..]);
    assert!(
        with_navigation_error(&safe, -1.0, &|_| true).is_err()
            && with_navigation_error(&safe, f64::NAN, &|_| true).is_err()
    );
}

#[test]
fn the_normal_distribution_and_numbers_out_of_range() {
    for (x, p) in [(0.0, 0.5), (1.0, 0.841_344_746), (-1.0, 0.158_655_254), (2.326_347_874, 0.99)] {
        assert!((normal(x) - p).abs() < PUBLISHED);
    }
    let map = ground(20);
    for bad in [
        Criteria { noise: 0.0, ..CRITERIA },
        Criteria { radius: 0.5, ..CRITERIA },
        Criteria { slope: f64::NAN, ..CRITERIA },
        Criteria { roughness: -1.0, ..CRITERIA },
        Criteria { footpads: Some(0.0), ..CRITERIA },
    ] {
        assert!(matches!(safe_landing(&map, &bad, &|_| true), Err(TerrainError::Number { .. })));
    }
}
