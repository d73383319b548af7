//! Second-order cone programs over stages, for guidance on board: a limit on the work, no allocation, `no_std`.
//!
//! ```text
//! minimise    sum_k cost_k . w_k,                    w_k = (u_k, x_k): controls and states of stage k
//! subject to  x_0 = start,  x_k+1 = dynamics_k w_k + offset_k,  end x_last = end values
//!             rows_k w_k + constants_k in R+ x Q x Q x ...,     Q = {(t, v): |v| <= t}
//! ```
//!
//! Optimal control with linear dynamics, such as powered descents by lossless convexification, has this form. A primal-dual interior-point method
//! on the homogeneous self-dual embedding, with Nesterov-Todd scaling, predictor and corrector ([`solver`]), takes some ten to twenty iterations.
//! Each factors the linear system by one sweep over the stages, in dense blocks of fixed size: the work grows with the number of stages and not with
//! any fill-in. What has no solution is told by a certificate.
//!
//! ```
//! use apsides_stage_cone::{Row, Stage, StageProgram, StageSettings, StageWork, Status, solve_stages};
//!
//! // A cart at rest moves by 1 in ten steps with the least sum of |u|: u, s >= |u|, position, speed.
//! type Cart = Stage<2, 4, 2>;
//! let mut stage = Cart::EMPTY;
//! stage.cost[1] = 1.0;
//! stage.dynamics = [Row::of(&[(2, 1.0), (3, 1.0), (0, 0.5)]), Row::of(&[(3, 1.0), (0, 1.0)])];
//! stage.add_cone(&[(Row::of(&[(1, 1.0)]), 0.0), (Row::of(&[(0, 1.0)]), 0.0)]);
//! let stages = [stage; 11];
//! let end = [[1.0, 0.0], [0.0, 1.0]];
//! let program = StageProgram { stages: &stages, start: [0.0, 0.0], end, end_values: [1.0, 0.0] };
//! let mut work = [StageWork::ZERO; 11];
//! let report = solve_stages(&program, &mut work, &StageSettings::default())?;
//! assert_eq!(report.status, Status::Solved);
//! // One push at the start, one at the end: 9 u = 1.
//! assert!((report.objective - 2.0 / 9.0).abs() < 1e-7);
//! assert!((work[0].variables()[0] - 1.0 / 9.0).abs() < 1e-6);
//! # Ok::<(), apsides_stage_cone::StageError>(())
//! ```
//!
//! Limits of the crate:
//!
//! * Costs are linear; a quadratic one is a cone. Equations within a stage are for the caller to eliminate. Rows that join two stages need what
//!   they join as a state.
//! * All stages have the sizes of the largest; controls and rows that a stage lacks cost next to nothing.
//! * Rows and variables are taken as they are scaled: sizes within some orders of magnitude of one are best.
//! * Stages whose active constraints leave their controls no freedom, with end equations beside them, may end with reduced tolerances.
//!
//! | module | subject |
//! | --- | --- |
//! | [`stage`], [`row`] | data: stages, sparse rows, the program |
//! | [`work`] | the workspace of a stage, owned by the caller, and the solution in it |
//! | [`solver`], [`settings`], [`report`] | solve, tolerances, how it ended |
//! | [`sparse`] | the same program for a general solver |
//! | [`error`] | what is refused |
//! | `cone`, `riccati` | arithmetic of cones, sweep over the stages |
//!
//! References: A. Domahidi, E. Chu, S. Boyd, ECOS: An SOCP solver for embedded systems, ECC 2013, doi 10.23919/ECC.2013.6669541. L. Vandenberghe,
//! The CVXOPT linear and quadratic cone program solvers, 2010. G. Frison, J. Jorgensen, Efficient implementation of the Riccati recursion for
//! solving linear-quadratic control problems, CCA 2013, doi 10.1109/CCA.2013.6662901.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]
#![cfg_attr(not(feature = "std"), no_std)]

mod cone;
pub mod error;
pub mod report;
mod riccati;
pub mod row;
pub mod settings;
pub mod solver;
pub mod sparse;
pub mod stage;
pub mod work;

pub use error::StageError;
pub use report::{StageReport, Status};
pub use row::Row;
pub use settings::StageSettings;
pub use solver::solve_stages;
pub use stage::{Stage, StageProgram};
pub use work::StageWork;
