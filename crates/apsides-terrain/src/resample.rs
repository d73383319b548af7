//! Maps with other pixels: area average, bilinear, pyramids.

use rayon::prelude::*;

use crate::{ElevationMap, Geometry, Raster, TerrainError};

/// The way from the heights of a map to those of new pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resampling {
    /// Mean over the area of the new pixel, for larger pixels; a height holds all over its pixel, so that planes are kept by whole
    /// ratios of sizes only. Gaps are left out; a pixel with heights on less than half of its
    /// part of the map is a gap.
    Area,
    /// Bilinear between the four centres around the new one, for smaller pixels; a gap where one that has a weight is a gap. In
    /// the outermost half pixel the height is that of the edge.
    Bilinear,
}

/// The same ground with square pixels of `pixel` (unit of the map), its north-western corner kept. The last row and column may reach
/// beyond the map by less than a pixel.
///
/// # Errors
/// A size that is not positive and finite, or so small that the map would have more than 2^31 pixels.
pub fn resample(map: &ElevationMap, pixel: f64, by: Resampling) -> Result<ElevationMap, TerrainError> {
    let from = map.geometry();
    let extent = |count: usize, size: f64| (count as f64 * size / pixel - 1e-9).ceil().max(1.0);
    let [width, height] = from.pixel();
    let (rows, cols) = (extent(from.rows(), height), extent(from.cols(), width));
    if !(pixel.is_finite() && pixel > 0.0 && rows * cols <= f64::from(1_u32 << 31)) {
        return Err(TerrainError::Number {
            name: "size of a pixel",
            value: pixel,
            allowed: "it must be positive, finite, and give at most 2^31 pixels".into(),
        });
    }
    let corner = from.position(-0.5, -0.5);
    let geometry = Geometry::new(
        rows as usize,
        cols as usize,
        [pixel; 2],
        [corner[0] + 0.5 * pixel, corner[1] - 0.5 * pixel],
        from.unit(),
    )?;
    let ratio = [pixel / height, pixel / width];
    let data = match by {
        Resampling::Area => area(map.relative(), &geometry, ratio),
        Resampling::Bilinear => bilinear(map.relative(), &geometry, ratio),
    };
    ElevationMap::from_relative(Raster::new(geometry, data)?, map.datum())
}

/// Means over 2 x 2 pixels, gaps as in [`Resampling::Area`].
///
/// # Errors
/// None for the geometry of a map.
pub fn halve(map: &ElevationMap) -> Result<ElevationMap, TerrainError> {
    let from = map.geometry();
    let [width, height] = from.pixel();
    let geometry = Geometry::new(
        from.rows().div_ceil(2),
        from.cols().div_ceil(2),
        [2.0 * width, 2.0 * height],
        from.position(0.5, 0.5),
        from.unit(),
    )?;
    let data = area(map.relative(), &geometry, [2.0; 2]);
    ElevationMap::from_relative(Raster::new(geometry, data)?, map.datum())
}

/// A map halved again and again, as long as both sides of the result have at least `least` pixels; without the map itself.
///
/// # Errors
/// None for the geometry of a map.
pub fn pyramid(map: &ElevationMap, least: usize) -> Result<Vec<ElevationMap>, TerrainError> {
    let mut levels: Vec<ElevationMap> = Vec::new();
    loop {
        let last = levels.last().unwrap_or(map);
        let side = last.geometry().rows().min(last.geometry().cols());
        if side < 2 || side.div_ceil(2) < least {
            return Ok(levels);
        }
        let next = halve(last)?;
        levels.push(next);
    }
}

/// Pixels of the map that new pixel `k` covers, with the covered part of each.
fn covered(k: usize, ratio: f64, count: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
    let (start, end) = (k as f64 * ratio, ((k + 1) as f64 * ratio).min(count as f64));
    let last = (end - 1e-9).ceil().max(1.0) as usize;
    (start as usize..last.min(count)).map(move |i| {
        let part = (end.min((i + 1) as f64) - start.max(i as f64)).max(0.0);
        (i, part)
    })
}

fn area(from: &Raster<f32>, to: &Geometry, ratio: [f64; 2]) -> Vec<f32> {
    let (rows, cols) = (from.geometry().rows(), from.geometry().cols());
    by_row(to, |row, line| {
        let rows = covered(row, ratio[0], rows);
        for (col, out) in line.iter_mut().enumerate() {
            let (mut sum, mut valid, mut all) = (0.0, 0.0, 0.0);
            for (i, high) in rows.clone() {
                let source = from.row(i);
                for (j, wide) in covered(col, ratio[1], cols) {
                    let part = high * wide;
                    all += part;
                    if !source[j].is_nan() {
                        valid += part;
                        sum += part * f64::from(source[j]);
                    }
                }
            }
            *out = if valid > 0.0 && valid >= 0.5 * all { (sum / valid) as f32 } else { f32::NAN };
        }
    })
}

