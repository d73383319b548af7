//! Observers of a solve while it runs.

pub use apsides_nlp::{Observer, SearchProgress};
