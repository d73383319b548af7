//! Problems 111 to 119; 115 does not exist.

use apsides_ad::Scalar;

use super::colville::{A, B, C, D, E};
use super::sum;
use crate::nlp::Program;
use crate::nlp::program::{INF, program};

/// Chemical potentials of 111 and 112, which are the same problem in logarithms of the variables of 112.
const POTENTIAL: [f64; 10] =
    [-6.089, -17.164, -34.054, -5.914, -24.721, -14.986, -24.1, -10.708, -26.662, -22.179];

/// Objective and constraints of 111 and 112 in amounts and their logarithms.
fn equilibrium<S: Scalar>(amount: [S; 10], log: [S; 10]) -> [S; 4] {
    let total = sum(amount.into_iter()).ln();
    let e = amount;
    [
        sum((0..10).map(|j| e[j] * (log[j] - total + POTENTIAL[j]))),
        e[0] + e[1] * 2.0 + e[2] * 2.0 + e[5] + e[9],
        e[3] + e[4] * 2.0 + e[5] + e[6],
        e[2] + e[6] + e[7] + e[8] * 2.0 + e[9],
    ]
}

/// Constraints of 119.
const MATRIX: [[f64; 8]; 8] = [
    [0.22, 0.20, 0.19, 0.25, 0.15, 0.11, 0.12, 0.13],
    [-1.46, 0.0, -1.30, 1.82, -1.15, 0.0, 0.80, 0.0],
    [1.29, -0.89, 0.0, 0.0, -1.16, -0.96, 0.0, -0.49],
    [-1.10, -1.06, 0.95, -0.54, 0.0, -1.78, -0.41, 0.0],
    [0.0, 0.0, 0.0, -1.43, 1.51, 0.59, -0.33, -0.43],
    [0.0, -1.72, -0.33, 0.0, 1.62, 1.24, 0.21, -0.26],
    [1.12, 0.0, 0.0, 0.31, 0.0, 0.0, 1.12, 0.0],
    [0.0, 0.45, 0.26, -1.10, 0.58, 0.0, -1.03, 0.10],
];
const SIDE: [f64; 8] = [2.5, 1.1, -3.1, -3.5, 1.3, 2.1, 2.3, -1.5];

/// Columns of the entries 1 of the upper triangle in the objective of 119, by rows; both count from 1.
const COUPLED: [&[usize]; 16] = [
    &[1, 4, 7, 8, 16],
    &[2, 3, 7, 10],
    &[3, 7, 9, 10, 14],
    &[4, 7, 11, 15],
    &[5, 6, 10, 12, 16],
    &[6, 8, 15],
    &[7, 11, 13],
    &[8, 10, 15],
    &[9, 12, 16],
    &[10, 14],
    &[11, 13],
    &[12, 14],
    &[13, 14],
    &[14],
    &[15],
    &[16],
];

