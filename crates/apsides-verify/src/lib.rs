//! Independent verification of optimal control solutions.

pub mod certificate;
pub mod error;
pub mod settings;
pub mod simulation;
pub mod verify;

mod boundary;
mod ends;
mod equations;
mod linkage;
mod optimality;
mod place;
mod scan;
mod shape;
#[cfg(test)]
mod tests;
mod worst;

pub use certificate::{Certificate, Check, CheckKind, Verdict};
pub use error::VerifyError;
pub use settings::VerifySettings;
pub use simulation::SimulatedPhase;
pub use verify::{Verification, verify};
