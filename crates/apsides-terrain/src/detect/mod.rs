//! Edges, craters and boulders found in an elevation map.

mod boulders;
mod craters;
mod edges;

pub use boulders::{BoulderSearch, FoundBoulder, boulders};
pub use craters::{CraterSearch, FoundCrater, craters};
pub use edges::{Canny, Thresholds, edges};
