//! A plane through most of a map, whatever the rest does.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::{ElevationMap, TerrainError};

/// A plane over map coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Map coordinates (east, north) of a point of the plane, m.
    pub origin_m: [f64; 2],
    /// Height there, m.
    pub height_m: f64,
    /// Rise to the east.
    pub east: f64,
    /// Rise to the north.
    pub north: f64,
}

impl Plane {
    /// Height at map coordinates (east, north), m.
    #[must_use]
    pub fn height_at(&self, position: [f64; 2]) -> f64 {
        let [east, north] = [position[0] - self.origin_m[0], position[1] - self.origin_m[1]];
        self.height_m + self.east * east + self.north * north
    }

    /// Angle between gravity and the normal, rad.
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.east.hypot(self.north).atan()
    }
}

/// The measure by which one plane through three points is better than another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RobustMethod {
    /// Least median of squares (Rousseeuw 1984). The scale is `1.4826 (1 + 5 / (n - 3)) sqrt(median)`; inliers are within 2.5 scales.
    LeastMedian,
    /// Most points within a distance (RANSAC, Fischler and Bolles 1981).
    Consensus {
        /// The distance, m, vertical.
        within_m: f64,
    },
}

/// Robust plane of a map: planes through three random points, the best of them by the method, then least squares on its inliers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobustFit {
    /// The measure of the best plane.
    pub method: RobustMethod,
    /// Planes that are tried.
    pub trials: usize,
    /// Random pixels on which they are judged.
    pub sample: usize,
    /// Seed of all draws.
    pub seed: u64,
}

impl Default for RobustFit {
    fn default() -> Self {
        RobustFit { method: RobustMethod::LeastMedian, trials: 500, sample: 20_000, seed: 0 }
    }
}

/// The plane and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustPlane {
    /// Least squares on the inliers.
    pub plane: Plane,
    /// Inliers are within this of the best plane of the trials, m, vertical.
    pub within_m: f64,
    /// Number of inliers, of all pixels with a height.
    pub inliers: usize,
}

/// A point: east, north, height, m.
type Point = [f64; 3];

impl RobustFit {
    /// Fits the plane.
    ///
    /// # Errors
    /// A map without heights, or with all of them on one line; no trials; an empty sample; a distance that is not positive; pixels that
    /// are not square, in metres.
    pub fn fit(&self, map: &ElevationMap) -> Result<RobustPlane, TerrainError> {
        let pixel_m = map.geometry().square_pixel()?;
        let number = |name, value: f64, fits: bool, allowed: &'static str| {
            if fits { Ok(()) } else { Err(TerrainError::Number { name, value, allowed: allowed.into() }) }
        };
        number("trials", self.trials as f64, self.trials > 0, "there must be at least one")?;
        number("sample", self.sample as f64, self.sample >= 3, "it must be at least 3")?;
        if let RobustMethod::Consensus { within_m } = self.method {
            let fits = within_m.is_finite() && within_m > 0.0;
            number("within_m", within_m, fits, "it must be positive and finite")?;
        }
        let heights = map.relative().data();
        let known = heights.len() - map.gaps();
        if known == 0 {
            return Err(TerrainError::Empty { pixels: heights.len() });
        }
        let cols = map.geometry().cols();
        let point = |k: usize| -> Point {
            [(k % cols) as f64 * pixel_m, -((k / cols) as f64) * pixel_m, f64::from(heights[k])]
        };
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut draw = |count: usize| ((u128::from(random.next_u64()) * count as u128) >> 64) as usize;
        // Gaps are drawn again; a map of few heights is bounded by the number of draws.
        let mut sample: Vec<Point> = Vec::with_capacity(self.sample);
        for _ in 0..self.sample.saturating_mul(heights.len() / known + 8) {
            let k = draw(heights.len());
            if heights[k].is_finite() {
                sample.push(point(k));
            }
            if sample.len() == self.sample {
                break;
            }
        }
        let mut best: Option<(f64, [f64; 3])> = None;
        let mut squares = vec![0.0; sample.len()];
        for _ in 0..self.trials {
            let corners = [0; 3].map(|_| draw(sample.len().max(1)));
            let Some(plane) = sample
                .get(corners[0])
                .and_then(|first| through(*first, sample[corners[1]], sample[corners[2]]))
            else {
                continue;
            };
            for (square, p) in squares.iter_mut().zip(&sample) {
                *square = residual(&plane, p).powi(2);
            }
            let cost = match self.method {
                RobustMethod::LeastMedian => {
                    let middle = squares.len() / 2;
                    *squares.select_nth_unstable_by(middle, f64::total_cmp).1
                }
                RobustMethod::Consensus { within_m } => {
                    -(squares.iter().filter(|s| **s <= within_m * within_m).count() as f64)
                }
            };
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, plane));
            }
        }
        let ill = TerrainError::Number {
            name: "heights of the map",
            value: known as f64,
            allowed: "there must be three that are not on one line".into(),
        };
        let Some((cost, plane)) = best else { return Err(ill) };
        let within_m = match self.method {
            RobustMethod::LeastMedian => {
                let scale = 1.4826 * (1.0 + 5.0 / (known as f64 - 3.0).max(1.0)) * cost.sqrt();
                // A map that is a plane has residuals of rounding alone.
                (2.5 * scale).max(1e-6 * pixel_m)
            }
            RobustMethod::Consensus { within_m } => within_m,
        };
        let points = || (0..heights.len()).filter(|&k| heights[k].is_finite()).map(point);
        let inliers = || points().filter(|p| residual(&plane, p).abs() <= within_m);
        let (plane, inliers) = least_squares(inliers).ok_or(ill)?;
        let geometry = map.geometry();
        Ok(RobustPlane {
            plane: Plane {
                origin_m: geometry.north_west(),
                height_m: plane[2] + map.datum(),
                east: plane[0],
                north: plane[1],
            },
            within_m,
            inliers,
        })
    }
}

