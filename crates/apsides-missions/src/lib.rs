//! The kinds of mission that come with apsides, each a struct in SI units that implements [`apsides_pipeline::Mission`].
//!
//! ```
//! use apsides_missions::registry;
//!
//! let mut mission = registry().load("lunar-perilune", &[])?;
//! mission.set("perilune_altitude_km", 20.0)?;
//! let outcome = mission.solve(None, &mut ())?;
//! assert!((outcome.summary.results["flight_time_s"] - 999.356984).abs() < 1e-5);
//! # Ok::<(), apsides_pipeline::Error>(())
//! ```
//!
//! | module | missions |
//! | --- | --- |
//! | [`lunar`] | planar soft landings on the Moon |
//! | [`geo`] | injection of an upper stage into geostationary orbit |
//! | [`entry`] | re-entry of a capsule |
//! | [`chang_e`] | a landing in six stages over the rotating Moon |
//! | [`moving_mass`] | a capsule steered by internal masses, flown under a law |
//! | [`problem`] | problems with equations of their own file |
//! | [`data`] | bodies, vehicles and sites |
//! | [`site_criteria`] | what a landing site must fulfil, from a file |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod catalogue;
#[cfg(feature = "chang-e")]
pub mod chang_e;
pub mod data;
#[cfg(any(feature = "lunar", feature = "chang-e"))]
mod deviating_flight;
#[cfg(feature = "entry")]
pub mod entry;
#[cfg(feature = "geo")]
pub mod geo;
#[cfg(feature = "lunar")]
pub mod lunar;
#[cfg(feature = "moving-mass")]
pub mod moving_mass;
#[cfg(feature = "problem")]
pub mod problem;
#[cfg(feature = "chang-e")]
pub mod site_criteria;

pub use catalogue::registry;

/// Makes an error of a sentence that names keys.
#[cfg(any(feature = "lunar", feature = "geo"))]
type Refuse<'a> = &'a dyn Fn(String) -> apsides_pipeline::Error;
