//! Edges of a map by J. Canny, IEEE Trans. Pattern Anal. Mach. Intell. 8 (1986) 679, doi 10.1109/TPAMI.1986.4767851.
//!
//! Heights are smoothed, the gradient is taken relative to its largest value, ridges of it are kept, and of these the chains that reach the upper
//! threshold somewhere; no part of a chain is below a lower threshold, which is a fixed part of the upper one. Instead of the edges for one
//! threshold there is for each pixel the largest threshold that makes it one.

use std::collections::BinaryHeap;

use crate::{Raster, TerrainError};

/// The lower threshold by the upper one.
const LOWER_PART: f32 = 0.4;
/// Weights of the smoothing along a row or a column: a normal distribution of one pixel.
const WEIGHTS: [f32; 5] = [0.054_488_68, 0.244_201_34, 0.402_619_96, 0.244_201_34, 0.054_488_68];

/// The largest upper threshold, as a part of the largest gradient of the map, at which each pixel is on an edge; 0 where it is on none. Gaps
/// count as level ground.
pub(super) fn edge_strength(heights: &Raster<f32>) -> Result<Raster<f32>, TerrainError> {
    let geometry = *heights.geometry();
    let grid = Pixels { rows: geometry.rows(), cols: geometry.cols() };
    let known: Vec<f32> = heights.data().iter().map(|h| if h.is_finite() { *h } else { 0.0 }).collect();
    let ridge = ridges(&grid, &grid.smooth(&grid.smooth(&known, [0, 1]), [1, 0]));
    Raster::new(geometry, chained(&grid, &ridge))
}

/// Rows and columns of values in one list.
struct Pixels {
    rows: usize,
    cols: usize,
}

impl Pixels {
    /// The place of a pixel beside another; none outside the map.
    fn beside(&self, k: usize, [south, east]: [i64; 2]) -> Option<usize> {
        let (row, col) = ((k / self.cols) as i64 + south, (k % self.cols) as i64 + east);
        let inside = (0..self.rows as i64).contains(&row) && (0..self.cols as i64).contains(&col);
        inside.then(|| row as usize * self.cols + col as usize)
    }

    /// The place of a pixel beside another, or the one at the border of the map that is nearest to it.
    fn nearest(&self, k: usize, [south, east]: [i64; 2]) -> usize {
        let clamp = |at: usize, step: i64, n: usize| (at as i64 + step).clamp(0, n as i64 - 1) as usize;
        clamp(k / self.cols, south, self.rows) * self.cols + clamp(k % self.cols, east, self.cols)
    }

    /// Values smoothed along a direction.
    fn smooth(&self, values: &[f32], [south, east]: [i64; 2]) -> Vec<f32> {
        let at = |k: usize, step: i64| values[self.nearest(k, [south * step, east * step])];
        (0..values.len()).map(|k| WEIGHTS.iter().zip(-2..).map(|(w, step)| w * at(k, step)).sum()).collect()
    }
}

/// The gradient by its largest value where it is no less than both neighbours along it, to the nearest of eight directions; else 0.
fn ridges(grid: &Pixels, heights: &[f32]) -> Vec<f32> {
    let rise = |k: usize, [south, east]: [i64; 2]| {
        0.5 * (heights[grid.nearest(k, [south, east])] - heights[grid.nearest(k, [-south, -east])])
    };
    let gradient: Vec<[f32; 2]> = (0..heights.len()).map(|k| [rise(k, [0, 1]), rise(k, [1, 0])]).collect();
    let largest = gradient.iter().map(|[x, y]| x.hypot(*y)).fold(f32::MIN_POSITIVE, f32::max);
    let size: Vec<f32> = gradient.iter().map(|[x, y]| x.hypot(*y) / largest).collect();
    let at = |k: usize, step| grid.beside(k, step).map_or(0.0, |k| size[k]);
    let ridge = |(k, [x, y]): (usize, &[f32; 2])| {
        let turn = (y.atan2(*x) * 4.0 / std::f32::consts::PI).round() as i64;
        let [south, east] = match turn.rem_euclid(4) {
            0 => [0, 1],
            1 => [1, 1],
            2 => [1, 0],
            _ => [1, -1],
        };
        let own = size[k];
        if own >= at(k, [south, east]) && own >= at(k, [-south, -east]) { own } else { 0.0 }
    };
    gradient.iter().enumerate().map(ridge).collect()
}

