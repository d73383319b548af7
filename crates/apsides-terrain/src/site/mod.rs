//! Landing sites on a hazard map.
//!
//! A candidate is a safe pixel whose clearance is at least that of the criteria. [`choose_sites`] takes the best by a [`SiteRule`] and says
//! why others lost. [`selection`] chooses one that a lander in flight can reach and stand on.

mod choice;
pub mod selection;
mod spiral;
mod table;

pub use choice::{Reason, Rival, ScoreWeights, Site, SiteChoice, SiteRequest, SiteRule, choose_sites};
pub use spiral::spiral;
