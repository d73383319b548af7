//! Dormand and Prince 5(4).

use super::tableau::Tableau;
use super::{ErrorWeights, Scheme, Stages, combine, hermite_rows, weighted, with_dimension};
use crate::system::OdeSystem;

/// The pair DOPRI5 with its dense output of order 4.
///
/// Coefficients: J. R. Dormand, P. J. Prince, *J. Comput. Appl. Math.* 6 (1980) 19,
/// doi:10.1016/0771-050X(80)90013-3; dense output: Hairer et al., section II.6.
pub(crate) struct Dopri5;

const C: [f64; 5] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0];
const A2: [f64; 1] = [1.0 / 5.0];
const A3: [f64; 2] = [3.0 / 40.0, 9.0 / 40.0];
const A4: [f64; 3] = [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0];
const A5: [f64; 4] = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
const A6: [f64; 5] = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];
/// Weights of the fifth-order solution: k1, k3, k4, k5, k6.
const B: [f64; 5] = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
/// Difference to the fourth-order solution: k1, k3, k4, k5, k6, k7.
const E: [f64; 6] =
    [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
/// Row 4 of the dense output: k1, k3, k4, k5, k6, k7.
const D: [f64; 6] = [
    -12715105075.0 / 11282082432.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

impl Dopri5 {
    /// The six stages of the solution of order five.
    pub(crate) fn tableau() -> Tableau {
        let a: [(&[usize], &[f64]); 5] =
            [(&[0], &A2), (&[0, 1], &A3), (&[0, 1, 2], &A4), (&[0, 1, 2, 3], &A5), (&[0, 1, 2, 3, 4], &A6)];
        let [c1, c2, c3, c4, c5] = C;
        Tableau::new(Self::ORDER, &[c1, c2, c3, c4, c5, 1.0], &a, (&[0, 2, 3, 4, 5], &B))
    }
}

impl Scheme for Dopri5 {
    const ORDER: i32 = 5;
    const ROWS: usize = 5;
    const LAST: usize = 6;
    const BEFORE_LAST: usize = 5;
    const STABILITY_LIMIT: f64 = 3.25;
    const EXPONENT: f64 = 0.2 - 0.75 * Self::BETA;
    const BETA: f64 = 0.04;
    const STEP_RATIO: (f64, f64) = (0.2, 10.0);
    const EVALUATIONS: (usize, usize, usize) = (6, 0, 0);

    #[inline]
    fn attempt<S: OdeSystem>(system: &S, t: f64, h: f64, stages: &mut Stages, weights: &ErrorWeights) -> f64 {
        with_dimension!(stages.x.len(), attempt::<S>(system, t, h, stages, weights))
    }

    /// The last stage of the attempt is the first of the next step.
    #[inline]
    fn complete<S: OdeSystem>(_system: &S, _t: f64, _h: f64, _stages: &mut Stages) {}

    fn dense<S: OdeSystem>(_system: &S, _t: f64, h: f64, stages: &mut Stages) {
        let Stages { x, next, k, rows, .. } = stages;
        let [k1, _, k3, k4, k5, k6, k7, ..] = &*k;
        let n = x.len();
        hermite_rows(h, n, x, next, k1, k7, rows);
        let k: [&[f64]; 6] = [k1, k3, k4, k5, k6, k7];
        for i in 0..n {
            rows[4 * n + i] = h * weighted(&D, &k, i);
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
    let [k1, k2, k3, k4, k5, k6, k7, ..] = stages.k.each_mut().map(|k| &mut k[..n]);
    combine(n, y, x, h, &A2, [k1]);
    system.rate(t + C[1] * h, y, k2);
    combine(n, y, x, h, &A3, [k1, k2]);
    system.rate(t + C[2] * h, y, k3);
    combine(n, y, x, h, &A4, [k1, k2, k3]);
    system.rate(t + C[3] * h, y, k4);
    combine(n, y, x, h, &A5, [k1, k2, k3, k4]);
    system.rate(t + C[4] * h, y, k5);
    combine(n, y, x, h, &A6, [k1, k2, k3, k4, k5]);
    system.rate(t + h, y, k6);
    combine(n, next, x, h, &B, [k1, k3, k4, k5, k6]);
    system.rate(t + h, next, k7);

    let k: [&[f64]; 6] = [k1, k3, k4, k5, k6, k7];
    let controlled = weights.absolute.len().min(n);
    let mut sum = 0.0;
    for i in 0..controlled {
        let error = h * weighted(&E, &k, i) / weights.scale(i, x[i], next[i]);
        sum += error * error;
    }
    (sum / controlled as f64).sqrt()
}
