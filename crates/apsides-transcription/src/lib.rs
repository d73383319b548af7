//! The common base of transcriptions of optimal control problems into nonlinear programs.
//!
//! Methods that take states and controls at nodes as unknowns differ in what joins the nodes; the rest of the program is the same:
//!
//! ```text
//! minimise    a^T x + sum_k f_k(x) + Phi(ends)
//! subject to  A x + c(x) within its limits,  g(ends) within its limits,  x within its limits
//! ```
//!
//! A method has the functions `f_k` and `c` along the phases, as a [`Discretisation`], and says where a phase stands in `x` and among
//! the rows, as a [`PhaseLayout`]. [`Transcription`] has the rest: times, integrals, durations, endpoint constraints, parameters,
//! their bounds and scales, starting point and warm start, patterns, names of rows, the call of the solver.
//!
//! The crate holds no method: it knows no points, steps or meshes. Programs whose unknowns are no states at nodes, such as the
//! coefficients of `apsides-flatness`, take its parts ([`Limits`], [`row_changes`]) and not the whole.
//!
//! ```
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_ocp::{At, Bounds, Ocp, Phase, State};
//! use apsides_transcription::{Limits, PhaseEnds, Places};
//!
//! struct Fall;
//! impl Dynamics<2, 0> for Fall {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 0], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], x[1] * 0.0 - 9.80665]
//!     }
//! }
//!
//! let phase = Phase::new("fall", Fall)
//!     .states([State::new("height", "m").starts_at(1.0).ends_at(0.0), State::new("speed", "m/s").starts_at(0.0)])
//!     .initial_time(Bounds::new(0.0, 1.0))
//!     .final_time(Bounds::new(0.0, 9.0))
//!     .duration(Bounds::new(0.1, 2.0));
//! // Three nodes of two states, then two times; a matching condition between each two nodes, then the duration.
//! let mut places = Places::default();
//! let (states, rows) = (places.take_columns(3 * 2), places.take_rows(2 * 2));
//! let times = places.take_columns(2);
//! let ends = PhaseEnds::new(&phase, (states, states + 4), (times, times + 1), &mut places);
//! assert_eq!((ends.final_state, ends.final_time, ends.duration_row), (4, 7, Some(rows + 4)));
//! let mut limits = Limits::new(8, Bounds::FREE);
//! limits.set(ends.initial_state, phase.states[0].initial);
//! assert_eq!((limits.lower[0], limits.upper[0]), (1.0, 1.0));
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`phase`], [`discretisation`] | the part of a method: the placement of a phase, the terms along the phases |
//! | [`places`], [`layout`] | columns and rows: those of the ends of phases, those of the whole problem |
//! | [`limits`] | bounds of variables and rows |
//! | [`transcription`] | the nonlinear program |
//! | [`scales`] | scales that the problem leaves open |
//! | [`solve`] | warm start from an earlier trajectory, call of the solver |
//! | [`extraction`] | programs for others, and from the decision vector back to the problem |
//! | [`row_origin`] | rows in the words of the problem |
//! | [`workers`] | threads over pieces of nodes |
//!
//! Reference: J. T. Betts, Practical Methods for Optimal Control and Estimation Using Nonlinear Programming, SIAM 2010, chapter 4,
//! doi 10.1137/1.9780898718577.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod discretisation;
pub mod extraction;
pub mod layout;
pub mod limits;
pub mod phase;
pub mod places;
pub mod row_origin;
pub mod scales;
pub mod solve;
pub mod transcription;
pub mod workers;

pub use discretisation::Discretisation;
pub use extraction::Transcribe;
pub use layout::Layout;
pub use limits::Limits;
pub use phase::{ConstantEntry, PhaseLayout, PhaseStart};
pub use places::{PhaseEnds, Places};
pub use row_origin::phase_row;
pub use scales::{Changes, as_scale, row_changes};
pub use transcription::{StartingPoint, Transcription, starting_point, write_next};
pub use workers::{Workers, in_pieces};
