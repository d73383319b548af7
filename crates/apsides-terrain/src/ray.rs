//! Straight rays over a map: does the ground stand in the way?

use crate::Raster;

/// Side of the tiles whose highest ground is kept, pixels.
const TILE: usize = 16;

/// The first thing that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meets {
    /// Nothing on the map.
    Nothing,
    /// Ground above the ray.
    Ground,
    /// No known ground above it, but a gap.
    Gap,
}

/// A ray from a pixel, in steps of one row or one column, whichever it crosses faster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    /// Row and column where it starts.
    pub(crate) from: [usize; 2],
    /// Height where it starts, m.
    pub(crate) height: f64,
    /// Rows and columns per step; the larger of the two is 1 or -1.
    pub(crate) step: [f64; 2],
    /// Rise per step, m.
    pub(crate) rise: f64,
    /// Steps to its end, which is left out.
    pub(crate) length: f64,
}

/// A map with the highest ground of its tiles.
///
/// The ground between two neighbouring centres of a row or a column is a straight line; rays are compared with it wherever they cross
/// a column (if they go more to the east or west) or a row. A gap may be as high as the highest pixel of the map, not higher. Tiles
/// below a ray are passed over, which changes nothing in the result.
pub(crate) struct RayGround<'a> {
    heights: &'a Raster<f32>,
    tiles: Vec<f64>,
    tile_cols: usize,
    highest: f64,
}

