//! Powered descent with least propellant by lossless convexification.
//!
//! With `u = T/m` and `d = ln(m/m(0))` the equations of motion are linear, `r'' = g + u - ..., d' = -s/c`. The bound `|T| >= T1` is not
//! convex; a slack `s` takes its place,
//!
//! ```text
//! |u| <= s,   T1 exp(-d)/m(0) <= s <= T2 exp(-d)/m(0)
//! ```
//!
//! and at the optimum `|u| = s` almost everywhere, because the costate of the velocity vanishes at most at instants: the relaxation is
//! lossless (Acikmese and Ploen 2007, Lemma 2; with a pointing limit Acikmese, Carson, Blackmore 2013). The solution reports the largest gap
//! `1 - |u|/s`. It is not small where less upward thrust than `T1` would be best, as at the start of a straight fall: only thrust
//! that chatters sideways comes near.
//!
//! The bounds on `s` are expanded about a reference `d*`: the upper one as `1 - e`, `e = d - d*`, which lies below the exponential, the
//! lower one as the tangent `1 - e` or as `1 - e + e^2/2` ([`LowerBound`]). Instead of the reference of the paper, full thrust from the start,
//! which costs accuracy, the masses of the solve before are taken, so that `e` vanishes: `mass_change` tells what is left.
//!
//! States are those of held controls exactly. By default the program is one over stages ([`ConeSolver::Stages`]), a control point and its node
//! each, whose linear systems are solved by a sweep. For Clarabel states are eliminated inside blocks of intervals
//! ([`DescentSettings::block`]): of seven states per interval, 1.4 are left with blocks of five. Eliminating all of them is worse where position is
//! limited, since each limit then depends on all controls before it.
//!
//! The end of the flight is not required but priced: the horizontal miss far above propellant,
//! miss of height and velocity ten times as high (exact penalties). So there is a solution for every flight time, whose search by
//! golden section needs no bracket, and when the target is out of reach it is that of least landing error (Blackmore, Acikmese,
//! Scharf 2010).
//!
//! Work is bounded: a fixed number of conic programs, each with a limit of iterations. Updates, solves and reads of a program allocate nothing;
//! what Clarabel allocates in a solve is its own.
//!
//! ```
//! use apsides_convex::{DescentLimits, DivertPlanner, DivertSettings, Outcome, DescentProblem};
//!
//! // A lunar lander at 2.4 km, tilt at most 60 deg, to hover at 100 m over one of three sites.
//! let limits = DescentLimits { pointing: Some(60_f64.to_radians()), ..DescentLimits::default() };
//! let problem = DescentProblem {
//!     gravity: [0.0, 0.0, -1.625],
//!     rotation: [0.0; 3],
//!     mass: 1322.3,
//!     dry_mass: 1200.0,
//!     exhaust_velocity: 2940.0,
//!     thrust: [1500.0, 7500.0],
//!     position: [0.0, 0.0, 2400.0],
//!     velocity: [0.0, 0.0, -46.0],
//!     target: [0.0, 0.0, 100.0],
//!     target_velocity: [0.0; 3],
//!     limits,
//! };
//! let mut planner = DivertPlanner::new(&problem, DivertSettings::default())?;
//! let diverts = planner.plan(&[[100.0, 0.0, 100.0], [400.0, 200.0, 100.0], [9000.0, 0.0, 100.0]])?;
//! assert!(diverts[0].propellant < diverts[1].propellant);
//! assert!(matches!(diverts[2].outcome, Outcome::OutOfReach { .. }));
//! # Ok::<(), apsides_convex::ConvexError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`problem`] | vehicle, start, target, limits |
//! | [`settings`] | what can be chosen |
//! | [`solver`] | flight time, passes, what is lacking |
//! | [`solution`] | trajectory, gap, active limits, outcome |
//! | [`divert`] | many sites from one state |
//! | `program`, `posed`, `stages`, `blocks` | the conic program, its numbers, over stages and in blocks for Clarabel |
//! | `transition`, `flight_time` | exact discretisation, search from a time nearby |
//!
//! References: B. Acikmese, S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353, doi 10.2514/1.27553. L. Blackmore, B. Acikmese, D. Scharf,
//! J. Guid. Control Dyn. 33 (2010) 1161, doi 10.2514/1.47202. B. Acikmese, J. Carson, L. Blackmore, IEEE Trans. Control Syst. Technol. 21
//! (2013) 2104, doi 10.1109/TCST.2012.2237346.

mod blocks;
pub mod divert;
mod flight_time;
mod posed;
pub mod problem;
mod program;
pub mod settings;
pub mod solution;
pub mod solver;
mod stages;
mod transition;

pub use divert::{Divert, DivertPlanner, DivertSettings};
pub use problem::{DescentLimits, DescentProblem};
pub use settings::{ConeSolver, DescentSettings, FlightTime, LowerBound};
pub use solution::{ActiveArc, DescentSolution, Limit, Outcome};
pub use solver::DescentSolver;
pub use transition::Hold;
