use super::*;
use crate::{DiscreteFlow, OdeError, SmoothSystem, Status};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-9;

/// Round-off of the arithmetic.
const ROUND_OFF: f64 = 1e-15;

/// A forced pendulum with damping, `x' = v`, `v' = -w0 sin x - w1 v + w2 s^2`, and the quadrature of `v^2 w1 + w2 x`.
struct Pendulum;

impl Pendulum {
    const COLUMNS: usize = 5;
}

impl SmoothSystem for Pendulum {
    fn states(&self) -> usize {
        2
    }

    fn quadratures(&self) -> usize {
        1
    }

    fn inputs(&self) -> usize {
        3
    }

    fn entries(&self) -> usize {
        2
    }

    fn rate(&mut self, s: f64, x: &[f64], w: &[f64], rate: &mut [f64]) {
        rate[0] = x[1];
        rate[1] = -w[0] * x[0].sin() - w[1] * x[1] + w[2] * s * s;
        rate[2] = x[1] * x[1] * w[1] + w[2] * x[0];
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
        entries.copy_from_slice(x);
        for (c, row) in (0..Self::COLUMNS).map(|c| (c, [sensitivity[c], sensitivity[Self::COLUMNS + c]])) {
            let direct = |k: usize| f64::from(u8::from(c == 2 + k));
            tangent[c] = row[1];
            tangent[5 + c] =
                -w[0] * x[0].cos() * row[0] - w[1] * row[1] - x[0].sin() * direct(0) - x[1] * direct(1)
                    + s * s * direct(2);
            tangent[10 + c] =
                2.0 * x[1] * w[1] * row[1] + w[2] * row[0] + x[1] * x[1] * direct(1) + x[0] * direct(2);
        }
    }

    fn add_transposed(&mut self, w: &[f64], x: &[f64], weights: &[f64], out: &mut [f64]) {
        out[0] += -w[0] * x[0].cos() * weights[1] + w[2] * weights[2];
        out[1] += weights[0] - w[1] * weights[1] + 2.0 * x[1] * w[1] * weights[2];
    }

    fn add_hessian(
        &mut self,
        _s: f64,
        x: &[f64],
        w: &[f64],
        sensitivity: &[f64],
        _entries: &[f64],
        weights: &[f64],
        hessian: &mut [f64],
    ) {
        let row = |i: usize, c: usize| match i {
            0 | 1 => sensitivity[i * Self::COLUMNS + c],
            k => f64::from(u8::from(c == k)),
        };
        let pairs = [
            (0, 0, weights[1] * w[0] * x[0].sin()),
            (0, 2, -weights[1] * x[0].cos()),
            (1, 3, -weights[1] + 2.0 * weights[2] * x[1]),
            (1, 1, 2.0 * weights[2] * w[1]),
            (0, 4, weights[2]),
        ];
        for a in 0..Self::COLUMNS {
            for b in 0..=a {
                for (i, j, h) in pairs {
                    let both = if i == j { 0.0 } else { row(j, a) * row(i, b) };
                    hessian[a * Self::COLUMNS + b] += h * (row(i, a) * row(j, b) + both);
                }
            }
        }
    }
}

const V: [f64; 5] = [0.7, -0.3, 1.4, 0.2, 0.6];
const SEEDS: [f64; 15] = [0.0, 0.0, 0.0, 0.3, -0.7, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.1, 0.8, -0.5];

fn flow(method: Method) -> DiscreteFlow {
    DiscreteFlow::new(method, &Pendulum, vec![0.0, 0.4, 0.9, 1.3, 1.5]).unwrap()
}

/// Sum of the seeds times the values, and its gradient.
fn weighted(flow: &mut DiscreteFlow, v: &[f64]) -> (f64, [f64; 5]) {
    flow.differentiate(&mut Pendulum, &v[..2], &v[2..]).unwrap();
    let (mut sum, mut gradient) = (0.0, [0.0; 5]);
    for (k, seed) in SEEDS.iter().enumerate() {
        sum += seed * flow.value(k / 3)[k % 3];
        for (c, g) in gradient.iter_mut().enumerate() {
            *g += seed * flow.sensitivity(k / 3)[k % 3 * 5 + c];
        }
    }
    (sum, gradient)
}

#[test]
fn the_steps_are_those_of_the_integrator() {
    for method in METHODS {
        let system = crate::FnSystem::new(3, |s, x: &[f64], dx: &mut [f64]| Pendulum.rate(s, x, &V[2..], dx));
        let settings = OdeSettings { method, fixed_step: Some(0.25), ..OdeSettings::default() };
        let mut end = [0.0; 3];
        let summary = Integrator::new(3, settings)
            .unwrap()
            .integrate(&system, 0.0, &[V[0], V[1], 0.0], 1.0, &mut end)
            .unwrap();
        assert_eq!(summary.status, Status::Completed);
        let mut flow = DiscreteFlow::new(method, &Pendulum, vec![0.0, 0.25, 0.5, 0.75, 1.0]).unwrap();
        flow.run(&mut Pendulum, &V[..2], &V[2..]).unwrap();
        assert!(distance(flow.value(4), &end) < ROUND_OFF, "{method:?}");
        let plain = flow.value(4).to_vec();
        flow.differentiate(&mut Pendulum, &V[..2], &V[2..]).unwrap();
        assert_eq!(flow.value(4), plain, "{method:?}");
        assert_eq!(flow.steps(), 4);
    }
}

/// Central differences of the discrete map itself; their own error is about 1e-10.
#[test]
fn derivatives_are_those_of_the_discrete_map() {
    for method in METHODS {
        let mut flow = flow(method);
        let (_, gradient) = weighted(&mut flow, &V);
        let mut hessian = [0.0; 25];
        flow.add_hessian(&mut Pendulum, &V[2..], &SEEDS, &mut hessian).unwrap();
        // The adjoint at the start is the gradient by the initial state.
        assert!(distance(&flow.adjoint(0)[..2], &gradient[..2]) < 10.0 * ROUND_OFF, "{method:?}");
        let step = 1e-5;
        for c in 0..5 {
            let mut moved = V;
            moved[c] = V[c] + step;
            let ahead = weighted(&mut flow, &moved);
            moved[c] = V[c] - step;
            let behind = weighted(&mut flow, &moved);
            close(gradient[c], (ahead.0 - behind.0) / (2.0 * step), DIFFERENCES);
            for r in 0..5 {
                let entry = hessian[r.max(c) * 5 + r.min(c)];
                close(entry, (ahead.1[r] - behind.1[r]) / (2.0 * step), DIFFERENCES);
            }
        }
    }
}

#[test]
fn ill_fitting_requests_are_refused() {
    assert!(matches!(
        DiscreteFlow::new(Method::Dopri5, &Pendulum, vec![0.0]),
        Err(OdeError::Dimension { argument: "grid", .. })
    ));
    assert!(DiscreteFlow::new(Method::Dopri5, &Pendulum, vec![0.0, f64::NAN]).is_err());
    let mut flow = flow(Method::Dopri5);
    assert!(flow.run(&mut Pendulum, &V[..3], &V[2..]).is_err());
    assert!(flow.run(&mut Pendulum, &V[..2], &V[1..]).is_err());
    assert!(flow.add_hessian(&mut Pendulum, &V[2..], &SEEDS, &mut [0.0; 4]).is_err());
    assert!(flow.add_hessian(&mut Pendulum, &V[2..], &SEEDS[1..], &mut [0.0; 25]).is_err());
    flow.run(&mut Pendulum, &[f64::NAN, 0.0], &V[2..]).unwrap();
    assert!(flow.value(4)[0].is_nan());
}
