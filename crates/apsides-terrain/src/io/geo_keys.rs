//! Geokeys of a GeoTIFF (OGC 19-008r4).

use crate::MapUnit;

pub(super) const MODEL_TYPE: u16 = 1024;
pub(super) const RASTER_TYPE: u16 = 1025;
pub(super) const ANGULAR_UNITS: u16 = 2054;
/// Semi-major axis of the ellipsoid, m.
pub(super) const SEMI_MAJOR_AXIS: u16 = 2057;
pub(super) const LINEAR_UNITS: u16 = 3076;
pub(super) const LINEAR_UNIT_SIZE: u16 = 3077;
pub(super) const VERTICAL_UNITS: u16 = 4099;
pub(super) const METRE: u16 = 9001;
pub(super) const DEGREE: u16 = 9102;
pub(super) const USER_DEFINED: u16 = 32767;
/// Tag of the real parameters.
pub(super) const DOUBLES: u16 = 34736;

/// Geokeys, as the three tags of a GeoTIFF hold them: what the map coordinates mean.
#[derive(Clone, Debug, PartialEq)]
pub struct GeoKeys {
    /// Version, revision, minor revision, number of keys, then four numbers for each key (tag 34735).
    pub directory: Vec<u16>,
    /// Real parameters (tag 34736).
    pub doubles: Vec<f64>,
    /// Text parameters, each closed by a vertical bar (tag 34737).
    pub text: String,
}

impl GeoKeys {
    /// Keys of a map in `unit` without a named reference system, its pixels being areas.
    pub(super) fn plain(unit: MapUnit) -> GeoKeys {
        let keys: [[u16; 4]; 4] = match unit {
            MapUnit::Metre => [
                [MODEL_TYPE, 0, 1, 1],
                [RASTER_TYPE, 0, 1, 1],
                [3072, 0, 1, USER_DEFINED],
                [LINEAR_UNITS, 0, 1, METRE],
            ],
            MapUnit::Degree => [
                [MODEL_TYPE, 0, 1, 2],
                [RASTER_TYPE, 0, 1, 1],
                [2048, 0, 1, USER_DEFINED],
                [ANGULAR_UNITS, 0, 1, DEGREE],
            ],
        };
        let directory = [[1, 1, 0, keys.len() as u16]].iter().chain(&keys).flatten().copied().collect();
        GeoKeys { directory, doubles: Vec::new(), text: String::new() }
    }

    /// Value of a key that is stored in the directory itself.
    pub fn short(&self, key: u16) -> Option<u16> {
        let entry = self.directory.get(4..)?.chunks_exact(4).find(|e| e[0] == key && e[1] == 0)?;
        Some(entry[3])
    }

    /// First real parameter of a key.
    pub fn double(&self, key: u16) -> Option<f64> {
        let entry = self.directory.get(4..)?.chunks_exact(4).find(|e| e[0] == key && e[1] == DOUBLES)?;
        self.doubles.get(usize::from(entry[3])).copied()
    }

    /// The same keys with `value` in `key`, if the key is there.
    pub(super) fn with(mut self, key: u16, value: u16) -> GeoKeys {
        for entry in self.directory.get_mut(4..).unwrap_or_default().chunks_exact_mut(4) {
            if entry[0] == key && entry[1] == 0 {
                entry[3] = value;
            }
        }
        self
    }

    /// The same keys for pixels that are areas.
    pub(super) fn for_areas(self) -> GeoKeys {
        self.with(RASTER_TYPE, 1)
    }
}
