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
//!
//! The limits of the method:
//!
//! | case | what happens | instead |
//! | --- | --- | --- |
//! | a bound on a state or a path constraint without controls is active | named in [`IndirectSolution::exceeded`] | a direct method |
//! | a bound on an integral | refused | the integral as a state with a bound at its end |
//! | a singular arc | no convergence, or [`FlowFailure::Chattering`] | a direct method, or its feedback as a phase of its own |
//! | a control that jumps from one bound of a path constraint to another | no convergence | a throttle with bounds, and a direction |
//! | a start from which Newton's method does not converge | a status | more segments, [`IndirectShooting::follow`], [`IndirectShooting::solve_smoothed`] |
//! | a switching function that is zero where a segment starts | its rate decides; where that is zero too and the level turns out wrong, the status says that it is no solution | another start |
//!
//! The conditions are necessary ones of first order. The certificate of `apsides-verify` looks at a solution from outside, at the sign
//! of the switching functions among others.
//!
//! | module | subject |
//! | --- | --- |
//! | `solver`, `settings`, `start` | the method, what can be chosen, where it starts |
//! | `method` | the method as an [`apsides_ocp::Method`], alone and after a direct method that gives the costates |
//! | `continuation` | families of problems, smoothed controls |
//! | `hamiltonian`, `term`, `pointwise`, `small` | the Hamiltonian of a phase, its least value over the controls, derivatives |
//! | `canonical`, `flow` | the equations of states and costates, flown over a segment across switches, with sensitivities |
//! | `layout`, `ends`, `conditions`, `newton` | unknowns, transversality, residuals and Jacobian, iteration |
//! | `extraction` | the solution as polynomials |
//!
//! References: A. E. Bryson, Y.-C. Ho, Applied Optimal Control, Taylor and Francis 1975, doi 10.1201/9781315137667. R. Bertrand,
//! R. Epenoy, New smoothing techniques for solving bang-bang optimal control problems, Optim. Control Appl. Methods 23 (2002), doi
//! 10.1002/oca.709. What state constraints add to the conditions: R. F. Hartl, S. P. Sethi, R. G. Vickson, A survey of the maximum
//! principles for optimal control problems with state constraints, SIAM Rev. 37 (1995), doi 10.1137/1037043.

mod canonical;
mod conditions;
mod continuation;
mod elimination;
mod ends;
mod extraction;
mod flow;
mod hamiltonian;
mod layout;
mod method;
mod newton;
mod pointwise;
mod settings;
mod small;
mod solver;
mod start;
mod term;

pub use apsides_ocp::method::Exceeded;
pub use conditions::FailedSegment;
pub use continuation::{ContinuationRecord, ContinuationSettings, Continued};
pub use flow::FlowFailure;
pub use hamiltonian::ControlSwitch;
pub use method::DirectIndirect;
pub use settings::IndirectSettings;
pub use solver::{IndirectShooting, IndirectSolution};
pub use start::{IndirectStart, PhaseStart};
