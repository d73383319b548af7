//! Edges of a map by J. Canny, IEEE Trans. Pattern Anal. Mach. Intell. 8 (1986) 679, doi 10.1109/TPAMI.1986.4767851.
//!
//! Heights are smoothed, the gradient is taken relative to its largest value, ridges of it are kept, and of these the chains that reach the upper
//! threshold somewhere.

use apsides_terrain::{Raster, TerrainError};

/// The threshold of the paper; the lower one is four tenths of it, as usual.
const UPPER: f32 = 0.4;
const LOWER: f32 = 0.4 * UPPER;
/// Weights of the smoothing along a row or a column: a normal distribution of one pixel.
const WEIGHTS: [f32; 5] = [0.054_488_68, 0.244_201_34, 0.402_619_96, 0.244_201_34, 0.054_488_68];

/// True on edges. Gaps count as level ground.
pub(super) fn edges(heights: &Raster<f32>) -> Result<Raster<bool>, TerrainError> {
    let geometry = *heights.geometry();
    let (rows, cols) = (geometry.rows(), geometry.cols());
    let known: Vec<f32> = heights.data().iter().map(|h| if h.is_finite() { *h } else { 0.0 }).collect();
    let clamp = |k: i64, n: usize| k.clamp(0, n as i64 - 1) as usize;
    let smooth = |from: &[f32], down: bool| -> Vec<f32> {
        let mut to = Vec::with_capacity(from.len());
        for r in 0..rows {
            for c in 0..cols {
                let at = |k: i64| {
                    let (r, c) =
                        if down { (clamp(r as i64 + k, rows), c) } else { (r, clamp(c as i64 + k, cols)) };
                    from.get(r * cols + c).copied().unwrap_or(0.0)
                };
                to.push(WEIGHTS.iter().zip(-2..).map(|(w, k)| w * at(k)).sum());
            }
        }
        to
    };
    let smoothed = smooth(&smooth(&known, false), true);
    let at = |r: i64, c: i64| smoothed.get(clamp(r, rows) * cols + clamp(c, cols)).copied().unwrap_or(0.0);
    let mut gradient = Vec::with_capacity(smoothed.len());
    for r in 0..rows as i64 {
        for c in 0..cols as i64 {
            gradient.push([0.5 * (at(r, c + 1) - at(r, c - 1)), 0.5 * (at(r + 1, c) - at(r - 1, c))]);
        }
    }
    let largest = gradient.iter().map(|[x, y]| x.hypot(*y)).fold(0.0_f32, f32::max);
    let size = |r: i64, c: i64| {
        let inside = (0..rows as i64).contains(&r) && (0..cols as i64).contains(&c);
        let g = gradient.get(r as usize * cols + c as usize).filter(|_| inside);
        g.map_or(0.0, |[x, y]| x.hypot(*y) / largest.max(f32::MIN_POSITIVE))
    };
    // Ridges: no less than both neighbours along the gradient, to the nearest of eight directions.
    let mut ridge = vec![0.0_f32; gradient.len()];
    let mut strong = Vec::new();
    for r in 0..rows as i64 {
        for c in 0..cols as i64 {
            let k = r as usize * cols + c as usize;
            let Some([x, y]) = gradient.get(k) else { continue };
            let turn = (y.atan2(*x) * 4.0 / std::f32::consts::PI).round() as i64;
            let (dr, dc) = match turn.rem_euclid(4) {
                0 => (0, 1),
                1 => (1, 1),
                2 => (1, 0),
                _ => (1, -1),
            };
            let own = size(r, c);
            if own >= LOWER && own >= size(r + dr, c + dc) && own >= size(r - dr, c - dc) {
                if let Some(place) = ridge.get_mut(k) {
                    *place = own;
                }
                if own >= UPPER {
                    strong.push((r, c));
                }
            }
        }
    }
    // Chains that reach the upper threshold.
    let mut edge = vec![false; gradient.len()];
    while let Some((r, c)) = strong.pop() {
        if !(0..rows as i64).contains(&r) || !(0..cols as i64).contains(&c) {
            continue;
        }
        let k = r as usize * cols + c as usize;
        let (Some(found), Some(ridge)) = (edge.get_mut(k), ridge.get(k)) else { continue };
        if *found || *ridge < LOWER {
            continue;
        }
        *found = true;
        strong.extend((-1..=1).flat_map(|dr| (-1..=1).map(move |dc| (r + dr, c + dc))));
    }
    Raster::new(geometry, edge)
}

#[cfg(test)]
mod tests {
    use apsides_terrain::Geometry;

    use super::*;

    /// A wall across the map is an edge along it, and nothing else is; a plane has none that is a chain of ridges but for its border.
    #[test]
    fn a_wall_is_an_edge() {
        let geometry = Geometry::square(20, 30, 1.0).unwrap();
        let heights: Vec<f32> = (0..600).map(|k| if k % 30 < 15 { 0.0 } else { 10.0 }).collect();
        let found = edges(&Raster::new(geometry, heights).unwrap()).unwrap();
        for row in 0..20 {
            let columns: Vec<usize> = (0..30).filter(|c| found.get(row, *c)).collect();
            assert!(
                !columns.is_empty() && columns.iter().all(|c| (14..=15).contains(c)),
                "{row}: {columns:?}"
            );
        }
    }
}
