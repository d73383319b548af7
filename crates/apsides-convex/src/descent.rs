//! Powered descent with least propellant by lossless convexification.

pub mod divert;
mod flight_time;
pub mod problem;
mod program;
pub mod settings;
pub mod solution;
pub mod solver;
mod transition;

pub use divert::{Divert, DivertPlanner, DivertSettings};
pub use problem::{DescentLimits, PoweredDescent};
pub use settings::{DescentSettings, FlightTime, LowerBound};
pub use solution::{ActiveArc, DescentSolution, Limit, Outcome};
pub use solver::DescentSolver;
pub use transition::Hold;
