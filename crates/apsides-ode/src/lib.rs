//! Explicit integration of `x' = f(t, x)`, `x(t0) = x0`, with dense output, events and state-transition
//! matrices `Phi' = (df/dx) Phi`.
//!
//! Two Runge-Kutta pairs of Dormand and Prince, of order 8(5,3) and 5(4), for any functions, and Taylor series of high order for formulas of
//! `apsides-ad`, all with step control. No implicit methods: a stiff system
//! is recognised and reported, not solved. No matrices but row-major slices, no physics.
//!
//! ```
//! use apsides_ode::{Direction, Event, EventLog, FnSystem, Integrator, OdeSettings, Status};
//!
//! // A stone thrown up at 10 m/s falls back to the ground at 2 v / g.
//! let stone = FnSystem::new(2, |_t, x, dx| {
//!     dx[0] = x[1];
//!     dx[1] = -9.81;
//! });
//! let height = |_t: f64, x: &[f64]| x[0];
//! let ground = Event::new(&height).directed(Direction::Falling).terminal();
//! let mut integrator = Integrator::new(2, OdeSettings::default())?;
//! let (mut end, mut log) = ([0.0; 2], EventLog::default());
//! let summary = integrator.integrate_observed(&stone, 0.0, &[0.0, 10.0], 60.0, &mut end, &[ground], &mut log)?;
//! assert_eq!(summary.status, Status::Event(0));
//! assert!((summary.time - 20.0 / 9.81).abs() < 1e-14);
//! assert!((end[1] + 10.0).abs() < 1e-13);
//! # Ok::<(), apsides_ode::OdeError>(())
//! ```
//!
//! | names | subject |
//! | --- | --- |
//! | [`OdeSystem`], [`Linearised`], [`FnSystem`] | the system |
//! | [`Integrator`], [`OdeSettings`], [`Method`] | the integration: to an end time, through sample times, as a whole |
//! | [`TaylorIntegrator`] | the same by Taylor series, of formulas |
//! | [`Summary`], [`Status`], [`Statistics`] | how it ended |
//! | [`Observer`], [`Step`], [`DenseSolution`] | what happens on the way, and dense output |
//! | [`Event`], [`Direction`], [`Occurrence`], [`EventLog`] | events |
//! | [`Variational`], [`StmPropagator`], [`propagate_with_stm`] | variational equations |
//! | [`DiscreteFlow`], [`SmoothSystem`] | given steps as a function of state and inputs, with first and second derivatives |
//!
//! References: E. Hairer, S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., Springer 1993,
//! doi:10.1007/978-3-540-78862-1; E. Hairer, G. Wanner, *II*, 1996, doi:10.1007/978-3-642-05221-7 (step control,
//! stiffness test). A. Jorba, M. Zou, Exp. Math. 14 (2005) 99, doi:10.1080/10586458.2005.10128904 (Taylor series).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod dense;
mod discrete;
mod error;
mod event;
mod event_log;
mod integrator;
mod report;
mod scheme;
mod settings;
mod step;
mod step_control;
mod system;
mod taylor;
#[cfg(test)]
mod tests;
mod variational;

pub use dense::DenseSolution;
pub use discrete::{DiscreteFlow, SmoothSystem};
pub use error::OdeError;
pub use event::{Direction, Event};
pub use event_log::{EventLog, EventRecord};
pub use integrator::Integrator;
pub use report::{Statistics, Status, Summary};
pub use settings::{Method, OdeSettings, Tolerance};
pub use step::{Observer, Occurrence, Step};
pub use system::{FnSystem, Linearised, OdeSystem};
pub use taylor::TaylorIntegrator;
pub use variational::{Stm, StmPropagator, Variational, propagate_with_stm};
