//! Direct shooting: single and multiple shooting with piecewise-polynomial controls, as a nonlinear program.
//!
//! A phase is divided into segments. Unknowns are the states at the nodes `x_k`, the values `c_k` of the controls at the control
//! points of each segment, the times and the static parameters. Runge-Kutta steps of given number take the state along a segment,
//!
//! ```text
//! x_{k+1} = phi(x_k, c_k, p, t0, tf),        integrals: the sum over the segments of their quadrature by the same steps
//! ```
//!
//! and path constraints hold at the control points, or at points of their own, with the state that the steps have there. The ends of
//! the segments are fractions of the phase or, as [`SegmentEnds::Free`], unknowns; then `t_k` and `t_{k+1}` take the place of
//! `t0` and `tf` in `phi`, and `t_{k+1} - t_k` has a least value. The program has exact first and second
//! derivatives of the discrete map ([`apsides_ode::DiscreteFlow`]) and is solved by [`apsides_nlp::InteriorPoint`]. With one segment
//! this is single shooting. Segments are independent of each other, so that several threads can integrate them; the numbers are the
//! same for any number of threads.
//!
//! After each solve three things are looked at in each segment:
//!
//! | lack | measure | remedy |
//! | --- | --- | --- |
//! | accuracy of the steps | an integration with step control from the same start | more steps, by the order of the method |
//! | freedom of the controls | what the slope of the Hamiltonian between the control points would gain | division; in single shooting a higher degree |
//! | bounds and path constraints between the points | their excess | rows for state bounds inside the segment, division, a straight line at a jump |
//!
//! and the next solve starts from the trajectory and its costates, until all are within their tolerances.
//!
//! The limits of the method:
//!
//! * A control that jumps or has a kink is met by short segments unless the ends of segments are unknowns. These have many local
//!   optima; `apsides-piecewise` starts from several.
//!   With kinks the costates are good to some 1e-5 of their size, at worst 1e-4, without to some 1e-7; `apsides-tests` has the figures.
//! * The equations are integrated from the guess of each node, by explicit steps: segments must be short enough that unstable or
//!   stiff equations do not leave the range of numbers there. Where they do, the status says so.
//! * Bounds and path constraints hold between the control points to their tolerance only; those on controls next to a jump not even
//!   that, which [`ShootingRecord::control_excess`] tells.
//! * It says which constraint could not be met, not what to relax; `apsides-radau` does.
//!
//! ```
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, State, Variable};
//! use apsides_shooting::direct::MultipleShooting;
//!
//! struct Slide;
//! impl Dynamics<3, 1> for Slide {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
//!         let (sin, cos) = u[0].sin_cos();
//!         [x[2] * sin, x[2] * cos, cos * 9.80665] // x, depth, speed
//!     }
//! }
//!
//! let slide = Phase::new("slide", Slide)
//!     .states([
//!         State::new("x", "m").starts_at(0.0).ends_at(10.0),
//!         State::new("depth", "m").starts_at(0.0).ends_at(5.0),
//!         State::new("speed", "m/s").within(0.0, 30.0).starts_at(0.0),
//!     ])
//!     .controls([Variable::new("angle", "rad").within(0.0, 3.2)])
//!     .final_time(Bounds::new(0.1, 10.0));
//! let ocp = Ocp::builder("brachistochrone").phase(slide).minimize("time", "s", At::FinalTime("slide")).build()?;
//! let solution = MultipleShooting::default().solve(&ocp, &Guess::linear(&ocp))?;
//! assert!(solution.accurate);
//! // The cycloid through (10, 5): x = r (a - sin a), depth = r (1 - cos a), time a sqrt(r / g).
//! assert!((solution.trajectory.objective - 1.8016031).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`settings`] | what can be chosen |
//! | [`solver`] | the method: refinement loop, solution, records |
//! | `method` | the method as an [`apsides_ocp::Method`] |
//! | `plan`, `layout`, `placement`, `transcription` | the nonlinear program, on `apsides-transcription` |
//! | `shot`, `segment_system`, `chain` | one segment: steps, rows, chain rule to its unknowns |
//! | `extraction`, `hamiltonian` | states and costates as polynomials |
//! | `estimate`, `refinement` | what a solution lacks, and the next division |
//!
//! References: H. G. Bock, K. J. Plitt, A multiple shooting algorithm for direct solution of optimal control problems, IFAC Proc. 17
//! (1984), doi 10.1016/S1474-6670(17)61205-9. W. W. Hager, Runge-Kutta methods in optimal control and the transformed adjoint system,
//! Numer. Math. 87 (2000), doi 10.1007/s002110000178.

mod chain;
mod estimate;
mod extraction;
mod hamiltonian;
mod layout;
mod method;
mod placement;
mod plan;
mod refinement;
mod segment_system;
pub mod settings;
mod shot;
pub mod solver;
mod transcription;

pub use settings::{MultipleShootingSettings, SegmentEnds};
pub use solver::{MultipleShooting, ShootingRecord, ShootingSolution};
