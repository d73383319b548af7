//! Independent verification of optimal control solutions.
//!
//! ```text
//! x' = f(t, x, u(t), p),  x(t0) given   ->   |x(tf) - x_stated(tf)|,  bounds and constraints along x(t),
//! J,  and with costates:  lambda' + dL/dx,  dL/du,  H,  transversality
//! ```
//!
//! [`verify()`] takes initial states, controls, static parameters and times from a trajectory, integrates the equations
//! of motion again by DOP853 with step control of its own, and compares. Nothing here knows how the trajectory was
//! found, and no solver or method is used. The outcome is a [`Certificate`]: named checks `value <= limit` with unit
//! and place, and a [`Verdict`]: `extremal` by Pontryagin's minimum principle over the whole control set,
//! `strict-local-optimum` by the second variation too.
//!
//! ```
//! use std::sync::Arc;
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_basis::Barycentric;
//! use apsides_ocp::{At, Bounds, Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, State, Trajectory, Variable};
//! use apsides_verify::{Verdict, VerifySettings, verify};
//!
//! struct Cart;
//! impl Dynamics<1, 1> for Cart {
//!     fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
//!         [u[0]]
//!     }
//! }
//!
//! let phase = Phase::new("run", Cart)
//!     .states([State::new("position", "m").within(-1.0, 10.0).starts_at(0.0).ends_at(6.0)])
//!     .controls([Variable::new("speed", "m/s").within(-3.0, 3.0)])
//!     .final_time(Bounds::new(0.1, 10.0));
//! let ocp = Ocp::builder("run").phase(phase).minimize("time", "s", At::FinalTime("run")).build()?;
//!
//! // The answer of some method: full speed for 2 s, costate -1/3 s/m.
//! let ends = Arc::new(Barycentric::new(&[-1.0, 1.0])?);
//! let line = |values: [f64; 2]| {
//!     let segment = Segment { basis: ends.clone(), values: values.into() };
//!     PiecewisePolynomial::new(1, vec![0.0, 2.0], vec![segment])
//! };
//! let run = PhaseTrajectory {
//!     name: "run".into(), initial_time: 0.0, final_time: 2.0, mesh: PhaseMesh::uniform(1, 2)?,
//!     state: line([0.0, 6.0])?, control: line([3.0, 3.0])?, costate: Some(line([-1.0 / 3.0; 2])?),
//!     path_multipliers: None, contacts: vec![], integral_multipliers: None, interval_errors: vec![0.0],
//! };
//! let answer = Trajectory { phases: vec![run], parameters: vec![], objective: 2.0, constraint_multipliers: None };
//! let certificate = verify(&ocp, &answer, &VerifySettings::default())?.certificate;
//! assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`mod@verify`] | all checks in order |
//! | [`certificate`] | checks and verdict |
//! | [`mod@sampled`] | trajectories from the samples of any program |
//! | [`simulation`] | the re-simulated path |
//! | [`settings`], [`error`] | tolerances; what is refused |
//!
//! References: A. E. Bryson and Y.-C. Ho, Applied Optimal Control, Taylor and Francis 1975; E. Hairer, S. P. Norsett,
//! G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, doi 10.1007/978-3-540-78862-1.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod certificate;
pub mod error;
pub mod sampled;
pub mod settings;
pub mod simulation;
pub mod verify;

mod adjoint;
mod boundary;
mod constant_controls;
mod convexity;
mod ends;
mod equations;
mod many_points;
mod meaning;
mod optimality;
mod place;
mod scan;
mod second_order;
mod shape;
#[cfg(test)]
mod tests;
mod worst;

pub use certificate::{Certificate, Check, CheckKind, Claim, Verdict};
pub use error::VerifyError;
pub use optimality::{StatedCostate, stated_costates, with_least_hamiltonian};
pub use sampled::{Interpolation, PhaseSamples, Sampled, sampled};
pub use settings::VerifySettings;
pub use simulation::{SimulatedPhase, open_loop_end};
pub use verify::{Verification, verify};
