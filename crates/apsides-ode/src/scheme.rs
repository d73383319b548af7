//! The interface of a Runge-Kutta pair to the integrator: one step, its error and its dense output.

pub(crate) mod dop853;
mod dop853_tableau;
pub(crate) mod dopri5;
pub(crate) mod tableau;

use crate::system::OdeSystem;

/// Largest number of stages of a pair, those of the dense output included.
const MAX_STAGES: usize = 16;
/// Largest number of rows of a dense output.
const MAX_ROWS: usize = 8;

/// Rows of the dense output that make the cubic through both ends and their rates.
pub(crate) const CUBIC_ROWS: usize = 4;

/// Storage of one step; all vectors have the dimension of the system.
#[derive(Debug, Clone)]
pub(crate) struct Stages {
    /// State at the start of the step.
    pub(crate) x: Vec<f64>,
    /// State at its end.
    pub(crate) next: Vec<f64>,
    /// Argument of a stage; after an attempt that of the last stage before the end (for the stiffness test).
    pub(crate) point: Vec<f64>,
    /// Rates of the stages, `k[0]` at the start of the step.
    pub(crate) k: [Vec<f64>; MAX_STAGES],
    /// Rows of the dense output, see [`Step`](crate::Step).
    pub(crate) rows: Vec<f64>,
}

impl Stages {
    pub(crate) fn new(dimension: usize) -> Self {
        let zeros = || vec![0.0; dimension];
        Self {
            x: zeros(),
            next: zeros(),
            point: zeros(),
            k: std::array::from_fn(|_| zeros()),
            rows: vec![0.0; MAX_ROWS * dimension],
        }
    }
}

/// Weights of the error norm; the absolute tolerances are those of the controlled components.
#[derive(Debug, Clone)]
pub(crate) struct ErrorWeights {
    pub(crate) relative: f64,
    pub(crate) absolute: Vec<f64>,
}

impl ErrorWeights {
    /// Tolerated error of component `i`, at most `|x|` in magnitude over the step.
    #[inline(always)]
    pub(crate) fn scale(&self, i: usize, a: f64, b: f64) -> f64 {
        self.absolute[i] + self.relative * a.abs().max(b.abs())
    }
}

/// A Runge-Kutta pair with dense output.
pub(crate) trait Scheme {
    /// Order of the solution.
    const ORDER: i32;
    /// Rows of the dense output.
    const ROWS: usize;
    /// Index of the stage at the end of the step, the first stage of the next.
    const LAST: usize;
    /// Index of the stage before it, at the same time, for the stiffness test.
    const BEFORE_LAST: usize;
    /// Extent of the stability region along the negative real axis, as the stiffness test sees it.
    const STABILITY_LIMIT: f64;
    /// Exponent of the error in the step control.
    const EXPONENT: f64;
    /// Exponent of the error of the step before (PI control).
    const BETA: f64;
    /// Bounds of the ratio of successive steps.
    const STEP_RATIO: (f64, f64);
    /// Evaluations of an attempt, to complete an accepted step, and of the dense output.
    const EVALUATIONS: (usize, usize, usize);

    /// Steps from `x` and `k[0]` to `next`; returns the weighted error norm, NaN if the rate was not finite.
    fn attempt<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages, weights: &ErrorWeights) -> f64;

    /// Makes `k[LAST]` the rate at the end of the step, if the attempt has not.
    fn complete<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages);

    /// Fills the first [`CUBIC_ROWS`] of the dense output, which need no evaluation.
    fn cubic(h: f64, stages: &mut Stages) {
        let Stages { x, next, k, rows, .. } = stages;
        hermite_rows(h, x.len(), x, next, &k[0], &k[Self::LAST], rows);
    }

    /// Fills the rows of the dense output.
    fn dense<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages);
}

/// `out = x + h sum_j a_j k_j`, the first `n` components.
#[inline(always)]
fn combine<const M: usize>(n: usize, out: &mut [f64], x: &[f64], h: f64, a: &[f64; M], k: [&[f64]; M]) {
    let (out, x) = (&mut out[..n], &x[..n]);
    let k = k.map(|k| &k[..n]);
    for i in 0..n {
        out[i] = x[i] + h * weighted(a, &k, i);
    }
}

/// `sum_j a_j k_j[i]`.
#[inline(always)]
fn weighted<const M: usize>(a: &[f64; M], k: &[&[f64]; M], i: usize) -> f64 {
    let mut sum = a[0] * k[0][i];
    for j in 1..M {
        sum += a[j] * k[j][i];
    }
    sum
}

/// Rows 0 to 3 of the dense output: `x`, `d = next - x`, `b = h k_first - d`, `d - h k_last - b`.
fn hermite_rows(h: f64, n: usize, x: &[f64], next: &[f64], first: &[f64], last: &[f64], rows: &mut [f64]) {
    for i in 0..n {
        let difference = next[i] - x[i];
        let bend = h * first[i] - difference;
        rows[i] = x[i];
        rows[n + i] = difference;
        rows[2 * n + i] = bend;
        rows[3 * n + i] = difference - h * last[i] - bend;
    }
}

/// Calls a generic function with the dimension as a constant where it is small, so that loops unroll; else with 0.
macro_rules! with_dimension {
    ($n:expr, $function:ident::<$system:ty>($($argument:expr),*)) => {
        match $n {
            2 => $function::<$system, 2>($($argument),*),
            4 => $function::<$system, 4>($($argument),*),
            6 => $function::<$system, 6>($($argument),*),
            7 => $function::<$system, 7>($($argument),*),
            _ => $function::<$system, 0>($($argument),*),
        }
    };
}
use with_dimension;
