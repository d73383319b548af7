//! Record of located events.

use std::ops::ControlFlow;

use crate::step::{Observer, Occurrence};

/// An event as kept in an [`EventLog`].
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// Position of the event in the list given to the integrator.
    pub event: usize,
    /// Time of the event.
    pub time: f64,
    /// State at that time.
    pub state: Vec<f64>,
    /// True if the event function rose through zero.
    pub rising: bool,
}

/// An observer that keeps every event, in time order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventLog {
    /// The events seen so far.
    pub records: Vec<EventRecord>,
}

impl Observer for EventLog {
    const OBSERVES_STEPS: bool = false;

    fn event(&mut self, occurrence: &Occurrence<'_>) -> ControlFlow<()> {
        let &Occurrence { event, time, state, rising } = occurrence;
        self.records.push(EventRecord { event, time, state: state.to_vec(), rising });
        ControlFlow::Continue(())
    }
}
