//! The normal distribution that points are drawn from, and its update (Hansen 2016, arXiv 1604.00772, equations 38 to 47).

use super::eigen::decompose;
use super::scratch::Scratch;
use super::vectors::{add, dot};
use super::weights::Weights;
use crate::Generator;
use serde::{Deserialize, Serialize};

/// `m + sigma N(0, C)` with its evolution paths; all vectors have the dimension `n`, matrices are row after row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Distribution {
    pub(super) weights: Weights,
    pub(super) mean: Vec<f64>,
    pub(super) sigma: f64,
    /// `C`, of which the lower triangle is kept up to date.
    pub(super) covariance: Vec<f64>,
    /// Eigenvectors of `C` in rows, and square roots of its eigenvalues, as of the last decomposition.
    axes: Vec<f64>,
    pub(super) lengths: Vec<f64>,
    pub(super) path_c: Vec<f64>,
    path_sigma: Vec<f64>,
    /// Generations, and that of the last decomposition.
    pub(super) generations: usize,
    decomposed: usize,
    /// Says whether `C` can be decomposed.
    pub(super) sound: bool,
    #[serde(skip)]
    work: Scratch<Work>,
}

/// Vectors of the update and of the decomposition.
#[derive(Clone, Debug, Default)]
struct Work {
    vectors: Vec<f64>,
    values: Vec<f64>,
    below: Vec<f64>,
    step: Vec<f64>,
    whitened: Vec<f64>,
}

impl Distribution {
    pub(super) fn new(mean: Vec<f64>, sigma: f64, weights: Weights) -> Self {
        let n = mean.len();
        let mut unit = vec![0.0; n * n];
        (0..n).for_each(|i| unit[i * n + i] = 1.0);
        Self {
            weights,
            mean,
            sigma,
            covariance: unit.clone(),
            axes: unit,
            lengths: vec![1.0; n],
            path_c: vec![0.0; n],
            path_sigma: vec![0.0; n],
            generations: 0,
            decomposed: 0,
            sound: true,
            work: Scratch::default(),
        }
    }

    fn dimension(&self) -> usize {
        self.mean.len()
    }

    /// Standard deviation of a coordinate, without `sigma`.
    pub(super) fn deviation(&self, i: usize) -> f64 {
        self.covariance[i * self.dimension() + i].max(0.0).sqrt()
    }

    /// Standard normal `z`, and `y = B D z`.
    pub(super) fn draw(&self, generator: &mut Generator, z: &mut [f64], y: &mut [f64]) {
        z.iter_mut().for_each(|z| *z = generator.normal());
        y.fill(0.0);
        for ((axis, length), z) in self.axes.chunks_exact(self.dimension()).zip(&self.lengths).zip(z) {
            add(y, length * *z, axis);
        }
    }

    /// `z = D^-1 B' y`, the inverse of what `draw` does.
    pub(super) fn whiten(&self, y: &[f64], z: &mut [f64]) {
        for ((axis, length), z) in self.axes.chunks_exact(self.dimension()).zip(&self.lengths).zip(z) {
            *z = dot(axis, y) / length;
        }
    }

    /// Takes a generation in. Row `k` of `y` and `z` is a step from the mean and the same whitened; `ranked` has rows, best first.
    pub(super) fn update(&mut self, y: &[f64], z: &[f64], ranked: &[usize]) {
        let n = self.dimension();
        let row = |k: usize| k * n..(k + 1) * n;
        let Self { weights: w, mean, path_c, path_sigma, covariance, axes, work, .. } = self;
        let work = &mut work.0;
        self.generations += 1;
        work.step.clear();
        work.step.resize(n, 0.0);
        work.whitened.clear();
        work.whitened.resize(n, 0.0);
        for (&k, &weight) in ranked.iter().zip(&w.ranked[..w.parents]) {
            add(&mut work.step, weight, &y[row(k)]);
            add(&mut work.whitened, weight, &z[row(k)]);
        }
        add(mean, self.sigma, &work.step);
        // C^(-1/2) of the step is B times its whitened form.
        path_sigma.iter_mut().for_each(|p| *p *= 1.0 - w.c_sigma);
        let gain = (w.c_sigma * (2.0 - w.c_sigma) * w.effective).sqrt();
        for (axis, z) in axes.chunks_exact(n).zip(&work.whitened) {
            add(path_sigma, gain * z, axis);
        }
        let length = dot(path_sigma, path_sigma).sqrt();
        let age = i32::try_from(2 * self.generations).unwrap_or(i32::MAX);
        let settled = (1.0 - (1.0 - w.c_sigma).powi(age)).sqrt();
        let steady = length / settled < (1.4 + 2.0 / (n as f64 + 1.0)) * w.length;
        path_c.iter_mut().for_each(|p| *p *= 1.0 - w.c_c);
        let variance_gain = w.c_c * (2.0 - w.c_c);
        if steady {
            add(path_c, (variance_gain * w.effective).sqrt(), &work.step);
        }
        let missing = if steady { 0.0 } else { w.c_1 * variance_gain };
        let kept = 1.0 + missing - w.c_1 - w.c_mu * w.sum;
        covariance.iter_mut().for_each(|c| *c *= kept);
        add_outer(covariance, w.c_1, path_c);
        let factor = |(&k, &weight): (&usize, &f64)| {
            let length = if weight < 0.0 { dot(&z[row(k)], &z[row(k)]) / n as f64 } else { 1.0 };
            (w.c_mu * weight / length.max(f64::MIN_POSITIVE), &y[row(k)])
        };
        let terms = ranked.iter().zip(&w.ranked).filter(|(_, w)| **w != 0.0).map(factor);
        add_outers(covariance, terms);
        // At most by e in one generation, as in pycma.
        self.sigma *= (w.c_sigma / w.d_sigma * (length / w.length - 1.0)).min(1.0).exp();
        if self.generations - self.decomposed >= w.lazy_gap(n) {
            self.decompose();
        }
    }

