//! Observers that several tests need.

use std::cell::Cell;

use apsides_pipeline::observer::{Flow, IterationRecord, Observer};

/// An observer that panics while it is told to: a fault of the program in the midst of a solve.
pub(crate) struct Panicking<'a>(pub(crate) &'a Cell<bool>);

impl Observer for Panicking<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> Flow {
        assert!(!self.0.get(), "planted in iteration {}", record.iteration);
        Flow::Continue
    }
}
