//! Maps in degrees on the ground: square pixels in metres on a sphere.
//!
//! The projection is the equirectangular one that is true along the middle latitude `phi0` of the map:
//! east = R cos(phi0) longitude, north = R latitude (Snyder, Map Projections, 1987, eq. 12-1 and 12-2, angles in rad). A pixel is as long
//! from west to east as from north to south; rows stay what they are, and columns are interpolated linearly, which keeps planes.

use super::malformed;
use crate::{Geometry, MapUnit, TerrainError};

/// Largest part by which metres to the east may differ along the northern and southern edge.
const LARGEST_DISTORTION: f64 = 0.01;
/// Largest ratio of the sides of a pixel: columns are not interpolated over more than two.
const LARGEST_RATIO: f64 = 2.0;
/// Largest part by which the radius that a file states may differ from the one that is given.
const SAME_RADIUS: f64 = 0.01;

/// The projection of a map in degrees to metres on a sphere: equirectangular, true along one latitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equirectangular {
    /// Radius of the sphere, m.
    pub radius_m: f64,
    /// Latitude along which metres to the east are true, deg.
    pub latitude_deg: f64,
}

impl Equirectangular {
    /// Longitude and latitude (deg) of a place (east, north), m.
    #[must_use]
    pub fn degrees(&self, [east, north]: [f64; 2]) -> [f64; 2] {
        let parallel = self.radius_m * self.latitude_deg.to_radians().cos();
        [(east / parallel).to_degrees(), (north / self.radius_m).to_degrees()]
    }

    /// Place (east, north), m, of a longitude and a latitude, deg.
    #[must_use]
    pub fn metres(&self, [longitude, latitude]: [f64; 2]) -> [f64; 2] {
        let parallel = self.radius_m * self.latitude_deg.to_radians().cos();
        [parallel * longitude.to_radians(), self.radius_m * latitude.to_radians()]
    }
}

/// Columns of square pixels in metres, from columns in degrees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Columns {
    pub(super) projection: Equirectangular,
    /// Columns that are stored.
    stored: usize,
    /// Stored columns in a new one.
    ratio: f64,
}

impl Columns {
    /// The projection of a map in degrees on a sphere of `radius` metres, and the geometry in metres; `stated` is the radius in the file.
    ///
    /// # Errors
    /// A radius that is not positive or not that of the file, a map whose metres to the east differ by more than a hundredth, pixels
    /// that are more than twice as long as wide.
    pub(super) fn new(
        format: &'static str,
        from: &Geometry,
        radius_m: f64,
        stated: Option<f64>,
    ) -> Result<(Columns, Geometry), TerrainError> {
        if !(radius_m.is_finite() && radius_m > 0.0) {
            let allowed = "it must be positive and finite";
            return Err(TerrainError::Number {
                name: "radius of the body",
                value: radius_m,
                allowed: allowed.into(),
            });
        }
        if let Some(other) = stated.filter(|s| (s - radius_m).abs() > SAME_RADIUS * radius_m) {
            let (stated, given) = (other / 1e3, radius_m / 1e3);
            let problem = format!("the file states {stated} km, and the body that is given has {given} km");
            return Err(malformed(format, "radius of the body", problem));
        }
        let [east, south] = from.pixel();
        let (north, rows) = (from.position(-0.5, 0.0)[1], from.rows());
        let south_edge = from.position(rows as f64 - 0.5, 0.0)[1];
        let latitude_deg = 0.5 * (north + south_edge);
        let true_scale = latitude_deg.to_radians().cos();
        let distortion = [north, south_edge]
            .map(|l| (l.to_radians().cos() / true_scale - 1.0).abs())
            .into_iter()
            .fold(0.0, f64::max);
        let beyond = north > 90.0 || south_edge < -90.0;
        if beyond || distortion > LARGEST_DISTORTION {
            let problem = format!(
                "latitudes from {south_edge} to {north} deg: metres to the east differ by more than {} % from those in the middle; \
                 cut out a part (`gdal_translate -projwin`) or project the map (`gdalwarp -t_srs`)",
                100.0 * LARGEST_DISTORTION
            );
            return Err(malformed(format, "latitudes", problem));
        }
        let ratio = south / (east * true_scale);
        if !(1.0 / LARGEST_RATIO..=LARGEST_RATIO).contains(&ratio) {
            let problem = format!(
                "the sides of a pixel on the ground differ by a factor of {:.3}: at most {LARGEST_RATIO} is allowed; project the map \
                 (`gdalwarp -t_srs`)",
                ratio.max(1.0 / ratio)
            );
            return Err(malformed(format, "size of a pixel", problem));
        }
        // Only columns whose centre is between two stored ones.
        let cols = ((from.cols() - 1) as f64 / ratio + 1e-9) as usize + 1;
        let projection = Equirectangular { radius_m, latitude_deg };
        let pixel = radius_m * south.to_radians();
        let place = projection.metres(from.north_west());
        let geometry = Geometry::new(rows, cols, [pixel; 2], place, MapUnit::Metre)?;
        Ok((Columns { projection, stored: from.cols(), ratio }, geometry))
    }

    /// Columns that are stored.
    pub(super) fn stored(&self) -> usize {
        self.stored
    }

    /// The stored columns that new columns `first` to `first + count` need: the first and their number.
    pub(super) fn needed(&self, first: usize, count: usize) -> [usize; 2] {
        let (start, _) = self.place(first);
        let (end, part) = self.place(first + count - 1);
        [start, end - start + if part > 0.0 { 2 } else { 1 }]
    }

    /// The stored column at or west of a new one, and the part of a column beyond it.
    fn place(&self, col: usize) -> (usize, f64) {
        let x = (col as f64 * self.ratio).min((self.stored - 1) as f64);
        (x as usize, x.fract())
    }

    /// Rows of new columns from rows of stored ones; a gap where one that has a weight is a gap.
    pub(super) fn interpolate(&self, heights: &[f64], first: usize, count: usize) -> Vec<f64> {
        let [start, stored] = self.needed(first, count);
        let new_row = |row: &[f64]| {
            let value = |k: usize| {
                let (col, part) = self.place(first + k);
                let west = row[col - start];
                if part > 0.0 { (1.0 - part) * west + part * row[col - start + 1] } else { west }
            };
            (0..count).map(value).collect::<Vec<_>>()
        };
        heights.chunks_exact(stored).flat_map(new_row).collect()
    }
}
