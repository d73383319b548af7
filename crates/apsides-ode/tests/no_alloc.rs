//! Nothing is allocated after construction, and with events after the first run with as many.

use std::ops::ControlFlow;

use apsides_ad::FormulaBuilder;
use apsides_ode::{
    DiscreteFlow, Event, FnSystem, Integrator, Linearised, Method, OdeSettings, OdeSystem, SmoothSystem,
    Step, StmPropagator, TaylorIntegrator,
};

struct Oscillator;

impl OdeSystem for Oscillator {
    fn dimension(&self) -> usize {
        2
    }

    fn rate(&self, _t: f64, x: &[f64], dx: &mut [f64]) {
        dx[0] = x[1];
        dx[1] = -x[0];
    }
}

impl Linearised for Oscillator {
    fn jacobian(&self, _t: f64, _x: &[f64], jac: &mut [f64]) {
        jac.copy_from_slice(&[0.0, 1.0, -1.0, 0.0]);
    }
}

/// `x'' = -w x` with the stiffness as an input.
impl SmoothSystem for Oscillator {
    fn states(&self) -> usize {
        2
    }

    fn inputs(&self) -> usize {
        1
    }

    fn entries(&self) -> usize {
        1
    }

    fn rate(&mut self, _s: f64, x: &[f64], w: &[f64], rate: &mut [f64]) {
        rate.copy_from_slice(&[x[1], -w[0] * x[0]]);
    }

    fn tangent(
        &mut self,
        s: f64,
        x: &[f64],
        w: &[f64],
        sensitivity: &[f64],
        rate: &mut [f64],
        tangent: &mut [f64],
        entries: &mut [f64],
    ) {
        self.rate(s, x, w, rate);
        entries[0] = x[0];
        for c in 0..3 {
            let direct = if c == 2 { -x[0] } else { 0.0 };
            tangent[c] = sensitivity[3 + c];
            tangent[3 + c] = direct - w[0] * sensitivity[c];
        }
    }

    fn add_transposed(&mut self, w: &[f64], _entries: &[f64], weights: &[f64], out: &mut [f64]) {
        out[0] -= w[0] * weights[1];
        out[1] += weights[0];
    }

    fn add_hessian(
        &mut self,
        _s: f64,
        _x: &[f64],
        _w: &[f64],
        sensitivity: &[f64],
        _entries: &[f64],
        weights: &[f64],
        hessian: &mut [f64],
    ) {
        for (c, slope) in sensitivity[..3].iter().enumerate() {
            hessian[6 + c] -= weights[1] * slope * if c == 2 { 2.0 } else { 1.0 };
        }
    }
}

#[test]
fn given_steps_allocate_nothing() {
    for method in [Method::Dop853, Method::Dopri5] {
        let grid = (0..=10).map(f64::from).collect();
        let mut flow = DiscreteFlow::new(method, &Oscillator, grid).unwrap();
        let (mut hessian, seeds) = ([0.0; 9], [0.5; 22]);
        let count = allocations(|| {
            flow.run(&mut Oscillator, &[1.0, 0.0], &[0.7]).unwrap();
            flow.differentiate(&mut Oscillator, &[1.0, 0.0], &[0.7]).unwrap();
            flow.add_hessian(&mut Oscillator, &[0.7], &seeds, &mut hessian).unwrap();
        });
        assert_eq!(count, 0, "{method:?}");
        assert!(hessian[8] != 0.0);
    }
}

fn allocations(run: impl FnOnce()) -> u64 {
    allocation_counter::measure(run).count_total
}

#[test]
fn integration_allocates_nothing() {
    let x0 = [1.0, 0.0];
    let mut x1 = [0.0; 2];
    let mut states = [0.0; 8];
    for method in [Method::Dop853, Method::Dopri5] {
        let settings = OdeSettings { method, ..OdeSettings::with_tolerance(1e-10) };
        let mut integrator = Integrator::new(2, settings.clone()).unwrap();
        let closure = FnSystem::new(2, |_t, x: &[f64], dx: &mut [f64]| (dx[0], dx[1]) = (x[1], -x[0]));
        let plain = allocations(|| {
            integrator.integrate(&closure, 0.0, &x0, 50.0, &mut x1).unwrap();
        });
        let sampled = allocations(|| {
            integrator.sample(&Oscillator, 0.0, &x0, &[1.0, 2.0, 30.0, 40.0], &mut states).unwrap();
        });
        let zero = |_: f64, x: &[f64]| x[0];
        let speed = |_: f64, x: &[f64]| x[1] - 0.5;
        let events = [Event::new(&zero), Event::new(&speed)];
        let mut steps = 0;
        let mut run = || {
            let mut observer = |_: &Step<'_>| {
                steps += 1;
                ControlFlow::Continue(())
            };
            integrator
                .integrate_observed(&Oscillator, 0.0, &x0, 50.0, &mut x1, &events, &mut observer)
                .unwrap();
        };
        run();
        let observed = allocations(run);
        let mut propagator = StmPropagator::new(2, 0, settings).unwrap();
        let stm = allocations(|| {
            propagator.propagate(&Oscillator, 0.0, &x0, 50.0).unwrap();
        });
        assert_eq!((plain, sampled, observed, stm), (0, 0, 0, 0), "{method:?}");
        assert!(steps > 0);
    }
}

#[test]
fn taylor_series_allocate_nothing() {
    let mut b = FormulaBuilder::new(4);
    let [x, v, w] = [0, 1, 2].map(|k| b.input(k));
    let sine = b.sin(x);
    let product = b.mul(w, sine);
    let pull = b.neg(product);
    let formula = b.formula(&[v, pull]).unwrap();
    let mut integrator = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-12)).unwrap();
    let mut x1 = [0.0; 2];
    let plain = allocations(|| {
        integrator.integrate(0.0, &[1.0, 0.0], &[2.0], 50.0, &mut x1).unwrap();
    });
    let height = |_: f64, x: &[f64]| x[0];
    let events = [Event::new(&height)];
    let mut steps = 0;
    let mut run = || {
        let mut observer = |_: &Step<'_>| {
            steps += 1;
            ControlFlow::Continue(())
        };
        integrator
            .integrate_observed(0.0, &[1.0, 0.0], &[2.0], 50.0, &mut x1, &events, &mut observer)
            .unwrap();
    };
    run();
    let observed = allocations(run);
    assert_eq!((plain, observed), (0, 0));
    assert!(steps > 0);
}
