//! Units of map coordinates.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Unit of map coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MapUnit {
    /// Metres east and north.
    Metre,
    /// Degrees of longitude (east) and latitude (north).
    Degree,
}

impl fmt::Display for MapUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            MapUnit::Metre => "m",
            MapUnit::Degree => "deg",
        })
    }
}
