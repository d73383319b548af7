//! Who sees a solve while it runs.

use apsides_nlp::{Flow, IterationRecord};

/// Sees the iterations of programs and the generations of searches, and can stop either.
///
/// Implemented for `()`, which sees nothing, and for functions of an iteration.
pub trait Observer: apsides_nlp::Observer {
    /// Called once per generation. [`Flow::Stop`] ends the search; the solve goes on from the best start found.
    fn generation(&mut self, _search: &SearchProgress) -> Flow {
        Flow::Continue
    }
}

impl Observer for () {}

impl<F: FnMut(&IterationRecord) -> Flow> Observer for F {}

/// A search after one of its generations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchProgress {
    /// Generations so far.
    pub generation: usize,
    /// Flights so far.
    pub evaluations: usize,
    /// Most flights.
    pub budget: usize,
    /// Objective of the best flight with what its misses and excesses cost; none where all flights failed.
    pub best: Option<f64>,
    /// Extent of the population as a part of the box.
    pub spread: f64,
}