pub(super) fn programs() -> Vec<Program> {
    vec![
        program!(
            111,
            10,
            4,
            [-2.3; 10],
            ([-100.0; 10], [100.0; 10]),
            ([2.0, 1.0, 1.0], [2.0, 1.0, 1.0]),
            // The book gives -47.76109026, a little above the optimum.
            -47.76109086,
            1e-9,
            |x| equilibrium(x.map(S::exp), *x)
        ),
        program!(
            112,
            10,
            4,
            [0.1; 10],
            ([1e-6; 10], [INF; 10]),
            ([2.0, 1.0, 1.0], [2.0, 1.0, 1.0]),
            // The AMPL model quotes -47.76109026 as for 111, a little above the optimum.
            -47.76109086,
            1e-9,
            |x| equilibrium(*x, x.map(S::ln))
        ),
        program!(
            113,
            10,
            9,
            [2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0],
            ([-INF; 10], [INF; 10]),
            ([-INF; 8], [105.0, 0.0, 12.0, 120.0, 40.0, 30.0, 0.0, 0.0]),
            24.3062091,
            1e-6,
            |x| {
                let sq = |i: usize, a: f64| (x[i] - a).powi(2);
                [
                    sq(0, 0.0) + sq(1, 0.0) + x[0] * x[1] - x[0] * 14.0 - x[1] * 16.0
                        + sq(2, 10.0)
                        + sq(3, 5.0) * 4.0
                        + sq(4, 3.0)
                        + sq(5, 1.0) * 2.0
                        + sq(6, 0.0) * 5.0
                        + sq(7, 11.0) * 7.0
                        + sq(8, 10.0) * 2.0
                        + sq(9, 7.0)
                        + 45.0,
                    x[0] * 4.0 + x[1] * 5.0 - x[6] * 3.0 + x[7] * 9.0,
                    x[0] * 10.0 - x[1] * 8.0 - x[6] * 17.0 + x[7] * 2.0,
                    x[0] * -8.0 + x[1] * 2.0 + x[8] * 5.0 - x[9] * 2.0,
                    sq(0, 2.0) * 3.0 + sq(1, 3.0) * 4.0 + sq(2, 0.0) * 2.0 - x[3] * 7.0,
                    sq(0, 0.0) * 5.0 + x[1] * 8.0 + sq(2, 6.0) - x[3] * 2.0,
                    sq(0, 8.0) * 0.5 + sq(1, 4.0) * 2.0 + sq(4, 0.0) * 3.0 - x[5],
                    sq(0, 0.0) + sq(1, 2.0) * 2.0 - x[0] * x[1] * 2.0 + x[4] * 14.0 - x[5] * 6.0,
                    x[0] * -3.0 + x[1] * 6.0 + sq(8, 8.0) * 12.0 - x[9] * 7.0,
                ]
            }
        ),
        program!(
            114,
            10,
            12,
            [1745.0, 12000.0, 110.0, 3048.0, 1974.0, 89.2, 92.8, 8.0, 3.6, 145.0],
            (
                [1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 85.0, 90.0, 3.0, 1.2, 145.0],
                [2000.0, 16000.0, 120.0, 5000.0, 2000.0, 93.0, 95.0, 12.0, 4.0, 162.0]
            ),
            ([0.0; 11], [INF, INF, INF, INF, INF, INF, INF, INF, 0.0, 0.0, 0.0]),
            -1768.80696,
            1e-8,
            |x| {
                const A: f64 = 0.99;
                const B: f64 = 0.9;
                let g1 = -(x[9] * 0.222) - x[8] * B + 35.82;
                let g2 = x[6] * 3.0 - x[9] * A - 133.0;
                let g5 = x[0] * 1.12 + x[0] * x[7] * 0.13167 - x[0] * x[7] * x[7] * 0.00667 - x[3] * A;
                let g6 = x[7] * 1.098 - x[7] * x[7] * 0.038 + x[5] * 0.325 - x[6] * A + 57.425;
                [
                    x[0] * 5.04 + x[1] * 0.035 + x[2] * 10.0 + x[4] * 3.36 - x[3] * x[6] * 0.063,
                    g1,
                    g2,
                    x[8] * (1.0 / B - B) - g1,
                    x[9] * (1.0 / A - A) - g2,
                    g5,
                    g6,
                    x[3] * (1.0 / A - A) - g5,
                    x[6] * (1.0 / A - A) - g6,
                    x[3] * 1.22 - x[0] - x[4],
                    x[2] * 98000.0 / (x[3] * x[8] + x[2] * 1000.0) - x[5],
                    (x[1] + x[4]) / x[0] - x[7],
                ]
            }
        ),
        program!(
            116,
            13,
            15,
            [0.5, 0.8, 0.9, 0.1, 0.14, 0.5, 489.0, 80.0, 650.0, 450.0, 150.0, 150.0, 150.0],
            (
                [0.1, 0.1, 0.1, 1e-4, 0.1, 0.1, 0.1, 0.1, 500.0, 0.1, 1.0, 1e-4, 1e-4],
                [1.0, 1.0, 1.0, 0.1, 0.9, 0.9, 1000.0, 1000.0, 1000.0, 500.0, 150.0, 150.0, 150.0]
            ),
            (
                [0.0, 0.0, -1.0, 50.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.9, 0.0, 0.0, 0.0],
                [INF, INF, INF, 250.0, INF, INF, INF, INF, INF, INF, INF, INF, INF, INF]
            ),
            // The book gives 97.588409; the feasible point found here is better.
            97.587509,
            1e-8,
            |x| {
                let total = x[10] + x[11] + x[12];
                let out = |y: S, x: S| y - x * 0.03475 - x * y * 0.975 + x * x * 0.00975;
                let cost = |y: S, x: S, flow: S| y - flow * 1.262626 + x * flow * 1.231059;
                [
                    total,
                    x[2] - x[1],
                    x[1] - x[0],
                    (x[7] - x[6]) * 0.002,
                    total,
                    cost(x[12], x[2], x[9]),
                    out(x[4], x[1]),
                    out(x[5], x[2]),
                    x[4] * x[6] - x[0] * x[7] - x[3] * x[6] + x[3] * x[7],
                    (x[1] * x[8] + x[4] * x[7] - x[0] * x[7] - x[5] * x[8]) * -0.002 - x[4] - x[5],
                    x[1] * x[8] - x[2] * x[9] - x[5] * x[8] - x[1] * 500.0 + x[5] * 500.0 + x[1] * x[9],
                    x[1] - (x[1] * x[9] - x[2] * x[9]) * 0.002,
                    out(x[3], x[0]),
                    cost(x[10], x[0], x[7]),
                    cost(x[11], x[1], x[8]),
                ]
            }
        ),
        program!(
            117,
            15,
            6,
            std::array::from_fn(|i| if i == 6 { 60.0 } else { 0.001 }),
            ([0.0; 15], [INF; 15]),
            (E.map(|e| -e), [INF; 5]),
            32.34867897,
            1e-8,
            |x| {
                let (y, z) = x.split_at(10);
                let linear = sum((0..10).map(|j| y[j] * B[j]));
                let quadratic = sum((0..25).map(|k| z[k / 5] * z[k % 5] * C[k / 5][k % 5]));
                let cubic = sum((0..5).map(|j| z[j].powi(3) * D[j]));
                let f = quadratic - linear + cubic * 2.0;
                let gradient = |j: usize| {
                    sum((0..5).map(|k| z[k] * C[k][j])) * 2.0 + z[j].powi(2) * (3.0 * D[j])
                        - sum((0..10).map(|k| y[k] * A[k][j]))
                };
                std::array::from_fn(|i| if i == 0 { f } else { gradient(i - 1) })
            }
        ),
        program!(
            118,
            15,
            18,
            [20.0, 55.0, 15.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0],
            (
                std::array::from_fn(|i| [8.0, 43.0, 3.0].get(i).copied().unwrap_or(0.0)),
                std::array::from_fn(|i| {
                    [21.0, 57.0, 16.0].get(i).copied().unwrap_or([90.0, 120.0, 60.0][i % 3])
                })
            ),
            (
                std::array::from_fn(|i| if i < 12 { -7.0 } else { [60.0, 50.0, 70.0, 85.0, 100.0][i - 12] }),
                std::array::from_fn(|i| if i < 12 { [6.0, 7.0, 6.0][i % 3] } else { INF })
            ),
            664.82045,
            1e-8,
            |x| {
                let f = sum((0..15).map(|i| {
                    let [a, b] = [[2.3, 1e-4], [1.7, 1e-4], [2.2, 1.5e-4]][i % 3];
                    x[i] * a + x[i] * x[i] * b
                }));
                std::array::from_fn(|i| match i {
                    0 => f,
                    1..=12 => x[i + 2] - x[i - 1],
                    _ => x[3 * i - 39] + x[3 * i - 38] + x[3 * i - 37],
                })
            }
        ),
        program!(119, 16, 9, [10.0; 16], ([0.0; 16], [5.0; 16]), (SIDE, SIDE), 244.899698, 1e-7, |x| {
            let q = x.map(|x| x * x + x + 1.0);
            let f = sum((0..16).map(|i| q[i] * sum(COUPLED[i].iter().map(|j| q[j - 1]))));
            // The second half of the matrix is the identity but for one entry.
            let row = |i: usize| {
                let extra = if i == 6 { -0.36 } else { 0.0 };
                x[8 + i] + x[8] * extra + sum((0..8).map(|j| x[j] * MATRIX[i][j]))
            };
            std::array::from_fn(|i| if i == 0 { f } else { row(i - 1) })
        }),
    ]
}
