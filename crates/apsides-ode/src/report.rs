//! Status and work of an integration.

/// The status of an integration: why it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// The end time was reached.
    Completed,
    /// The terminal event of this position in the list stopped it.
    Event(usize),
    /// The observer stopped it.
    Stopped,
    /// The number of attempted steps reached the limit.
    TooManySteps,
    /// The error control asks for a step below the resolution of time: a singularity or an impossible tolerance.
    StepTooSmall,
    /// The rate is NaN or infinite however short the step.
    NotFinite,
    /// The step is held down by stability, not accuracy: the system is stiff and wants an implicit method.
    Stiff,
}

/// Work done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Accepted steps.
    pub accepted: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Evaluations of the rate, those for the dense output included.
    pub evaluations: usize,
}

/// Status and work of an integration; the state at [`time`](Self::time) is in the caller's slice whatever the status.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Status of the integration.
    pub status: Status,
    /// Time reached, that of the last good state.
    pub time: f64,
    /// Magnitude of the step the error control would try next; zero when no step was taken.
    pub next_step: f64,
    /// Work done.
    pub statistics: Statistics,
}
