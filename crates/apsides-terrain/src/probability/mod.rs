//! Probability of a safe landing, given noisy heights and an uncertain touchdown point.
//!
//! Limits on slope and roughness that are applied to noisy heights as they are fail in both ways: the largest of many residuals grows with
//! the noise, so that safe ground is refused, and limits raised to make up for it accept hazards. Here the noise is taken out first
//! ([`denoise`]), what is left of it is kept as a standard deviation per pixel, and each limit becomes a probability. The way of
//! combining them (per pixel, over the footprint and the footpads of every heading, the worst kept, then the navigation error) is
//! that of T. Ivanov, A. Huertas and A. Johnson, Probabilistic surface characterization for safe landing hazard detection and
//! avoidance, US patent 9 141 113 (2015).
//!
//! A pixel is declared safe where the probability reaches [`DECISION`].

mod denoise;

pub use denoise::{Posterior, denoise};

use rayon::prelude::*;
use std::f64::consts::{SQRT_2, TAU};

use crate::disk::{Disk, LocalPlane, RowSums};
use crate::hazard::Watch;
use crate::{ElevationMap, Raster, TerrainError};
use denoise::{check_noise, resolved};

/// Least probability at which a pixel is declared safe. On synthetic ground of 1 m and of 0.1 m pixels, with noise up to 0.10 m, less
/// than 1 % of what passes is not safe.
pub const DECISION: f64 = 0.97;

/// Largest standard deviation of the touchdown point, pixels.
const LARGEST_ERROR: f64 = 1e5;

/// Headings of the four footpads, which repeat after a quarter turn: every 5 degrees.
const HEADINGS: usize = 18;

/// The limits that a landing puts on the ground, and the noise of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criteria {
    /// Radius of the disk of the least-squares plane and of the residuals, m.
    pub radius: f64,
    /// Largest slope of the plane against the horizontal and of the four footpads, rad.
    pub slope: f64,
    /// Largest distance of the ground in the disk from the plane, normal to it, m.
    pub roughness: f64,
    /// Distance of the four footpads from the centre, m; none to leave them out.
    pub footpads: Option<f64>,
    /// Standard deviation of the white noise of a height, m.
    pub noise: f64,
}

/// Probability that the ground around each pixel is within the limits; NaN where the disk or a footpad leaves the map or meets a gap, and
/// in rows that `watch` does not let pass.
///
/// The product of four probabilities, each of normal errors:
/// * slope of the plane over the disk; its gradient has the standard deviation `noise / sqrt(Sxx)`,
/// * residual of the pixel of the disk that has the least margin in its own standard deviations,
/// * slope of the plane through the footpads at the worst of 18 headings, 5 degrees apart: contact on the higher diagonal, worse of
///   the two tips, linearised in the errors of the heights,
/// * a rock as high as the roughness allows, 4 to 5 pixels wide, would stand out of the noise. It is the same all over the map, near 1
///   where the noise is below a third of the roughness, and small where it is two thirds: such a map cannot show that ground is safe.
///
/// Rocks of two or three pixels that are just too high are the least certain; they are most of what is declared safe falsely.
///
/// # Errors
/// Limits or a noise out of range, or pixels that are not square or in degrees.
pub fn safe_landing(
    map: &ElevationMap,
    criteria: &Criteria,
    watch: Watch<'_>,
) -> Result<Raster<f32>, TerrainError> {
    let pixel = map.geometry().square_pixel()?;
    criteria.check(pixel)?;
    let posterior = denoise(map, criteria.noise)?;
    let disk = Disk::new(criteria.radius, pixel);
    let (raw, clean) = (RowSums::new(map.relative()), RowSums::new(posterior.heights.relative()));
    let precision: Vec<f32> = posterior.deviation.data().iter().map(|s| s.recip()).collect();
    let (limit, spread) = (criteria.slope.tan(), criteria.noise / (disk.moment.sqrt() * pixel));
    let pads = criteria.footpads.map(|rho| ExpectedFootpads::new(&posterior, rho / pixel, pixel, limit));
    let resolved = resolved(criteria.roughness, criteria.noise);
    let mut safe = vec![f32::NAN; map.geometry().pixels()];
    let cols = map.geometry().cols();
    safe.par_chunks_mut(cols).enumerate().filter(|_| watch(cols)).for_each(|(row, line)| {
        for (col, out) in line.iter_mut().enumerate() {
            let (Some(noisy), Some(plane)) = (raw.plane(&disk, row, col), clean.plane(&disk, row, col))
            else {
                continue;
            };
            let slope = noisy.rise[0].hypot(noisy.rise[1]) / pixel;
            let mut probability = resolved * normal((limit - slope) / spread);
            if probability > 1e-6 {
                probability *=
                    smooth(&posterior, &precision, &disk, &plane, [row, col], pixel, criteria.roughness);
            }
            if let Some(pads) = &pads {
                let Some(stands) = pads.probability([row, col]) else { continue };
                probability *= stands;
            }
            *out = probability as f32;
        }
    });
    Raster::new(*map.geometry(), safe)
}

