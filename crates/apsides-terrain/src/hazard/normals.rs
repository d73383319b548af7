//! Slope as the median angle of normals.

use super::Plane;
use crate::{ElevationMap, TerrainError};

/// Median angle between the normal of a plane and the normals of a neighbourhood, rad; none if the neighbourhood of radius `radius_m`
/// leaves the map, has a gap or fewer than two pixels besides the centre.
///
/// Each pair of pixels nearer to the centre than `radius_m` has, with the centre, a normal, unless the three are on one line.
///
/// **This is not the slope of the ground.** It is measured from the fitted plane of the map, not from gravity: where the map as a whole
/// is inclined, ground that follows it passes however steep it is. A site has to be judged by [`Layer::Slope`](super::Layer::Slope) or
/// [`Layer::FootpadSlope`](super::Layer::FootpadSlope). It is here to compare with published results.
///
/// # Errors
/// A pixel outside the map; a radius that is not positive or more than 50 pixels; pixels that are not square, in metres.
///
/// # Examples
/// ```
/// use apsides_terrain::hazard::{Plane, median_normal_angle};
/// use apsides_terrain::{ElevationMap, Geometry};
///
/// // Ground that rises by a tenth to the east, against a plane that does so too and one that is level.
/// let geometry = Geometry::square(9, 9, 1.0)?;
/// let heights: Vec<f64> = (0..81).map(|k| 0.1 * f64::from(k % 9)).collect();
/// let map = ElevationMap::from_heights(geometry, &heights)?;
/// let inclined = Plane { origin_m: [0.0; 2], height_m: 0.0, east: 0.1, north: 0.0 };
/// let level = Plane { east: 0.0, ..inclined };
/// let [along, across] = [inclined, level].map(|plane| median_normal_angle(&map, &plane, 4, 4, 2.5));
/// assert!(along?.is_some_and(|angle| angle < 1e-3));
/// assert!(across?.is_some_and(|angle| (angle - 0.1_f64.atan()).abs() < 1e-6));
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn median_normal_angle(
    map: &ElevationMap,
    plane: &Plane,
    row: usize,
    col: usize,
    radius_m: f64,
) -> Result<Option<f64>, TerrainError> {
    let geometry = map.geometry();
    let pixel_m = geometry.square_pixel()?;
    let [rows, cols] = [geometry.rows(), geometry.cols()];
    if row >= rows || col >= cols {
        return Err(TerrainError::Outside { row, col, rows, cols });
    }
    let radius = radius_m / pixel_m;
    if !(radius > 0.0 && radius <= 50.0) {
        let allowed = "it must be positive and at most 50 pixels";
        return Err(TerrainError::Number { name: "radius_m", value: radius_m, allowed: allowed.into() });
    }
    let reach = radius.ceil() as i64;
    let Some(centre) = map.height(row, col) else { return Ok(None) };
    let mut spokes = Vec::new();
    for south in -reach..=reach {
        for east in -reach..=reach {
            let distance = ((south * south + east * east) as f64).sqrt();
            if distance == 0.0 || distance >= radius - 1e-9 {
                continue;
            }
            let (r, c) = (row as i64 + south, col as i64 + east);
            if r < 0 || c < 0 || r >= rows as i64 || c >= cols as i64 {
                return Ok(None);
            }
            let Some(height) = map.height(r as usize, c as usize) else { return Ok(None) };
            spokes.push([east as f64 * pixel_m, -(south as f64) * pixel_m, height - centre]);
        }
    }
    let of_plane = unit([-plane.east, -plane.north, 1.0]);
    let mut angles = Vec::with_capacity(spokes.len() * spokes.len() / 2);
    for (k, a) in spokes.iter().enumerate() {
        for b in &spokes[k + 1..] {
            let area = a[0] * b[1] - a[1] * b[0];
            if area.abs() <= 1e-9 * pixel_m * pixel_m {
                continue;
            }
            let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], area];
            let up = unit(normal.map(|n| n * area.signum()));
            let cosine: f64 = (0..3).map(|i| up[i] * of_plane[i]).sum();
            angles.push(cosine.clamp(-1.0, 1.0).acos());
        }
    }
    if angles.is_empty() {
        return Ok(None);
    }
    angles.sort_unstable_by(f64::total_cmp);
    let middle = angles.len() / 2;
    let lower = if angles.len().is_multiple_of(2) { middle - 1 } else { middle };
    Ok(Some(0.5 * (angles[lower] + angles[middle])))
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}
