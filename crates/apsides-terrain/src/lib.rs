//! From an elevation map to a safe landing site.
//!
//! An [`ElevationMap`] is a [`Raster`] of heights with a [`Geometry`]. Row 0 is the northernmost, column 0 the westernmost. A gap
//! (no data) is NaN and stays a gap in every layer made from it; a gap is never safe.

pub mod detect;
mod disk;
mod error;
mod geometry;
pub mod interpolation;
pub mod light;
mod map;
pub mod probability;
mod raster;
mod ray;
pub mod resample;
pub mod sight;
pub mod synthetic;

pub use error::TerrainError;
pub use geometry::{Geometry, MapUnit};
pub use map::ElevationMap;
pub use raster::Raster;