/// Probability that a landing aimed at each pixel is safe, when it ends with a normal error of standard deviation `error` (m) to the
/// east and to the north. What is unknown or outside the map is not safe; an unknown pixel stays unknown, and so do rows that `watch` does not let
/// pass.
///
/// # Errors
/// An error that is negative or of more than 100 000 pixels, or pixels that are not square or in degrees.
pub fn with_navigation_error(
    safe: &Raster<f32>,
    error: f64,
    watch: Watch<'_>,
) -> Result<Raster<f32>, TerrainError> {
    let geometry = *safe.geometry();
    let sigma = error / geometry.square_pixel()?;
    if !(error >= 0.0 && sigma <= LARGEST_ERROR) {
        return Err(TerrainError::Number {
            name: "navigation error, m",
            value: error,
            allowed: "it must be from 0 to 100000 pixels".into(),
        });
    }
    let (rows, cols) = (geometry.rows(), geometry.cols());
    // Beyond four standard deviations is one landing in 16 000 for each axis.
    let reach = (4.0 * sigma).ceil() as usize;
    let weight = |k: usize| if k == 0 { 1.0 } else { (-0.5 * (k as f64 / sigma).powi(2)).exp() };
    let sum = 1.0 + 2.0 * (1..=reach).map(weight).sum::<f64>();
    // Beyond the map nothing is safe.
    let reach = reach.min(rows.max(cols));
    let kernel: Vec<f64> = (0..=reach).map(|k| weight(k) / sum).collect();
    let weight = |a: usize, b: usize| kernel[a.abs_diff(b)];
    let mut along = vec![0.0_f32; rows * cols];
    along.par_chunks_mut(cols).enumerate().filter(|_| watch(0)).for_each(|(row, line)| {
        let source = safe.row(row);
        for (col, out) in line.iter_mut().enumerate() {
            let near = col.saturating_sub(reach)..(col + reach + 1).min(cols);
            let sum: f64 =
                near.filter(|c| !source[*c].is_nan()).map(|c| weight(c, col) * f64::from(source[c])).sum();
            *out = sum as f32;
        }
    });
    let mut result = vec![0.0_f32; rows * cols];
    result.par_chunks_mut(cols).enumerate().for_each_init(
        || vec![0.0_f64; cols],
        |sums, (row, line)| {
            if !watch(cols) {
                line.fill(f32::NAN);
                return;
            }
            sums.fill(0.0);
            for r in row.saturating_sub(reach)..(row + reach + 1).min(rows) {
                let w = weight(r, row);
                sums.iter_mut().zip(&along[r * cols..]).for_each(|(sum, p)| *sum += w * f64::from(*p));
            }
            for ((out, sum), known) in line.iter_mut().zip(sums.iter()).zip(safe.row(row)) {
                *out = if known.is_nan() { f32::NAN } else { *sum as f32 };
            }
        },
    );
    Raster::new(geometry, result)
}