/// `[east, north, height at the origin]` of the plane through three points, unless they are near one line.
fn through(a: Point, b: Point, c: Point) -> Option<[f64; 3]> {
    let [b, c] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let area = b[0] * c[1] - b[1] * c[0];
    if area.abs() <= 1e-9 * (b[0].hypot(b[1]) * c[0].hypot(c[1])) {
        return None;
    }
    let east = (b[2] * c[1] - b[1] * c[2]) / area;
    let north = (b[0] * c[2] - b[2] * c[0]) / area;
    Some([east, north, a[2] - east * a[0] - north * a[1]])
}

fn residual(plane: &[f64; 3], p: &Point) -> f64 {
    p[2] - plane[2] - plane[0] * p[0] - plane[1] * p[1]
}

/// Least squares, around the mean of the points, and their number.
fn least_squares<I: Iterator<Item = Point>>(points: impl Fn() -> I) -> Option<([f64; 3], usize)> {
    let mut count = 0;
    let mut mean = [0.0; 3];
    for p in points() {
        count += 1;
        (0..3).for_each(|i| mean[i] += p[i]);
    }
    let mean = mean.map(|m| m / f64::from(count.max(1)));
    let mut moments = [0.0; 5];
    for p in points() {
        let [x, y, z] = [p[0] - mean[0], p[1] - mean[1], p[2] - mean[2]];
        let products = [x * x, x * y, y * y, x * z, y * z];
        (0..5).for_each(|i| moments[i] += products[i]);
    }
    let [xx, xy, yy, xz, yz] = moments;
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-12 * xx * yy || count < 3 {
        return None;
    }
    let east = (xz * yy - yz * xy) / determinant;
    let north = (yz * xx - xz * xy) / determinant;
    Some(([east, north, mean[2] - east * mean[0] - north * mean[1]], count as usize))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f64 = 1e-6;

    #[test]
    fn a_third_of_outliers_changes_nothing() {
        let (rows, cols) = (60, 80);
        let heights: Vec<f64> = (0..rows * cols)
            .map(|k| {
                let (row, col) = ((k / cols) as f64, (k % cols) as f64);
                let plane = 700.0 + 0.1 * (2.0 * col) - 0.05 * (-2.0 * row);
                if k % 3 == 0 { plane + 5.0 + (k % 7) as f64 } else { plane }
            })
            .collect();
        let map = ElevationMap::from_heights(Geometry::square(rows, cols, 2.0).unwrap(), &heights).unwrap();
        for method in [RobustMethod::LeastMedian, RobustMethod::Consensus { within_m: 0.1 }] {
            let found = RobustFit { method, ..RobustFit::default() }.fit(&map).unwrap();
            assert!((found.plane.east - 0.1).abs() < SINGLE && (found.plane.north + 0.05).abs() < SINGLE);
            assert!((found.plane.height_at([0.0, 0.0]) - 700.0).abs() < 100.0 * SINGLE, "{found:?}");
            assert_eq!(found.inliers, rows * cols * 2 / 3);
        }
    }

    #[test]
    fn maps_without_a_plane_are_refused() {
        let gaps = ElevationMap::from_heights(Geometry::square(2, 2, 1.0).unwrap(), &[f64::NAN; 4]).unwrap();
        assert!(matches!(RobustFit::default().fit(&gaps), Err(TerrainError::Empty { pixels: 4 })));
        let line = ElevationMap::from_heights(Geometry::square(1, 9, 1.0).unwrap(), &[1.0; 9]).unwrap();
        assert!(matches!(RobustFit::default().fit(&line), Err(TerrainError::Number { .. })));
    }
}
