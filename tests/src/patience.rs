//! An observer that interrupts a solve.

use apsides::nlp::{Flow, IterationRecord, Observer};

/// Stops after so many iterations.
#[derive(Debug)]
pub struct Patience(pub usize);

impl Observer for Patience {
    fn iteration(&mut self, _: &IterationRecord) -> Flow {
        self.0 = self.0.saturating_sub(1);
        if self.0 == 0 { Flow::Stop } else { Flow::Continue }
    }
}
