//! Craters by their shape: a rim all around that is higher than the floor.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::resample::pyramid;
use crate::{ElevationMap, Raster, TerrainError};

/// Samples of the rim.
const RIM: usize = 16;

/// Samples around the centre, and their distance from it in radii.
const FLOOR: (usize, f64) = (8, 0.4);

/// Radii that are tried on each level of the pyramid, pixels: a factor of two in equal steps.
const RADII: [f64; 4] = [4.0, 4.757, 5.657, 6.727];

/// Least rise to any pair of opposite rim samples, over the mean: closer to zero is a valley or a step.
const ALL_AROUND: f64 = 0.45;

/// Rise from the samples of the floor to those of the rim of a paraboloid bowl, over its depth: 1 - 8/9 0.4^2.
const SEEN: f64 = 0.858;

/// The craters to look for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CraterSearch {
    /// Smallest and largest diameter, m. Less than 8 pixels is not found.
    pub diameters: [f64; 2],
    /// Least depth from rim to floor over the diameter; fresh craters have 0.2.
    pub depth: f64,
}

/// A crater that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundCrater {
    /// Centre (east, north), m.
    pub centre: [f64; 2],
    /// Diameter of the rim, m, in steps of a fifth.
    pub diameter: f64,
    /// From the rim to the floor, m, as of a paraboloid.
    pub depth: f64,
}

/// Craters of a map, the deepest for their size first.
///
/// On each level of a pyramid of 2 x 2 means, rings of 16 samples are compared with the floor inside: opposite samples are averaged, so
/// that a slope cancels, and all pairs have to be higher than the floor. Of overlapping finds of similar size the deepest for its
/// size remains. What touches a gap or the edge is not found.
///
/// # Errors
/// Diameters or a depth out of range, or pixels that are not square or in degrees.
pub fn craters(map: &ElevationMap, search: &CraterSearch) -> Result<Vec<FoundCrater>, TerrainError> {
    let pixel = map.geometry().square_pixel()?;
    let [least, most] = search.diameters;
    for (name, value, fits, allowed) in [
        (
            "smallest diameter of a crater, m",
            least,
            least.is_finite() && least > 0.0,
            "it must be positive and finite",
        ),
        (
            "largest diameter of a crater, m",
            most,
            most.is_finite() && most >= least,
            "it must be at least the smallest",
        ),
        (
            "depth of a crater over its diameter",
            search.depth,
            search.depth > 0.0 && search.depth < 1.0,
            "it must be between 0 and 1",
        ),
    ] {
        if !fits {
            return Err(TerrainError::Number { name, value, allowed: allowed.into() });
        }
    }
    let levels = pyramid(map, 16)?;
    let mut found = Vec::new();
    for (level, map) in std::iter::once(map).chain(&levels).enumerate() {
        let size = pixel * (1_u64 << level) as f64;
        for radius in RADII {
            if (least..=most).contains(&(2.0 * radius * size)) {
                found.extend(rings(map, radius, size, search.depth));
            }
        }
    }
    Ok(separate(found))
}

/// Local maxima of the depth over the diameter for rings of one radius (pixels).
fn rings(map: &ElevationMap, radius: f64, pixel: f64, least: f64) -> Vec<FoundCrater> {
    let heights = map.relative();
    let (rows, cols) = (map.geometry().rows(), map.geometry().cols());
    let circle = |count: usize, radius: f64| -> Vec<isize> {
        (0..count)
            .map(|k| {
                let (s, c) = (TAU * k as f64 / count as f64).sin_cos();
                (radius * s).round() as isize * cols as isize + (radius * c).round() as isize
            })
            .collect()
    };
    let (rim, floor) = (circle(RIM, radius), circle(FLOOR.0, FLOOR.1 * radius));
    let reach = radius.ceil() as usize;
    let mut depth = vec![f32::NAN; rows * cols];
    depth.par_chunks_mut(cols).enumerate().for_each(|(row, line)| {
        if row < reach || row + reach >= rows {
            return;
        }
        for col in reach..cols.saturating_sub(reach) {
            let centre = row * cols + col;
            let z = |offset: isize| f64::from(heights.data()[centre.wrapping_add_signed(offset)]);
            let middle = (z(0) + floor.iter().map(|o| z(*o)).sum::<f64>()) / (floor.len() + 1) as f64;
            let (mut sum, mut lowest) = (0.0, f64::INFINITY);
            for k in 0..RIM / 2 {
                let pair = 0.5 * (z(rim[k]) + z(rim[k + RIM / 2])) - middle;
                sum += pair;
                lowest = lowest.min(pair);
            }
            let mean = sum / (RIM / 2) as f64;
            if mean > 0.0 && lowest >= ALL_AROUND * mean {
                line[col] = (mean / SEEN) as f32;
            }
        }
    });
    let diameter = 2.0 * radius * pixel;
    let Ok(depth) = Raster::new(*map.geometry(), depth) else { return Vec::new() };
    let mut found = Vec::new();
    for row in 1..rows.saturating_sub(1) {
        for col in 1..cols.saturating_sub(1) {
            let here = depth.get(row, col);
            if here.is_nan() || f64::from(here) < least * diameter {
                continue;
            }
            let around = (row - 1..=row + 1).flat_map(|r| (col - 1..=col + 1).map(move |c| (r, c)));
            if around.clone().all(|(r, c)| depth.get(r, c).is_nan() || depth.get(r, c) <= here) {
                let centre = map.geometry().position(row as f64, col as f64);
                found.push(FoundCrater { centre, diameter, depth: f64::from(here) });
            }
        }
    }
    found
}

