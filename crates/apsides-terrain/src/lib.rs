//! From an elevation map to a safe landing site.
//!
//! An [`ElevationMap`] is a [`Raster`] of heights with a [`Geometry`]. Row 0 is the northernmost, column 0 the westernmost. A gap
//! (no data) is NaN and stays a gap in every layer made from it; a gap is never safe.

pub mod contact;
pub mod detect;
mod disk;
mod distance;
mod error;
mod geometry;
pub mod hazard;
pub mod interpolation;
pub mod io;
pub mod light;
mod map;
pub mod probability;
mod raster;
mod ray;
pub mod resample;
pub mod sight;
pub mod site;
pub mod survey;
pub mod synthetic;

pub use distance::distance_to_nearest;
pub use error::TerrainError;
pub use geometry::{Geometry, MapUnit};
pub use map::ElevationMap;
pub use raster::Raster;
