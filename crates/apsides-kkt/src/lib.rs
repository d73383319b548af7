//! Sparse symmetric indefinite (KKT) systems: analyse once, refactor, inertia, refinement.

mod elimination;
mod error;
mod factor;
mod pattern;
mod refine;
mod scaling;
mod settings;
mod system;

pub use error::KktError;
pub use settings::{Factorisation, KktSettings, Ordering};
pub use system::{Inertia, KktCounters, KktSystem, SolveQuality};