/// Keeps, of finds that are the same crater, the one that is deepest for its size.
fn separate(mut found: Vec<FoundCrater>) -> Vec<FoundCrater> {
    let score = |c: &FoundCrater| c.depth / c.diameter;
    found.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let mut kept: Vec<FoundCrater> = Vec::new();
    for crater in found {
        let same = |other: &FoundCrater| {
            let [east, north] = [0, 1].map(|k| crater.centre[k] - other.centre[k]);
            let ratio = crater.diameter / other.diameter;
            // A ring around the crater on one side of it is no other crater.
            (0.4..2.5).contains(&ratio) && east.hypot(north) < 0.5 * crater.diameter.max(other.diameter)
        };
        if !kept.iter().any(same) {
            kept.push(crater);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Boulders, Synthetic, Terrain};

    /// Craters with a tenth of their diameter in depth, from ten pixels on, on rolling ground with boulders.
    #[test]
    fn recall_and_precision_on_synthetic_ground() {
        let (mut sought, mut hit, mut found_count, mut right) = (0, 0, 0, 0);
        for seed in 1..=3 {
            let terrain = Terrain { rows: 500, cols: 500, ..Terrain::coarse() };
            let terrain = Terrain { boulders: Boulders { abundance: 0.02, ..terrain.boulders }, ..terrain };
            let ground = Synthetic::new(terrain, seed).unwrap();
            let truth = ground.craters(0, 0, 500, 500).unwrap();
            let search = CraterSearch { diameters: [8.0, 120.0], depth: 0.08 };
            let found = craters(&ground.map().unwrap(), &search).unwrap();
            let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let matches = |c: [f64; 2], d: f64, f: &FoundCrater| {
                near(c, f.centre) < 0.25 * d && (0.7..1.45).contains(&(f.diameter / d))
            };
            for crater in truth.iter().filter(|c| {
                let inside = |x: f64| (0.6 * c.diameter..499.0 - 0.6 * c.diameter).contains(&x);
                c.diameter >= 10.0
                    && c.diameter <= 100.0
                    && c.depth >= 0.1 * c.diameter
                    && inside(c.centre[0])
                    && inside(-c.centre[1])
            }) {
                sought += 1;
                hit += usize::from(found.iter().any(|f| matches(crater.centre, crater.diameter, f)));
            }
            found_count += found.len();
            right += found.iter().filter(|f| truth.iter().any(|c| matches(c.centre, c.diameter, f))).count();
        }
        let (recall, precision) = (hit as f64 / sought as f64, right as f64 / found_count as f64);
        println!("craters: recall {recall:.3} of {sought}, precision {precision:.3} of {found_count}");
        assert!(sought > 100 && recall > 0.85 && precision > 0.7, "{recall} {precision}");
    }

    #[test]
    fn ground_without_craters_and_numbers_out_of_range() {
        let heights: Vec<f64> =
            (0..10_000).map(|k| 0.3 * f64::from(k % 100) + (f64::from(k / 100) * 0.2).sin()).collect();
        let map =
            ElevationMap::from_heights(crate::Geometry::square(100, 100, 1.0).unwrap(), &heights).unwrap();
        let search = CraterSearch { diameters: [8.0, 40.0], depth: 0.02 };
        assert!(craters(&map, &search).unwrap().is_empty());
        for bad in [
            CraterSearch { diameters: [0.0, 1.0], ..search },
            CraterSearch { diameters: [2.0, 1.0], ..search },
            CraterSearch { depth: f64::NAN, ..search },
        ] {
            assert!(matches!(craters(&map, &bad), Err(TerrainError::Number { .. })));
        }
    }
}
