//! Craters and boulders found in an elevation map.

mod boulders;
mod craters;

pub use boulders::{BoulderSearch, FoundBoulder, boulders};
pub use craters::{CraterSearch, FoundCrater, craters};
