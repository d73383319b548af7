//! Direct shooting.

mod chain;
mod estimate;
mod extraction;
mod hamiltonian;
mod layout;
mod plan;
mod refinement;
mod row_origin;
mod scales;
mod segment_system;
pub mod settings;
mod shot;
pub mod solver;
mod transcription;
mod warm_start;

pub use settings::MultipleShootingSettings;
pub use solver::{MultipleShooting, ShootingRecord, ShootingSolution};
