//! From an elevation map to a safe landing site.
//!
//! An [`ElevationMap`] is a [`Raster`] of heights with a [`Geometry`]. Row 0 is the northernmost, column 0 the westernmost. A gap
//! (no data) is NaN and stays a gap in every layer made from it; a gap is never safe. Criteria make a verdict of each pixel, and a site is
//! a safe pixel that is far enough from all others:
//!
//! ```text
//! slope <= slope_max,  roughness <= roughness_max,  step <= step_max,  ..   and   distance to what is not safe >= clearance_min
//! ```
//!
//! ```
//! use apsides_terrain::hazard::{SiteCriteria, hazard_map};
//! use apsides_terrain::site::{SiteRequest, choose_sites};
//! use apsides_terrain::synthetic::{Synthetic, Terrain};
//!
//! let terrain = Terrain { rows: 200, cols: 200, ..Terrain::fine() };
//! let map = Synthetic::new(terrain, 7)?.map()?;
//! let criteria = SiteCriteria::CHANG_E_3_FINE;
//! let hazards = hazard_map(&map, &criteria)?;
//! let choice = choose_sites(&map, &hazards, &SiteRequest::default())?;
//! let [site] = &choice.sites[..] else { return Ok(()) }; // no site is safe
//! assert!(site.clearance_m >= criteria.clearance_min_m);
//! # Ok::<(), apsides_terrain::TerrainError>(())
//! ```
//!
//! The crate reads maps from bytes, not from paths; it knows no trajectories, and does not re-project maps between coordinate systems.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

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
mod unit;

pub use distance::distance_to_nearest;
pub use error::TerrainError;
pub use geometry::Geometry;
pub use map::ElevationMap;
pub use raster::Raster;
pub use unit::MapUnit;
