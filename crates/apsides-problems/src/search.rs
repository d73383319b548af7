//! Functions for searches without derivatives, with known least values.
//!
//! [`Landscape`] has the six functions that comparisons of metaheuristics are made on, in any dimension; a [`ShiftedRotated`]
//! one has its minimum at a random place and its axes turned, so that neither the centre of the box nor one
//! coordinate at a time helps. [`PlaneFunction`] has functions of two variables with a single minimum that is hard to find.

mod instance;
mod landscape;
mod plane;
mod random;

pub use instance::{ShiftedRotated, Transform};
pub use landscape::Landscape;
pub use plane::PlaneFunction;
