//! The vocabulary that iterative solvers share: status, iteration records, observers, and the report of a nonlinear program
//!
//! ```text
//! minimise f(x)   subject to   cl <= c(x) <= cu,   xl <= x <= xu
//! ```
//!
//! The crate has no solver and no dependency. A crate that refers to solvers without having one, such as `apsides-ocp`, takes its
//! types from here; `apsides-nlp` re-exports them.
//!
//! ```
//! use apsides_iteration::{Flow, IterationRecord, Observer, Status};
//!
//! /// Halves the distance to the solution in each iteration.
//! fn solve(observer: &mut dyn Observer) -> Status {
//!     for iteration in 0..60 {
//!         let step = 0.5_f64.powi(iteration as i32);
//!         let record = IterationRecord { iteration, step_norm: step, ..IterationRecord::default() };
//!         if observer.iteration(&record) == Flow::Stop {
//!             return Status::Interrupted;
//!         }
//!         if step < 1e-9 {
//!             return Status::Optimal;
//!         }
//!     }
//!     Status::IterationLimit
//! }
//!
//! assert_eq!(solve(&mut ()), Status::Optimal);
//! let mut impatient = |r: &IterationRecord| if r.iteration < 10 { Flow::Continue } else { Flow::Stop };
//! assert_eq!(solve(&mut impatient), Status::Interrupted);
//! assert_eq!(Status::Interrupted.word(), "interrupted");
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`status`] | how a solve ended |
//! | [`observer`] | records of iterations and generations, watching and stopping |
//! | [`report`] | the outcome of a nonlinear program: point, multipliers, errors, work |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod observer;
pub mod report;
pub mod status;

pub use observer::{Flow, IterationRecord, Observer, SearchProgress};
pub use report::{Counters, OptimalityError, Residuals, ScalingFactors, SolveReport, Timing, Violation};
pub use status::{Evaluation, Status};