impl<'a> RayGround<'a> {
    pub(crate) fn new(heights: &'a Raster<f32>) -> RayGround<'a> {
        let (rows, cols) = (heights.geometry().rows(), heights.geometry().cols());
        let highest = heights.data().iter().fold(f32::NEG_INFINITY, |h, &z| h.max(z));
        let (tile_rows, tile_cols) = (rows.div_ceil(TILE), cols.div_ceil(TILE));
        let mut tiles = vec![f64::NEG_INFINITY; tile_rows * tile_cols];
        for (tile, top) in tiles.iter_mut().enumerate() {
            let (first_row, first_col) = (tile / tile_cols * TILE, tile % tile_cols * TILE);
            // A point between two pixels needs both: one more row and column.
            for row in first_row..(first_row + TILE + 1).min(rows) {
                for &z in &heights.row(row)[first_col..(first_col + TILE + 1).min(cols)] {
                    *top = top.max(f64::from(if z.is_nan() { highest } else { z }));
                }
            }
        }
        RayGround { heights, tiles, tile_cols, highest: f64::from(highest) }
    }

    pub(crate) fn meets(&self, ray: &Ray) -> Meets {
        let (rows, cols) = (self.heights.geometry().rows(), self.heights.geometry().cols());
        let last = [(rows - 1) as f64, (cols - 1) as f64];
        let start = ray.from.map(|x| x as f64);
        let mut unknown = false;
        let mut k = 1.0;
        while k < ray.length {
            let at = [start[0] + k * ray.step[0], start[1] + k * ray.step[1]];
            let height = ray.height + k * ray.rise;
            if (0..2).any(|a| !(0.0..=last[a]).contains(&at[a])) || (ray.rise >= 0.0 && height > self.highest)
            {
                break;
            }
            let (row, col) = (at[0] as usize, at[1] as usize);
            let top = self.tiles[row / TILE * self.tile_cols + col / TILE];
            if height > top {
                let steps = (0..2)
                    .map(|a| within_tile(at[a], ray.step[a]))
                    .fold(f64::INFINITY, f64::min)
                    .floor()
                    .max(1.0);
                // A margin for rounding; a falling ray has to be above the tile where it leaves it.
                let lowest = height.min(ray.height + (k + steps) * ray.rise);
                if lowest > top + 1e-9 * top.abs() {
                    k += steps;
                    continue;
                }
            }
            let ground = self.between(at);
            if ground >= height {
                return Meets::Ground;
            }
            unknown |= ground.is_nan() && height <= self.highest;
            k += 1.0;
        }
        if unknown { Meets::Gap } else { Meets::Nothing }
    }

    /// Height of a point on the line between two neighbouring pixels; NaN if one of them is a gap.
    fn between(&self, at: [f64; 2]) -> f64 {
        let (row, col) = (at[0] as usize, at[1] as usize);
        let (down, right) = (at[0] - row as f64, at[1] - col as f64);
        let z = |row, col| f64::from(self.heights.get(row, col));
        let first = z(row, col);
        if down > 0.0 {
            first + down * (z(row + 1, col) - first)
        } else if right > 0.0 {
            first + right * (z(row, col + 1) - first)
        } else {
            first
        }
    }
}

/// Steps of which all stay in the tile.
fn within_tile(at: f64, step: f64) -> f64 {
    let start = (at as usize / TILE * TILE) as f64;
    if step > 0.0 {
        (start + TILE as f64 - at) / step
    } else if step < 0.0 {
        (at - start) / -step
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{ElevationMap, Geometry};

    /// A rough map that needs no generator: sines of incommensurate waves, with some gaps.
    pub(crate) fn rough(rows: usize, cols: usize, gaps: bool) -> ElevationMap {
        let geometry = Geometry::square(rows, cols, 2.0).unwrap();
        let heights: Vec<f64> = (0..rows * cols)
            .map(|k| {
                let (r, c) = ((k / cols) as f64, (k % cols) as f64);
                let spike = if k % 97 == 13 { 4.0 } else { 0.0 };
                let z = 6.0 * (0.11 * r).sin() * (0.07 * c).cos() + (0.9 * r + 1.7 * c).sin() + spike;
                if gaps && k % 211 == 50 { f64::NAN } else { z }
            })
            .collect();
        ElevationMap::from_heights(geometry, &heights).unwrap()
    }

    /// The definition, step by step.
    pub(crate) fn meets_by_definition(heights: &Raster<f32>, ray: &Ray) -> Meets {
        let highest = heights.data().iter().filter(|z| !z.is_nan()).fold(f64::MIN, |h, &z| h.max(z.into()));
        let (rows, cols) = (heights.geometry().rows() as f64, heights.geometry().cols() as f64);
        let mut met = Meets::Nothing;
        let mut k = 1.0;
        while k < ray.length {
            let (r, c) = (ray.from[0] as f64 + k * ray.step[0], ray.from[1] as f64 + k * ray.step[1]);
            if r < 0.0 || c < 0.0 || r > rows - 1.0 || c > cols - 1.0 {
                break;
            }
            let z = |r: f64, c: f64| f64::from(heights.get(r as usize, c as usize));
            let first = z(r.floor(), c.floor());
            let part = (r - r.floor()) + (c - c.floor());
            let ground = if part > 0.0 { first + part * (z(r.ceil(), c.ceil()) - first) } else { first };
            let height = ray.height + k * ray.rise;
            if ground >= height {
                return Meets::Ground;
            }
            if ground.is_nan() && height <= highest {
                met = Meets::Gap;
            }
            k += 1.0;
        }
        met
    }

    #[test]
    fn passing_over_tiles_changes_nothing() {
        for gaps in [false, true] {
            let map = rough(70, 90, gaps);
            let ground = RayGround::new(map.relative());
            let mut counts = [0; 3];
            for k in 0..40_000_usize {
                let from = [(k * 31) % 70, (k * 17) % 90];
                let angle = 0.37 * k as f64;
                let (s, c) = angle.sin_cos();
                let scale = s.abs().max(c.abs());
                let step = if s.abs() > c.abs() { [s.signum(), c / scale] } else { [s / scale, c.signum()] };
                let rise = [0.02, 0.3, 0.9, -0.1, -0.4][k % 5];
                let height =
                    f64::from(map.relative().get(from[0], from[1])) + f64::from((k % 3) as u32) * 3.0;
                if height.is_nan() {
                    continue;
                }
                let length = [f64::INFINITY, 20.5][k % 2];
                let ray = Ray { from, height, step, rise, length };
                let found = ground.meets(&ray);
                assert_eq!(found, meets_by_definition(map.relative(), &ray), "{ray:?}");
                counts[found as usize] += 1;
            }
            assert!(counts[0] > 1000 && counts[1] > 1000 && (counts[2] > 100) == gaps, "{counts:?}");
        }
    }
}
