//! Edges after J. Canny, A computational approach to edge detection, IEEE Trans. PAMI 8 (1986) 679, doi 10.1109/TPAMI.1986.4767851.

use rayon::prelude::*;

use crate::{ElevationMap, Raster, TerrainError};

/// Two thresholds on the length of the smoothed gradient: an edge passes the lower one and is joined to one that passes the upper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thresholds {
    /// Rise over distance, m/m.
    Gradient {
        /// Lower threshold.
        low: f64,
        /// Upper threshold.
        high: f64,
    },
    /// Heights taken for an 8-bit image (255 grey levels are 1) and the unscaled response of the Sobel operator, which is eight times
    /// the difference between neighbouring pixels. The lower threshold is 0.4 of the upper.
    Image {
        /// Height of a grey level, m.
        level: f64,
        /// Upper threshold.
        high: f64,
    },
    /// Parts of the longest gradient of the map, the lower threshold 0.4 of the upper (the convention of MATLAB's `edge`).
    Relative {
        /// Upper threshold, in (0, 1).
        high: f64,
    },
}

/// Smoothing and thresholds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Canny {
    /// Standard deviation of the Gaussian smoothing, pixels; sqrt(2) in MATLAB's `edge`.
    pub sigma: f64,
    /// Thresholds.
    pub thresholds: Thresholds,
}

/// Edges of a map: 1 on an edge, 0 elsewhere, NaN where a gap or the border of the map is within reach of the smoothing.
///
/// Gaussian smoothing out to three standard deviations, Sobel operator, non-maximum suppression between the two interpolated
/// neighbours along the gradient, hysteresis over the eight neighbours.
///
/// # Errors
/// A smoothing or thresholds out of range, or pixels that are not square or in degrees.
pub fn edges(map: &ElevationMap, canny: &Canny) -> Result<Raster<f32>, TerrainError> {
    let geometry = *map.geometry();
    let pixel = geometry.square_pixel()?;
    canny.check()?;
    let (rows, cols) = (geometry.rows(), geometry.cols());
    let smooth = gaussian(map.relative(), canny.sigma);
    let mut gradients = vec![[f32::NAN; 2]; smooth.len()];
    gradients.par_chunks_mut(cols).enumerate().for_each(|(row, line)| {
        if row == 0 || row + 1 == rows {
            return;
        }
        for col in 1..cols.saturating_sub(1) {
            let z = |down: usize, right: usize| smooth[(row + down - 1) * cols + col + right - 1];
            let east = z(0, 2) + 2.0 * z(1, 2) + z(2, 2) - z(0, 0) - 2.0 * z(1, 0) - z(2, 0);
            let south = z(2, 0) + 2.0 * z(2, 1) + z(2, 2) - z(0, 0) - 2.0 * z(0, 1) - z(0, 2);
            line[col] = [east, south];
        }
    });
    let lengths: Vec<f32> = gradients.iter().map(|[e, s]| e.hypot(*s)).collect();
    let longest = lengths.iter().filter(|l| !l.is_nan()).fold(0.0_f32, |a, b| a.max(*b));
    let [low, high] = match canny.thresholds {
        Thresholds::Gradient { low, high } => [low * 8.0 * pixel, high * 8.0 * pixel],
        Thresholds::Image { level, high } => [0.4 * high * 255.0 * level, high * 255.0 * level],
        Thresholds::Relative { high } => [0.4, 1.0].map(|part| part * high * f64::from(longest)),
    };
    let mut marks = vec![f32::NAN; lengths.len()];
    marks.par_chunks_mut(cols).enumerate().for_each(|(row, line)| {
        if row < 2 || row + 2 >= rows {
            return;
        }
        for col in 2..cols.saturating_sub(2) {
            let k = row * cols + col;
            let [east, south] = gradients[k];
            let around = |down: i64, right: i64| {
                lengths[(row as i64 + down) as usize * cols + (col as i64 + right) as usize]
            };
            // Between the neighbour along the longer component and the diagonal one.
            let (e, s) = (if east < 0.0 { -1 } else { 1 }, if south < 0.0 { -1 } else { 1 });
            let (straight, part) = if east.abs() >= south.abs() {
                ([0, e], south.abs() / east.abs().max(f32::MIN_POSITIVE))
            } else {
                ([s, 0], east.abs() / south.abs())
            };
            let beside = |sign: i64| {
                let near = around(sign * straight[0], sign * straight[1]);
                near + part * (around(sign * s, sign * e) - near)
            };
            let (ahead, behind) = (beside(1), beside(-1));
            let length = lengths[k];
            if (length + ahead + behind).is_nan() {
                continue;
            }
            // Of two equal neighbours one counts.
            let ridge = length > 0.0 && length > behind && length >= ahead && f64::from(length) >= low;
            line[col] = if ridge { 0.5 } else { 0.0 };
        }
    });
    hysteresis(&mut marks, &lengths, rows, cols, high);
    Raster::new(geometry, marks)
}

impl Canny {
    fn check(&self) -> Result<(), TerrainError> {
        let positive = "it must be positive and finite";
        let finite = |x: f64| x.is_finite() && x > 0.0;
        let rules = match self.thresholds {
            Thresholds::Gradient { low, high } => [
                ("lower threshold of edges", low, finite(low), positive),
                (
                    "upper threshold of edges",
                    high,
                    finite(high) && high >= low,
                    "it must be at least the lower",
                ),
            ],
            Thresholds::Image { level, high } => [
                ("height of a grey level, m", level, finite(level), positive),
                ("threshold of edges", high, finite(high), positive),
            ],
            Thresholds::Relative { high } => {
                [("threshold of edges", high, high > 0.0 && high < 1.0, "it must be between 0 and 1"); 2]
            }
        };
        let smoothing = (
            "smoothing of edges, pixels",
            self.sigma,
            self.sigma > 0.1 && self.sigma <= 100.0,
            "it must be in (0.1, 100]",
        );
        match rules.into_iter().chain([smoothing]).find(|(_, _, fits, _)| !fits) {
            Some((name, value, _, allowed)) => Err(TerrainError::Number { name, value, allowed }),
            None => Ok(()),
        }
    }
}

