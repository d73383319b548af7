//! Successive convexification.

mod flow;
mod layout;
mod linearisation;
pub mod settings;
pub mod solver;
mod subproblem;

pub use settings::SuccessiveSettings;
pub use solver::{SuccessiveConvexification, SuccessiveRecord, SuccessiveSolution, SuccessiveStatus};
