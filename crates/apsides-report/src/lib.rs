//! Figures, HTML reports and data files for apsides results.

mod columns;
mod error;
mod multipliers;
mod number;
mod trajectory_csv;
mod trajectory_reader;
mod units;

pub use error::ReportError;
pub use multipliers::{ConstraintMultipliers, Multipliers, PathMultipliers};
pub use trajectory_csv::write_trajectory;
pub use trajectory_reader::read_trajectory;
