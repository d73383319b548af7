//! Indirect shooting: Pontryagin's conditions as a multi-point boundary value problem.
//!
//! ```text
//! H = L + lambda^T f,   x' = dH/dlambda,   lambda' = -dH/dx,   u = argmin H,   transversality from the endpoint functions
//! ```
//!
//! Everything follows from the functions of the problem: the costate equations from their Jacobians, the derivatives of the
//! boundary value problem from their Hessians. Controls that the Hamiltonian is linear in switch between their bounds at zeros of the
//! switching function; path constraints that depend on controls are part of the pointwise minimisation. Bounds on states along a
//! phase and path constraints without controls are not imposed, but reported where they are exceeded.
//!
//! [`IndirectShooting`] solves from an [`IndirectStart`], which a trajectory with costates gives in one call.

mod canonical;
mod conditions;
mod continuation;
mod ends;
mod extraction;
mod flow;
mod hamiltonian;
mod layout;
mod newton;
mod pointwise;
mod settings;
mod small;
mod solver;
mod start;
mod term;

pub use conditions::FailedSegment;
pub use continuation::{ContinuationRecord, ContinuationSettings, Continued};
pub use flow::{ControlSwitch, FlowFailure};
pub use settings::IndirectSettings;
pub use solver::{Exceeded, IndirectShooting, IndirectSolution};
pub use start::{IndirectStart, PhaseStart};
