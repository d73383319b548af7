//! Estimates the heights behind noisy ones, with their standard deviation.
//!
//! The map is split into octaves of detail by the undecimated wavelet transform with the B3 spline (J.-L. Starck et al., Image
//! Processing and Data Analysis, 1998, chapter 1). In each octave a detail is normal with a variance estimated around it; its
//! posterior given white noise is normal again (local Wiener estimate; M. K. Mihcak et al., IEEE Signal Process. Lett. 6 (1999) 300,
//! doi 10.1109/97.803428). Two additions keep single rocks, which are rare and do not raise the variance around them:
//!
//! * a detail that stands out of the noise by [`OUTLIER`] standard deviations is its own estimate of the variance;
//! * the finest detail is expected to continue the next coarser one, with a variance of its own size: narrow peaks have both.

use rayon::prelude::*;

use crate::{ElevationMap, Raster, TerrainError};

/// Octaves of detail: one pixel to eight.
const LEVELS: usize = 3;

/// Side of the window of the variance, in steps of its octave.
const WINDOW: usize = 9;

/// Least variance of a detail over that of its noise: what the estimate over a window cannot tell from zero.
const FLOOR: f64 = 0.05 / 0.95;

/// Details over noise, in standard deviations, that are taken for rocks: one of 16 000 by chance.
const OUTLIER: f64 = 4.0;

/// Expected ratio of the finest detail to the next at the top of a half-ellipsoid of 3 to 4 pixels.
const CONTINUED: f64 = 0.8;

/// Standard deviation of that ratio.
const CONTINUED_SPREAD: f64 = 0.7;

/// Detail in the second octave at the top of a half-ellipsoid of 4 to 5 pixels, over its height.
const SECOND_OCTAVE: f64 = 0.45;

/// B3 spline.
const KERNEL: [f64; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];

/// Heights given a noisy map: mean and standard deviation of each pixel.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Expected heights; gaps as in the noisy map.
    pub heights: ElevationMap,
    /// Standard deviations, m.
    pub deviation: Raster<f32>,
}

/// The posterior of a map with white normal noise of standard deviation `noise` (m) in each height.
///
/// Beside gaps and the edge the smoothing uses the pixels that there are; the noise left there is a little larger than stated.
///
/// # Errors
/// A noise that is not positive and finite.
pub fn denoise(map: &ElevationMap, noise: f64) -> Result<Posterior, TerrainError> {
    check_noise(noise)?;
    let geometry = *map.geometry();
    let (rows, cols) = (geometry.rows(), geometry.cols());
    let mut smooth = map.relative().data().to_vec();
    let mut details = Vec::with_capacity(LEVELS);
    for level in 0..LEVELS {
        let next = blur(&smooth, rows, cols, 1 << level);
        let detail: Vec<f32> = smooth.iter().zip(&next).map(|(a, b)| a - b).collect();
        details.push(detail);
        smooth = next;
    }
    let (deviations, rest) = noise_of_levels();
    let mut heights = smooth;
    let mut variance = vec![((noise * rest) * (noise * rest)) as f32; heights.len()];
    let mut coarser: Vec<f32> = Vec::new();
    for (level, mut detail) in details.into_iter().enumerate().rev() {
        let n = (noise * deviations[level]).powi(2);
        let around = mean_square(&detail, rows, cols, WINDOW * (1 << level) / 2);
        let values = detail.par_iter_mut().zip(&mut variance).zip(&mut heights).enumerate();
        values.for_each(|(k, ((w, variance), height))| {
            let x = f64::from(*w);
            let mut prior = (f64::from(around[k]) - n).max(FLOOR * n);
            if x * x > OUTLIER * OUTLIER * n {
                prior = prior.max(x * x);
            }
            let mut expected = 0.0;
            if level == 0 {
                let parent = f64::from(coarser[k]);
                expected = CONTINUED * parent;
                prior = prior.max((CONTINUED_SPREAD * parent).powi(2));
            }
            let gain = prior / (prior + n);
            *w = (expected + gain * (x - expected)) as f32;
            *height += *w;
            *variance += (gain * n) as f32;
        });
        coarser = detail;
    }
    let deviation =
        variance.iter().zip(&heights).map(|(v, z)| if z.is_nan() { *z } else { v.sqrt() }).collect();
    Ok(Posterior {
        heights: ElevationMap::from_relative(Raster::new(geometry, heights)?, map.datum())?,
        deviation: Raster::new(geometry, deviation)?,
    })
}

/// Probability that a rock of a height, 4 to 5 pixels wide, stands out of the noise as [`OUTLIER`] asks.
pub(super) fn resolved(height: f64, noise: f64) -> f64 {
    let ([_, second, _], _) = noise_of_levels();
    super::normal(SECOND_OCTAVE * height / (second * noise) - OUTLIER)
}

pub(super) fn check_noise(noise: f64) -> Result<(), TerrainError> {
    if noise.is_finite() && noise > 0.0 {
        return Ok(());
    }
    Err(TerrainError::Number {
        name: "standard deviation of the noise, m",
        value: noise,
        allowed: "it must be positive and finite".into(),
    })
}

