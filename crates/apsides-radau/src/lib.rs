//! hp Legendre-Gauss-Radau collocation for multi-phase optimal control.
//!
//! In each interval of a phase the state is a polynomial through `N` Radau points and the interval's end, and meets
//! the equations of motion at the `N` points:
//!
//! ```text
//! sum_j D_ij x_j = (h / 2) (tf - t0) f(x_i, u_i, p, t_i),     i = 1 .. N
//! ```
//!
//! The resulting sparse nonlinear program has exact first and second derivatives. After each solve the error between the points is
//! estimated and the mesh refined until the estimate meets the tolerance; costates follow from the multipliers.
//!
//! The crate does not integrate a trajectory again: that is what `apsides-verify` does, with code of its own.
//!
//! ```
//! use apsides_ad::{Dynamics, PathFunction, Scalar};
//! use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
//! use apsides_radau::Radau;
//!
//! struct Cart;
//! impl Dynamics<2, 1> for Cart {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], u[0]]
//!     }
//! }
//! struct Effort;
//! impl PathFunction<2, 1, 1> for Effort {
//!     fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
//!         [u[0].square() * 0.5]
//!     }
//! }
//!
//! let phase = Phase::new("move", Cart)
//!     .states([State::new("x", "m").starts_at(0.0).ends_at(1.0), State::new("v", "m/s").starts_at(0.0).ends_at(0.0)])
//!     .controls([Variable::new("a", "m/s2")])
//!     .final_time(Bounds::fixed(1.0))
//!     .integral(Variable::new("effort", "m2/s3"), Effort);
//! let ocp = Ocp::builder("rest to rest").phase(phase).minimize_integral("move", "effort").build()?;
//! let solution = Radau::default().solve(&ocp, &Guess::linear(&ocp))?;
//! assert!((solution.trajectory.objective - 6.0).abs() < 1e-9); // closed form
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`transcription`] | the nonlinear program |
//! | [`solver`], [`settings`] | the method and its solution; what can be chosen |
//! | `mesh_sequence` | from mesh to mesh: solve, estimate, refine |
//! | `method` | the method as an [`apsides_ocp::Method`] |
//! | [`session`] | re-solves with other data from the last solution |
//! | [`switches`] | where controls switch between their bounds |
//! | [`scales`] | scales, and warnings where they do not fit |
//! | [`explanation`], [`relaxation`] | why a problem is infeasible: what conflicts, and what to relax by how much |
//!
//! References: D. Garg et al., A unified framework for the numerical solution of optimal control problems using
//! pseudospectral methods, Automatica 46 (2010), doi 10.1016/j.automatica.2010.06.048. M. Patterson, W. Hager, A. Rao, A ph mesh refinement method for
//! optimal control, Optim. Control Appl. Methods 36 (2015), doi 10.1002/oca.2114. F. Liu, W. Hager, A. Rao, Adaptive mesh refinement method for
//! optimal control using decay rates of Legendre polynomial coefficients, IEEE Trans. Control Syst. Technol. 26 (2018).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod activity;
mod along;
mod arc_rates;
mod attempts;
mod blur;
mod boundary_arcs;
mod bounds;
mod breaks;
mod change;
mod contact;
mod costate_error;
mod crossed;
mod crossing;
mod determined;
mod elimination;
pub mod error;
mod error_estimate;
mod events;
mod excess;
pub mod explanation;
mod extraction;
mod flown;
mod idle_controls;
mod implied_ends;
mod invariants;
mod joints;
mod junction;
mod layout;
mod least_relaxation;
mod lower_hamiltonian;
mod mesh_sequence;
mod mesh_solve;
mod method;
mod monotone;
mod node_derivatives;
mod node_term;
mod placement;
mod progress;
mod quantity;
mod rate_term;
mod redundant;
mod refinement;
pub mod relaxation;
mod row_bends;
mod row_rate;
mod saddle;
pub mod scales;
pub mod session;
pub mod settings;
mod settling;
mod shortfall;
mod smoothness;
mod solved;
pub mod solver;
mod spread_flights;
mod start_residuals;
mod starts;
mod state_bounds;
pub mod switches;
pub mod transcription;

pub use apsides_nlp::Side;
pub use apsides_ocp::{RowOrigin, Unmet};
pub use error::RadauError;
pub use explanation::{Conflict, Explanation, Remedy};
pub use relaxation::{Requirement, RequirementKind, rounded_up};
pub use scales::ScaleWarning;
pub use session::{Resolved, Session};
pub use settings::RadauSettings;
pub use solver::{MeshRecord, Radau, RadauSolution};
pub use switches::{Level, Switch};
pub use transcription::{Collocation, Transcription};
