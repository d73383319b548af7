//! Spaceflight trajectory optimisation: missions, pipelines and verified results.

pub mod outcome;

pub use outcome::{Counters, ObjectiveValue, Outcome, Summary, Timing};
