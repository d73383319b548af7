//! The raster of a file before it is read: its head, and where its numbers are stored.

use super::ReadOptions;
use super::chunks::Chunks;
use super::geo_keys::GeoKeys;
use super::raw::Raw;
use super::sample::Sample;
use crate::{Geometry, MapUnit, TerrainError};

/// The facts that the head of a file states about its raster.
pub(super) struct Head {
    pub(super) format: &'static str,
    pub(super) rows: u64,
    pub(super) cols: u64,
    /// Extents of a pixel to the east and to the south, if stated.
    pub(super) pixel: Option<[f64; 2]>,
    /// Coordinates of the centre of the north-western pixel.
    pub(super) north_west: [f64; 2],
    pub(super) unit: MapUnit,
    /// Radius of the body that its degrees are on, if stated, m.
    pub(super) radius_m: Option<f64>,
    pub(super) sample: Sample,
    /// Height = stored number x `scale` + `offset`, m.
    pub(super) scale: f64,
    pub(super) offset: f64,
    /// Stored numbers that stand for gaps.
    pub(super) missing: Vec<f64>,
    /// The first stored row is the southernmost.
    pub(super) south_up: bool,
    pub(super) geo_keys: Option<GeoKeys>,
}

impl Head {
    /// A head without place, scale or gaps.
    pub(super) fn plain(format: &'static str, rows: u64, cols: u64, sample: Sample) -> Head {
        Head {
            format,
            rows,
            cols,
            pixel: None,
            north_west: [0.0; 2],
            unit: MapUnit::Metre,
            radius_m: None,
            sample,
            scale: 1.0,
            offset: 0.0,
            missing: Vec::new(),
            south_up: false,
            geo_keys: None,
        }
    }

    /// The geometry, the caller's pixel before the file's.
    pub(super) fn geometry(&self, options: &ReadOptions) -> Result<Geometry, TerrainError> {
        let side = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
        let (rows, cols) = (side(self.rows), side(self.cols));
        if let Some(pixel) = options.pixel_m {
            return Geometry::square(rows, cols, pixel);
        }
        if rows == 0 || cols == 0 {
            return Err(TerrainError::Shape { rows, cols, values: 0 });
        }
        let Some(pixel) = self.pixel else {
            return Err(TerrainError::NoPixelSize { format: self.format });
        };
        Geometry::new(rows, cols, pixel, self.north_west, self.unit)
    }
}

/// The source of stored numbers.
pub(super) enum Store<R> {
    /// From uncompressed bytes.
    Raw(Raw<R>),
    /// From compressed strips or tiles.
    Chunks(Box<Chunks<R>>),
    /// From memory, row by row.
    Held(Vec<f64>),
}
