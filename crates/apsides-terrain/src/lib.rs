//! From an elevation map to a safe landing site.
//!
//! An [`ElevationMap`] is a [`Raster`] of heights with a [`Geometry`]. Row 0 is the northernmost, column 0 the westernmost. A gap
//! (no data) is NaN and stays a gap in every layer made from it; a gap is never safe.

pub mod contact;
mod error;
mod geometry;
pub mod io;
mod map;
mod raster;

pub use error::TerrainError;
pub use geometry::{Geometry, MapUnit};
pub use map::ElevationMap;
pub use raster::Raster;
