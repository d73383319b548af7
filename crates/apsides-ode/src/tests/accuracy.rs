use std::f64::consts::TAU;
use std::ops::ControlFlow;

use super::*;
use crate::{DenseSolution, FnSystem, OdeError, Status, Step, Tolerance};

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 1e-7;

/// Round-off of the arithmetic.
const ROUND_OFF: f64 = 1e-15;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-11;

/// Gravitational parameter of the Moon, m^3/s^2, and the radius of a 100 km orbit, m.
const MOON: f64 = 4.9048695e12;
const RADIUS: f64 = 1.838e6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-15;

#[test]
fn ten_lunar_orbits_return_to_the_start() {
    let x0 = [RADIUS, 0.0, 0.0, 0.0, (MOON / RADIUS).sqrt(), 0.0];
    let end = 10.0 * TAU * (RADIUS.powi(3) / MOON).sqrt();
    let mut x1 = [0.0; 6];
    // The miss in metres, and the work, a golden number.
    for (method, miss, evaluations) in [(Method::Dop853, 1e-4, 5882), (Method::Dopri5, 2e-3, 29798)] {
        let mut integrator = integrator(6, method, 1e-12);
        let summary = integrator.integrate(&Kepler { axes: 3, mu: MOON }, 0.0, &x0, end, &mut x1).unwrap();
        assert_eq!((summary.status, summary.time), (Status::Completed, end));
        assert!(distance(&x1[..3], &x0[..3]) < miss);
        assert!(summary.statistics.evaluations <= evaluations + evaluations / 50);
    }
}

#[test]
fn harmonic_oscillator_follows_the_cosine() {
    let mut x1 = [0.0; 2];
    for method in METHODS {
        for tolerance in [1e-6, 1e-9, 1e-12] {
            let mut integrator = integrator(2, method, tolerance);
            integrator.integrate(&Oscillator { frequency: 1.0 }, 0.0, &[1.0, 0.0], 20.0, &mut x1).unwrap();
            close(x1[0], 20f64.cos(), 100.0 * tolerance);
            close(x1[1], -20f64.sin(), 100.0 * tolerance);
        }
    }
}

/// Restricted three-body problem; start and period of the closed orbit: Hairer et al. I, eq. 0.1 and 0.2.
fn arenstorf() -> (impl OdeSystem, [f64; 4], f64) {
    let system = FnSystem::new(4, |_t, x: &[f64], dx: &mut [f64]| {
        let mu = 0.012277471;
        let rest = 1.0 - mu;
        let d1 = ((x[0] + mu).powi(2) + x[1] * x[1]).powf(1.5);
        let d2 = ((x[0] - rest).powi(2) + x[1] * x[1]).powf(1.5);
        dx[0] = x[2];
        dx[1] = x[3];
        dx[2] = x[0] + 2.0 * x[3] - rest * (x[0] + mu) / d1 - mu * (x[0] - rest) / d2;
        dx[3] = x[1] - 2.0 * x[2] - rest * x[1] / d1 - mu * x[1] / d2;
    });
    (system, [0.994, 0.0, 0.0, -2.00158510637908252240537862224], 17.0652165601579625588917206249)
}

#[test]
fn arenstorf_orbit_closes() {
    let (system, x0, period) = arenstorf();
    let mut x1 = [0.0; 4];
    for (method, tolerance, miss) in
        [(Method::Dop853, 1e-14, 5e-11), (Method::Dop853, 1e-10, 1e-7), (Method::Dopri5, 1e-12, 1e-8)]
    {
        let mut integrator = integrator(4, method, tolerance);
        integrator.integrate(&system, 0.0, &x0, period, &mut x1).unwrap();
        assert!(distance(&x1[..2], &x0[..2]) < miss);
    }
}

/// Sample output of the published program DOPRI5 at tolerance 1e-7: positions at t = 2, 8, 16, and its counters.
#[test]
fn arenstorf_orbit_passes_the_published_points() {
    let (system, x0, period) = arenstorf();
    let published = [
        (2.0, -0.5798781411, 0.6090775251),
        (8.0, -1.174553350, -0.2759466982),
        (16.0, 0.2427110999, -0.3899948833),
    ];
    let times = published.map(|p| p.0);
    let mut states = [0.0; 12];
    integrator(4, Method::Dopri5, 1e-7).sample(&system, 0.0, &x0, &times, &mut states).unwrap();
    for (state, p) in states.chunks(4).zip(published) {
        close(state[0], p.1, PUBLISHED);
        close(state[1], p.2, PUBLISHED);
    }
    let mut x1 = [0.0; 4];
    let summary = integrator(4, Method::Dopri5, 1e-7).integrate(&system, 0.0, &x0, period, &mut x1).unwrap();
    assert_eq!((summary.statistics.evaluations, summary.statistics.accepted), (1442, 216));
}

