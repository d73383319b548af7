//! Illumination and cast shadows for a given Sun.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use crate::ray::{Meets, Ray, RayGround};
use crate::{ElevationMap, Raster, TerrainError};

/// Direction of a point-like Sun at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    azimuth: f64,
    elevation: f64,
}

impl Sun {
    /// From the azimuth, rad, clockwise from north (row 0), and the elevation over the horizontal, rad.
    ///
    /// # Errors
    /// An azimuth that is not finite; an elevation outside (0, pi/2].
    pub fn new(azimuth: f64, elevation: f64) -> Result<Sun, TerrainError> {
        if !azimuth.is_finite() {
            return Err(TerrainError::Number {
                name: "azimuth of the Sun, rad",
                value: azimuth,
                allowed: "it must be finite".into(),
            });
        }
        if !(elevation > 0.0 && elevation <= FRAC_PI_2) {
            return Err(TerrainError::Number {
                name: "elevation of the Sun, rad",
                value: elevation,
                allowed: "it must be above 0 and at most pi/2".into(),
            });
        }
        Ok(Sun { azimuth, elevation })
    }

    /// Azimuth, rad, clockwise from north.
    pub fn azimuth(&self) -> f64 {
        self.azimuth
    }

    /// Elevation over the horizontal, rad.
    pub fn elevation(&self) -> f64 {
        self.elevation
    }

    /// Unit vector towards the Sun (east, north, up).
    pub fn direction(&self) -> [f64; 3] {
        let ((sa, ca), (se, ce)) = (self.azimuth.sin_cos(), self.elevation.sin_cos());
        [sa * ce, ca * ce, se]
    }
}

/// Cosine of the angle of incidence, 0 where the ground faces away from the Sun: the brightness of a Lambert surface, without cast
/// shadows.
///
/// Gradients are central differences, at the edge of the map one-sided; NaN where a pixel that they need is a gap.
///
/// # Errors
/// Pixels that are not square or in degrees.
pub fn incidence(map: &ElevationMap, sun: &Sun) -> Result<Raster<f32>, TerrainError> {
    let pixel = map.geometry().square_pixel()?;
    let heights = map.relative();
    let (rows, cols) = (map.geometry().rows(), map.geometry().cols());
    let [east, north, up] = sun.direction();
    fill(map, |row, col| {
        let z = |row: usize, col: usize| f64::from(heights.get(row, col));
        let (west_col, east_col) = (col.saturating_sub(1), (col + 1).min(cols - 1));
        let (north_row, south_row) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let over = |count: usize| pixel * count.max(1) as f64;
        let by_east = (z(row, east_col) - z(row, west_col)) / over(east_col - west_col);
        let by_north = (z(north_row, col) - z(south_row, col)) / over(south_row - north_row);
        let normal = (1.0 + by_east * by_east + by_north * by_north).sqrt();
        let cosine = (up - east * by_east - north * by_north) / normal;
        if cosine.is_nan() || z(row, col).is_nan() { f32::NAN } else { cosine.max(0.0) as f32 }
    })
}

/// Cast shadows: 1 where the Sun is seen from the centre of a pixel, 0 where ground stands in between; NaN in gaps and where it
/// depends on a gap. Ground outside the map casts no shadow.
///
/// Rays are compared with the straight lines between neighbouring centres wherever they cross a column (if the Sun is more to the
/// east or west) or a row; a gap is taken to be no higher than the highest pixel of the map.
///
/// # Errors
/// Pixels that are not square or in degrees.
///
/// # Examples
/// ```
/// use apsides_terrain::light::{Sun, cast_shadow};
/// use apsides_terrain::{ElevationMap, Geometry};
///
/// // A wall of 5 m on the flat, along the column 20 m east.
/// let geometry = Geometry::square(41, 41, 1.0)?;
/// let heights: Vec<f64> = (0..41 * 41).map(|k| if k % 41 == 20 { 5.0 } else { 0.0 }).collect();
/// let map = ElevationMap::from_heights(geometry, &heights)?;
/// // The Sun in the west, 45 deg high: the shadow of the wall ends 5 m behind it.
/// let lit = cast_shadow(&map, &Sun::new(-0.5 * std::f64::consts::PI, 0.25 * std::f64::consts::PI)?)?;
/// assert_eq!([19, 22, 24, 26].map(|col| lit.get(20, col)), [1.0, 0.0, 0.0, 1.0]);
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn cast_shadow(map: &ElevationMap, sun: &Sun) -> Result<Raster<f32>, TerrainError> {
    let pixel = map.geometry().square_pixel()?;
    let ground = RayGround::new(map.relative());
    let (s, c) = sun.azimuth.sin_cos();
    let scale = s.abs().max(c.abs());
    let step = if s.abs() > c.abs() { [-c / scale, s.signum()] } else { [-c.signum(), s / scale] };
    let rise = pixel * step[0].hypot(step[1]) * sun.elevation.tan();
    fill(map, |row, col| {
        let height = f64::from(map.relative().get(row, col));
        if height.is_nan() {
            return f32::NAN;
        }
        match ground.meets(&Ray { from: [row, col], height, step, rise, length: f64::INFINITY }) {
            Meets::Nothing => 1.0,
            Meets::Ground => 0.0,
            Meets::Gap => f32::NAN,
        }
    })
}

