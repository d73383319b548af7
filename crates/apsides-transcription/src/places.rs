//! Columns, rows and stages: those that are taken, and those that every phase has.

use apsides_ocp::{Bounds, Phase};

/// The first columns, rows and stages that are not taken.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Places {
    pub(crate) column: usize,
    pub(crate) row: usize,
    pub(crate) stage: u32,
}

impl Places {
    /// Takes so many columns and returns the first.
    pub fn take_columns(&mut self, count: usize) -> usize {
        self.column += count;
        self.column - count
    }

    /// Takes so many rows and returns the first.
    pub fn take_rows(&mut self, count: usize) -> usize {
        self.row += count;
        self.row - count
    }

    /// Takes so many stages of the elimination order and returns the first.
    pub fn take_stages(&mut self, count: u32) -> u32 {
        self.stage += count;
        self.stage - count
    }

    /// The first row that is not taken.
    #[must_use]
    pub fn next_row(&self) -> usize {
        self.row
    }
}

/// The columns and rows of one phase that every method has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PhaseEnds {
    /// The first column of the state at the start.
    pub initial_state: usize,
    /// The first column of the state at the end.
    pub final_state: usize,
    /// The column of the start time.
    pub initial_time: usize,
    /// The column of the end time.
    pub final_time: usize,
    /// The row of each integral that has bounds.
    pub integral_rows: Vec<Option<usize>>,
    /// The row of the duration, when it has bounds that those on the times do not imply.
    pub duration_row: Option<usize>,
}

impl PhaseEnds {
    /// The ends of a phase with states at the given first columns, at its start and at its end, and times at the given columns.
    /// The rows of its integrals and of its duration are taken here.
    #[must_use]
    pub fn new(phase: &Phase, states: (usize, usize), times: (usize, usize), places: &mut Places) -> Self {
        let has_row = |bounds: Bounds| bounds != Bounds::FREE;
        let integrals = phase.integrals.iter();
        Self {
            initial_state: states.0,
            final_state: states.1,
            initial_time: times.0,
            final_time: times.1,
            integral_rows: integrals
                .map(|q| has_row(q.variable.bounds).then(|| places.take_rows(1)))
                .collect(),
            duration_row: phase.needs_duration_row().then(|| places.take_rows(1)),
        }
    }

    /// The multipliers of the bounds on the integrals: zero for an integral without bounds.
    #[must_use]
    pub fn integral_multipliers(&self, constraint_multipliers: &[f64]) -> Vec<f64> {
        self.integral_rows.iter().map(|row| row.map_or(0.0, |r| constraint_multipliers[r])).collect()
    }
}
