//! One interval of a phase: end state and integrals with their derivatives by the variational equations.
//!
//! On the normalised time `s` of interval `k` of `N`, with `f = (k + s)/N`, `t = (1 - f) t0 + f tf` and the control
//! `u = (1 - s) u_k + s u_{k+1}`,
//!
//! ```text
//! d(x, q)/ds = (tf - t0)/N (rate, integrands)(x, u, p, t),   parameters (u_k, u_{k+1}, p, t0, tf)
//! ```
//!
//! so that free times dilate the interval.

use std::cell::RefCell;
use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ocp::Phase;
use apsides_ode::{Linearised, OdeSystem};

/// Equations of motion and integrands of a phase on one interval.
pub(crate) struct IntervalFlow {
    functions: Vec<Arc<dyn NodeFunction>>,
    states: usize,
    controls: usize,
    parameters: usize,
    /// Fraction of the phase at the start of the interval, and its width.
    pub(crate) start: f64,
    pub(crate) width: f64,
    /// `u_k, u_{k+1}, p, t0, tf`.
    pub(crate) inputs: Vec<f64>,
    work: RefCell<Work>,
}

#[derive(Default)]
struct Work {
    z: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
}

impl IntervalFlow {
    pub(crate) fn new(phase: &Phase, parameters: usize) -> Self {
        let functions: Vec<_> = std::iter::once(&phase.dynamics)
            .chain(phase.integrals.iter().map(|q| &q.function))
            .cloned()
            .collect();
        let (states, controls) = (phase.states.len(), phase.controls.len());
        let largest =
            |f: &dyn Fn(&Arc<dyn NodeFunction>) -> usize| functions.iter().map(f).max().unwrap_or(0);
        let work = Work {
            z: vec![0.0; states + controls + parameters + 1],
            values: vec![0.0; largest(&|f| f.outputs())],
            entries: vec![0.0; largest(&|f| f.pattern().jacobian_len())],
        };
        Self {
            states,
            controls,
            parameters,
            start: 0.0,
            width: 1.0,
            inputs: vec![0.0; 2 * controls + parameters + 2],
            work: RefCell::new(work),
            functions,
        }
    }

    /// States and integrals.
    pub(crate) fn outputs(&self) -> usize {
        self.states + self.functions.len() - 1
    }

    fn times(&self) -> (f64, f64) {
        let n = self.inputs.len();
        (self.inputs[n - 2], self.inputs[n - 1])
    }

    /// `d/ds` per rate.
    fn factor(&self) -> f64 {
        let (t0, tf) = self.times();
        self.width * (tf - t0)
    }

    /// Fills `[x, u, p, t]` of a function; returns how many.
    fn fill(&self, function: &dyn NodeFunction, s: f64, x: &[f64], z: &mut [f64]) -> usize {
        let (nx, nu) = (self.states, self.controls);
        z[..nx].copy_from_slice(&x[..nx]);
        for c in 0..nu {
            z[nx + c] = (1.0 - s) * self.inputs[c] + s * self.inputs[nu + c];
        }
        let count = function.inputs();
        z[nx + nu..count - 1].copy_from_slice(&self.inputs[2 * nu..][..count - 1 - nx - nu]);
        let f = self.start + s * self.width;
        let (t0, tf) = self.times();
        z[count - 1] = (1.0 - f) * t0 + f * tf;
        count
    }

    /// Calls `each(function, first output, inputs)` with values and Jacobian entries in `work`.
    fn differentiate(
        &self,
        s: f64,
        x: &[f64],
        mut each: impl FnMut(&dyn NodeFunction, usize, &[f64], &[f64]),
    ) {
        let work = &mut *self.work.borrow_mut();
        let mut first = 0;
        for function in &self.functions {
            let count = self.fill(function.as_ref(), s, x, &mut work.z);
            let (values, entries) = (
                &mut work.values[..function.outputs()],
                &mut work.entries[..function.pattern().jacobian_len()],
            );
            function.jacobian(&work.z[..count], values, entries);
            each(function.as_ref(), first, values, entries);
            first += function.outputs();
        }
    }
}

impl OdeSystem for IntervalFlow {
    fn dimension(&self) -> usize {
        self.outputs()
    }

    fn rate(&self, s: f64, x: &[f64], dx: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        let (factor, mut first) = (self.factor(), 0);
        for function in &self.functions {
            let count = self.fill(function.as_ref(), s, x, &mut work.z);
            let out = &mut dx[first..first + function.outputs()];
            function.value(&work.z[..count], out);
            out.iter_mut().for_each(|v| *v *= factor);
            first += function.outputs();
        }
    }
}

impl Linearised for IntervalFlow {
    fn jacobian(&self, s: f64, x: &[f64], jac: &mut [f64]) {
        let (n, factor) = (self.outputs(), self.factor());
        jac.fill(0.0);
        self.differentiate(s, x, |function, first, _, entries| {
            for ((r, c), v) in function.pattern().jacobian_entries().zip(entries) {
                if c < self.states {
                    jac[(first + r) * n + c] = factor * v;
                }
            }
        });
    }

    fn parameters(&self) -> usize {
        self.inputs.len()
    }

    fn parameter_jacobian(&self, s: f64, x: &[f64], jac: &mut [f64]) {
        let (nx, nu, columns) = (self.states, self.controls, self.inputs.len());
        let (factor, f) = (self.factor(), self.start + s * self.width);
        jac.fill(0.0);
        self.differentiate(s, x, |function, first, values, entries| {
            let time = function.inputs() - 1;
            for (r, value) in values.iter().enumerate() {
                let row = &mut jac[(first + r) * columns..][..columns];
                row[columns - 2] -= self.width * value;
                row[columns - 1] += self.width * value;
            }
            for ((r, c), v) in function.pattern().jacobian_entries().zip(entries) {
                let row = &mut jac[(first + r) * columns..][..columns];
                if c == time {
                    row[columns - 2] += factor * v * (1.0 - f);
                    row[columns - 1] += factor * v * f;
                } else if c >= nx + nu {
                    row[2 * nu + c - nx - nu] += factor * v;
                } else if c >= nx {
                    row[c - nx] += factor * v * (1.0 - s);
                    row[nu + c - nx] += factor * v * s;
                }
            }
        });
    }
}

impl IntervalFlow {
    /// Number of static parameters.
    pub(crate) fn static_parameters(&self) -> usize {
        self.parameters
    }
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
