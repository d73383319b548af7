//! Sparse nonlinear programming by a primal-dual interior point method.

mod augmented;
mod barrier;
mod engine;
mod error;
mod filter;
mod interior_point;
mod iterate;
mod line_search;
mod model;
mod observer;
mod problem;
mod report;
mod restoration;
mod scaled;
mod scaling;
mod settings;
mod start;
mod step;

pub use error::NlpError;
pub use interior_point::InteriorPoint;
pub use observer::{Flow, IterationRecord, Observer};
pub use problem::{Nlp, Pattern, Scaling, Stages};
pub use report::{
    Counters, Evaluation, OptimalityError, Residuals, ScalingFactors, SolveReport, Status, Timing, Violation,
    WarmStart,
};
pub use settings::{BarrierOracle, BarrierStrategy, NlpSettings, ScalingMethod};