impl Criteria {
    fn check(&self, pixel: f64) -> Result<(), TerrainError> {
        check_noise(self.noise)?;
        let positive = "it must be positive and finite";
        let finite = |x: f64| x.is_finite() && x > 0.0;
        let rules = [
            (
                "radius of the disk, m",
                self.radius,
                finite(self.radius) && self.radius >= pixel,
                "it must be at least a pixel",
            ),
            (
                "largest slope, rad",
                self.slope,
                finite(self.slope) && self.slope < 1.5,
                "it must be in (0, 1.5)",
            ),
            ("largest roughness, m", self.roughness, finite(self.roughness), positive),
            (
                "distance of the footpads, m",
                self.footpads.unwrap_or(1.0),
                finite(self.footpads.unwrap_or(1.0)),
                positive,
            ),
        ];
        match rules.into_iter().find(|(_, _, fits, _)| !fits) {
            Some((name, value, _, allowed)) => {
                Err(TerrainError::Number { name, value, allowed: allowed.into() })
            }
            None => Ok(()),
        }
    }
}

/// Probability that the pixel of the disk with the least margin in its own standard deviations is within the limit.
fn smooth(
    posterior: &Posterior,
    precision: &[f32],
    disk: &Disk,
    plane: &LocalPlane,
    [row, col]: [usize; 2],
    pixel: f64,
    limit: f64,
) -> f64 {
    const LANES: usize = 8;
    let heights = posterior.heights.relative();
    let [east, south] = plane.rise;
    // Residuals along the vertical are longer than those normal to the plane.
    let normal_to_plane = (1.0 + (east * east + south * south) / (pixel * pixel)).sqrt();
    let vertical = (limit * normal_to_plane) as f32;
    let mut least = [f32::INFINITY; LANES];
    for (i, &w) in disk.half.iter().enumerate() {
        let start = heights.geometry().index(row + i - disk.reach, col - w);
        let end = start + 2 * w + 1;
        let first = plane.height + south * (i as f64 - disk.reach as f64) - east * w as f64;
        let (mut ground, step) = (first as f32, east as f32);
        let (z, p) = (&heights.data()[start..end], &precision[start..end]);
        let (groups, rest) = z.as_chunks::<LANES>();
        let (factors, last) = p.as_chunks::<LANES>();
        let lanes: [f32; LANES] = std::array::from_fn(|k| k as f32 * step);
        for (z, p) in groups.iter().zip(factors) {
            for k in 0..LANES {
                let margin = (vertical - (z[k] - (ground + lanes[k])).abs()) * p[k];
                least[k] = if margin < least[k] { margin } else { least[k] };
            }
            ground += LANES as f32 * step;
        }
        for (k, (z, p)) in rest.iter().zip(last).enumerate() {
            let margin = (vertical - (z - (ground + lanes[k])).abs()) * p;
            least[k] = if margin < least[k] { margin } else { least[k] };
        }
    }
    normal(f64::from(least.into_iter().fold(f32::INFINITY, f32::min)) / normal_to_plane)
}

/// Four footpads on expected heights.
struct ExpectedFootpads<'a> {
    posterior: &'a Posterior,
    /// Offsets from the centre, for each heading.
    pads: Vec<[Pad; 4]>,
    /// Distance from the centre, m.
    arm: f64,
    limit: f64,
}

/// A point between four pixels, at a fixed offset from a pixel.
#[derive(Clone, Copy, Default)]
struct Pad {
    /// Rows and columns from the pixel to the north-western of the four.
    offset: [isize; 2],
    /// Weights of the four, row by row.
    weights: [f64; 4],
}