/// A pixel and the threshold at which it is found to be on an edge, by which it is ordered.
#[derive(PartialEq)]
struct Found {
    threshold: f32,
    pixel: usize,
}

impl Eq for Found {}

impl Ord for Found {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.threshold.total_cmp(&other.threshold).then(self.pixel.cmp(&other.pixel))
    }
}

impl PartialOrd for Found {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// For each ridge the largest threshold of a chain through it: that of the strongest ridge of the chain, or what the weakest allows. Found from the
/// strongest on, as the widest paths of a graph.
fn chained(grid: &Pixels, ridge: &[f32]) -> Vec<f32> {
    let mut strength = ridge.to_vec();
    let ridges = ridge.iter().enumerate().filter(|(_, own)| **own > 0.0);
    let mut open: BinaryHeap<Found> = ridges.map(|(pixel, own)| Found { threshold: *own, pixel }).collect();
    while let Some(Found { threshold, pixel }) = open.pop() {
        if threshold < strength[pixel] {
            continue;
        }
        for step in (-1..=1).flat_map(|south| (-1..=1).map(move |east| [south, east])) {
            let Some(next) = grid.beside(pixel, step) else { continue };
            let through = threshold.min(ridge[next] / LOWER_PART);
            if through > strength[next] {
                strength[next] = through;
                open.push(Found { threshold: through, pixel: next });
            }
        }
    }
    strength
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    /// Rounding of single precision.
    const SINGLE: f32 = 1e-6;

    fn strength(cols: usize, heights: Vec<f32>) -> Raster<f32> {
        let geometry = Geometry::square(heights.len() / cols, cols, 1.0).unwrap();
        edge_strength(&Raster::new(geometry, heights).unwrap()).unwrap()
    }

    /// A wall across the map is an edge along it at any threshold, and nothing else is one.
    #[test]
    fn a_wall_is_an_edge() {
        let found = strength(30, (0..600).map(|k| if k % 30 < 15 { 0.0 } else { 10.0 }).collect());
        for row in 0..20 {
            let columns: Vec<usize> = (0..30).filter(|c| found.get(row, *c) > 0.0).collect();
            assert!(
                !columns.is_empty() && columns.iter().all(|c| (14..=15).contains(c)),
                "{row}: {columns:?}"
            );
            assert!(columns.iter().all(|c| (found.get(row, *c) - 1.0).abs() < SINGLE), "{row}");
        }
    }

    /// A second wall of a third of the height, apart from the first, is one up to a third; joined to the first at its end it is one up to a third
    /// over the part of the lower threshold, since its chain reaches the upper one.
    #[test]
    fn chains_carry_their_strongest_part() {
        let apart = strength(40, (0..800).map(|k| [0.0, 3.0, 12.0][(k % 40 + 7) / 20]).collect());
        assert!(
            (apart.get(10, 12) - 1.0 / 3.0).abs() < SINGLE || (apart.get(10, 13) - 1.0 / 3.0).abs() < SINGLE
        );
        let chain = |ridge: &[f32]| chained(&Pixels { rows: 1, cols: ridge.len() }, ridge);
        assert_eq!(chain(&[1.0, 0.3, 0.2]), [1.0, 0.3 / LOWER_PART, 0.2 / LOWER_PART]);
        assert_eq!(chain(&[1.0, 0.0, 0.2]), [1.0, 0.0, 0.2]);
        assert_eq!(chain(&[0.5, 0.1, 0.9]), [0.5, 0.1 / LOWER_PART, 0.9]);
    }

    /// Level ground and gaps have no edge.
    #[test]
    fn level_ground_has_none() {
        let level = strength(20, vec![3.0; 400]);
        assert!(level.data().iter().all(|s| *s == 0.0));
        assert!(strength(20, vec![f32::NAN; 400]).data().iter().all(|s| *s == 0.0));
    }
}
