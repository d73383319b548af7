//! Optimal control by convex programs: powered descents by lossless convexification, and problems of [`apsides_ocp`] by successive
//! convexification.
//!
//! ```text
//! lossless:    minimise propellant,  r'' = g + T/m - 2 w x r' - w x (w x r),  m' = -|T|/c,  T1 <= |T| <= T2,  limits
//! successive:  minimise J(z) subject to c(z) = 0, h(z) <= 0 by convex programs in steps from one point to the next
//! ```
//!
//! Lossless convexification makes a second-order cone program of a problem whose thrust bounds are not convex, with the same optimum
//! ([`descent`]); it needs no guess, takes about a millisecond a program, and tells what is lacking when a target cannot be reached.
//! Successive convexification ([`successive`]) takes any [`Ocp`](apsides_ocp::Ocp) and a guess.
//!
//! ```
//! use apsides_convex::{DescentLimits, DescentSettings, DescentSolver, Outcome, DescentProblem};
//!
//! // Case c of Acikmese and Ploen 2007: Mars, six canted engines, a glide slope of 4 deg.
//! let cant = 27_f64.to_radians().cos();
//! let problem = DescentProblem {
//!     gravity: [0.0, 0.0, -3.7114],
//!     rotation: [0.0; 3],
//!     mass: 1905.0,
//!     dry_mass: 1505.0,
//!     exhaust_velocity: 225.0 * 9.807 * cant,
//!     thrust: [0.3, 0.8].map(|throttle| throttle * 6.0 * 3100.0 * cant),
//!     position: [2000.0, 0.0, 1500.0],
//!     velocity: [100.0, 0.0, -75.0],
//!     target: [0.0; 3],
//!     target_velocity: [0.0; 3],
//!     limits: DescentLimits { glide_slope: Some(4_f64.to_radians()), ..DescentLimits::default() },
//! };
//! let solution = DescentSolver::new(&problem, DescentSettings::default())?.solve()?;
//! assert_eq!(solution.outcome, Outcome::Landed);
//! assert!((solution.propellant - 398.07).abs() < 0.1); // optimum 398.0739 kg
//! assert!(solution.relaxation_gap < 1e-6);
//! # Ok::<(), apsides_convex::ConvexError>(())
//! ```
//!
//! Limits of the crate:
//!
//! * Descents have uniform gravity and no atmosphere; successive convexification takes such models.
//! * Limits hold at nodes. Between them linear controls keep those of the thrust, not those of position and speed.
//! * Solutions of successive convexification have no costates, and its controls are linear on equal intervals: jumps are met to the length of
//!   an interval. `apsides-radau` refines such a trajectory ([`Guess::earlier`](apsides_ocp::Guess::earlier)).
//!
//! | module | subject |
//! | --- | --- |
//! | [`descent`] | powered descent, flight time, diverts to many sites |
//! | [`successive`] | any problem, from a guess |
//! | [`error`] | what is refused |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod descent;
pub mod error;
mod rows;
pub mod successive;

pub use descent::{
    ActiveArc, ConeSolver, DescentLimits, DescentProblem, DescentSettings, DescentSolution, DescentSolver,
    Divert, DivertPlanner, DivertSettings, FlightTime, Hold, Limit, LowerBound, Outcome,
};
pub use error::ConvexError;
pub use successive::{SuccessiveConvexification, SuccessiveRecord, SuccessiveSettings, SuccessiveSolution};
