//! Successive convexification: any problem of [`apsides_ocp`], from a guess, by a sequence of convex programs.
//!
//! Unknowns are states and controls at the nodes of equal intervals, controls linear in between, start and end times and static
//! parameters. The equations of motion are integrated over each interval with their variational equations ([`apsides_ode::StmPropagator`]); free
//! times dilate the interval. At a point `z` everything that is not linear is linearised, and a step `d` minimises
//!
//! ```text
//! J + J_z d + rho sum |violations of c + c_z d| + w/2 |d|^2     within bounds
//! ```
//!
//! in scaled unknowns: an exact penalty, so that each program has a solution (virtual control), and a weight on the squared step in the place of a
//! trust region. The step is taken when the penalised objective falls by a part of what the model promises; the weight falls where the
//! model is good and rises where it is not. A step that falls short is solved again with the constraint values it led to
//! (second-order correction), without which curved constraints allow short steps only. The penalty follows the multipliers, and is raised while
//! constraints are not met at a point where the model promises no more; if that does not help the worst constraint is named
//! ([`SuccessiveSolution::unmet`]).
//!
//! No second derivative is used: where the optimum is not held by constraints, convergence is linear.
//!
//! ```
//! use apsides_convex::SuccessiveConvexification;
//!
//! let problem = apsides_problems::find("brachistochrone_dymos").expect("in the gallery");
//! let case = problem.pose()?;
//! let solution = SuccessiveConvexification::default().solve(&case.ocp, &case.guess)?;
//! assert!(solution.status.is_success());
//! assert!(problem.optimum.relative_difference(solution.trajectory.objective).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`settings`] | what can be chosen |
//! | [`solver`] | the iteration, what it returns |
//! | `method` | the method as an [`apsides_ocp::Method`] |
//! | `flow`, `linearisation`, `layout` | values and derivatives at a point |
//! | `subproblem` | the convex program |
//!
//! References: Y. Mao, M. Szmuk, B. Acikmese, Successive convexification of non-convex optimal control problems and its convergence
//! properties, IEEE CDC 2016, doi 10.1109/CDC.2016.7798816. D. Malyuta et al., Convex optimization for trajectory generation, IEEE
//! Control Systems 42 (2022) 40, doi 10.1109/MCS.2022.3187542.

mod flow;
mod layout;
mod linearisation;
mod method;
pub mod settings;
pub mod solver;
mod subproblem;

pub use settings::SuccessiveSettings;
pub use solver::{SuccessiveConvexification, SuccessiveRecord, SuccessiveSolution};