impl Pad {
    fn new(down: f64, right: f64) -> Pad {
        let (i, j) = (down.floor(), right.floor());
        let (t, s) = (down - i, right - j);
        let weights = [(1.0 - t) * (1.0 - s), (1.0 - t) * s, t * (1.0 - s), t * s];
        Pad { offset: [i as isize, j as isize], weights }
    }

    /// Height and standard deviation; none if a pixel with a weight is outside the map or a gap.
    fn at(&self, posterior: &Posterior, row: usize, col: usize) -> Option<[f64; 2]> {
        let heights = posterior.heights.relative();
        let (rows, cols) = (heights.geometry().rows(), heights.geometry().cols());
        let (row, col) = (row.checked_add_signed(self.offset[0])?, col.checked_add_signed(self.offset[1])?);
        let mut pad = [0.0; 2];
        for (k, &weight) in self.weights.iter().enumerate() {
            if weight > 0.0 {
                let (r, c) = (row + k / 2, col + k % 2);
                if r >= rows || c >= cols {
                    return None;
                }
                pad[0] += weight * f64::from(heights.get(r, c));
                pad[1] += weight * f64::from(posterior.deviation.get(r, c));
            }
        }
        pad[0].is_finite().then_some(pad)
    }
}

impl ExpectedFootpads<'_> {
    fn new(posterior: &Posterior, rho: f64, pixel: f64, limit: f64) -> ExpectedFootpads<'_> {
        let pads = (0..HEADINGS)
            .map(|heading| {
                let (s, c) = (heading as f64 * TAU / (4 * HEADINGS) as f64).sin_cos();
                let (s, c) = (rho * s, rho * c);
                [[-c, s], [s, c], [c, -s], [-s, -c]].map(|[down, right]| Pad::new(down, right))
            })
            .collect();
        ExpectedFootpads { posterior, pads, arm: rho * pixel, limit }
    }

    /// At the worst heading; none if a pad leaves the map or meets a gap.
    fn probability(&self, [row, col]: [usize; 2]) -> Option<f64> {
        // Least margin in standard deviations.
        let mut worst = f64::INFINITY;
        for four in &self.pads {
            let mut pads = [[0.0; 2]; 4];
            for (pad, place) in pads.iter_mut().zip(four) {
                *pad = place.at(self.posterior, row, col)?;
            }
            // Contact on the higher diagonal.
            if pads[0][0] + pads[2][0] < pads[1][0] + pads[3][0] {
                pads.rotate_left(1);
            }
            let [a, b, c, d] = pads;
            let middle = 0.5 * (a[0] + c[0]);
            let low = if (b[0] - middle).abs() > (d[0] - middle).abs() { b } else { d };
            let along = (a[0] - c[0]) / (2.0 * self.arm);
            let across = (low[0] - middle) / self.arm;
            let both = a[1] * a[1] + c[1] * c[1];
            let variances = [
                0.25 * both / (self.arm * self.arm),
                (low[1] * low[1] + 0.25 * both) / (self.arm * self.arm),
            ];
            let slope = (along * along + across * across).sqrt();
            let variance = if slope > 0.0 {
                (along * along * variances[0] + across * across * variances[1]) / (slope * slope)
            } else {
                variances[0].max(variances[1])
            };
            worst = worst.min((self.limit - slope) / variance.sqrt());
        }
        Some(normal(worst))
    }
}

/// Probability of a standard normal variable below `x`, to 1.5e-7 (M. Abramowitz and I. A. Stegun, Handbook of Mathematical
/// Functions, 1964, 7.1.26).
fn normal(x: f64) -> f64 {
    let y = x.abs() / SQRT_2;
    let t = (1.0 + 0.327_591_1 * y).recip();
    let series = t
        * (0.254_829_592
            + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let tail = 0.5 * series * (-y * y).exp();
    if x > 0.0 { 1.0 - tail } else { tail }
}

#[cfg(test)]
mod tests;
