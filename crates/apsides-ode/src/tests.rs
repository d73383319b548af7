mod accuracy;
mod discrete;
mod events;
mod failures;
mod taylor;
mod variational;

use crate::{Integrator, Linearised, Method, OdeSettings, OdeSystem};

/// Both pairs.
const METHODS: [Method; 2] = [Method::Dop853, Method::Dopri5];
/// A few units of rounding accumulated over some steps.
const ROUNDING: f64 = 1e-13;

/// Planar or spatial two-body problem of gravitational parameter `mu`; state position, velocity.
struct Kepler {
    axes: usize,
    mu: f64,
}

impl OdeSystem for Kepler {
    fn dimension(&self) -> usize {
        2 * self.axes
    }

    fn rate(&self, _t: f64, x: &[f64], dx: &mut [f64]) {
        let r2: f64 = x[..self.axes].iter().map(|v| v * v).sum();
        let factor = -self.mu / (r2 * r2.sqrt());
        for i in 0..self.axes {
            dx[i] = x[self.axes + i];
            dx[self.axes + i] = factor * x[i];
        }
    }
}

impl Linearised for Kepler {
    fn jacobian(&self, _t: f64, x: &[f64], jac: &mut [f64]) {
        let (m, n) = (self.axes, 2 * self.axes);
        let r2: f64 = x[..m].iter().map(|v| v * v).sum();
        let factor = self.mu / (r2 * r2.sqrt());
        jac.fill(0.0);
        for i in 0..m {
            jac[i * n + m + i] = 1.0;
            for j in 0..m {
                jac[(m + i) * n + j] = 3.0 * factor * x[i] * x[j] / r2;
            }
            jac[(m + i) * n + i] -= factor;
        }
    }
}

/// `x'' = -w^2 x` with the frequency `w` as a parameter.
struct Oscillator {
    frequency: f64,
}

impl OdeSystem for Oscillator {
    fn dimension(&self) -> usize {
        2
    }

    fn rate(&self, _t: f64, x: &[f64], dx: &mut [f64]) {
        dx[0] = x[1];
        dx[1] = -self.frequency * self.frequency * x[0];
    }
}

impl Linearised for Oscillator {
    fn jacobian(&self, _t: f64, _x: &[f64], jac: &mut [f64]) {
        jac.copy_from_slice(&[0.0, 1.0, -self.frequency * self.frequency, 0.0]);
    }

    fn parameters(&self) -> usize {
        1
    }

    fn parameter_jacobian(&self, _t: f64, x: &[f64], jac: &mut [f64]) {
        jac.copy_from_slice(&[0.0, -2.0 * self.frequency * x[0]]);
    }
}

/// Periapsis of the planar orbit of eccentricity `e`, `a = mu = 1`, period `2 pi`.
fn periapsis(e: f64) -> [f64; 4] {
    [1.0 - e, 0.0, 0.0, ((1.0 + e) / (1.0 - e)).sqrt()]
}

fn integrator(dimension: usize, method: Method, tolerance: f64) -> Integrator {
    Integrator::new(dimension, OdeSettings { method, ..OdeSettings::with_tolerance(tolerance) }).unwrap()
}

#[track_caller]
fn close(actual: f64, expected: f64, tolerance: f64) {
    assert!((actual - expected).abs() <= tolerance, "{actual} is not {expected} within {tolerance}");
}

/// Largest difference of two vectors.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
