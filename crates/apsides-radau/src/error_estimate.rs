//! How far the polynomials are from the equations of motion between the collocation points.
//!
//! In each interval of `N` points the state and control are interpolated to a Radau rule of `N + 1` points, the rates
//! there are integrated, and the result is compared with the interpolated state (Patterson, Hager, Rao 2015, eqs. 24 to 27,
//! doi 10.1002/oca.2114).

use apsides_basis::Lgr;
use apsides_ocp::{Ocp, Phase, PhaseTrajectory, Scaling, Trajectory};

use crate::RadauError;

/// Writes the estimated relative error of every interval into the trajectory and returns the largest.
///
/// Differences are relative to the largest value of each state in its phase, where that is above its scale.
pub(crate) fn estimate(ocp: &Ocp, scaling: &Scaling, trajectory: &mut Trajectory) -> Result<f64, RadauError> {
    let mut largest = 0.0_f64;
    for (k, phase) in ocp.phases.iter().enumerate() {
        let scales = &scaling.phases[k].states;
        let parameters = &trajectory.parameters;
        let errors = phase_errors(phase, scales, parameters, &trajectory.phases[k])?;
        // A NaN must not hide behind `max`.
        largest = errors.iter().fold(largest, |a, &e| if e <= a { a } else { e });
        trajectory.phases[k].interval_errors = errors;
    }
    Ok(largest)
}

fn phase_errors(
    phase: &Phase,
    scales: &[f64],
    parameters: &[f64],
    p: &PhaseTrajectory,
) -> Result<Vec<f64>, RadauError> {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let mut inputs = vec![0.0; phase.dynamics.inputs()];
    let time_input = inputs.len() - 1;
    if phase.takes_parameters(phase.dynamics.as_ref()) {
        inputs[nx + nu..time_input].copy_from_slice(parameters);
    }
    let size = state_sizes(scales, p);
    let mut errors = Vec::with_capacity(p.mesh.intervals());
    for (k, &n) in p.mesh.points().iter().enumerate() {
        let m = (n + 1).min(apsides_basis::MAX_POINTS);
        let rule = Lgr::new(m)?;
        let (start, end) = (p.state.breaks()[k], p.state.breaks()[k + 1]);
        let half = 0.5 * (end - start);
        let time = |tau: f64| start + half * (tau + 1.0);
        let mut rates = vec![0.0; m * nx];
        for (i, &tau) in rule.nodes().iter().enumerate() {
            let t = time(tau);
            p.state.evaluate_in(k, t, &mut inputs[..nx]);
            p.control.evaluate_in(k, t, &mut inputs[nx..nx + nu]);
            inputs[time_input] = t;
            phase.dynamics.value(&inputs, &mut rates[i * nx..(i + 1) * nx]);
        }
        let (mut x0, mut x) = (vec![0.0; nx], vec![0.0; nx]);
        p.state.evaluate_in(k, start, &mut x0);
        let mut worst = 0.0_f64;
        for (j, &tau) in rule.support()[1..].iter().enumerate() {
            p.state.evaluate_in(k, time(tau), &mut x);
            let row = &rule.integration()[j * m..(j + 1) * m];
            for s in 0..nx {
                let sum: f64 = row.iter().enumerate().map(|(l, a)| a * rates[l * nx + s]).sum();
                let e = (x0[s] + half * sum - x[s]).abs() / size[s];
                worst = if e <= worst { worst } else { e };
            }
        }
        errors.push(worst);
    }
    Ok(errors)
}

fn state_sizes(scales: &[f64], p: &PhaseTrajectory) -> Vec<f64> {
    let mut size = scales.to_vec();
    for segment in p.state.segments() {
        for row in segment.values.chunks(size.len()) {
            for (s, v) in size.iter_mut().zip(row) {
                *s = s.max(v.abs());
            }
        }
    }
    size
}
