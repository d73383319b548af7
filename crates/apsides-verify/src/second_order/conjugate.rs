//! The conjugate point of the start, from which on the second variation is negative.

use apsides_ocp::{EndpointInput, Ocp};

use super::activity::Space;
use super::form::Form;
use super::interval::{Interval, Rule};
use crate::optimality::PhaseConditions;
use crate::place::place;

/// Bisections of the interval that holds the conjugate point.
const BISECTIONS: usize = 44;

/// A conjugate point closer to the start than this part of the duration is none.
const AT_ONCE: f64 = 1e-6;

/// The conjugate point in words, or what else the negative direction needs.
pub(super) fn place_of(ocp: &Ocp, form: &Form, conditions: &mut [PhaseConditions<'_>]) -> String {
    if let [phase] = &mut conditions[..]
        && let Some(time) = conjugate_time(ocp, form, phase)
    {
        let phase = &form.phases[0];
        // Not a point of the trajectory but its control: the generalised condition of Legendre and Clebsch fails everywhere.
        return if time - phase.spans[0].start < AT_ONCE * phase.duration {
            format!("on every interval, however short, from {}", place(&ocp.phases[0], phase.spans[0].start))
        } else {
            format!("conjugate point at {}", place(&ocp.phases[0], time))
        };
    }
    "through the ends, times or parameters; no conjugate point inside the phase".to_owned()
}

/// The first time at which changes that vanish afterwards have no positive second variation; one phase.
fn conjugate_time(ocp: &Ocp, form: &Form, conditions: &mut PhaseConditions<'_>) -> Option<f64> {
    let phase = form.phases.first()?;
    let fixed: Vec<bool> = (0..phase.sizes.states)
        .map(|state| {
            form.activity(EndpointInput::InitialState { phase: 0, state }).is_fixed_in(Space::Necessary)
        })
        .collect();
    let mut times = vec![false; phase.sizes.times];
    phase.held.iter().for_each(|k| times[*k] = true);
    times[0] = form.activity(EndpointInput::InitialTime { phase: 0 }).is_fixed_in(Space::Necessary);
    let positive =
        |intervals: &[Interval]| phase.truncated(intervals, form.size, 0.0, &fixed, &times).is_positive();
    let n = phase.intervals.len();
    if positive(&phase.intervals) {
        return None;
    }
    // The form on fewer intervals is a part of that on more: positive up to some number of them.
    let (mut good, mut bad) = (0, n);
    while bad - good > 1 {
        let middle = good + (bad - good) / 2;
        if positive(&phase.intervals[..middle]) { good = middle } else { bad = middle }
    }
    let rule = Rule::new()?;
    let whole = phase.spans[bad - 1];
    let parameters = vec![1.0; ocp.parameters.len()];
    let mut intervals = phase.intervals[..bad].to_vec();
    let (mut low, mut high) = (whole.start, whole.end);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if !(middle > low && middle < high) {
            break;
        }
        intervals[bad - 1] =
            Interval::new(conditions, &parameters, &rule, whole.until(middle), phase.duration)?;
        if positive(&intervals) { low = middle } else { high = middle }
    }
    Some(high)
}
