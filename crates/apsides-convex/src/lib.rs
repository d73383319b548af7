//! Optimal control by convex programs.

pub mod descent;
pub mod error;
mod rows;
pub mod successive;

pub use descent::{
    ActiveArc, DescentLimits, DescentSettings, DescentSolution, DescentSolver, Divert, DivertPlanner,
    DivertSettings, FlightTime, Hold, Limit, LowerBound, Outcome, PoweredDescent,
};
pub use error::ConvexError;
pub use successive::{
    SuccessiveConvexification, SuccessiveRecord, SuccessiveSettings, SuccessiveSolution, SuccessiveStatus,
};
