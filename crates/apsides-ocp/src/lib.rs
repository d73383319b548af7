//! The language of multi-phase optimal control problems.
//!
//! ```text
//! minimise   Phi(ends, p) + sum over phases of the integral of g(t, x, u, p)
//! subject to dx/dt = f(t, x, u, p),  path bounds,  bounds at the ends,  constraints between ends
//! ```
//!
//! A problem is written once and handed to any method. This crate holds no method and no solver: it defines
//! [`Ocp`], the interface of methods ([`Method`]), what a method starts from ([`Guess`], [`Mesh`], [`Scaling`]) and what it returns
//! ([`Trajectory`], [`Solution`]).
//! A problem that is ill-posed is refused by [`OcpBuilder::build`] with the name and the reason.
//!
//! ```
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_ocp::{At, Bounds, Ocp, Phase, State, Variable};
//!
//! struct Brachistochrone { gravity: f64 }
//! impl Dynamics<3, 1> for Brachistochrone {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
//!         let (sin, cos) = u[0].sin_cos();
//!         [x[2] * sin, x[2] * cos, cos * self.gravity] // x, depth, speed
//!     }
//! }
//!
//! let slide = Phase::new("slide", Brachistochrone { gravity: 9.80665 })
//!     .states([
//!         State::new("x", "m").within(0.0, 20.0).starts_at(0.0).ends_at(10.0),
//!         State::new("depth", "m").within(0.0, 20.0).starts_at(0.0).ends_at(5.0),
//!         State::new("speed", "m/s").within(0.0, 30.0).starts_at(0.0),
//!     ])
//!     .controls([Variable::new("angle", "rad").within(0.0, 3.2)])
//!     .final_time(Bounds::new(0.1, 10.0));
//! let ocp = Ocp::builder("brachistochrone")
//!     .phase(slide)
//!     .minimize("time", "s", At::FinalTime("slide"))
//!     .build()?;
//! assert_eq!(ocp.phases[0].state_index("speed"), Some(2));
//! # Ok::<(), apsides_ocp::OcpError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`variable`] | bounds, named quantities |
//! | [`phase`] | one phase |
//! | [`endpoint`] | boundary conditions, linkages |
//! | [`endpoint_term`] | those, as a method sees them |
//! | [`linkage`] | states that a phase takes over from an earlier one |
//! | [`accumulated`] | integrals in boundary conditions |
//! | [`explicit_time`], [`passed_features`] | pulses, jumps and kinks of time; layers and walls of states |
//! | [`problem`] | the whole, its builder and checks |
//! | [`scaling`], [`curvature`] | typical sizes; that of an objective near zero |
//! | [`origin`] | where a row of a discretised problem comes from |
//! | [`by_direction`], [`cones`] | vectors of controls by length and direction; path constraints of a length |
//! | [`path_ends`] | path constraints at the ends of their phases |
//! | [`guess`], [`mesh`] | what a method starts from |
//! | [`spread`] | points spread over a cube, for several starts |
//! | [`piecewise`], [`trajectory`] | states, controls and costates of a solution |
//! | [`method`] | the interface of methods and what each of them returns |
//!
//! Reference: J. T. Betts, Practical Methods for Optimal Control and Estimation Using Nonlinear Programming, SIAM
//! 2010, doi 10.1137/1.9780898718577.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod accumulated;
mod angles;
mod around;
mod bent;
mod bow;
pub mod by_cosine;
pub mod by_direction;
pub mod by_parts;
pub mod cones;
pub mod curvature;
pub mod effective_controls;
pub mod endpoint;
pub mod endpoint_term;
pub mod error;
pub mod explicit_time;
pub mod guess;
pub mod lagrangian;
pub mod linkage;
pub mod mesh;
pub mod method;
pub mod not_finite;
pub mod origin;
pub mod passed_features;
pub mod path_ends;
pub mod phase;
pub mod piecewise;
pub mod problem;
mod rewrite;
pub mod scaling;
pub mod spread;
mod squares;
pub mod trajectory;
pub mod turns;
pub mod variable;
pub mod without_kinks;

pub use by_cosine::ByCosine;
pub use by_direction::ByDirection;
pub use by_parts::ByParts;
pub use endpoint::{At, EndpointConstraint, EndpointInput};
pub use endpoint_term::EndpointTerm;
pub use error::OcpError;
pub use guess::{Guess, PhaseGuess};
pub use lagrangian::LagrangianSlope;
pub use mesh::{ArcKind, Break, Crossing, Mesh, PhaseArc, PhaseMesh, TouchPoint};
pub use method::{Method, MethodError, Solution, Start};
pub use origin::{RowOrigin, Unmet};
pub use path_ends::{PathEnd, PathEnds};
pub use phase::{Direction, Integral, Kink, PathConstraint, Phase};
pub use piecewise::{PiecewisePolynomial, Segment};
pub use problem::{Objective, Ocp, OcpBuilder, Sense, Term};
pub use scaling::{PhaseScaling, Scaling};
pub use trajectory::{Contact, PhaseTrajectory, Trajectory};
pub use turns::Turns;
pub use variable::{Bounds, State, Variable, behind_number};
pub use without_kinks::WithoutKinks;
