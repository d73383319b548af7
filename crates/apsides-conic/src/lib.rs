//! Conic programs with a fixed pattern, whose data are updated in place.
//!
//! ```text
//! minimise    1/2 x' P x + q' x
//! subject to  A x + s = b,   s in K_1 x K_2 x ...
//! ```
//!
//! Each `K` is a [`Cone`]: zero, nonnegative orthant, or second-order `{(t, w): |w| <= t}`. A program is built once from
//! triplets; values of `P`, `q`, `A`, `b` are replaced afterwards without a new analysis of the pattern, and
//! [`ConicProgram::solve`] says by a [`Status`] how it ended. The solver is Clarabel (P. J. Goulart, Y. Chen, Clarabel: An
//! interior-point solver for conic programs with quadratic objectives, 2024, arXiv:2405.12762).
//!
//! The crate does not offer:
//!
//! * No warm start: an interior point starts anew at each solve.
//! * Rows and columns are scaled once, by the data the program is built with; data that change by orders of magnitude
//!   afterwards want a new program. Weights that vary belong in `q`.
//! * Nothing of this crate allocates in an update or a solve; Clarabel itself allocates a little in each solve.
//!
//! ```
//! use apsides_conic::{Cone, ConicData, ConicProgram, ConicSettings, Status, Triplets};
//!
//! // The point of the half plane x + y >= 2 that is nearest to the origin: min t, |(x, y)| <= t.
//! let mut matrix = Triplets::default();
//! matrix.push(0, 1, -1.0); // 2 - (x + y) <= 0
//! matrix.push(0, 2, -1.0);
//! for k in 0..3 {
//!     matrix.push(1 + k, k, -1.0); // (t, x, y) in the second-order cone
//! }
//! let data = ConicData {
//!     linear: vec![1.0, 0.0, 0.0],
//!     quadratic: Triplets::default(),
//!     matrix,
//!     right_hand_side: vec![-2.0, 0.0, 0.0, 0.0],
//!     cones: vec![Cone::NonNegative(1), Cone::SecondOrder(3)],
//! };
//! let mut program = ConicProgram::new(&data, ConicSettings::default())?;
//! assert_eq!(program.solve(), Status::Solved);
//! assert!((program.x()[0] - 2.0_f64.sqrt()).abs() < 1e-7);
//! program.set_right_hand_side(&[-4.0, 0.0, 0.0, 0.0])?;
//! assert_eq!(program.solve(), Status::Solved);
//! assert!((program.x()[0] - 8.0_f64.sqrt()).abs() < 1e-7);
//! # Ok::<(), apsides_conic::ConicError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`triplets`] | matrices by entries, and their columns |
//! | [`program`] | build, update, solve |
//! | [`settings`] | tolerances and the limit of iterations |
//! | [`error`] | what is refused |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod error;
pub mod program;
pub mod settings;
pub mod triplets;

pub use error::{ConicError, Refusal};
pub use program::{Cone, ConicData, ConicProgram, ConicReport, Status};
pub use settings::ConicSettings;
pub use triplets::Triplets;
