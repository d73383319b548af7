//! The parts that tests across crates share: tolerances by class, settings of a method by problem, one verified run.
//!
//! | module | subject |
//! | --- | --- |
//! | [`tolerance`] | named tolerances |
//! | [`run`] | a problem of the gallery, solved and verified |
//! | [`mission`] | a mission through the facade: solved, verified, compared |
//! | [`patience`] | an observer that interrupts |
//! | [`perturbation`] | problems of the gallery with other numbers |
//! | [`golden`] | stored counters |
//! | [`shared`](mod@shared) | maps and references outside the project |

pub mod golden;
pub mod mission;
pub mod patience;
pub mod perturbation;
pub mod run;
pub mod shared;
pub mod tolerance;

pub use patience::Patience;
pub use run::{Failure, Run, solve};
pub use shared::shared;

/// The page of the book is a test.
#[cfg(doctest)]
#[doc = include_str!("../../docs/problems-in-rust.md")]
struct ProblemsInRust;
