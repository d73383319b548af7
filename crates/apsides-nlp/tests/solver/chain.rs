//! A chain-structured problem of any length: optimal control of the Van der Pol oscillator,
//!
//! `min int_0^10 x^2 + y^2 + u^2 dt`, `x' = (1 - y^2) x - y + u`, `y' = x`, `x(0) = 0`, `y(0) = 1`, `|u| <= 1`,
//! `x >= -0.25`, by the implicit midpoint rule.

use apsides_nlp::{Nlp, Pattern, Stages};

const HORIZON: f64 = 10.0;

#[allow(unreachable_pub)] // Shared with the benches.
pub struct VanDerPol {
    pub intervals: usize,
    pub with_stages: bool,
}

impl VanDerPol {
    fn step(&self) -> f64 {
        HORIZON / self.intervals as f64
    }

    /// Midpoint of interval `k`: `x`, `y`, and the control, which is constant.
    fn middle(x: &[f64], k: usize) -> (f64, f64, f64) {
        let z = &x[3 * k..3 * k + 6];
        (0.5 * (z[0] + z[3]), 0.5 * (z[1] + z[4]), z[2])
    }
}

impl Nlp for VanDerPol {
    fn variables(&self) -> usize {
        3 * (self.intervals + 1)
    }
    fn constraints(&self) -> usize {
        2 * self.intervals
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        for (low, high) in lower.chunks_mut(3).zip(upper.chunks_mut(3)) {
            low.copy_from_slice(&[-0.25, f64::NEG_INFINITY, -1.0]);
            high.copy_from_slice(&[f64::INFINITY, f64::INFINITY, 1.0]);
        }
        lower[..2].copy_from_slice(&[0.0, 1.0]);
        upper[..2].copy_from_slice(&[0.0, 1.0]);
        let last = lower.len() - 1;
        (lower[last], upper[last]) = (0.0, 0.0);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(0.0);
        upper.fill(0.0);
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.fill(0.0);
    }
    fn jacobian_pattern(&self) -> Pattern {
        let entries = |k: usize| {
            (0..2).flat_map(move |i| [0, 1, 3, 4, 2].into_iter().map(move |j| (2 * k + i, 3 * k + j)))
        };
        Pattern::from_pairs((0..self.intervals).flat_map(entries))
    }
    fn hessian_pattern(&self) -> Pattern {
        const BLOCK: [(usize, usize); 11] =
            [(0, 0), (1, 0), (1, 1), (2, 2), (3, 0), (3, 1), (3, 3), (4, 0), (4, 1), (4, 3), (4, 4)];
        let entries = |k: usize| BLOCK.into_iter().map(move |(i, j)| (3 * k + i, 3 * k + j));
        Pattern::from_pairs((0..self.intervals).flat_map(entries))
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        let cost = |k| {
            let (a, b, u) = Self::middle(x, k);
            a * a + b * b + u * u
        };
        self.step() * (0..self.intervals).map(cost).sum::<f64>()
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        let h = self.step();
        for k in 0..self.intervals {
            let (a, b, u) = Self::middle(x, k);
            let g = &mut gradient[3 * k..3 * k + 6];
            g[0] += h * a;
            g[3] += h * a;
            g[1] += h * b;
            g[4] += h * b;
            g[2] += 2.0 * h * u;
        }
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        let h = self.step();
        for (k, defect) in values.chunks_mut(2).enumerate() {
            let (a, b, u) = Self::middle(x, k);
            defect[0] = x[3 * k + 3] - x[3 * k] - h * ((1.0 - b * b) * a - b + u);
            defect[1] = x[3 * k + 4] - x[3 * k + 1] - h * a;
        }
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let h = self.step();
        for (k, block) in values.chunks_mut(10).enumerate() {
            let (a, b, _) = Self::middle(x, k);
            let da = -0.5 * h * (1.0 - b * b);
            let db = -0.5 * h * (-2.0 * a * b - 1.0);
            block.copy_from_slice(&[da - 1.0, db, da + 1.0, db, -h, -0.5 * h, -1.0, -0.5 * h, 1.0, 0.0]);
        }
    }
    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let h = self.step();
        for (k, block) in values.chunks_mut(11).enumerate() {
            let (a, b, _) = Self::middle(x, k);
            let y = -h * multipliers[2 * k];
            let aa = 0.5 * h * factor;
            let ab = 0.25 * y * -2.0 * b;
            let bb = 0.5 * h * factor + 0.25 * y * -2.0 * a;
            block.copy_from_slice(&[aa, ab, bb, 2.0 * h * factor, aa, ab, aa, ab, bb, ab, bb]);
        }
    }
    fn stages(&self) -> Option<Stages> {
        self.with_stages.then(|| Stages {
            variables: (0..=self.intervals as u32).flat_map(|k| [k; 3]).collect(),
            constraints: (0..self.intervals as u32).flat_map(|k| [k; 2]).collect(),
        })
    }
}
