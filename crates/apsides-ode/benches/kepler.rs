//! Ten low lunar orbits at 1e-12: rate evaluations per second of the two pairs, the time of Taylor series, and the cost of dense output,
//! events and the state-transition matrix.

use std::hint::black_box;
use std::ops::ControlFlow;

use apsides_ad::{Dynamics, Scalar, dynamics_node};
use apsides_ode::{
    Event, EventLog, Integrator, Linearised, Method, OdeSettings, OdeSystem, Step, StmPropagator,
    TaylorIntegrator,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Gravitational parameter of the Moon, m^3/s^2.
const MU: f64 = 4.9048695e12;

struct Kepler;

impl OdeSystem for Kepler {
    fn dimension(&self) -> usize {
        6
    }

    #[inline]
    fn rate(&self, _t: f64, x: &[f64], dx: &mut [f64]) {
        let r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
        let factor = -MU / (r2 * r2.sqrt());
        for i in 0..3 {
            dx[i] = x[3 + i];
            dx[3 + i] = factor * x[i];
        }
    }
}

impl Dynamics<6, 0> for Kepler {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], _u: &[S; 0], _p: &[S; 0]) -> [S; 6] {
        let r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
        let factor = S::from(-MU) / (r2 * r2.sqrt());
        [x[3], x[4], x[5], x[0] * factor, x[1] * factor, x[2] * factor]
    }
}

impl Linearised for Kepler {
    fn jacobian(&self, _t: f64, x: &[f64], jac: &mut [f64]) {
        let r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
        let factor = MU / (r2 * r2.sqrt());
        jac.fill(0.0);
        for i in 0..3 {
            jac[6 * i + 3 + i] = 1.0;
            for j in 0..3 {
                jac[6 * (3 + i) + j] = 3.0 * factor * x[i] * x[j] / r2;
            }
            jac[6 * (3 + i) + i] -= factor;
        }
    }
}

fn orbits(c: &mut Criterion) {
    let x0 = [1.838e6, 0.0, 0.0, 0.0, (MU / 1.838e6f64).sqrt(), 0.0];
    let end = 10.0 * std::f64::consts::TAU * (1.838e6f64.powi(3) / MU).sqrt();
    let settings = |method| OdeSettings { method, ..OdeSettings::with_tolerance(1e-12) };
    let mut x1 = [0.0; 6];
    let mut group = c.benchmark_group("ten_lunar_orbits");
    for method in [Method::Dop853, Method::Dopri5] {
        let mut integrator = Integrator::new(6, settings(method)).expect("valid settings");
        let summary = integrator.integrate(&Kepler, 0.0, &x0, end, &mut x1).expect("valid request");
        group.throughput(Throughput::Elements(summary.statistics.evaluations as u64));
        group.bench_function(format!("{method:?}"), |b| {
            b.iter(|| integrator.integrate(black_box(&Kepler), 0.0, &x0, end, &mut x1))
        });
    }
    let formula = dynamics_node(Kepler).formula().expect("made of elementary functions");
    let mut taylor = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-12)).expect("smooth");
    group.throughput(Throughput::Elements(1));
    group.bench_function("Taylor", |b| b.iter(|| taylor.integrate(0.0, black_box(&x0), &[], end, &mut x1)));
    group.finish();

    let mut group = c.benchmark_group("ten_lunar_orbits_with");
    let mut integrator = Integrator::new(6, settings(Method::Dop853)).expect("valid settings");
    group.bench_function("dense_output", |b| {
        b.iter(|| {
            let mut see = |step: &Step<'_>| {
                black_box(step);
                ControlFlow::Continue(())
            };
            integrator.integrate_observed(black_box(&Kepler), 0.0, &x0, end, &mut x1, &[], &mut see)
        })
    });
    let height = |_: f64, x: &[f64]| x[1];
    group.bench_function("events", |b| {
        b.iter(|| {
            let mut log = EventLog::default();
            let events = [Event::new(&height)];
            integrator.integrate_observed(black_box(&Kepler), 0.0, &x0, end, &mut x1, &events, &mut log)
        })
    });
    let mut propagator = StmPropagator::new(6, 0, settings(Method::Dop853)).expect("valid settings");
    group.bench_function("stm", |b| b.iter(|| propagator.propagate(black_box(&Kepler), 0.0, &x0, end)));
    group.finish();
}

criterion_group!(benches, orbits);
criterion_main!(benches);
