//! Slope as the median angle of normals.

use super::Plane;
use crate::disk::ROUNDING;
use crate::{ElevationMap, TerrainError};

/// Most pixels of the radius of a neighbourhood.
const LARGEST_RADIUS: f64 = 30.0;

/// The pairs of pixels around a centre that have a normal with it.
#[derive(Clone, Debug)]
pub(super) struct NormalPairs {
    /// Pixels around the centre, to the south and to the east.
    pub(super) offsets: Vec<(isize, isize)>,
    /// Pixels from the centre within which all offsets are.
    pub(super) reach: usize,
    pixel_m: f64,
    pairs: Vec<Pair>,
}

/// Two pixels by their places among the offsets, and the gradient of the plane through them and the centre by their heights above it: to the
/// east `a[0] z_1 + a[1] z_2`, to the north `b[0] z_1 + b[1] z_2`, in pixels.
#[derive(Clone, Copy, Debug)]
struct Pair {
    places: [u16; 2],
    east: [f32; 2],
    north: [f32; 2],
}

impl NormalPairs {
    /// The pairs nearer to the centre than a radius of at most 30 pixels.
    pub(super) fn new(radius_m: f64, pixel_m: f64) -> NormalPairs {
        let radius = radius_m / pixel_m;
        let most = radius.ceil() as isize;
        let offsets: Vec<(isize, isize)> = (-most..=most)
            .flat_map(|south| (-most..=most).map(move |east| (south, east)))
            .filter(|&(south, east)| {
                let distance = ((south * south + east * east) as f64).sqrt();
                distance > 0.0 && distance < radius - ROUNDING
            })
            .collect();
        let reach = offsets.iter().map(|(south, _)| south.unsigned_abs()).max().unwrap_or(0);
        let mut pairs = Vec::new();
        for (k, first) in offsets.iter().enumerate() {
            for (l, second) in offsets.iter().enumerate().skip(k + 1) {
                let [x, y] = [first, second].map(|&(south, east)| [east as f32, -south as f32]);
                let area = x[0] * y[1] - x[1] * y[0];
                // Three pixels on one line have no normal.
                if area != 0.0 {
                    let (east, north) = ([y[1] / area, -x[1] / area], [-y[0] / area, x[0] / area]);
                    pairs.push(Pair { places: [k as u16, l as u16], east, north });
                }
            }
        }
        NormalPairs { offsets, reach, pixel_m, pairs }
    }

    /// The median angle between the normals and that of a plane, rad, by the heights of the offsets above the centre, m; none without pairs.
    /// `cosines` is memory.
    pub(super) fn median(&self, rises: &[f64], plane: &Plane, cosines: &mut Vec<f64>) -> Option<f64> {
        let (east, north) = (plane.east, plane.north);
        let length = (1.0 + east * east + north * north).sqrt();
        let scale = self.pixel_m.recip();
        cosines.clear();
        cosines.extend(self.pairs.iter().map(|pair| {
            let [first, second] = pair.places.map(|k| scale * rises[usize::from(k)]);
            let gradient = |by: [f32; 2]| f64::from(by[0]) * first + f64::from(by[1]) * second;
            let (x, y) = (gradient(pair.east), gradient(pair.north));
            (1.0 + x * east + y * north) / ((1.0 + x * x + y * y).sqrt() * length)
        }));
        if cosines.is_empty() {
            return None;
        }
        let angle = |cosine: f64| cosine.clamp(-1.0, 1.0).acos();
        let middle = cosines.len() / 2;
        let is_even = cosines.len().is_multiple_of(2);
        let (below, cosine, _) = cosines.select_nth_unstable_by(middle, f64::total_cmp);
        let cosine = *cosine;
        let other = if is_even { below.iter().copied().fold(f64::NEG_INFINITY, f64::max) } else { cosine };
        Some(0.5 * (angle(cosine) + angle(other)))
    }
}

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
/// A pixel outside the map; a radius that is not positive or more than 30 pixels; pixels that are not square, in metres.
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
    if !(radius > 0.0 && radius <= LARGEST_RADIUS) {
        let allowed = "it must be positive and at most 30 pixels";
        return Err(TerrainError::Number { name: "radius_m", value: radius_m, allowed: allowed.into() });
    }
    let Some(centre) = map.height(row, col) else { return Ok(None) };
    let pairs = NormalPairs::new(radius_m, pixel_m);
    let rise = |&(south, east): &(isize, isize)| {
        let (row, col) = (row.checked_add_signed(south)?, col.checked_add_signed(east)?);
        (row < rows && col < cols).then(|| map.height(row, col)).flatten().map(|height| height - centre)
    };
    let rises: Option<Vec<f64>> = pairs.offsets.iter().map(rise).collect();
    Ok(rises.and_then(|rises| pairs.median(&rises, plane, &mut Vec::new())))
}