/// Keeps the marks that are joined to one that passes the upper threshold.
fn hysteresis(marks: &mut [f32], lengths: &[f32], rows: usize, cols: usize, high: f64) {
    let mut open: Vec<usize> =
        (0..marks.len()).filter(|&k| marks[k] == 0.5 && f64::from(lengths[k]) >= high).collect();
    open.iter().for_each(|&k| marks[k] = 1.0);
    while let Some(k) = open.pop() {
        let (row, col) = (k / cols, k % cols);
        for r in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
            for c in col.saturating_sub(1)..=(col + 1).min(cols - 1) {
                let next = r * cols + c;
                if marks[next] == 0.5 {
                    marks[next] = 1.0;
                    open.push(next);
                }
            }
        }
    }
    marks.iter_mut().filter(|m| **m == 0.5).for_each(|m| *m = 0.0);
}

/// Gaussian smoothing; NaN where it reaches beyond the map or into a gap.
fn gaussian(heights: &Raster<f32>, sigma: f64) -> Vec<f32> {
    let (rows, cols) = (heights.geometry().rows(), heights.geometry().cols());
    let reach = (3.0 * sigma).ceil() as usize;
    let mut kernel: Vec<f64> =
        (0..=2 * reach).map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let mut along = vec![f32::NAN; rows * cols];
    along.par_chunks_mut(cols).enumerate().for_each(|(row, line)| {
        for (out, near) in line.iter_mut().skip(reach).zip(heights.row(row).windows(2 * reach + 1)) {
            *out = near.iter().zip(&kernel).map(|(z, k)| f64::from(*z) * k).sum::<f64>() as f32;
        }
    });
    let mut smooth = vec![f32::NAN; rows * cols];
    smooth.par_chunks_mut(cols).enumerate().for_each(|(row, line)| {
        if row < reach || row + reach >= rows {
            return;
        }
        for (col, out) in line.iter_mut().enumerate() {
            let sum: f64 = kernel
                .iter()
                .enumerate()
                .map(|(i, k)| f64::from(along[(row + i - reach) * cols + col]) * k)
                .sum();
            *out = sum as f32;
        }
    });
    smooth
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    fn step(height: f64, gap: bool) -> ElevationMap {
        let heights: Vec<f64> = (0..40 * 40)
            .map(|k| match (k / 40, k % 40) {
                (20, 5) if gap => f64::NAN,
                (_, col) if col >= 20 => height,
                _ => 0.0,
            })
            .collect();
        ElevationMap::from_heights(Geometry::square(40, 40, 2.0).unwrap(), &heights).unwrap()
    }

    /// A step of 1 m smoothed with 1 pixel has the gradient 1 / sqrt(2 pi) per pixel, a little less by the operator's width.
    #[test]
    fn a_step_is_one_line_of_the_expected_gradient() {
        let canny = |low, high| Canny { sigma: 1.0, thresholds: Thresholds::Gradient { low, high } };
        let found = edges(&step(1.0, false), &canny(0.05, 0.15)).unwrap();
        for row in 5..35 {
            let at: Vec<usize> = (0..40).filter(|&c| found.get(row, c) == 1.0).collect();
            assert!(at == [19] || at == [20], "{at:?}");
        }
        // 0.3829 / 2 of a metre per metre: the mass of the normal law within half a pixel.
        assert!(edges(&step(1.0, false), &canny(0.05, 0.20)).unwrap().data().iter().all(|e| *e != 1.0));
        assert!(found.get(2, 20).is_nan());
    }

    #[test]
    fn thresholds_of_an_image() {
        let canny =
            |level, high| Canny { sigma: 2.0_f64.sqrt(), thresholds: Thresholds::Image { level, high } };
        // 0.4 of 255 grey levels of 1 m over eight: a rise of 12.75 m per pixel.
        assert!(edges(&step(30.0, false), &canny(1.0, 0.4)).unwrap().data().iter().all(|e| *e != 1.0));
        assert!(edges(&step(60.0, false), &canny(1.0, 0.4)).unwrap().data().contains(&1.0));
        let relative = Canny { sigma: 1.0, thresholds: Thresholds::Relative { high: 0.4 } };
        assert!(edges(&step(0.001, false), &relative).unwrap().data().contains(&1.0));
        assert!(edges(&step(0.0, false), &relative).unwrap().data().iter().all(|e| *e != 1.0));
    }

    #[test]
    fn gaps_make_edges_unknown_and_numbers_are_checked() {
        let canny = Canny { sigma: 1.0, thresholds: Thresholds::Gradient { low: 0.1, high: 0.1 } };
        let found = edges(&step(1.0, true), &canny).unwrap();
        assert!(found.get(20, 5).is_nan() && found.get(20, 8).is_nan() && found.get(20, 20) >= 0.0);
        for sigma in [0.0, f64::NAN, 1e9] {
            assert!(edges(&step(1.0, false), &Canny { sigma, ..canny }).is_err());
        }
        let thresholds = Thresholds::Gradient { low: 0.2, high: 0.1 };
        assert!(edges(&step(1.0, false), &Canny { thresholds, ..canny }).is_err());
    }
}
