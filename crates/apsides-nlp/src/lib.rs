//! Sparse nonlinear programming by a primal-dual interior point method:
//!
//! ```text
//! minimise f(x)   subject to   cl <= c(x) <= cu,   xl <= x <= xu
//! ```
//!
//! with exact first and second derivatives from the problem ([`Nlp`]). The method is the filter line search of
//! Waechter and Biegler with its restoration phase. It finds local solutions, differentiates nothing, knows no
//! integers, and keeps no dense matrices.
//!
//! Problem 71 of Hock and Schittkowski, `min x0 x3 (x0 + x1 + x2) + x2` with `x0 x1 x2 x3 >= 25`, `|x|^2 = 40` and
//! `1 <= x <= 5`:
//!
//! ```
//! use apsides_nlp::{InteriorPoint, Nlp, Pattern, Status};
//!
//! struct Hs71;
//!
//! impl Nlp for Hs71 {
//!     fn variables(&self) -> usize { 4 }
//!     fn constraints(&self) -> usize { 2 }
//!     fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
//!         lower.fill(1.0);
//!         upper.fill(5.0);
//!     }
//!     fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
//!         lower.copy_from_slice(&[25.0, 40.0]);
//!         upper.copy_from_slice(&[f64::INFINITY, 40.0]);
//!     }
//!     fn initial_point(&self, x: &mut [f64]) { x.copy_from_slice(&[1.0, 5.0, 5.0, 1.0]) }
//!     fn jacobian_pattern(&self) -> Pattern { Pattern::dense(2, 4) }
//!     fn hessian_pattern(&self) -> Pattern { Pattern::lower_triangle(4) }
//!     fn objective(&mut self, x: &[f64]) -> f64 { x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2] }
//!     fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
//!         let sum = x[0] + x[1] + x[2];
//!         g.copy_from_slice(&[x[3] * (x[0] + sum), x[0] * x[3], x[0] * x[3] + 1.0, x[0] * sum]);
//!     }
//!     fn constraint_values(&mut self, x: &[f64], c: &mut [f64]) {
//!         c[0] = x.iter().product();
//!         c[1] = x.iter().map(|x| x * x).sum();
//!     }
//!     fn jacobian(&mut self, x: &[f64], j: &mut [f64]) {
//!         let product = [x[1] * x[2] * x[3], x[0] * x[2] * x[3], x[0] * x[1] * x[3], x[0] * x[1] * x[2]];
//!         j[..4].copy_from_slice(&product);
//!         (0..4).for_each(|i| j[4 + i] = 2.0 * x[i]);
//!     }
//!     fn hessian(&mut self, x: &[f64], factor: f64, y: &[f64], h: &mut [f64]) {
//!         let (f, c) = (factor, y[0]);
//!         h.copy_from_slice(&[
//!             2.0 * f * x[3] + 2.0 * y[1],
//!             f * x[3] + c * x[2] * x[3], 2.0 * y[1],
//!             f * x[3] + c * x[1] * x[3], c * x[0] * x[3], 2.0 * y[1],
//!             f * (2.0 * x[0] + x[1] + x[2]) + c * x[1] * x[2], f * x[0] + c * x[0] * x[2],
//!             f * x[0] + c * x[0] * x[1], 2.0 * y[1],
//!         ]);
//!     }
//! }
//!
//! let report = InteriorPoint::default().solve(&mut Hs71)?;
//! assert_eq!(report.status, Status::Optimal);
//! assert!((report.objective - 17.0140173).abs() < 1e-7);
//! assert!(apsides_nlp::check_derivatives(&mut Hs71, &[1.5, 4.0, 3.0, 2.0])?.is_within(1e-6));
//! # Ok::<(), apsides_nlp::NlpError>(())
//! ```
//!
//! Multipliers have the signs of `L = f + y^T c - zl^T (x - xl) - zu^T (xu - x)`.
//!
//! | module | subject |
//! | --- | --- |
//! | `problem` | [`Nlp`]: what a user writes |
//! | `settings`, `warm_start`, `error` | what goes in, what is refused; what comes out and can be watched is in `apsides_iteration` |
//! | `interior_point` | [`InteriorPoint`]: set-up, alternation with the restoration phase, report |
//! | `scaled`, `scaling` | fixed variables removed, slacks added, everything scaled; the only place that knows the user's units |
//! | `model` | the problem as the engine sees it |
//! | `engine` | the iteration, with what begins and ends it (`start`) |
//! | `step`, `line_search`, `barrier`, `quality` | the strategies of the iteration: direction, step length, barrier parameter and what it is chosen by |
//! | `curvature`, `active_set` | the end of a solve: saddles are left, weakly active bounds met exactly |
//! | `state`, `iterate`, `filter`, `vector` | the state that they share: points, directions, bounds, filter |
//! | `augmented` | the linear system without slacks and elastic variables |
//! | `restoration` | the same engine on the constraint violation |
//! | `sensitivity` | [`Sensitivity`]: derivatives of a solution with respect to parameters |
//! | `resolver` | [`Resolver`]: programs of one structure and other data, each from the last solution |
//! | `derivative_check` | [`check_derivatives`] |
//! | `requirement`, `elastic`, `diagnosis` | [`diagnose`]: which requirements conflict, and the least relaxation that helps |
//!
//! # References
//! - A. Waechter, L. T. Biegler, On the implementation of an interior-point filter line-search algorithm for
//!   large-scale nonlinear programming, Math. Program. 106 (2006), doi 10.1007/s10107-004-0559-y
//! - J. Nocedal, A. Waechter, R. A. Waltz, Adaptive barrier update strategies for nonlinear interior methods, SIAM J.
//!   Optim. 19 (2009), doi 10.1137/060649513
//! - H. Pirnay, R. Lopez-Negrete, L. T. Biegler, Optimal sensitivity based on IPOPT, Math. Program. Comput. 4 (2012),
//!   doi 10.1007/s12532-012-0043-2
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod active_set;
mod augmented;
mod barrier;
mod curvature;
mod derivative_check;
mod diagnosis;
mod elastic;
mod engine;
mod error;
mod filter;
mod interior_point;
mod iterate;
mod line_search;
mod model;
mod problem;
mod quality;
mod requirement;
mod resolver;
mod restoration;
mod scaled;
mod scaling;
mod selection;
mod sensitivity;
mod settings;
mod start;
mod state;
mod step;
mod vector;
mod warm_start;

pub use apsides_iteration::{
    Counters, Evaluation, Flow, IterationRecord, Observer, OptimalityError, Residuals, ScalingFactors,
    SearchProgress, SolveReport, Status, Timing, Violation,
};
pub use apsides_kkt::{KktSettings, Ordering};
pub use derivative_check::{DerivativeEntry, DerivativeReport, check_derivatives};
pub use diagnosis::{Diagnosis, diagnose, relax};
pub use error::NlpError;
pub use interior_point::InteriorPoint;
pub use problem::{Nlp, Pattern, Scaling, Stages};
pub use requirement::{Limit, Place, Relaxation, Requirement, Side, requirements_of};
pub use resolver::{Resolved, Resolver, Way};
pub use sensitivity::{ActiveConstraints, Perturbation, Sensitivity, SolutionDerivative};
pub use settings::{BarrierOracle, BarrierStrategy, NlpSettings, ScalingMethod};
pub use warm_start::WarmStart;
