//! Observers of a solve while it runs.

pub use apsides_nlp::{Flow, IterationRecord, Observer, SearchProgress};
