//! Optimal control of differentially flat systems, with the outputs on B-splines.
//!
//! States and controls of a flat system follow from a few outputs and their derivatives, `[x, u, r] = F(y, y', .. , t)`. With the
//! outputs as splines of normalised time, the coefficients, times and parameters are all the unknowns there are, and the equations of
//! motion need no collocation:
//!
//! ```text
//! y_i(s) = sum_j B_j(s) c_ij,   minimise J(X, U)   subject to   r = 0,  bounds, path constraints, boundary conditions
//! ```
//!
//! Equations that the outputs do not satisfy by themselves remain as residuals `r`: fewer controls than outputs, or states that are outputs of
//! their own. Everything else is read from the [`Ocp`](apsides_ocp::Ocp).
//!
//! On few points a solver converges to curves that are no trajectories. So the residual of all equations of motion is looked at
//! between the points, and splines are refined until it meets a tolerance. Costates are not computed. Where a flat map is singular,
//! as the attitude of an aircraft in free fall, bounds must keep the flight away from it: a solver jumps across what it does not see.
//!
//! ```
//! use apsides_ad::{Dynamics, FlatMap, PathFunction, Scalar};
//! use apsides_flatness::{FlatSystem, Flatness};
//! use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
//!
//! struct Cart;
//! impl Dynamics<2, 1> for Cart {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], u[0]]
//!     }
//! }
//! // One output, the position, and derivatives to number 2.
//! impl FlatMap<1, 3, 2, 1, 0> for Cart {
//!     fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 1], _p: &[S; 0]) -> ([S; 2], [S; 1], [S; 0]) {
//!         ([y[0][0], y[0][1]], [y[0][2]], [])
//!     }
//!     fn outputs(&self, _t: f64, x: &[f64; 2], _u: &[f64; 1], _p: &[f64; 0]) -> [f64; 1] {
//!         [x[0]]
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
//! let solution = Flatness::default().solve(&ocp, &[FlatSystem::new(Cart)], &Guess::linear(&ocp))?;
//! assert!(solution.accurate && (solution.trajectory.objective - 6.0).abs() < 1e-8); // closed form
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`system`] | flat systems |
//! | [`settings`] | splines, points, tolerances |
//! | [`solver`] | the method and its solution |
//! | [`curve`] | splines of a phase |
//! | [`Transcription`] | the discretised problem, for a solver of one's own |
//! | [`FlatMethod`] | the method as an [`apsides_ocp::Method`], with the flat systems of a problem |
//!
//! References: M. Fliess, J. Levine, P. Martin, P. Rouchon, *Int. J. Control* 61 (1995) 1327, doi 10.1080/00207179508921959.
//! R. Jamilnia, Modares Mechanical Engineering 17(10), 2017 (planar lunar landing on B-splines).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod curve;
pub mod error;
mod estimate;
mod extraction;
mod flat_point;
mod layout;
mod method;
mod redundant;
mod rows;
pub mod settings;
pub mod solver;
mod spline_mesh;
mod start;
pub mod system;
mod terms;
mod transcription;

pub use curve::PhaseSplines;
pub use error::FlatnessError;
pub use method::FlatMethod;
pub use settings::{BoundRows, Breaks, FlatnessSettings, Placement, SplineSettings};
pub use solver::{Flatness, FlatnessSolution, SolveRecord};
pub use system::FlatSystem;
pub use transcription::Transcription;