    /// Brings axes and lengths up to date.
    fn decompose(&mut self) {
        let n = self.dimension();
        self.decomposed = self.generations;
        let work = &mut self.work.0;
        work.vectors.clone_from(&self.covariance);
        work.values.resize(n, 0.0);
        work.below.resize(n, 0.0);
        self.sound = decompose(&mut work.vectors, &mut work.values, &mut work.below)
            && work.values.iter().all(|v| *v > 0.0)
            && self.sigma.is_finite()
            && self.sigma > 0.0;
        if self.sound {
            std::mem::swap(&mut self.axes, &mut work.vectors);
            for (length, value) in self.lengths.iter_mut().zip(&work.values) {
                *length = value.sqrt();
            }
        }
    }

    /// Ratio of the largest to the least eigenvalue of `C`.
    pub(super) fn condition(&self) -> f64 {
        let least = self.lengths.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        let largest = self.lengths.iter().fold(0.0_f64, |a, &b| a.max(b));
        (largest / least).powi(2)
    }

    /// Tells whether a tenth of a standard deviation along one axis, another one in each generation, changes no coordinate of the mean,
    /// or a fifth of one along a coordinate does not change that.
    pub(super) fn has_no_effect(&self) -> bool {
        let n = self.dimension();
        let k = self.generations % n;
        let step = 0.1 * self.sigma * self.lengths[k];
        let axis = &self.axes[k * n..(k + 1) * n];
        self.mean.iter().zip(axis).all(|(m, a)| *m == m + step * a)
            || (0..n).any(|i| self.mean[i] == self.mean[i] + 0.2 * self.sigma * self.deviation(i))
    }
}

/// Adds `factor * y y'` to the lower triangle of a matrix.
fn add_outer(matrix: &mut [f64], factor: f64, y: &[f64]) {
    for (i, row) in matrix.chunks_exact_mut(y.len()).enumerate() {
        add(&mut row[..=i], factor * y[i], &y[..=i]);
    }
}

/// Adds many such terms, four at a time, so that the matrix is read and written less often.
fn add_outers<'a>(matrix: &mut [f64], mut terms: impl Iterator<Item = (f64, &'a [f64])>) {
    loop {
        let four = [terms.next(), terms.next(), terms.next(), terms.next()];
        let [Some((fa, a)), Some((fb, b)), Some((fc, c)), Some((fd, d))] = four else {
            four.into_iter().flatten().for_each(|(factor, y)| add_outer(matrix, factor, y));
            return;
        };
        for (i, row) in matrix.chunks_exact_mut(a.len()).enumerate() {
            let (ga, gb, gc, gd) = (fa * a[i], fb * b[i], fc * c[i], fd * d[i]);
            let (row, a, b, c, d) = (&mut row[..=i], &a[..=i], &b[..=i], &c[..=i], &d[..=i]);
            for j in 0..=i {
                row[j] += ga * a[j] + gb * b[j] + (gc * c[j] + gd * d[j]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn drawing_and_whitening_are_inverse() {
        let n = 6;
        let mut generator = Generator::new(1);
        let mut d = Distribution::new(vec![0.0; n], 1.0, Weights::new(n, 10, true));
        let (mut z, mut y, mut back) = (vec![0.0; 10 * n], vec![0.0; 10 * n], vec![0.0; n]);
        let ranked: Vec<usize> = (0..10).collect();
        for _ in 0..50 {
            for k in 0..10 {
                d.draw(&mut generator, &mut z[k * n..(k + 1) * n], &mut y[k * n..(k + 1) * n]);
            }
            d.update(&y, &z, &ranked);
        }
        assert!(d.sound && d.condition() > 1.1);
        d.draw(&mut generator, &mut z[..n], &mut y[..n]);
        d.whiten(&y[..n], &mut back);
        for (a, b) in z.iter().zip(&back) {
            assert!((a - b).abs() < ROUNDING);
        }
    }

    #[test]
    fn the_covariance_of_drawn_steps_is_the_matrix() {
        let n = 3;
        let mut d = Distribution::new(vec![0.0; n], 1.0, Weights::new(n, 8, true));
        // Lower triangle alone.
        d.covariance = vec![4.0, 0.0, 0.0, 1.0, 2.0, 0.0, -0.5, 0.3, 1.0];
        d.decompose();
        let mut generator = Generator::new(5);
        let (mut z, mut y) = (vec![0.0; n], vec![0.0; n]);
        let count = 200_000;
        let mut sums = vec![0.0; n * n];
        for _ in 0..count {
            d.draw(&mut generator, &mut z, &mut y);
            add_outer(&mut sums, 1.0 / f64::from(count), &y);
        }
        for (sum, exact) in sums.iter().zip(&d.covariance) {
            // Four standard deviations of the largest entry's estimate.
            assert!((sum - exact).abs() < 4.0 * 4.0 * (2.0 / f64::from(count)).sqrt(), "{sum} {exact}");
        }
    }
}
