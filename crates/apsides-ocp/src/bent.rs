//! Bent guesses, from which a solve may end elsewhere.
//!
//! A symmetric start leads to a symmetric end: from a straight line through the middle of an obstacle Newton's method finds no way around
//! it, and a slew about an axis of symmetry keeps the axis. A bent start has no such symmetry.

use std::f64::consts::PI;

use crate::bow::bow;
use crate::{Guess, Ocp, Scaling};

/// Points of a bent guess.
const POINTS: usize = 33;
/// Largest bend of a state or a control, relative to its scale and to the number of the bend.
const BEND: f64 = 0.3;
/// Irrational multiples of this are spread evenly over a unit interval (H. Weyl, 1916).
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Guess {
    /// The guess, with states and controls bent to either side by up to a third of their scales, and durations that are free longer or shorter
    /// by up to a third, all within their bounds; fixed states at the ends, and those where phases meet, stay. Each number, from 1 on, gives another bend, that many times as
    /// large, and the same one each time.
    #[must_use]
    pub fn bent(&self, ocp: &Ocp, number: usize) -> Self {
        let scaling = Scaling::new(ocp, self);
        let mut bends = (1..).map(|k: usize| {
            let spread = ((k + 7 * number) as f64 * GOLDEN).fract();
            BEND * number as f64 * (2.0 * spread - 1.0)
        });
        let longer = bends.by_ref().next().unwrap_or_default().exp();
        let mut begin = self.phases.first().map_or(0.0, |guess| guess.initial_time);
        let mut phases = Vec::new();
        for (k, ((guess, phase), scales)) in
            self.phases.iter().zip(&ocp.phases).zip(&scaling.phases).enumerate()
        {
            let (is_first, is_last) = (k == 0, k + 1 == ocp.phases.len());
            let by_state: Vec<f64> = scales.states.iter().zip(&mut bends).map(|(s, b)| s * b).collect();
            let by_control: Vec<f64> = scales.controls.iter().zip(&mut bends).map(|(s, b)| s * b).collect();
            let mut bent = guess.with_samples(POINTS, |fraction, x, u| {
                for ((x, by), state) in x.iter_mut().zip(&by_state).zip(&phase.states) {
                    let bow = bow(state, is_first, is_last, fraction);
                    *x = state.variable.bounds.clamp(*x + by * bow);
                }
                // Half a wave on a mean: some controls change their sign on the way, others do not.
                for ((u, by), control) in u.iter_mut().zip(&by_control).zip(&phase.controls) {
                    *u = control.bounds.clamp(*u + by * (0.5 + (PI * fraction).cos()));
                }
            });
            let duration = phase.duration.clamp(longer * (guess.final_time - guess.initial_time));
            let initial_time = phase.initial_time.clamp(begin);
            let final_time = phase.final_time.clamp(initial_time + duration);
            if final_time > initial_time {
                (bent.initial_time, bent.final_time) = (initial_time, final_time);
            }
            begin = bent.final_time;
            phases.push(bent);
        }
        Self { phases, parameters: self.parameters.clone(), constraint_multipliers: None }
    }
}