fn bilinear(from: &Raster<f32>, to: &Geometry, ratio: [f64; 2]) -> Vec<f32> {
    let place = |k: usize, ratio: f64, count: usize| {
        let x = ((k as f64 + 0.5) * ratio - 0.5).clamp(0.0, (count - 1) as f64);
        let first = (x as usize).min(count.saturating_sub(2));
        (first, x - first as f64)
    };
    let (rows, cols) = (from.geometry().rows(), from.geometry().cols());
    by_row(to, |row, line| {
        let (i, t) = place(row, ratio[0], rows);
        for (col, out) in line.iter_mut().enumerate() {
            let (j, s) = place(col, ratio[1], cols);
            let mut sum = 0.0;
            for (a, high) in [(i, 1.0 - t), (i + 1, t)] {
                for (b, wide) in [(j, 1.0 - s), (j + 1, s)] {
                    if high * wide > 0.0 {
                        sum += high * wide * f64::from(from.get(a, b));
                    }
                }
            }
            *out = sum as f32;
        }
    })
}

/// All pixels of a raster, its rows in parallel.
fn by_row(to: &Geometry, fill: impl Fn(usize, &mut [f32]) + Sync) -> Vec<f32> {
    let mut data = vec![0.0; to.pixels()];
    data.par_chunks_mut(to.cols()).enumerate().for_each(|(row, line)| fill(row, line));
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MapUnit;

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f64 = 1e-5;

    fn plane(rows: usize, cols: usize) -> ElevationMap {
        let geometry = Geometry::new(rows, cols, [1.0; 2], [100.0, 200.0], MapUnit::Metre).unwrap();
        let heights: Vec<f64> = (0..rows * cols).map(|k| height(&geometry, k / cols, k % cols)).collect();
        ElevationMap::from_heights(geometry, &heights).unwrap()
    }

    fn height(geometry: &Geometry, row: usize, col: usize) -> f64 {
        let [e, n] = geometry.position(row as f64, col as f64);
        0.25 * e - 0.5 * n
    }

    #[test]
    fn planes_are_kept_where_pixels_lie_in_the_map() {
        let map = plane(12, 18);
        for (pixel, by, size) in [
            (2.0, Resampling::Area, (6, 9)),
            (3.0, Resampling::Area, (4, 6)),
            (0.5, Resampling::Bilinear, (24, 36)),
            (3.0, Resampling::Bilinear, (4, 6)),
        ] {
            let new = resample(&map, pixel, by).unwrap();
            let g = new.geometry();
            assert_eq!((g.rows(), g.cols()), size);
            assert_eq!(g.position(-0.5, -0.5), map.geometry().position(-0.5, -0.5));
            for (row, col) in [(1, 1), (2, 3), (size.0 - 2, size.1 - 2)] {
                let error = (new.height(row, col).unwrap() - height(g, row, col)).abs();
                assert!(error < SINGLE, "{pixel} {by:?} {row} {col}: {error}");
            }
        }
    }

    #[test]
    fn means_leave_gaps_out_and_need_half_of_the_area() {
        let n = f64::NAN;
        let heights = [1.0, 2.0, n, 4.0, 5.0, 3.0, 6.0, n, n, 8.0, n, n, n, n, 9.0];
        let map = ElevationMap::from_heights(Geometry::square(3, 5, 1.0).unwrap(), &heights).unwrap();
        let half = halve(&map).unwrap();
        assert_eq!((half.geometry().rows(), half.geometry().cols()), (2, 3));
        assert_eq!(half.height(0, 0), Some(3.0)); // 1, 2, 3, 6
        assert_eq!(half.height(0, 1), None); // one of four
        assert_eq!(half.height(0, 2), Some(6.5)); // 5, 8: the part of the map
        assert_eq!(half.height(1, 0), None);
        assert_eq!(half.height(1, 2), Some(9.0));
        assert_eq!(half.geometry().north_west(), [0.5, -0.5]);
        let same = resample(&map, 2.0, Resampling::Area).unwrap();
        assert_eq!(same.height(0, 0), Some(3.0));
        assert_eq!(same.geometry(), half.geometry());
    }

    #[test]
    fn a_pyramid_keeps_the_mean() {
        let map = plane(16, 32);
        let levels = pyramid(&map, 2).unwrap();
        let sizes: Vec<_> = levels.iter().map(|l| (l.geometry().rows(), l.geometry().cols())).collect();
        assert_eq!(sizes, [(8, 16), (4, 8), (2, 4)]);
        let mean = |m: &ElevationMap| {
            m.relative().data().iter().map(|&z| f64::from(z)).sum::<f64>() / m.geometry().pixels() as f64
        };
        for level in &levels {
            assert!((mean(level) - mean(&map)).abs() < SINGLE);
        }
        assert!(pyramid(&plane(1, 1), 1).unwrap().is_empty());
    }

    #[test]
    fn sizes_that_cannot_be() {
        for pixel in [0.0, -1.0, f64::NAN, 1e-9] {
            assert!(matches!(
                resample(&plane(3, 3), pixel, Resampling::Area),
                Err(TerrainError::Number { .. })
            ));
        }
        let one = resample(&plane(3, 3), 100.0, Resampling::Area).unwrap();
        assert_eq!((one.geometry().rows(), one.geometry().cols()), (1, 1));
    }
}
