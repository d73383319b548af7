//! Spaceflight trajectory optimisation: missions, pipelines and verified results.
//!
//! ```text
//! mission file -> problem and guess -> method -> trajectory -> independent verification -> outcome
//! ```
//!
//! This crate joins the layers below and re-exports them. It reads mission files, but prints nothing; the program is
//! `apsides-cli`, figures and result files are `apsides-report`.
//!
//! ```
//! use apsides::Mission;
//!
//! let mission = Mission::load("lunar-perilune", &["perilune_altitude_km=20".into()])?;
//! let outcome = mission.solve(None, &mut ())?;
//! assert!(outcome.summary.certificate.is_verified());
//! assert!((outcome.summary.results["flight_time_s"] - 999.356984).abs() < 1e-5);
//! # Ok::<(), apsides::Error>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`mission_file`], [`key`] | mission files and their keys |
//! | [`missions`] | the missions that come with the crate |
//! | [`vehicle`] | vehicles as data |
//! | [`pipeline`] | solve and verify |
//! | [`moving_mass`] | a capsule steered by internal masses: cases, laws, closed-loop descents |
//! | [`simulation`] | simulate a mission under its law |
//! | [`sweep`] | parameter sweeps |
//! | [`footprint`] | the ends that a vehicle can reach |
//! | [`reproduce`] | published tables computed again |
//! | [`site_criteria`] | what a landing site must fulfil, from a file |
//! | [`site_selection`] | a landing site chosen in flight |
//! | [`montecarlo`], [`dispersion`] | flights that deviate from a plan |
//! | [`covariance`] | state-transition matrices and covariances along any trajectory |
//! | [`sensitivity`] | what one more unit of a key is worth |
//! | [`outcome`] | results |
//! | [`observer`] | progress |

pub(crate) mod checkpoint;
pub mod covariance;
pub mod dispersion;
pub mod error;
pub mod footprint;
pub mod key;
pub(crate) mod method;
pub mod mission_file;
pub mod missions;
pub mod montecarlo;
pub mod moving_mass;
pub mod observer;
pub mod outcome;
pub mod pipeline;
pub mod reproduce;
pub mod sensitivity;
pub mod simulation;
pub mod site_criteria;
pub mod site_selection;
pub mod sweep;
pub mod vehicle;

pub use apsides_ad as ad;
pub use apsides_basis as basis;
pub use apsides_control as control;
pub use apsides_dynamics as dynamics;
pub use apsides_flatness as flatness;
pub use apsides_metaheuristics as metaheuristics;
pub use apsides_nlp as nlp;
pub use apsides_ocp as ocp;
pub use apsides_ode as ode;
pub use apsides_radau as radau;
pub use apsides_terrain as terrain;
pub use apsides_verify as verify;

pub use error::Error;
pub use mission_file::Mission;
pub use missions::{Decisions, Expansion, Posed};
pub use observer::{Observer, SearchProgress};
pub use outcome::{Counters, Curve, ObjectiveValue, Outcome, Reduced, SearchSummary, Summary, Timing};
pub use sensitivity::Price;
pub use simulation::Simulated;
pub use site_selection::SiteSelection;
