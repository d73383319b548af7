//! From an elevation map to a safe landing site.
//!
//! An [`ElevationMap`] is a [`Raster`] of heights with a [`Geometry`]. Row 0 is the northernmost, column 0 the westernmost. A gap
//! (no data) is NaN and stays a gap in every layer made from it; a gap is never safe.

mod distance;
mod error;
mod geometry;
pub mod hazard;
mod map;
mod raster;
pub mod site;

pub use distance::distance_to_nearest;
pub use error::TerrainError;
pub use geometry::{Geometry, MapUnit};
pub use map::ElevationMap;
pub use raster::Raster;
