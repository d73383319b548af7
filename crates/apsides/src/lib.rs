//! Spaceflight trajectory optimisation: missions, pipelines and verified results.
//!
//! ```text
//! mission file -> mission in SI -> problem and guess -> method -> trajectory -> independent verification -> outcome
//! ```
//!
//! This crate joins the layers below and re-exports them. It prints nothing; the program is `apsides-cli`, figures and result files are
//! `apsides-report`.
//!
//! ```
//! let mut mission = apsides::load("lunar-perilune", &[])?;
//! mission.set("perilune_altitude_km", 20.0)?;
//! let outcome = mission.solve(None, &mut ())?;
//! assert!(outcome.summary.certificate.is_verified());
//! assert!((outcome.summary.results["flight_time_s"] - 999.356984).abs() < 1e-5);
//! # Ok::<(), apsides::Error>(())
//! ```
//!
//! Kinds of mission and methods are features, all of them on by default: `default-features = false, features = ["lunar"]` solves lunar
//! landings by collocation, with neither terrain nor conic solver; `"lunar", "flatness"` in flat outputs too.
//!
//! | crate | subject |
//! | --- | --- |
//! | [`pipeline`] | from a mission to a verified outcome: keys, methods, sweeps, sensitivities, Monte Carlo, footprints |
//! | [`missions`] | the kinds of mission |
//! | [`ocp`] | the language of optimal control problems |
//! | [`radau`], [`flatness`], [`shooting`], [`piecewise`], [`convex`] | methods |
//! | [`verify`] | certificates |
//! | [`ephemeris`] | epochs, axes, states at times of one's choice, files for other programs |
//! | [`dynamics`], [`terrain`], [`control`] | equations of motion, elevation maps, closed loops |
//! | [`nlp`], [`ode`], [`metaheuristics`], [`ad`], [`basis`] | engines and kernels |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub use apsides_ad as ad;
pub use apsides_basis as basis;
pub use apsides_control as control;
#[cfg(feature = "convex")]
pub use apsides_convex as convex;
pub use apsides_dynamics as dynamics;
pub use apsides_ephemeris as ephemeris;
#[cfg(feature = "flatness")]
pub use apsides_flatness as flatness;
pub use apsides_metaheuristics as metaheuristics;
pub use apsides_missions as missions;
pub use apsides_nlp as nlp;
pub use apsides_ocp as ocp;
pub use apsides_ode as ode;
#[cfg(feature = "piecewise")]
pub use apsides_piecewise as piecewise;
pub use apsides_pipeline as pipeline;
pub use apsides_radau as radau;
#[cfg(feature = "shooting")]
pub use apsides_shooting as shooting;
#[cfg(feature = "terrain")]
pub use apsides_terrain as terrain;
pub use apsides_verify as verify;

pub use apsides_missions::registry;
pub use apsides_pipeline::{
    Counters, Curve, Decisions, Error, Kind, Mission, ObjectiveValue, Observer, Outcome, Pipeline, Posed,
    Price, Registry, SearchProgress, SearchSummary, Simulated, Summary, Timing,
};

/// Reads a mission from a file, or by its name from those that come with the program, with the texts `key=value` that replace values of
/// the file.
///
/// # Errors
/// The first mistake, with its place.
pub fn load(file_or_name: &str, overrides: &[String]) -> Result<Pipeline, Error> {
    registry().load(file_or_name, overrides)
}

/// Reads a mission from the text of a file; `source` names it in messages.
///
/// # Errors
/// The first mistake, with its place.
pub fn parse(text: &str, source: &str, overrides: &[String]) -> Result<Pipeline, Error> {
    registry().parse(text, source, overrides)
}
