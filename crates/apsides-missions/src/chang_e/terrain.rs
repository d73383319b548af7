//! Elevation maps of a landing: from files or from the generator.

use std::io::BufReader;
use std::path::PathBuf;

use apsides_pipeline::values::Values;
use apsides_pipeline::{Error, regular_file};
use apsides_terrain::io::{ReadOptions, read};
use apsides_terrain::synthetic::{Synthetic, Terrain};
use apsides_terrain::{ElevationMap, TerrainError};

use super::keys::{self, MapKeys};
use crate::data::BODY_RADIUS;

/// Most pixels of a map that is read in flight, 8192 x 8192: with its layers it takes some 3 GB.
const MOST_PIXELS: u64 = 1 << 26;

/// The source of an elevation map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MapSource {
    /// There is no map.
    None,
    /// The generator makes it from a seed.
    Generated,
    /// It is read from a file.
    File(PathBuf),
}

/// A map that is seen in flight, its middle below the lander, and what is wanted on it. The map itself is read when a site is chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct SiteMap {
    /// The source of the map.
    pub source: MapSource,
    /// Size of a pixel, m; none for what the file states, or the usual one of a generated map.
    pub pixel: Option<f64>,
    /// Radius of the body, which makes metres of the degrees of a file, m.
    pub body_radius: f64,
    /// Width of a generated map, m.
    pub width: f64,
    /// The criteria of a site: the name of a preset or the path of a file of criteria.
    pub criteria: String,
    /// Propellant that a site without hazard is worth more than one that is just allowed, kg.
    pub hazard_worth: f64,
    /// Largest tilt of the thrust from the vertical on the way to the site, rad.
    pub tilt: f64,
    /// Least height above the map on the way to the site, m; none where it is not limited.
    pub clearance: Option<f64>,
    /// The site that is decided on the map: east, north and up from the ground below the lander, m. Open coordinates are none.
    pub site: [Option<f64>; 3],
}

impl SiteMap {
    /// The map of values.
    pub(super) fn read(values: &Values, keys: &MapKeys) -> Result<Self, Error> {
        let [east, north, up] = keys.site;
        Ok(Self {
            source: match values.word(keys.map)? {
                keys::NO_MAP => MapSource::None,
                keys::GENERATED => MapSource::Generated,
                path => MapSource::File(path.into()),
            },
            pixel: values.limit(keys.pixel)?,
            body_radius: 1e3 * values.number(BODY_RADIUS)?,
            width: values.number(keys.width)?,
            criteria: values.word(keys.criteria)?.into(),
            hazard_worth: values.number(keys.hazard_worth)?,
            tilt: values.number(keys.tilt)?.to_radians(),
            clearance: values.optional(keys.clearance)?,
            site: [decided(values, east)?, decided(values, north)?, decided(values, up)?],
        })
    }

    /// Returns true if a site is to be chosen on the map.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.source != MapSource::None && self.site.contains(&None)
    }

    /// The map, of a size that `terrain` has unless the map has its own; none where there is no map.
    pub(super) fn map(
        &self,
        keys: &MapKeys,
        terrain: Terrain,
        seed: u64,
    ) -> Result<Option<ElevationMap>, Error> {
        let key = keys.map;
        let path = match &self.source {
            MapSource::None => return Ok(None),
            MapSource::Generated => {
                let made = Synthetic::new(self.sized(terrain), seed).and_then(|s| s.map());
                return made.map(Some).map_err(|e| Error::in_mission(format!("`{key}`: {e}")));
            }
            MapSource::File(path) => path,
        };
        let file = regular_file::open(path).map_err(|e| Error::File {
            path: path.clone(),
            reason: format!("{e}; `{key}` takes \"{}\", \"{}\" or a map file", keys::NO_MAP, keys::GENERATED),
        })?;
        let options = ReadOptions {
            pixel_m: self.pixel,
            body_radius_m: Some(self.body_radius),
            max_pixels: MOST_PIXELS,
            ..ReadOptions::default()
        };
        read(BufReader::new(file), &options).map(Some).map_err(|e| {
            let reason = match e {
                TerrainError::NoPixelSize { format } => {
                    format!("{format}, size of a pixel: the file states none: give one with `{}`", keys.pixel)
                }
                e => e.to_string(),
            };
            Error::File { path: path.clone(), reason }
        })
    }

    fn sized(&self, terrain: Terrain) -> Terrain {
        let pixel = self.pixel.unwrap_or(terrain.pixel);
        let side = (self.width / pixel).round() as usize;
        Terrain { rows: side, cols: side, pixel, ..terrain }
    }
}

/// A number that is decided in flight; an infinite one in a file is open too.
pub(super) fn decided(values: &Values, path: &str) -> Result<Option<f64>, Error> {
    Ok(values.optional(path)?.filter(|v| v.is_finite()))
}