/// A raster over the map of a function of row and column, its rows in parallel.
pub(crate) fn fill(
    map: &ElevationMap,
    of: impl Fn(usize, usize) -> f32 + Sync,
) -> Result<Raster<f32>, TerrainError> {
    let geometry = *map.geometry();
    let mut data = vec![0.0; geometry.pixels()];
    data.par_chunks_mut(geometry.cols()).enumerate().for_each(|(row, line)| {
        line.iter_mut().enumerate().for_each(|(col, value)| *value = of(row, col));
    });
    Raster::new(geometry, data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;
    use crate::ray::tests::{meets_by_definition, rough};

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f64 = 1e-6;

    fn deg(x: f64) -> f64 {
        x.to_radians()
    }

    #[test]
    fn a_plane_has_the_cosine_between_normal_and_sun() {
        let geometry = Geometry::square(5, 6, 2.0).unwrap();
        let (by_east, by_north) = (0.2, -0.1);
        let heights: Vec<f64> = (0..30)
            .map(|k| {
                let [e, n] = geometry.position((k / 6) as f64, (k % 6) as f64);
                by_east * e + by_north * n
            })
            .collect();
        let map = ElevationMap::from_heights(geometry, &heights).unwrap();
        let sun = Sun::new(deg(120.0), deg(25.0)).unwrap();
        let normal = [-by_east, -by_north, 1.0_f64].map(|x| x / 1.05_f64.sqrt());
        let expected: f64 = normal.iter().zip(sun.direction()).map(|(a, b)| a * b).sum();
        for found in incidence(&map, &sun).unwrap().data() {
            assert!((f64::from(*found) - expected).abs() < SINGLE);
        }
    }

    /// A wall of 10 m casts a shadow of 10 m / tan(elevation) away from the Sun.
    #[test]
    fn length_and_side_of_the_shadow_of_a_wall() {
        let heights: Vec<f64> = (0..41 * 41).map(|k| if k % 41 == 20 { 10.0 } else { 0.0 }).collect();
        let map = ElevationMap::from_heights(Geometry::square(41, 41, 1.0).unwrap(), &heights).unwrap();
        // The Sun in the east, 45.0 degrees high seen along the ray: 10 m to the west, the tip excluded by the slanted wall side.
        let sun = Sun::new(deg(90.0), (10.0_f64 / 7.5).atan()).unwrap();
        let lit = cast_shadow(&map, &sun).unwrap();
        let dark: Vec<usize> = (0..41).filter(|&c| lit.get(30, c) == 0.0).collect();
        assert_eq!(dark, [13, 14, 15, 16, 17, 18, 19]);
        // From the north-east the way across is longer by sqrt(2); rows near the north edge see past it.
        let sun = Sun::new(deg(45.0), (10.0 / (7.5 * 2.0_f64.sqrt())).atan()).unwrap();
        let lit = cast_shadow(&map, &sun).unwrap();
        let dark: Vec<usize> = (0..41).filter(|&c| lit.get(30, c) == 0.0).collect();
        assert_eq!(dark, [13, 14, 15, 16, 17, 18, 19]);
        assert_eq!(lit.get(3, 14), 1.0);
        assert!(
            cast_shadow(&map, &Sun::new(0.0, FRAC_PI_2).unwrap()).unwrap().data().iter().all(|l| *l == 1.0)
        );
    }

    #[test]
    fn shadows_are_those_of_the_definition() {
        for (gaps, azimuth, elevation) in [(false, 33.0, 4.0), (true, 200.0, 9.0), (true, 290.0, 30.0)] {
            let map = rough(60, 75, gaps);
            let sun = Sun::new(deg(azimuth), deg(elevation)).unwrap();
            let lit = cast_shadow(&map, &sun).unwrap();
            let (s, c) = sun.azimuth().sin_cos();
            let scale = s.abs().max(c.abs());
            let step = if s.abs() > c.abs() { [-c / scale, s.signum()] } else { [-c.signum(), s / scale] };
            let rise = 2.0 * step[0].hypot(step[1]) * sun.elevation().tan();
            for (row, col) in (0..60).flat_map(|r| (0..75).map(move |c| (r, c))) {
                let Some(height) = map.height(row, col) else {
                    assert!(lit.get(row, col).is_nan());
                    continue;
                };
                let ray =
                    Ray { from: [row, col], height: height - map.datum(), step, rise, length: f64::INFINITY };
                let expected = meets_by_definition(map.relative(), &ray);
                let found = lit.get(row, col);
                assert_eq!(found.is_nan(), expected == Meets::Gap);
                assert!(found.is_nan() || (found == 1.0) == (expected == Meets::Nothing));
            }
        }
    }

    #[test]
    fn a_sun_below_the_horizon_is_refused() {
        for (azimuth, elevation) in [(0.0, 0.0), (0.0, -0.1), (0.0, 2.0), (f64::NAN, 0.5), (0.0, f64::NAN)] {
            assert!(matches!(Sun::new(azimuth, elevation), Err(TerrainError::Number { .. })));
        }
    }
}
