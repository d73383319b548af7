//! Dormand and Prince 8(5,3).

use super::dop853_tableau::*;
use super::tableau::Tableau;
use super::{ErrorWeights, Scheme, Stages, combine, hermite_rows, weighted, with_dimension};
use crate::system::OdeSystem;

/// The pair DOP853 with its dense output of order 7.
pub(crate) struct Dop853;

impl Dop853 {
    /// The twelve stages of the solution of order eight.
    pub(crate) fn tableau() -> Tableau {
        let a: [(&[usize], &[f64]); 11] = [
            (&[0], &A2),
            (&[0, 1], &A3),
            (&[0, 2], &A4),
            (&[0, 2, 3], &A5),
            (&[0, 3, 4], &A6),
            (&[0, 3, 4, 5], &A7),
            (&[0, 3, 4, 5, 6], &A8),
            (&[0, 3, 4, 5, 6, 7], &A9),
            (&[0, 3, 4, 5, 6, 7, 8], &A10),
            (&[0, 3, 4, 5, 6, 7, 8, 9], &A11),
            (&[0, 3, 4, 5, 6, 7, 8, 9, 10], &A12),
        ];
        Tableau::new(Self::ORDER, &C[..12], &a, (&[0, 5, 6, 7, 8, 9, 10, 11], &B))
    }
}

impl Scheme for Dop853 {
    const ORDER: i32 = 8;
    const ROWS: usize = 8;
    const LAST: usize = 12;
    const BEFORE_LAST: usize = 11;
    const STABILITY_LIMIT: f64 = 6.1;
    const EXPONENT: f64 = 1.0 / 8.0 - 0.2 * Self::BETA;
    /// Zero, as published. Positive values save rejections on rough problems, but cost steps on orbits (7 % for 0.04).
    const BETA: f64 = 0.0;
    const STEP_RATIO: (f64, f64) = (0.333, 6.0);
    const EVALUATIONS: (usize, usize, usize) = (11, 1, 3);

    #[inline]
    fn attempt<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages, weights: &ErrorWeights) -> f64 {
        with_dimension!(stages.x.len(), attempt::<S>(system, t, h, stages, weights))
    }

    #[inline]
    fn complete<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages) {
        system.rate(t + h, &stages.next, &mut stages.k[Self::LAST]);
    }

    fn dense<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages) {
        let Stages { x, next, point: y, k, rows } = stages;
        let [k1, _, _, _, _, k6, k7, k8, k9, k10, k11, k12, k13, k14, k15, k16] = k;
        let n = x.len();
        combine(n, y, x, h, &A14, [k1, k7, k8, k9, k10, k11, k12, k13]);
        system.rate(t + C[13] * h, y, k14);
        combine(n, y, x, h, &A15, [k1, k6, k7, k8, k11, k12, k13, k14]);
        system.rate(t + C[14] * h, y, k15);
        combine(n, y, x, h, &A16, [k1, k6, k7, k8, k9, k13, k14, k15]);
        system.rate(t + C[15] * h, y, k16);
        hermite_rows(h, n, x, next, k1, k13, rows);
        let k: [&[f64]; 12] = [k1, k6, k7, k8, k9, k10, k11, k12, k13, k14, k15, k16];
        for (d, row) in [&D4, &D5, &D6, &D7].into_iter().zip(rows[4 * n..8 * n].chunks_exact_mut(n)) {
            for i in 0..n {
                row[i] = h * weighted(d, &k, i);
            }
        }
    }
}

fn attempt<S: OdeSystem, const N: usize>(
    system: &S,
    t: f64,
    h: f64,
    stages: &mut Stages,
    weights: &ErrorWeights,
) -> f64 {
    let n = if N == 0 { stages.x.len() } else { N };
    let (x, next, y) = (&stages.x[..n], &mut stages.next[..n], &mut stages.point[..n]);
    let [k1, k2, k3, k4, k5, k6, k7, k8, k9, k10, k11, k12, ..] = stages.k.each_mut().map(|k| &mut k[..n]);
    combine(n, y, x, h, &A2, [k1]);
    system.rate(t + C[1] * h, y, k2);
    combine(n, y, x, h, &A3, [k1, k2]);
    system.rate(t + C[2] * h, y, k3);
    combine(n, y, x, h, &A4, [k1, k3]);
    system.rate(t + C[3] * h, y, k4);
    combine(n, y, x, h, &A5, [k1, k3, k4]);
    system.rate(t + C[4] * h, y, k5);
    combine(n, y, x, h, &A6, [k1, k4, k5]);
    system.rate(t + C[5] * h, y, k6);
    combine(n, y, x, h, &A7, [k1, k4, k5, k6]);
    system.rate(t + C[6] * h, y, k7);
    combine(n, y, x, h, &A8, [k1, k4, k5, k6, k7]);
    system.rate(t + C[7] * h, y, k8);
    combine(n, y, x, h, &A9, [k1, k4, k5, k6, k7, k8]);
    system.rate(t + C[8] * h, y, k9);
    combine(n, y, x, h, &A10, [k1, k4, k5, k6, k7, k8, k9]);
    system.rate(t + C[9] * h, y, k10);
    combine(n, y, x, h, &A11, [k1, k4, k5, k6, k7, k8, k9, k10]);
    system.rate(t + C[10] * h, y, k11);
    combine(n, y, x, h, &A12, [k1, k4, k5, k6, k7, k8, k9, k10, k11]);
    system.rate(t + h, y, k12);
    combine(n, next, x, h, &B, [k1, k6, k7, k8, k9, k10, k11, k12]);

    // Hairer et al., eq. II.10.20: both estimates, the fifth-order one weighted by its ratio to the third-order one.
    let k: [&[f64]; 8] = [k1, k6, k7, k8, k9, k10, k11, k12];
    let controlled = weights.absolute.len().min(n);
    let (mut fifth, mut third) = (0.0, 0.0);
    for i in 0..controlled {
        let weight = 1.0 / weights.scale(i, x[i], next[i]);
        let error = weight * weighted(&E5, &k, i);
        fifth += error * error;
        let error = weight * (weighted(&B, &k, i) - weighted(&B3, &[k[0], k[4], k[7]], i));
        third += error * error;
    }
    let sum = fifth + 0.01 * third;
    if sum == 0.0 { 0.0 } else { h.abs() * fifth / (sum * controlled as f64).sqrt() }
}
