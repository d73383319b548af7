//! Matrices as triplets, and dense elimination to compare with.

#![allow(dead_code, reason = "each test program uses a part")]

use apsides_kkt::{KktSettings, KktSystem, SolveQuality};

/// Reproducible numbers in [-1, 1) (splitmix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    pub(crate) fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (((self.next() + 1.0) * 0.5 * n as f64) as usize).min(n - 1)
    }
}

/// One triangle of a symmetric matrix as triplets.
#[derive(Clone, Default)]
pub(crate) struct Triplets {
    pub(crate) n: usize,
    pub(crate) primal: usize,
    pub(crate) rows: Vec<usize>,
    pub(crate) cols: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl Triplets {
    pub(crate) fn new(n: usize, primal: usize) -> Self {
        Self { n, primal, ..Self::default() }
    }
    pub(crate) fn push(&mut self, i: usize, j: usize, v: f64) {
        self.rows.push(i);
        self.cols.push(j);
        self.values.push(v);
    }
    pub(crate) fn dense(&self) -> Vec<Vec<f64>> {
        let mut a = vec![vec![0.0; self.n]; self.n];
        for ((&i, &j), &v) in self.rows.iter().zip(&self.cols).zip(&self.values) {
            a[i][j] += v;
            if i != j {
                a[j][i] += v;
            }
        }
        a
    }
    pub(crate) fn analyse(&self, settings: KktSettings) -> KktSystem {
        KktSystem::analyse(self.n, self.primal, &self.rows, &self.cols, settings).expect("well-posed")
    }
    /// `|b - A x| / |b|` row by row in the original, unscaled system, in the maximum norm.
    pub(crate) fn plain_residual(&self, x: &[f64], b: &[f64]) -> f64 {
        let product = multiply(&self.dense(), x);
        let r = product.iter().zip(b).map(|(p, b)| (p - b).abs()).fold(0.0, f64::max);
        r / b.iter().fold(0.0f64, |m, v| m.max(v.abs()))
    }
}

pub(crate) fn multiply(a: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    a.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

/// Gaussian elimination with partial pivoting.
pub(crate) fn dense_solve(mut a: Vec<Vec<f64>>, b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut x = b.to_vec();
    for k in 0..n {
        let p = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).expect("k < n");
        a.swap(k, p);
        x.swap(k, p);
        for i in k + 1..n {
            let f = a[i][k] / a[k][k];
            for j in k..n {
                let u = a[k][j];
                a[i][j] -= f * u;
            }
            x[i] -= f * x[k];
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| a[k][j] * x[j]).sum();
        x[k] = (x[k] - sum) / a[k][k];
    }
    x
}

pub(crate) fn assert_close(x: &[f64], y: &[f64], tolerance: f64) {
    let scale = y.iter().fold(1.0f64, |m, v| m.max(v.abs()));
    for (i, (x, y)) in x.iter().zip(y).enumerate() {
        assert!((x - y).abs() <= tolerance * scale, "entry {i}: {x} against {y}");
    }
}

/// Solves alone, and beside another right-hand side: the bits are the same.
pub(crate) fn solve(system: &mut KktSystem, b: &[f64]) -> (Vec<f64>, SolveQuality) {
    let mut x = vec![f64::NAN; b.len()];
    let other: Vec<f64> = b.iter().rev().map(|b| b.cos()).collect();
    let (mut beside, mut x_other) = (x.clone(), x.clone());
    let both = system.solve_columns([&other, b], [&mut x_other, &mut beside]).expect("factored");
    let quality = system.solve(b, &mut x).expect("factored");
    assert_eq!((&x, quality), (&beside, both[1]));
    let quality_of_other = system.solve(&other, &mut beside).expect("factored");
    assert_eq!((&x_other, both[0]), (&beside, quality_of_other));
    (x, quality)
}
