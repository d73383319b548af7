//! Feedback laws, guidance laws, actuators and closed-loop simulation.
//!
//! A vehicle `x' = f(t, x, u)` is steered by a law that acts at sample times `t_k = t_0 + k T` on what sensors show of the state:
//!
//! ```text
//! u_k = actuators(law(t_k, sensors(x(t_k)))),   x' = f(t, x, u_k)  over  [t_k, t_k + T]
//! ```
//!
//! The laws know no problem of optimal control; a trajectory to follow is handed to them as a function of time. Nothing here estimates a
//! state from measurements.
//!
//! ```
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_control::{controller::Ideal, pid::*, record::Recording, simulation::*};
//!
//! struct Axis; // angle and rate; angular acceleration as control
//!
//! impl Dynamics<2, 1> for Axis {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], u[0] + 0.1] // with a constant disturbance
//!     }
//! }
//!
//! let mut pid = Pid::new(PidSettings::new(PidGains::new(3.0, 1.0, 3.0), 0.01))?;
//! let mut law = |_t: f64, x: &[f64; 2]| [pid.update_with_rate(-x[0], -x[1])];
//! let settings = SimulationSettings { time_limit: 40.0, ..Default::default() };
//! let mut record = Recording::every(10);
//! let flight = Simulation::new(&Axis, settings)?.fly(&[0.2, 0.0], &mut law, &mut Ideal, None, &mut record)?;
//! assert_eq!(flight.ending, Ending::TimeLimit);
//! assert!(flight.state[0].abs() < 1e-9);
//! # Ok::<(), apsides_control::ControlError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`pid`], [`nonlinear_pid`] | PID laws with limits and anti-windup |
//! | [`lqr`], [`schedule`] | linear-quadratic regulators, gains against a scheduling variable |
//! | [`sliding`] | sliding mode with a boundary layer |
//! | [`guidance`] | guidance laws of powered descent |
//! | [`allocation`] | two internal masses on crossed tracks or on a rim |
//! | [`actuator`], [`sensor`] | travel, rate, acceleration, delay, play, contact; noise, bias, delay |
//! | [`controller`] | the traits of laws and actuators |
//! | [`simulation`], [`record`] | runs, how they end, what is kept of them, statistics |
//! | [`linear`], [`state_space`] | linear plants with exact derivatives; systems, loops, root locus |
//! | [`margins`] | gain, phase and delay margins |
//!
//! References: K. J. Astrom, B. Wittenmark, *Computer-Controlled Systems*, 3rd ed., Prentice-Hall 1997. E. K.-W. Chu, H.-Y. Fan, W.-W. Lin,
//! C.-S. Wang, *Int. J. Control* 77 (2004) 767, doi 10.1080/00207170410001714988. J.-J. E. Slotine, S. S. Sastry, *Int. J. Control* 38 (1983)
//! 465, doi 10.1080/00207178308933088. A. A. Najm, I. K. Ibraheem, *Eng. Sci. Technol. Int. J.* 22 (2019) 1087,
//! doi 10.1016/j.jestch.2019.02.005. C. F. Van Loan, *IEEE Trans. Autom. Control* 23 (1978) 395, doi 10.1109/TAC.1978.1101743.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod actuator;
pub mod allocation;
pub mod controller;
mod error;
pub mod guidance;
pub mod linear;
pub mod lqr;
pub mod margins;
mod matrix;
pub mod nonlinear_pid;
pub mod pid;
pub mod record;
mod response;
pub mod schedule;
pub mod sensor;
pub mod simulation;
pub mod sliding;
pub mod state_space;

pub use error::ControlError;
