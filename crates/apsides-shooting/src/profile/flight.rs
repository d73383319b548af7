//! Results of a flight.

use apsides_ode::Status;

/// The reason that a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlightEnd {
    /// The state of the stop passed its value.
    Stopped,
    /// The end time of a flight without stop.
    EndTime,
    /// The latest end time of the phase, without having stopped.
    TimeLimit,
    /// The end time is not after the start.
    NoDuration,
    /// The rates are NaN or infinite.
    NotFinite,
    /// The flight takes too many steps.
    TooManySteps,
    /// The values on both sides of a joint of a profile in energy send the energy back to it.
    Held,
    /// The step became shorter than time resolves.
    StepTooSmall,
}

impl FlightEnd {
    /// Says whether the flight has an end that can be judged.
    #[must_use]
    pub fn is_complete(self) -> bool {
        matches!(self, Self::Stopped | Self::EndTime | Self::TimeLimit)
    }

    /// A status of the integrator that is no end of a piece.
    pub(crate) fn failure(status: Status) -> Self {
        match status {
            Status::NotFinite => Self::NotFinite,
            Status::TooManySteps => Self::TooManySteps,
            _ => Self::StepTooSmall,
        }
    }
}

/// The distance of a quantity outside (positive) or inside (negative) its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// In the quantity's unit; infinite where the quantity is NaN.
    pub amount: f64,
    /// Relative to the nearer bound, to the quantity's size where that bound is zero.
    pub relative: f64,
    /// Value of the quantity.
    pub value: f64,
    /// Time of it.
    pub time: f64,
}

impl Excess {
    /// The excess of nothing seen yet.
    pub(crate) const NONE: Self =
        Self { amount: f64::NEG_INFINITY, relative: f64::NEG_INFINITY, value: f64::NAN, time: f64::NAN };
}

/// One flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// The reason that it ended.
    pub end: FlightEnd,
    /// Objective as it is minimised: that of a maximised one is negated. NaN unless the end is complete.
    pub objective: f64,
    /// Start.
    pub initial_time: f64,
    /// End.
    pub final_time: f64,
    /// State at the start.
    pub initial_state: Vec<f64>,
    /// State at the end, or the last one before a failure.
    pub final_state: Vec<f64>,
    /// Static parameters.
    pub parameters: Vec<f64>,
    /// Integrals of the phase, in its order.
    pub integrals: Vec<f64>,
    /// Per state: its value at the end less the nearest one that it may end at, in its unit.
    pub state_misses: Vec<f64>,
    /// Rows of the endpoint constraints, then bounds of the integrals, then the end time, at the end of the flight.
    pub end_conditions: Vec<Excess>,
    /// Largest excess along the flight of each quantity of [`watched`](super::ProfileShooting::watched).
    pub peaks: Vec<Excess>,
    /// Steps taken.
    pub steps: usize,
    /// Evaluations of the rates.
    pub evaluations: usize,
}
