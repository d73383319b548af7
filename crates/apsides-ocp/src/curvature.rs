//! The size of an objective by its curvature: what a sum of squares has that can be brought down to nothing.
//!
//! At such an optimum the objective, its gradient and all costates are rounding, and nothing of them tells what is small. The change of the
//! objective to second order does, when every quantity moves by its scale.

use apsides_ad::NodeFunction;

use crate::{EndpointInput, Ocp, Scaling, Trajectory};

/// Part of its scale by which a quantity may always be off.
const ACCURACY: f64 = 1e-6;

/// Costates of this size, times the scales of their states, are rounding: those that quantities within their accuracy leave of an objective
/// that is nothing within the same accuracy. Zero for any other objective.
#[must_use]
pub fn rounding_of_costates(ocp: &Ocp, trajectory: &Trajectory, scaling: &Scaling) -> f64 {
    let share =
        share_of_curvature(ocp, trajectory, scaling, ACCURACY, |input| ACCURACY * scaling.of_end(input));
    if trajectory.objective.abs() <= share { share / ACCURACY } else { 0.0 }
}

/// The change of the objective to second order when states and controls along the phases move by a part of their scales, and end quantities
/// by these steps.
#[must_use]
pub fn share_of_curvature(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    along: f64,
    step: impl Fn(EndpointInput) -> f64,
) -> f64 {
    let o = &ocp.objective;
    let functions = o.functions.iter().map(|(inputs, f)| {
        let z: Vec<f64> = inputs.iter().map(|i| trajectory.end_value(*i)).collect();
        let steps: Vec<f64> = inputs.iter().map(|i| step(*i)).collect();
        second_order(f.as_ref(), &z, &steps, &mut Vec::new())
    });
    let integrals = o.integrals.iter().map(|&(phase, q, weight)| {
        weight.abs() * share_of_integral(ocp, trajectory, scaling, [phase, q], along)
    });
    functions.chain(integrals).filter(|part| part.is_finite()).sum()
}

/// The change of an integral, by the indices of its phase and of itself, to second order when states and controls along the phase move by a
/// part of their scales.
#[must_use]
pub fn share_of_integral(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    [phase, integral]: [usize; 2],
    along: f64,
) -> f64 {
    let of = &scaling.phases[phase];
    let inputs = ocp.phases[phase].integrals[integral].function.inputs();
    let mut steps: Vec<f64> = of.states.iter().chain(&of.controls).map(|s| along * s).collect();
    steps.resize(inputs, 0.0);
    let mut entries = Vec::new();
    mean_along(ocp, trajectory, [phase, integral], |f, z| second_order(f, z, &steps, &mut entries))
}

/// Mean over the nodes of a phase of something made of the integrand of an integral, by the indices of both, and its inputs there, times the
/// duration.
pub fn mean_along(
    ocp: &Ocp,
    trajectory: &Trajectory,
    [phase, integral]: [usize; 2],
    mut of: impl FnMut(&dyn NodeFunction, &[f64]) -> f64,
) -> f64 {
    let (posed, found) = (&ocp.phases[phase], &trajectory.phases[phase]);
    let f = posed.integrals[integral].function.as_ref();
    let taken = if posed.takes_parameters(f) { &trajectory.parameters[..] } else { &[] };
    let mut z = vec![0.0; f.inputs()];
    let (mut sum, mut count) = (0.0, 0.0);
    for (t, segment) in found.nodes() {
        let (x, rest) = z.split_at_mut(posed.states.len());
        let (u, rest) = rest.split_at_mut(posed.controls.len());
        let (p, time) = rest.split_at_mut(taken.len());
        found.state.evaluate(t, x);
        found.control.evaluate_in(segment, t, u);
        p.copy_from_slice(taken);
        time.fill(t);
        sum += of(f, &z);
        count += 1.0;
    }
    (found.final_time - found.initial_time) * sum / count
}

/// The change of the only output to second order for steps of its inputs, with all signs that add up.
fn second_order(f: &dyn NodeFunction, z: &[f64], steps: &[f64], entries: &mut Vec<f64>) -> f64 {
    entries.resize(f.pattern().hessian_len(), 0.0);
    f.hessian(z, &[1.0], entries);
    let terms = f.pattern().hessian.iter().zip(&*entries).map(|((i, j), h)| {
        let share = if i == j { 0.5 } else { 1.0 };
        (share * h * steps[*i] * steps[*j]).abs()
    });
    terms.sum()
}
