//! The interface of methods: a problem and a start in, a solution of the same form out of each of them.
//!
//! ```
//! use apsides_ocp::method::{Method, MethodError, Start};
//! use apsides_ocp::{Guess, Ocp};
//!
//! /// The objective of one problem by each of several methods.
//! fn compare(ocp: &Ocp, methods: &[&dyn Method]) -> Result<Vec<(&'static str, f64)>, MethodError> {
//!     let start = Start::new(Guess::linear(ocp));
//!     let mut found = Vec::new();
//!     for method in methods {
//!         let solution = method.solve(ocp, &start, &mut ())?;
//!         if solution.is_success() {
//!             found.push((method.name(), solution.trajectory.objective));
//!         }
//!     }
//!     Ok(found)
//! }
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`start`] | where a solve begins |
//! | [`solution`] | its result: trajectory, status, counters |
//! | [`accuracy`] | measures of accuracy and their tolerances |
//! | [`deficiency`] | reasons why a converged solution is not one of the problem, and remedies |
//! | [`switch`] | jumps of controls and path constraints along a solution |
//! | [`warning`] | doubts that remain though a solve succeeds |

pub mod accuracy;
pub mod deficiency;
pub mod solution;
pub mod start;
pub mod switch;
pub mod warning;

use std::error::Error;
use std::fmt::Debug;

use apsides_iteration::Observer;

use crate::Ocp;

pub use accuracy::Accuracy;
pub use deficiency::{Deficiency, Exceeded, Reason, Remedy};
pub use solution::{Counters, SearchEnd, SearchRecord, Solution};
pub use start::Start;
pub use switch::{Level, Switch};
pub use warning::{ScaleWarning, Warning};

/// A method that solves optimal control problems.
///
/// The methods of the workspace are structs of settings with this interface; each has besides it a `solve` of its own, which takes a
/// guess and returns a solution with the details of that method.
pub trait Method: Debug + Send + Sync {
    /// The word that names the method in files and messages, such as `multiple-shooting`.
    fn name(&self) -> &'static str;

    /// Solves a problem from a start.
    ///
    /// The observer sees every iteration and can stop the solve; the best trajectory so far is returned then. A method ignores
    /// those parts of the start that it has no use for.
    ///
    /// # Errors
    /// When the request is ill-posed, or the problem has what the method does not cover. Not converging is a status of the solution.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError>;
}

/// A method refuses a request. The source is the error of its crate, for instance an [`OcpError`](crate::OcpError).
#[derive(Debug, thiserror::Error)]
#[error("{method}: {source}")]
pub struct MethodError {
    /// The name of the method.
    pub method: &'static str,
    /// The reason.
    pub source: Box<dyn Error + Send + Sync + 'static>,
}

impl MethodError {
    /// A refusal by a method, for use with `map_err`.
    pub fn by<E>(method: &'static str) -> impl Fn(E) -> Self
    where
        E: Error + Send + Sync + 'static,
    {
        move |source| Self { method, source: Box::new(source) }
    }
}