/// Van der Pol's equation with `eps = 1e-3`: Hairer et al. II, eq. 1.5'; reference by Radau IIA at 1e-11.
#[test]
fn van_der_pol() {
    let system = FnSystem::new(2, |_t, x: &[f64], dx: &mut [f64]| {
        dx[0] = x[1];
        dx[1] = ((1.0 - x[0] * x[0]) * x[1] - x[0]) / 1e-3;
    });
    let mut x1 = [0.0; 2];
    let mut integrator = integrator(2, Method::Dop853, 1e-11);
    assert_eq!(
        integrator.integrate(&system, 0.0, &[2.0, 0.0], 2.0, &mut x1).unwrap().status,
        Status::Completed
    );
    close(x1[0], 1.7632345, PUBLISHED);
    close(x1[1], -0.83568868, PUBLISHED);
}

/// Errors at the end and in the dense output of `steps` fixed steps over one orbit of eccentricity 0.2.
fn fixed_step_errors(method: Method, steps: usize) -> (f64, f64) {
    let settings = OdeSettings { method, fixed_step: Some(TAU / steps as f64), ..OdeSettings::default() };
    let kepler = Kepler { axes: 2, mu: 1.0 };
    let x0 = periapsis(0.2);
    let mut fixed = Integrator::new(4, settings).unwrap();
    let mut x1 = [0.0; 4];
    let summary = fixed.integrate(&kepler, 0.0, &x0, TAU, &mut x1).unwrap();
    assert_eq!(summary.statistics.accepted, steps);
    let (_, dense) = fixed.solve_dense(&kepler, 0.0, &x0, TAU).unwrap();
    let (_, exact) = integrator(4, Method::Dop853, 1e-14).solve_dense(&kepler, 0.0, &x0, TAU).unwrap();
    let mut worst = 0.0f64;
    let (mut a, mut b) = ([0.0; 4], [0.0; 4]);
    for k in 0..=200 {
        // The first step only: elsewhere the error of the solution hides that of the interpolant.
        let t = TAU / steps as f64 * k as f64 / 200.0;
        dense.evaluate(t, &mut a).unwrap();
        exact.evaluate(t, &mut b).unwrap();
        worst = worst.max(distance(&a, &b));
    }
    (distance(&x1, &x0), worst)
}

#[test]
fn measured_orders() {
    for (method, steps, order, dense_order) in
        [(Method::Dop853, 30, 8.0, 8.0), (Method::Dopri5, 100, 5.0, 5.0)]
    {
        let (coarse, coarse_dense) = fixed_step_errors(method, steps);
        let (fine, fine_dense) = fixed_step_errors(method, 2 * steps);
        let (end, inside) = ((coarse / fine).log2(), (coarse_dense / fine_dense).log2());
        assert!((end - order).abs() < 0.6, "{method:?}: order {end}");
        assert!(inside > dense_order - 0.4, "{method:?}: order of dense output {inside}");
    }
}

#[test]
fn dense_output_is_as_accurate_as_the_steps() {
    for (method, tolerance) in [(Method::Dop853, 1e-10), (Method::Dopri5, 1e-10)] {
        let (summary, dense) = integrator(2, method, tolerance)
            .solve_dense(&Oscillator { frequency: 1.0 }, 1.0, &[1f64.cos(), -1f64.sin()], 30.0)
            .unwrap();
        assert_eq!(dense.times().len(), summary.statistics.accepted + 1);
        assert_eq!((dense.start(), dense.end()), (1.0, 30.0));
        let mut x = [0.0; 2];
        for k in 0..=2900 {
            let t = 1.0 + k as f64 / 100.0;
            dense.evaluate(t, &mut x).unwrap();
            close(x[0], t.cos(), 100.0 * tolerance);
            close(x[1], -t.sin(), 100.0 * tolerance);
        }
        assert!(matches!(dense.evaluate(30.1, &mut x), Err(OdeError::OutsideInterval { .. })));
        assert!(dense.evaluate(f64::NAN, &mut x).is_err());
        assert!(dense.evaluate(2.0, &mut [0.0; 3]).is_err());
    }
}

#[test]
fn dense_output_backward_and_of_no_length() {
    let mut integrator = integrator(2, Method::Dop853, 1e-12);
    let (_, dense) = integrator.solve_dense(&Oscillator { frequency: 1.0 }, 0.0, &[1.0, 0.0], -12.0).unwrap();
    let mut x = [0.0; 2];
    for k in 0..=120 {
        let t = -f64::from(k) / 10.0;
        dense.evaluate(t, &mut x).unwrap();
        close(x[0], t.cos(), INTEGRATION);
    }
    assert!(dense.evaluate(0.1, &mut x).is_err());
    let point = DenseSolution::new(3.0, &[4.0, 5.0]);
    point.evaluate(3.0, &mut x).unwrap();
    assert_eq!(x, [4.0, 5.0]);
    assert!(point.evaluate(3.1, &mut x).is_err());
}

