//! Ridges of the objective: a function of end quantities with a kink at which its slope falls.
//!
//! The derivative of a magnitude is taken as zero at its kink, which suits a magnitude that is to be small. Where it is to be large the
//! kink is a ridge, and both of its sides are better to first order.

use apsides_ad::NodeFunction;
use apsides_ocp::{EndpointInput, Ocp};

use crate::ends::{EndScales, Ends, allowed};
use crate::worst::Worst;
use crate::{Check, CheckKind, VerifySettings};

/// Distance to both sides, relative to the scale of the quantity, and the part of it that is tried beside it.
const STEP: f64 = 1e-5;
const PART: f64 = 0.1;

/// The largest fall of a slope at a kink, relative to the slopes on both sides. None where no function of the objective has kinks.
pub(super) fn check(
    ocp: &Ocp,
    ends: &Ends,
    scales: &EndScales<'_>,
    settings: &VerifySettings,
) -> Option<Check> {
    let sign = ocp.objective.sense.sign();
    let mut worst = Worst::default();
    for (inputs, function) in &ocp.objective.functions {
        if function.formula().is_ok_and(|f| !f.kinks().is_empty()) {
            let z: Vec<f64> = inputs.iter().map(|i| ends.value(*i)).collect();
            let free = inputs.iter().enumerate().filter(|(_, input)| !allowed(ocp, **input).is_fixed());
            for (k, input) in free {
                let fall = fall(function.as_ref(), &z, k, scales.scale(*input), sign);
                worst.consider(fall, settings.stationarity_tolerance, "-", || words(ocp, *input));
            }
        }
    }
    worst.into_check("ridges of the objective", CheckKind::Curvature)
}

/// The fall of the slope in one input, relative to the slopes on both sides; zero where there is none.
fn fall(function: &dyn NodeFunction, z: &[f64], k: usize, scale: f64, sign: f64) -> f64 {
    let at = |step: f64| {
        let (mut moved, mut value) = (z.to_vec(), [0.0]);
        moved[k] += step;
        function.value(&moved, &mut value);
        sign * value[0]
    };
    let here = at(0.0);
    let slopes = |step: f64| [(here - at(-step)) / step, (at(step) - here) / step];
    let [far, near] = [STEP, STEP * PART].map(|part| slopes(part * scale));
    let falls = [far, near].map(|[before, after]| before - after);
    // Of a smooth function the fall shrinks with the step.
    if falls[0] > 0.0 && falls[1] > 0.5 * falls[0] { falls[1] / (near[0].abs() + near[1].abs()) } else { 0.0 }
}

/// The words for an end quantity.
fn words(ocp: &Ocp, input: EndpointInput) -> String {
    let (end, quantity, phase) = match input {
        EndpointInput::InitialTime { phase } => ("initial", "time", phase),
        EndpointInput::FinalTime { phase } => ("final", "time", phase),
        EndpointInput::InitialState { phase, state } => {
            ("initial", ocp.phases[phase].states[state].variable.name.as_str(), phase)
        }
        EndpointInput::FinalState { phase, state } => {
            ("final", ocp.phases[phase].states[state].variable.name.as_str(), phase)
        }
        EndpointInput::Parameter { index } => return ocp.parameters[index].name.clone(),
    };
    format!("{end} {quantity}, phase `{}`", ocp.phases[phase].name)
}
