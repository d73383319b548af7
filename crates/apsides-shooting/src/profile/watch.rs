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
    /// Times of the last two looks along the piece, the later one first; NaN where there was none.
    pub(crate) times: [f64; 2],
    /// Value of each limit at these times.
    pub(crate) values: Vec<[f64; 2]>,
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
    /// Looks at the state in the storage, the first of a piece.
    pub(crate) fn begin(&mut self, t: f64) {
        self.storage.times = [f64::NAN; 2];
        self.look(t);
    }

    /// Looks at the state in the storage.
    fn look(&mut self, t: f64) {
        if self.limits.is_empty() {
            return;
        }
        let scratch = &mut *self.scratch.borrow_mut();
        let WatchStorage { state, rows, times, values } = &mut *self.storage;
        self.motion.take(self.interval, t, state, scratch);
        let mut first = 0;
        for constraint in &self.motion.phase.path {
            let out = &mut rows[first..first + constraint.rows.len()];
            self.motion.value(constraint.function.as_ref(), t, scratch, out);
            first += constraint.rows.len();
        }
        let controls = scratch.controls(self.motion.phase);
        for ((limit, peak), before) in self.limits.iter().zip(&mut *self.peaks).zip(values) {
            let value = match limit.quantity {
                Quantity::Path(row) => rows[row],
                Quantity::State(k) => state[k],
                Quantity::Control(k) => controls[k],
                Quantity::Endpoint(_) | Quantity::Integral(_) | Quantity::FinalTime => continue,
            };
            let mut raise = |value: f64, t: f64| {
                // A NaN is an infinite excess.
                let undefined = value.is_nan() && peak.amount < f64::INFINITY;
                if undefined || limit.bounds.excess(value) > peak.amount {
                    *peak = limit.excess(&limit.bounds, value, t);
                }
            };
            raise(value, t);
            if let Some((t, value)) = extremum([times[1], times[0], t], [before[1], before[0], value]) {
                raise(value, t);
            }
            *before = [value, before[0]];
        }
        *times = [t, times[0]];
    }
}

/// Where the parabola through three points turns, if the middle one is above or below both others.
///
/// With equal distances it goes beyond the middle value by at most an eighth of the larger difference; more, from points of very
/// different distances, is cut off.
fn extremum(t: [f64; 3], v: [f64; 3]) -> Option<(f64, f64)> {
    let (before, after) = (v[1] - v[0], v[1] - v[2]);
    if before * after <= 0.0 || !(before * after).is_finite() || !t[0].is_finite() {
        return None;
    }
    let (a, b) = (t[1] - t[0], t[2] - t[1]);
    // v = v1 + slope s - curvature s^2 with s = t - t1.
    let curvature = (before / a + after / b) / (a + b);
    let slope = (before / a * b - after / b * a) / (a + b);
    let shift = 0.5 * slope / curvature;
    let most = 0.125 * before.abs().max(after.abs());
    Some((t[1] + shift, v[1] + (0.5 * slope * shift).clamp(-most, most)))
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

#[cfg(test)]
mod tests {
    use super::extremum;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn parabolas_are_met_and_steep_ends_cut_off() {
        let p = |t: f64| 3.0 - 2.0 * (t - 1.2_f64).powi(2);
        for sign in [1.0, -1.0] {
            let (t, v) = extremum([0.0, 1.0, 2.5], [p(0.0), p(1.0), p(2.5)].map(|v| sign * v)).unwrap();
            assert!((t - 1.2).abs() < ROUNDING && (v - 3.0 * sign).abs() < ROUNDING);
        }
        assert_eq!(extremum([0.0, 1.0, 2.0], [0.0, 1.0, 2.0]), None);
        assert_eq!(extremum([f64::NAN, 1.0, 2.0], [0.0, 1.0, 0.0]), None);
        assert_eq!(extremum([0.0, 1.0, 2.0], [0.0, f64::INFINITY, 0.0]), None);
        let (_, v) = extremum([0.0, 0.01, 10.0], [0.0, 1.0, 0.9]).unwrap();
        assert_eq!(v, 1.125);
    }
}
