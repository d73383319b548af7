//! The course of a bend along a phase.

use std::f64::consts::PI;

use crate::State;

/// The bend of a state at a part of a phase, one at most: none at fixed ends, and where phases meet.
pub(crate) fn bow(state: &State, is_first: bool, is_last: bool, fraction: f64) -> f64 {
    let keeps_start = !is_first || state.initial.is_fixed();
    let keeps_end = !is_last || state.terminal.is_fixed();
    match (keeps_start, keeps_end) {
        (true, true) => (PI * fraction).sin(),
        (true, false) => (0.5 * PI * fraction).sin(),
        (false, true) => (0.5 * PI * fraction).cos(),
        (false, false) => 1.0,
    }
}
