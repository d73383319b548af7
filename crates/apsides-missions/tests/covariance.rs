//! Covariances along trajectories against central differences of flights, and against flights with drawn errors.
#![allow(clippy::unwrap_used)]

use apsides_metaheuristics::Generator;
use apsides_missions::registry;
use apsides_ocp::{Ocp, Trajectory};
use apsides_ode::{Integrator, OdeSettings};
use apsides_pipeline::covariance::{Transition, along};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-8;

struct Flights {
    ocp: Ocp,
    trajectory: Trajectory,
    phase: usize,
}

impl Flights {
    fn of(mission: &str, overrides: &[&str], phase: usize) -> Self {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        let mission = registry().load(mission, &overrides).unwrap();
        let outcome = mission.solve(None, &mut ()).unwrap();
        Self { ocp: mission.pose().unwrap().ocp, trajectory: outcome.trajectory, phase }
    }

    fn start(&self) -> Vec<f64> {
        let phase = &self.trajectory.phases[self.phase];
        phase.state_at(phase.initial_time)
    }

    /// The end from a start, with errors of the controls.
    fn end(&self, start: &[f64], errors: &[f64], accuracy: f64) -> Vec<f64> {
        let flown = &self.trajectory.phases[self.phase];
        let dynamics = self.ocp.phases[self.phase].dynamics.as_ref();
        let n = start.len();
        let mut integrator = Integrator::new(n, OdeSettings::with_tolerance(accuracy)).unwrap();
        let mut x = start.to_vec();
        for (leg, ends) in flown.control.breaks().windows(2).enumerate() {
            let system = apsides_ode::FnSystem::new(n, |t: f64, x: &[f64], dx: &mut [f64]| {
                let mut z = vec![0.0; dynamics.inputs()];
                z[..n].copy_from_slice(x);
                flown.control.evaluate_in(leg, t, &mut z[n..n + errors.len()]);
                for (u, error) in z[n..].iter_mut().zip(errors) {
                    *u += error;
                }
                z[n + errors.len()] = t;
                dynamics.value(&z, dx);
            });
            let from = x.clone();
            integrator.integrate(&system, ends[0], &from, ends[1], &mut x).unwrap();
        }
        x
    }
}

fn check_derivatives(flights: &Flights, state_steps: &[f64], control_steps: &[f64]) {
    let found = along(&flights.ocp, &flights.trajectory, flights.phase, 1e-12).unwrap();
    let last = found.transitions.last().unwrap();
    let (start, n, k) = (flights.start(), state_steps.len(), control_steps.len());
    let none = vec![0.0; k];
    // Five points; each column by the size of what its step changes.
    for column in 0..n + k {
        let h = if column < n { state_steps[column] } else { control_steps[column - n] };
        let moved = |s: f64| {
            let (mut x, mut u) = (start.clone(), none.clone());
            if column < n {
                x[column] += s * h;
            } else {
                u[column - n] += s * h;
            }
            flights.end(&x, &u, 1e-13)
        };
        let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(moved);
        for i in 0..n {
            let change = (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / 12.0;
            let entry = h * if column < n { last.phi[i * n + column] } else { last.psi[i * k + column - n] };
            // The size of a row: the change that the steps of all states make.
            let size: f64 = (0..n).map(|j| (last.phi[i * n + j] * state_steps[j]).abs()).sum();
            assert!((change - entry).abs() < DIFFERENCES * size, "{i} {column}: {change} {entry} of {size}");
        }
    }
}

#[test]
fn derivatives_are_those_of_flights() {
    // Radius, angle, speeds and mass; the thrust's angle and the throttle.
    let planar = Flights::of("chang-e-3-braking", &["motion=plane"], 0);
    check_derivatives(&planar, &[1e3, 5e-4, 1.0, 1.0, 1.0], &[1e-3, 1e-3]);
    // A phase in the middle of a flight, of vertical motion.
    let vertical = Flights::of("chang-e-3-flat", &["motion=plane"], 2);
    check_derivatives(&vertical, &[10.0, 1.0, 1.0], &[1e-3]);
}

#[test]
fn covariances_are_those_of_samples() {
    const SAMPLES: usize = 4000;
    let flights = Flights::of("chang-e-3-braking", &["motion=plane"], 0);
    let (start, controls) = ([300.0, 2e-4, 0.5, 0.5, 2.0], [1e-3, 0.0]);
    let n = start.len();
    let initial: Vec<f64> =
        (0..n * n).map(|k| if k % (n + 1) == 0 { f64::powi(start[k / n], 2) } else { 0.0 }).collect();
    let transitions = along(&flights.ocp, &flights.trajectory, 0, 1e-10).unwrap();
    let all = transitions.covariances(&initial, &controls).unwrap();
    assert_eq!((all.len(), &all[0]), (transitions.times.len(), &initial));
    let linear = all.last().unwrap();
    let mut random = Generator::new(11);
    let nominal = flights.start();
    let ends: Vec<Vec<f64>> = (0..SAMPLES)
        .map(|_| {
            let x: Vec<f64> = nominal.iter().zip(start).map(|(x, s)| x + s * random.normal()).collect();
            let u = controls.map(|s| s * random.normal());
            flights.end(&x, &u, 1e-8)
        })
        .collect();
    let mean = |i: usize| ends.iter().map(|x| x[i]).sum::<f64>() / SAMPLES as f64;
    let means: Vec<f64> = (0..n).map(mean).collect();
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = ends.iter().map(|x| (x[i] - means[i]) * (x[j] - means[j])).sum();
            let size = (linear[i * n + i] * linear[j * n + j]).sqrt();
            let apart = (sum / (SAMPLES as f64 - 1.0) - linear[i * n + j]) / size;
            // Four standard errors of a variance.
            assert!(apart.abs() < 4.0 * (2.0 / SAMPLES as f64).sqrt(), "{i} {j}: {apart}");
        }
    }
}

#[test]
fn numbers_that_do_not_fit_are_refused() {
    let flights = Flights::of("chang-e-3-braking", &["motion=plane"], 0);
    assert!(
        along(&flights.ocp, &flights.trajectory, 3, 1e-8).unwrap_err().to_string().contains("no phase 3")
    );
    let error = Transition::identity(3, 1).covariance(&[0.0; 9], &[]).unwrap_err().to_string();
    assert!(error.contains("it takes 3 x 3 and 1"), "{error}");
    let other = registry().load("lunar-direct", &[]).unwrap().pose().unwrap().ocp;
    let error = along(&other, &flights.trajectory, 0, 1e-8).unwrap_err().to_string();
    assert!(error.contains("not one of this problem"), "{error}");
}