#[test]
fn sample_times_forward_and_backward() {
    let system = Oscillator { frequency: 1.0 };
    let mut integrator = integrator(2, Method::Dop853, 1e-12);
    for sign in [1.0, -1.0] {
        let times = [0.0, 0.0, 0.1, 0.2, 7.0, 7.0, 25.0].map(|t| sign * t);
        let mut states = [0.0; 14];
        let summary = integrator.sample(&system, 0.0, &[1.0, 0.0], &times, &mut states).unwrap();
        assert_eq!((summary.status, summary.time), (Status::Completed, sign * 25.0));
        for (t, x) in times.iter().zip(states.chunks(2)) {
            close(x[0], t.cos(), INTEGRATION);
        }
        assert_eq!(states[..4], [1.0, 0.0, 1.0, 0.0]);
    }
    let mut states = [0.0; 4];
    let turned = integrator.sample(&system, 0.0, &[1.0, 0.0], &[2.0, 1.0], &mut states);
    assert_eq!(turned, Err(OdeError::SampleOrder { index: 1, time: 1.0, previous: 2.0 }));
    assert!(integrator.sample(&system, 0.0, &[1.0, 0.0], &[1.0, 0.0], &mut states).is_err());
    assert!(integrator.sample(&system, 0.0, &[1.0, 0.0], &[1.0, f64::NAN], &mut states).is_err());
    assert!(integrator.sample(&system, 0.0, &[1.0, 0.0], &[1.0], &mut states).is_err());
    assert_eq!(integrator.sample(&system, 0.0, &[1.0, 0.0], &[], &mut []).unwrap().status, Status::Completed);
}

#[test]
fn round_trip_returns_to_the_start() {
    let kepler = Kepler { axes: 2, mu: 1.0 };
    let x0 = periapsis(0.6);
    let (mut there, mut back) = ([0.0; 4], [0.0; 4]);
    for method in METHODS {
        let mut integrator = integrator(4, method, 1e-13);
        integrator.integrate(&kepler, 2.0, &x0, 20.0, &mut there).unwrap();
        let summary = integrator.integrate(&kepler, 20.0, &there, 2.0, &mut back).unwrap();
        assert_eq!(summary.time, 2.0);
        assert!(distance(&back, &x0) < 20.0 * INTEGRATION, "{method:?}: {:e}", distance(&back, &x0));
    }
}

#[test]
fn tolerance_per_component_and_controlled_components() {
    // Two decoupled oscillators; the fast one matters only where it is controlled.
    let system = FnSystem::new(4, |_t, x: &[f64], dx: &mut [f64]| {
        (dx[0], dx[1], dx[2], dx[3]) = (x[1], -x[0], 10.0 * x[3], -10.0 * x[2]);
    });
    let x0 = [1.0, 0.0, 1.0, 0.0];
    let mut x1 = [0.0; 4];
    let mut steps = |settings| {
        let mut integrator = Integrator::new(4, settings).unwrap();
        integrator.integrate(&system, 0.0, &x0, 10.0, &mut x1).unwrap().statistics.accepted
    };
    let base = OdeSettings::with_tolerance(1e-10);
    let all = steps(base.clone());
    let slow = steps(OdeSettings { controlled_components: Some(2), ..base.clone() });
    let loose = vec![1e-10, 1e-10, 1e3, 1e3];
    let loose = steps(OdeSettings { absolute_tolerance: Tolerance::PerComponent(loose), ..base });
    assert!(3 * slow < all && 3 * loose < all, "{all} {slow} {loose}");
}

#[test]
fn observer_sees_every_step_and_may_stop() {
    let system = Oscillator { frequency: 1.0 };
    let mut integrator = integrator(2, Method::Dop853, 1e-9);
    let mut x1 = [0.0; 2];
    let mut reached = 0.0;
    let mut steps = 0;
    let mut observer = |step: &Step<'_>| {
        assert_eq!(step.start(), reached);
        close(step.start_state()[0], step.start().cos(), 1e4 * INTEGRATION);
        reached = step.end();
        steps += 1;
        if step.end() > 5.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let summary =
        integrator.integrate_observed(&system, 0.0, &[1.0, 0.0], 100.0, &mut x1, &[], &mut observer).unwrap();
    assert_eq!(summary.status, Status::Stopped);
    assert_eq!((summary.time, summary.statistics.accepted), (reached, steps));
    close(x1[0], summary.time.cos(), 1e4 * INTEGRATION);
}

#[test]
fn step_limits_are_kept() {
    let system = Oscillator { frequency: 1.0 };
    let settings =
        OdeSettings { max_step: 0.125, initial_step: Some(1e-3), ..OdeSettings::with_tolerance(1e-6) };
    let mut integrator = Integrator::new(2, settings).unwrap();
    let mut x1 = [0.0; 2];
    let mut lengths = vec![];
    let mut observer = |step: &Step<'_>| {
        lengths.push(step.start() - step.end());
        ControlFlow::Continue(())
    };
    let summary =
        integrator.integrate_observed(&system, 4.0, &[1.0, 0.0], 0.0, &mut x1, &[], &mut observer).unwrap();
    close(lengths[0], 1e-3, ROUNDING);
    assert!(lengths.iter().all(|&h| h > 0.0 && h <= 0.125 + ROUNDING));
    close(summary.next_step, 0.125, ROUND_OFF);
}
