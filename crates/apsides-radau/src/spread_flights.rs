//! Flights with controls, durations, free starts and parameters that are spread over what their bounds allow, as starts.
//!
//! A guess that is no motion may lead to where the requirements conflict, though there are motions that meet them: straight lines between
//! the ends of a spiral have the wrong times and the wrong controls. A flight is a motion to begin with, and of many flights some
//! end close to what is required.

use apsides_ocp::spread::Spread;
use apsides_ocp::{Bounds, Guess, Mesh, Ocp, PhaseGuess, Scaling};

use crate::RadauError;
use crate::flown::{Flight, fly};
use crate::start_residuals::StartResiduals;
use crate::transcription::Transcription;

/// Flights that are tried: ten values to each of two numbers.
const FLIGHTS: usize = 100;
/// Flights that are starts.
const STARTS: usize = 3;
/// Largest miss of a start, relative to the scales of what is missed: one that is as far off as these are large is nowhere near.
const CLOSE: f64 = 1.0;
/// Largest factor of a free duration, either way.
const LONGER: f64 = 3.0;

/// The flights that miss the requirements least on a mesh, the closest first; none that is far off.
pub(crate) fn closest_flights(ocp: &Ocp, guess: &Guess, mesh: &Mesh) -> Result<Vec<Guess>, RadauError> {
    let scaling = Scaling::new(ocp, guess);
    let mut found: Vec<(f64, Guess)> = Vec::new();
    for parts in Spread::of(numbers(ocp)).take(FLIGHTS) {
        let Some(steered) = steered(ocp, guess, &scaling, &parts) else { continue };
        let flown = match fly(ocp, &steered, mesh)? {
            Flight::IsCarried(flown) | Flight::TakesMore(flown, _) => flown,
            Flight::Fails => continue,
        };
        let miss = StartResiduals::of(&mut Transcription::new(ocp, mesh, &flown)?).largest();
        if miss < CLOSE {
            found.push((miss, flown));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(found.into_iter().take(STARTS).map(|(_, flown)| flown).collect())
}

/// Numbers that make a flight: both ends of each control, and the duration of each phase, the free states at its start, and the parameters.
fn numbers(ocp: &Ocp) -> usize {
    let of_phases: usize = ocp.phases.iter().map(|phase| 2 * phase.controls.len() + 1).sum();
    of_phases + free_starts(ocp).count() + free_parameters(ocp).count()
}

/// True if a state at the start of the flight, or a parameter, is free.
pub(crate) fn has_free_starts(ocp: &Ocp) -> bool {
    free_starts(ocp).chain(free_parameters(ocp)).next().is_some()
}

/// The states at the start of the flight that are not fixed, by index; later phases start where the ones before them end.
fn free_starts(ocp: &Ocp) -> impl Iterator<Item = usize> {
    let first = ocp.phases.first().map_or(&[][..], |phase| &phase.states);
    first.iter().enumerate().filter(|(_, state)| !state.initial.is_fixed()).map(|(index, _)| index)
}

/// The parameters that are not fixed, by index.
fn free_parameters(ocp: &Ocp) -> impl Iterator<Item = usize> {
    ocp.parameters.iter().enumerate().filter(|(_, p)| !p.bounds.is_fixed()).map(|(index, _)| index)
}

/// The guess with controls along straight lines between values at such parts of their bounds, and durations, free starts and parameters at such
/// parts of what is tried, starts that constraints tie where these are met; none where a duration has no length.
fn steered(ocp: &Ocp, guess: &Guess, scaling: &Scaling, parts: &[f64]) -> Option<Guess> {
    let mut parts = parts.iter().copied();
    let mut phases = Vec::with_capacity(ocp.phases.len());
    for ((phase, usual), scales) in ocp.phases.iter().zip(&guess.phases).zip(&scaling.phases) {
        let mut middle = vec![0.0; phase.controls.len()];
        usual.control(0.5, &mut middle);
        let mut ends = [Vec::new(), Vec::new()];
        for ((control, middle), scale) in phase.controls.iter().zip(&middle).zip(&scales.controls) {
            let range = range(control.bounds, *middle, *scale);
            for end in &mut ends {
                end.push(within(range, parts.next()?));
            }
        }
        let factor = LONGER.powf(2.0 * parts.next()? - 1.0);
        let duration = phase.duration.clamp(factor * (usual.final_time - usual.initial_time));
        let final_time = phase.final_time.clamp(usual.initial_time + duration);
        let mut start = vec![0.0; phase.states.len()];
        usual.state(0.0, &mut start);
        if phases.is_empty() {
            for k in free_starts(ocp) {
                let state = &phase.states[k];
                let allowed = state.initial.intersect(&state.variable.bounds);
                start[k] = within(range(allowed, start[k], scales.states[k]), parts.next()?);
            }
        }
        let times = [usual.initial_time, final_time];
        phases.push(PhaseGuess::samples(&times, vec![start; 2], ends.to_vec()).ok()?);
    }
    let mut parameters = guess.parameters.clone();
    for k in free_parameters(ocp) {
        let allowed = range(ocp.parameters[k].bounds, parameters[k], scaling.parameters[k]);
        parameters[k] = within(allowed, parts.next()?);
    }
    let steered = Guess { phases, parameters, constraint_multipliers: None };
    Some(steered.with_starts_that_meet(ocp))
}

/// The value at a part of a range.
fn within(range: Bounds, part: f64) -> f64 {
    range.lower + part * (range.upper - range.lower)
}

/// The bounds of a quantity, or where it has none on a side, as far as its scale from the guess.
fn range(bounds: Bounds, middle: f64, scale: f64) -> Bounds {
    let or = |bound: f64, other: f64| if bound.is_finite() { bound } else { other };
    Bounds { lower: or(bounds.lower, middle - scale), upper: or(bounds.upper, middle + scale) }
}
