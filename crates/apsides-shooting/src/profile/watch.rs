//! Looks at path constraints and bounds along a flight, and keeps its dense output where it is wanted.

use std::cell::RefCell;
use std::ops::ControlFlow;

use apsides_ode::{DenseSolution, Observer, Step};

use super::flight::Excess;
use super::limits::{Limit, Quantity};
use super::motion::{Motion, Scratch};

/// Storage of a watch.
#[derive(Clone, Debug)]
pub(crate) struct WatchStorage {
    /// State and integrals.
    pub(crate) state: Vec<f64>,
    /// Path constraint rows.
    pub(crate) rows: Vec<f64>,
}

/// A flight as a whole: dense output, and per piece the sub-interval of the profile and the times.
pub(crate) struct Recording {
    pub(crate) solution: DenseSolution,
    pub(crate) pieces: Vec<(usize, f64, f64)>,
}

impl Recording {
    pub(crate) fn new() -> Self {
        Self { solution: DenseSolution::new(0.0, &[]), pieces: Vec::new() }
    }

    /// Starts anew.
    pub(crate) fn begin(&mut self, t: f64, state: &[f64]) {
        self.solution = DenseSolution::new(t, state);
        self.pieces.clear();
    }
}

/// Sees the steps along one sub-interval of the profile.
pub(crate) struct Watch<'a> {
    pub(crate) motion: Motion<'a>,
    pub(crate) interval: usize,
    pub(crate) limits: &'a [Limit],
    pub(crate) samples: usize,
    pub(crate) scratch: &'a RefCell<Scratch>,
    pub(crate) storage: &'a mut WatchStorage,
    pub(crate) peaks: &'a mut [Excess],
    pub(crate) recording: Option<&'a mut Recording>,
}

impl Watch<'_> {
    /// Looks at the state in the storage.
    pub(crate) fn look(&mut self, t: f64) {
        if self.limits.is_empty() {
            return;
        }
        let scratch = &mut *self.scratch.borrow_mut();
        let WatchStorage { state, rows } = &mut *self.storage;
        self.motion.take(self.interval, t, state, scratch);
        let mut first = 0;
        for constraint in &self.motion.phase.path {
            let out = &mut rows[first..first + constraint.rows.len()];
            self.motion.value(constraint.function.as_ref(), t, scratch, out);
            first += constraint.rows.len();
        }
        let controls = scratch.controls(self.motion.phase);
        for (limit, peak) in self.limits.iter().zip(&mut *self.peaks) {
            let value = match limit.quantity {
                Quantity::Path(row) => rows[row],
                Quantity::State(k) => state[k],
                Quantity::Control(k) => controls[k],
                Quantity::Endpoint(_) | Quantity::Integral(_) | Quantity::FinalTime => continue,
            };
            let excess = limit.excess(&limit.bounds, value, t);
            if excess.amount > peak.amount {
                *peak = excess;
            }
        }
    }
}

impl Observer for Watch<'_> {
    fn step(&mut self, step: &Step<'_>) -> ControlFlow<()> {
        if !self.limits.is_empty() {
            for k in 1..=self.samples {
                let part = k as f64 / self.samples as f64;
                let t = if k == self.samples {
                    step.end()
                } else {
                    step.start() + part * (step.end() - step.start())
                };
                step.evaluate(t, &mut self.storage.state);
                self.look(t);
            }
        }
        if let Some(recording) = &mut self.recording {
            return recording.solution.step(step);
        }
        ControlFlow::Continue(())
    }
}
