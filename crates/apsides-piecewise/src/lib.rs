//! Control parameterisation: piecewise-constant controls, with the lengths of their segments as unknowns if wished.
//!
//! A phase is divided into `n` segments with the controls `c_k`. With the time-scaling transform (enhancing technique), a normalised
//! time `s` takes segment `k` from `k - 1` to `k`, and
//!
//! ```text
//! dt/ds = theta_k,   dx/ds = theta_k f(t, x, c_k, p),   theta_k >= least,   sum_k theta_k = tf - t0
//! ```
//!
//! make the lengths `theta_k` unknowns beside the controls, so that controls switch when it is best. The unknowns here are the times
//! of the nodes, whose differences are the `theta_k`: the same problem, in which each segment depends on its own two times alone. The
//! program is that of [`apsides_shooting::direct`] with controls of degree 0: the state at each node is an unknown, all
//! derivatives are those of the Runge-Kutta steps, from their variational equations and discrete adjoint.
//!
//! Inequalities along a phase, path constraints and bounds on states, are kept in one of two ways ([`Constraints`]):
//!
//! * at points of each segment, which is the better one: each row is linearised where it is active, and the multipliers are those of
//!   the problem;
//! * as one number each, `int L_eps(v) dt <= tau` of the violation `v`, the constraint transcription of Jennings and Teo
//!   ([`smoothing`]). `eps` shrinks tenfold, `tau` with it, as long as the constraints hold along the trajectory, `tau` by half
//!   where they do not. What it costs is a distance from the bound of the order of `eps`, and a slope of the integral
//!   that fades as the constraint is approached.
//!
//! Where constraints are exceeded between their points, each segment gets more of them, up to 17; with unknown lengths the program
//! would else move its points away from where the constraint is active.
//!
//! With smooth optimal controls the objective misses the optimum by `O(h^2)` in the length of the segments. Refinement divides those
//! that have most to gain by the estimate of [`apsides_shooting::direct`], until what is left by extrapolation from the last division
//! is within the tolerance. Free lengths have many local optima: they start from the solution with equal lengths, which they can only
//! improve, then from random ones, and the best is taken. The same seed gives the same numbers.
//!
//! Limit of the method: a control that is to vary along a segment varies by steps; certificates therefore find feasible trajectories
//! whose controls do not minimise the Hamiltonian between the steps. For optima use the other methods.
//!
//! ```
//! use apsides_ad::{Dynamics, PathFunction, Scalar};
//! use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
//! use apsides_piecewise::{PiecewiseConstant, PiecewiseSettings};
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
//! let gap = |segments| -> Result<f64, Box<dyn std::error::Error>> {
//!     let settings = PiecewiseSettings { intervals: segments, ..PiecewiseSettings::default() };
//!     let solution = PiecewiseConstant { settings }.solve(&ocp, &Guess::linear(&ocp))?;
//!     Ok(solution.trajectory.objective - 0.5 * 1_f64.tanh())
//! };
//! let ratio = gap(8)? / gap(16)?;
//! assert!((ratio - 4.0).abs() < 0.05, "{ratio}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`settings`] | what can be chosen |
//! | [`solver`] | the method: starts, passes, refinement; solution, records |
//! | `method` | the method as an [`apsides_ocp::Method`] |
//! | [`smoothing`] | `L_eps`, and its integrands |
//! | `inequality` | the inequalities of a problem, their excess, the problem with their integrals |
//!
//! References: K. L. Teo, C. J. Goh, K. H. Wong, A Unified Computational Approach to Optimal Control Problems, Longman 1991.
//! L. S. Jennings, K. L. Teo, A computational algorithm for functional inequality constrained optimization problems, Automatica 26
//! (1990), doi 10.1016/0005-1098(90)90131-Z. H. W. J. Lee, K. L. Teo, V. Rehbock, L. S. Jennings, Control parametrization enhancing
//! technique for optimal discrete-valued control problems, Automatica 35 (1999), doi 10.1016/S0005-1098(99)00050-3. Q. Lin,
//! R. Loxton, K. L. Teo, The control parameterization method for nonlinear optimal control: a survey, Journal of Industrial and
//! Management Optimization 10 (2014), doi 10.3934/jimo.2014.10.275.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod inequality;
mod method;
pub mod settings;
pub mod smoothing;
pub mod solver;

pub use apsides_shooting::ShootingError;
pub use inequality::Excess;
pub use settings::{Constraints, FreeLengths, Lengths, PiecewiseSettings, Transcription};
pub use solver::{PassRecord, PiecewiseConstant, PiecewiseSolution, StartRecord};
