//! From a mission to a verified outcome.
//!
//! ```text
//! mission file -> Values -> Mission -> problem and guess -> method -> trajectory -> independent verification -> Outcome
//! ```
//!
//! This crate knows no mission: kinds of mission implement [`Mission`] and are added to a [`Registry`], which reads them from files as a
//! [`Pipeline`]. It prints nothing.
//!
//! | module | subject |
//! | --- | --- |
//! | [`key`], [`unit_ending`], [`values`] | keys of mission files; the units that end their names; their values, each with its place |
//! | [`file`](mod@file), [`registry`] | reading mission files |
//! | [`named_data`] | bodies, vehicles and sites as data |
//! | [`schema`] | the JSON Schema of mission files |
//! | [`mission`] | [`Mission`]: what a kind of mission is |
//! | [`memory`], `foreseen` | the memory that a solve takes |
//! | [`posed`] | a mission as an optimal control problem, with a start |
//! | [`method`] | the methods, their keys and settings |
//! | [`pipeline`] | [`Pipeline`]: pose, solve, verify |
//! | [`outcome`], [`observer`] | results and progress |
//! | [`cancellation`] | work without iterations that is ended |
//! | [`sensitivity`] | what one more unit of a key is worth |
//! | [`ephemeris`] | solutions and records as flights about a body, at times of one's choice |
//! | [`placing`] | the keys of epoch and axes |
//! | [`record`] | solves on disk, from which work goes on |
//! | [`sweep`] | parameter sweeps |
//! | [`footprint`](mod@footprint) | the ends that a vehicle can reach |
//! | [`dispersion`], [`montecarlo`] | flights that deviate from a plan |
//! | [`shard`] | parts of a large run, and what they make together |
//! | [`arithmetic`] | what of a machine decides the bits of results |
//! | [`fault`] | panics of one case among many |
//! | [`digest`] | SHA-256 in hexadecimal digits |
//! | [`open_loop`] | flights of any solved mission that deviate, along its controls |
//! | [`draws`] | optima of a mission whose numbers are uncertain |
//! | [`covariance`] | state-transition matrices and covariances along any trajectory |
//! | [`simulation`], `closed_loop` | flights under a law |
//! | [`regular_file`] | files that are read |
//! | [`site`] | landing sites that were chosen on maps |
//! | [`lock`] | one process for a directory of results |
//! | [`whole_file`] | the one writer of files |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod arithmetic;
pub mod cancellation;
mod closed_loop;
pub mod covariance;
pub mod digest;
pub mod dispersion;
pub mod draws;
pub mod ephemeris;
pub mod error;
pub mod explanation;
pub mod fault;
pub mod file;
pub mod footprint;
mod foreseen;
pub mod key;
pub mod lines;
pub mod lock;
pub mod memory;
pub mod method;
pub mod mission;
pub mod montecarlo;
pub mod named_data;
pub mod observer;
pub mod open_loop;
pub mod outcome;
pub mod pipeline;
pub mod placing;
pub mod posed;
pub mod record;
pub mod registry;
pub mod regular_file;
pub mod schema;
mod sealed;
pub mod sensitivity;
pub mod shard;
pub mod simulation;
pub mod site;
pub mod sweep;
pub mod unit_ending;
pub mod values;
pub mod whole_file;

pub use cancellation::Cancellation;
pub use error::Error;
pub use mission::{Kind, Mission, Offers, Scalars};
pub use observer::{Observer, SearchProgress};
pub use outcome::{
    Counters, Curve, Decisions, ObjectiveValue, Outcome, Price, Reduced, SearchSummary, Summary, Timing,
};
pub use pipeline::Pipeline;
pub use posed::{Expansion, Posed};
pub use registry::Registry;
pub use simulation::Simulated;
pub use site::{ChosenSite, SiteSummary};
