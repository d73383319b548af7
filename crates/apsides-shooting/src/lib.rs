//! Shooting: optimal control through the integration of the equations of motion.
//!
//! ```text
//! direct:    x_{k+1} = phi(x_k, u_k, t_k, t_{k+1}),  minimise J over nodes, controls, times
//! indirect:  x' = dH/dlambda,  lambda' = -dH/dx,  u = argmin H,  boundary and transversality conditions = 0
//! ```
//!
//! Direct shooting starts from states and controls; its multipliers are costates, from which indirect shooting starts. What the first
//! leaves, tolerance of a program and polynomials for controls, the second removes:
//!
//! ```
//! use apsides_ad::{Dynamics, PathFunction, Scalar};
//! use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
//! use apsides_shooting::{direct::MultipleShooting, indirect::IndirectShooting};
//!
//! struct Regulator;
//! impl Dynamics<1, 1> for Regulator {
//!     fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
//!         [u[0]]
//!     }
//! }
//! impl PathFunction<1, 1, 1> for Regulator {
//!     fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
//!         [(x[0].square() + u[0].square()) * 0.5]
//!     }
//! }
//!
//! let phase = Phase::new("regulate", Regulator)
//!     .states([State::new("x", "-").starts_at(1.0)])
//!     .controls([Variable::new("u", "-")])
//!     .final_time(Bounds::fixed(1.0))
//!     .integral(Variable::new("cost", "-"), Regulator);
//! let ocp = Ocp::builder("regulator").phase(phase).minimize_integral("regulate", "cost").build()?;
//! let direct = MultipleShooting::default().solve(&ocp, &Guess::linear(&ocp))?;
//! let indirect = IndirectShooting::default().solve_from(&ocp, &direct.trajectory, 1)?;
//! let exact = indirect.trajectory.ok_or("no trajectory")?;
//! // x = cosh(1 - t) / cosh(1), lambda = sinh(1 - t) / cosh(1), cost tanh(1) / 2.
//! assert!((direct.trajectory.objective - 0.5 * 1_f64.tanh()).abs() < 1e-9);
//! assert!((exact.objective - 0.5 * 1_f64.tanh()).abs() < 1e-11);
//! assert!((exact.phases[0].control_at(0.0)[0] + 1_f64.tanh()).abs() < 1e-10);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`direct`] | single and multiple shooting with piecewise-polynomial controls, as a nonlinear program |
//! | [`indirect`] | Pontryagin's conditions as a multi-point boundary value problem |
//! | [`profile`] | control profiles of a few numbers, flown by single shooting for searches without derivatives |
//! | [`error`] | what is refused |
//!
//! Neither finds a start: direct shooting takes one, and indirect shooting converges from near the solution alone. Each module says what
//! else its method does not do.
//!
//! References: H. G. Bock, K. J. Plitt, A multiple shooting algorithm for direct solution
//! of optimal control problems, IFAC Proc. 17 (1984), doi 10.1016/S1474-6670(17)61205-9. A. E. Bryson, Y.-C. Ho, Applied Optimal
//! Control, Taylor and Francis 1975, doi 10.1201/9781315137667.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod direct;
pub mod error;
pub mod indirect;
pub mod profile;

pub use error::ShootingError;