/// Standard deviation of each octave of detail, and of what is left, in white noise of 1.
fn noise_of_levels() -> ([f64; LEVELS], f64) {
    // Kernels of the successive smoothings along one axis.
    let mut kernels = vec![vec![1.0]];
    for level in 0..LEVELS {
        let last = &kernels[level];
        let step = 1 << level;
        let mut next = vec![0.0; last.len() + 4 * step];
        for (i, a) in last.iter().enumerate() {
            for (j, b) in KERNEL.iter().enumerate() {
                next[i + j * step] += a * b;
            }
        }
        kernels.push(next);
    }
    let product = |a: usize, b: usize| -> f64 {
        let shift = (kernels[b].len() - kernels[a].len()) / 2;
        let sum: f64 = kernels[a].iter().zip(&kernels[b][shift..]).map(|(x, y)| x * y).sum();
        sum * sum
    };
    let detail = |l: usize| (product(l, l) - 2.0 * product(l, l + 1) + product(l + 1, l + 1)).sqrt();
    (std::array::from_fn(detail), product(LEVELS, LEVELS).sqrt())
}

/// Smoothing with the spline at a step, over the heights that there are; gaps stay.
fn blur(from: &[f32], rows: usize, cols: usize, step: usize) -> Vec<f32> {
    let reach = 2 * step;
    // Sums of weighted heights and of weights along rows, then along columns.
    let mut along = vec![[0.0_f32; 2]; from.len()];
    along.par_chunks_mut(cols).zip(from.par_chunks(cols)).for_each(|(out, line)| {
        for (col, out) in out.iter_mut().enumerate() {
            for (k, &weight) in KERNEL.iter().enumerate() {
                let Some(&z) = (col + k * step).checked_sub(reach).and_then(|c| line.get(c)) else {
                    continue;
                };
                if !z.is_nan() {
                    *out = [out[0] + weight as f32 * z, out[1] + weight as f32];
                }
            }
        }
    });
    let mut smooth = vec![0.0_f32; from.len()];
    smooth.par_chunks_mut(cols).enumerate().for_each(|(row, out)| {
        for (col, out) in out.iter_mut().enumerate() {
            let mut sum = [0.0_f32; 2];
            for (k, &weight) in KERNEL.iter().enumerate() {
                let Some(r) = (row + k * step).checked_sub(reach).filter(|r| *r < rows) else { continue };
                let [z, w] = along[r * cols + col];
                sum = [sum[0] + weight as f32 * z, sum[1] + weight as f32 * w];
            }
            *out = if from[row * cols + col].is_nan() { f32::NAN } else { sum[0] / sum[1] };
        }
    });
    smooth
}

/// Mean square over the values that there are in a square of `2 reach + 1` pixels.
fn mean_square(values: &[f32], rows: usize, cols: usize, reach: usize) -> Vec<f32> {
    let mut along = vec![[0.0_f32; 2]; values.len()];
    along.par_chunks_mut(cols).zip(values.par_chunks(cols)).for_each_init(
        || vec![[0.0_f64; 2]; cols + 1],
        |sums, (out, line)| {
            for (col, &w) in line.iter().enumerate() {
                let [s, n] = sums[col];
                let w = f64::from(w);
                sums[col + 1] = if w.is_nan() { [s, n] } else { [s + w * w, n + 1.0] };
            }
            for (col, out) in out.iter_mut().enumerate() {
                let (a, b) = (sums[col.saturating_sub(reach)], sums[(col + reach + 1).min(cols)]);
                *out = [(b[0] - a[0]) as f32, (b[1] - a[1]) as f32];
            }
        },
    );
    let mut mean = vec![0.0_f32; values.len()];
    mean.par_chunks_mut(cols).enumerate().for_each_init(
        || vec![[0.0_f32; 2]; cols],
        |sums, (row, out)| {
            sums.fill([0.0; 2]);
            for r in row.saturating_sub(reach)..(row + reach + 1).min(rows) {
                for (sum, value) in sums.iter_mut().zip(&along[r * cols..(r + 1) * cols]) {
                    *sum = [sum[0] + value[0], sum[1] + value[1]];
                }
            }
            out.iter_mut().zip(sums.iter()).for_each(|(out, [s, n])| *out = s / n.max(1.0));
        },
    );
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    /// Published: the last digit of the simulated noise of the octaves.
    const PUBLISHED: f64 = 1e-3;

    /// Single precision of the heights, m.
    const SINGLE: f64 = 1e-5;

    /// The finest octave in closed form, 1 - 2 (3/8)^2 + (35/128)^2; the next as simulated by Starck et al., 0.200 and 0.086.
    #[test]
    fn noise_of_the_octaves() {
        let (found, rest) = noise_of_levels();
        let finest = (1.0 - 2.0 * 0.375_f64.powi(2) + (35.0 / 128.0_f64).powi(2)).sqrt();
        assert!((found[0] - finest).abs() < ROUNDING);
        assert!((found[1] - 0.200).abs() < PUBLISHED && (found[2] - 0.086).abs() < PUBLISHED, "{found:?}");
        assert!(rest > 0.0 && rest < found[2]);
    }

    #[test]
    fn a_plane_is_kept_and_gaps_stay() {
        let geometry = Geometry::square(50, 60, 1.0).unwrap();
        let mut heights: Vec<f64> =
            (0..3000).map(|k| 0.25 * (k % 60) as f64 - 0.125 * (k / 60) as f64).collect();
        heights[25 * 60 + 30] = f64::NAN;
        let map = ElevationMap::from_heights(geometry, &heights).unwrap();
        let posterior = denoise(&map, 0.01).unwrap();
        assert_eq!(posterior.heights.height(25, 30), None);
        assert!(posterior.deviation.get(25, 30).is_nan());
        let error = posterior.heights.height(42, 15).unwrap() - heights[42 * 60 + 15];
        assert!(error.abs() < SINGLE, "{error}");
        assert!(denoise(&map, 0.0).is_err() && denoise(&map, f64::NAN).is_err());
    }
}
