//! Problems of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (1981, doi
//! 10.1007/978-3-642-48320-2), by their number, with the optimal values of the collection.

use apsides_nlp::{BarrierOracle, BarrierStrategy, NlpSettings, Status};

use crate::support::{Dense, INF, Jet, solve_with};

fn strategies() -> [NlpSettings; 4] {
    let adaptive = |barrier_oracle| NlpSettings {
        barrier: BarrierStrategy::Adaptive,
        barrier_oracle,
        ..NlpSettings::default()
    };
    [
        NlpSettings::default(),
        adaptive(BarrierOracle::QualityFunction),
        adaptive(BarrierOracle::Probing),
        adaptive(BarrierOracle::Loqo),
    ]
}

/// Solves by every barrier strategy; the monotone one within `iterations`.
fn assert_optimum<const N: usize, const M: usize>(
    problem: &Dense<N, M>,
    optimum: f64,
    tolerance: f64,
    iterations: usize,
) {
    for settings in strategies() {
        let report = solve_with(problem, &settings);
        let strategy = (settings.barrier, settings.barrier_oracle);
        assert_eq!(report.status, Status::Optimal, "{strategy:?}: f = {}", report.objective);
        let error = (report.objective - optimum).abs();
        assert!(error <= tolerance * optimum.abs().max(1.0), "{strategy:?}: f = {}", report.objective);
        if settings.barrier == BarrierStrategy::Monotone {
            assert!(report.counters.iterations <= iterations, "{} iterations", report.counters.iterations);
        }
    }
}

pub(crate) fn hs71() -> Dense<4, 2> {
    Dense {
        start: [1.0, 5.0, 5.0, 1.0],
        lower: [1.0; 4],
        upper: [5.0; 4],
        constraint_lower: [25.0, 40.0],
        constraint_upper: [INF, 40.0],
        objective: |x| x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        constraints: |x| [x[0] * x[1] * x[2] * x[3], x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]],
    }
}

#[test]
fn problem_64() {
    let problem = Dense {
        start: [1.0; 3],
        lower: [1e-5; 3],
        upper: [INF; 3],
        constraint_lower: [-INF],
        constraint_upper: [1.0],
        objective: |x| {
            5.0 * x[0] + 50000.0 / x[0] + 20.0 * x[1] + 72000.0 / x[1] + 10.0 * x[2] + 144000.0 / x[2]
        },
        constraints: |x| [4.0 / x[0] + 32.0 / x[1] + 120.0 / x[2]],
    };
    assert_optimum(&problem, 6299.842428, 1e-8, 25);
}

#[test]
fn problem_71() {
    assert_optimum(&hs71(), 17.01401729, 1e-9, 8);
}

const COLVILLE_A: [[f64; 5]; 10] = [
    [-16.0, 2.0, 0.0, 1.0, 0.0],
    [0.0, -2.0, 0.0, 0.4, 2.0],
    [-3.5, 0.0, 2.0, 0.0, 0.0],
    [0.0, -2.0, 0.0, -4.0, -1.0],
    [0.0, -9.0, -2.0, 1.0, -2.8],
    [2.0, 0.0, -4.0, 0.0, 0.0],
    [-1.0; 5],
    [-1.0, -2.0, -3.0, -2.0, -1.0],
    [1.0, 2.0, 3.0, 4.0, 5.0],
    [1.0; 5],
];
const COLVILLE_B: [f64; 10] = [-40.0, -2.0, -0.25, -4.0, -4.0, -1.0, -40.0, -60.0, 5.0, 1.0];
const COLVILLE_C: [[f64; 5]; 5] = [
    [30.0, -20.0, -10.0, 32.0, -10.0],
    [-20.0, 39.0, -6.0, -31.0, 32.0],
    [-10.0, -6.0, 10.0, -6.0, -10.0],
    [32.0, -31.0, -6.0, 39.0, -20.0],
    [-10.0, 32.0, -10.0, -20.0, 30.0],
];
const COLVILLE_D: [f64; 5] = [4.0, 8.0, 10.0, 6.0, 2.0];
const COLVILLE_E: [f64; 5] = [-15.0, -27.0, -36.0, -18.0, -12.0];

fn sum<const N: usize>(terms: impl Iterator<Item = Jet<N>>) -> Jet<N> {
    terms.fold(Jet::constant(0.0), |sum, term| sum + term)
}

#[test]
fn problem_86() {
    let problem = Dense {
        start: [0.0, 0.0, 0.0, 0.0, 1.0],
        lower: [0.0; 5],
        upper: [INF; 5],
        constraint_lower: COLVILLE_B,
        constraint_upper: [INF; 10],
        objective: |x| {
            sum((0..5).map(|j| {
                let quadratic = sum((0..5).map(|i| COLVILLE_C[i][j] * x[i] * x[j]));
                COLVILLE_E[j] * x[j] + quadratic + COLVILLE_D[j] * x[j].powi(3)
            }))
        },
        constraints: |x| std::array::from_fn(|i| sum((0..5).map(|j| COLVILLE_A[i][j] * x[j]))),
    };
    assert_optimum(&problem, -32.34867897, 1e-8, 15);
}

#[test]
fn problem_93() {
    let problem = Dense {
        start: [5.54, 4.4, 12.02, 11.82, 0.702, 0.852],
        lower: [0.0; 6],
        upper: [INF; 6],
        constraint_lower: [2.07, -INF],
        constraint_upper: [INF, 1.0],
        objective: |x| {
            let a = x[0] * x[3] * (x[0] + x[1] + x[2]);
            let b = x[1] * x[2] * (x[0] + 1.57 * x[1] + x[3]);
            0.0204 * a + 0.0187 * b + 0.0607 * a * x[4] * x[4] + 0.0437 * b * x[5] * x[5]
        },
        constraints: |x| {
            let a = x[0] * x[3] * (x[0] + x[1] + x[2]);
            let b = x[1] * x[2] * (x[0] + 1.57 * x[1] + x[3]);
            [
                0.001 * x[0] * x[1] * x[2] * x[3] * x[4] * x[5],
                0.00062 * a * x[4] * x[4] + 0.00058 * b * x[5] * x[5],
            ]
        },
    };
    assert_optimum(&problem, 135.075961, 1e-7, 20);
}

#[test]
fn problem_100() {
    let problem = Dense {
        start: [1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0],
        lower: [-INF; 7],
        upper: [INF; 7],
        constraint_lower: [-INF, -INF, -INF, 0.0],
        constraint_upper: [127.0, 282.0, 196.0, INF],
        objective: |x| {
            (x[0] - 10.0).powi(2)
                + 5.0 * (x[1] - 12.0).powi(2)
                + x[2].powi(4)
                + 3.0 * (x[3] - 11.0).powi(2)
                + 10.0 * x[4].powi(6)
                + 7.0 * x[5].powi(2)
                + x[6].powi(4)
                - 4.0 * x[5] * x[6]
                - 10.0 * x[5]
                - 8.0 * x[6]
        },
        constraints: |x| {
            [
                2.0 * x[0].powi(2) + 3.0 * x[1].powi(4) + x[2] + 4.0 * x[3].powi(2) + 5.0 * x[4],
                7.0 * x[0] + 3.0 * x[1] + 10.0 * x[2].powi(2) + x[3] - x[4],
                23.0 * x[0] + x[1].powi(2) + 6.0 * x[5].powi(2) - 8.0 * x[6],
                -4.0 * x[0].powi(2) - x[1].powi(2) + 3.0 * x[0] * x[1] - 2.0 * x[2].powi(2) - 5.0 * x[5]
                    + 11.0 * x[6],
            ]
        },
    };
    assert_optimum(&problem, 680.6300573, 1e-9, 12);
}

#[test]
fn problem_106() {
    // The collection gives 7049.330923; the feasible point found here, by every strategy, is better.
    let problem = Dense {
        start: [5000.0, 5000.0, 5000.0, 200.0, 350.0, 150.0, 225.0, 425.0],
        lower: [100.0, 1000.0, 1000.0, 10.0, 10.0, 10.0, 10.0, 10.0],
        upper: [10000.0, 10000.0, 10000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0],
        constraint_lower: [-INF, -INF, -INF, -83333.333, 0.0, 1250000.0],
        constraint_upper: [1.0, 1.0, 1.0, INF, INF, INF],
        objective: |x| x[0] + x[1] + x[2],
        constraints: |x| {
            [
                0.0025 * (x[3] + x[5]),
                0.0025 * (x[4] + x[6] - x[3]),
                0.01 * (x[7] - x[4]),
                x[0] * x[5] - 833.33252 * x[3] - 100.0 * x[0],
                x[1] * x[6] - 1250.0 * x[4] - x[1] * x[3] + 1250.0 * x[3],
                x[2] * x[7] - x[2] * x[4] + 2500.0 * x[4],
            ]
        },
    };
    assert_optimum(&problem, 7049.248021, 1e-8, 25);
}

#[test]
fn problem_111() {
    const C: [f64; 10] =
        [-6.089, -17.164, -34.054, -5.914, -24.721, -14.986, -24.1, -10.708, -26.662, -22.179];
    let problem = Dense {
        start: [-2.3; 10],
        lower: [-100.0; 10],
        upper: [100.0; 10],
        constraint_lower: [2.0, 1.0, 1.0],
        constraint_upper: [2.0, 1.0, 1.0],
        objective: |x| {
            let log_sum = sum(x.iter().map(|x| x.exp())).ln();
            sum((0..10).map(|j| x[j].exp() * (x[j] - log_sum + C[j])))
        },
        constraints: |x| {
            let e = x.map(Jet::exp);
            [
                e[0] + 2.0 * e[1] + 2.0 * e[2] + e[5] + e[9],
                e[3] + 2.0 * e[4] + e[5] + e[6],
                e[2] + e[6] + e[7] + 2.0 * e[8] + e[9],
            ]
        },
    };
    // The collection gives -47.76109026, a little above the optimum.
    assert_optimum(&problem, -47.76109086, 1e-9, 25);
}

#[test]
fn problem_114() {
    const A: f64 = 0.99;
    const B: f64 = 0.9;
    let problem = Dense {
        start: [1745.0, 12000.0, 110.0, 3048.0, 1974.0, 89.2, 92.8, 8.0, 3.6, 145.0],
        lower: [1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 85.0, 90.0, 3.0, 1.2, 145.0],
        upper: [2000.0, 16000.0, 120.0, 5000.0, 2000.0, 93.0, 95.0, 12.0, 4.0, 162.0],
        constraint_lower: [0.0; 11],
        constraint_upper: [INF, INF, INF, INF, INF, INF, INF, INF, 0.0, 0.0, 0.0],
        objective: |x| 5.04 * x[0] + 0.035 * x[1] + 10.0 * x[2] + 3.36 * x[4] - 0.063 * x[3] * x[6],
        constraints: |x| {
            let g1 = 35.82 - 0.222 * x[9] - B * x[8];
            let g2 = -133.0 + 3.0 * x[6] - A * x[9];
            let g5 = 1.12 * x[0] + 0.13167 * x[0] * x[7] - 0.00667 * x[0] * x[7] * x[7] - A * x[3];
            let g6 = 57.425 + 1.098 * x[7] - 0.038 * x[7] * x[7] + 0.325 * x[5] - A * x[6];
            [
                g1,
                g2,
                (1.0 / B - B) * x[8] - g1,
                (1.0 / A - A) * x[9] - g2,
                g5,
                g6,
                (1.0 / A - A) * x[3] - g5,
                (1.0 / A - A) * x[6] - g6,
                1.22 * x[3] - x[0] - x[4],
                98000.0 * x[2] / (x[3] * x[8] + 1000.0 * x[2]) - x[5],
                (x[1] + x[4]) / x[0] - x[7],
            ]
        },
    };
    assert_optimum(&problem, -1768.80696, 1e-8, 25);
}

#[test]
fn problem_116() {
    // The collection gives 97.588409; the feasible point found here, by every strategy, is better: 97.587509.
    let problem = Dense {
        start: [0.5, 0.8, 0.9, 0.1, 0.14, 0.5, 489.0, 80.0, 650.0, 450.0, 150.0, 150.0, 150.0],
        lower: [0.1, 0.1, 0.1, 1e-4, 0.1, 0.1, 0.1, 0.1, 500.0, 0.1, 1.0, 1e-4, 1e-4],
        upper: [1.0, 1.0, 1.0, 0.1, 0.9, 0.9, 1000.0, 1000.0, 1000.0, 500.0, 150.0, 150.0, 150.0],
        constraint_lower: [0.0, 0.0, -1.0, 50.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.9, 0.0, 0.0, 0.0],
        constraint_upper: [INF, INF, INF, 250.0, INF, INF, INF, INF, INF, INF, INF, INF, INF, INF],
        objective: |x| x[10] + x[11] + x[12],
        constraints: |x| {
            [
                x[2] - x[1],
                x[1] - x[0],
                0.002 * (x[7] - x[6]),
                x[10] + x[11] + x[12],
                x[12] - 1.262626 * x[9] + 1.231059 * x[2] * x[9],
                x[4] - 0.03475 * x[1] - 0.975 * x[1] * x[4] + 0.00975 * x[1] * x[1],
                x[5] - 0.03475 * x[2] - 0.975 * x[2] * x[5] + 0.00975 * x[2] * x[2],
                x[4] * x[6] - x[0] * x[7] - x[3] * x[6] + x[3] * x[7],
                -0.002 * (x[1] * x[8] + x[4] * x[7] - x[0] * x[7] - x[5] * x[8]) - x[4] - x[5],
                x[1] * x[8] - x[2] * x[9] - x[5] * x[8] - 500.0 * x[1] + 500.0 * x[5] + x[1] * x[9],
                x[1] - 0.002 * (x[1] * x[9] - x[2] * x[9]),
                x[3] - 0.03475 * x[0] - 0.975 * x[0] * x[3] + 0.00975 * x[0] * x[0],
                x[10] - 1.262626 * x[7] + 1.231059 * x[0] * x[7],
                x[11] - 1.262626 * x[8] + 1.231059 * x[1] * x[8],
            ]
        },
    };
    assert_optimum(&problem, 97.587509, 1e-8, 30);
}

#[test]
fn problem_117() {
    let mut start = [0.001; 15];
    start[6] = 60.0;
    let problem = Dense {
        start,
        lower: [0.0; 15],
        upper: [INF; 15],
        constraint_lower: COLVILLE_E.map(|e| -e),
        constraint_upper: [INF; 5],
        objective: |x| {
            let linear = sum((0..10).map(|j| COLVILLE_B[j] * x[j]));
            let quadratic = sum((0..25).map(|k| COLVILLE_C[k / 5][k % 5] * x[10 + k / 5] * x[10 + k % 5]));
            quadratic - linear + 2.0 * sum((0..5).map(|j| COLVILLE_D[j] * x[10 + j].powi(3)))
        },
        constraints: |x| {
            std::array::from_fn(|j| {
                2.0 * sum((0..5).map(|k| COLVILLE_C[k][j] * x[10 + k]))
                    + 3.0 * COLVILLE_D[j] * x[10 + j].powi(2)
                    - sum((0..10).map(|k| COLVILLE_A[k][j] * x[k]))
            })
        },
    };
    assert_optimum(&problem, 32.34867897, 1e-8, 30);
}

#[test]
fn problem_118() {
    let mut lower = [0.0; 15];
    let mut upper = [0.0; 15];
    for k in 0..5 {
        upper[3 * k..3 * k + 3].copy_from_slice(&[90.0, 120.0, 60.0]);
    }
    lower[..3].copy_from_slice(&[8.0, 43.0, 3.0]);
    upper[..3].copy_from_slice(&[21.0, 57.0, 16.0]);
    let (mut constraint_lower, mut constraint_upper) = ([-7.0; 17], [INF; 17]);
    for i in 0..12 {
        constraint_upper[i] = if i % 3 == 1 { 7.0 } else { 6.0 };
    }
    constraint_lower[12..].copy_from_slice(&[60.0, 50.0, 70.0, 85.0, 100.0]);
    let problem = Dense {
        start: [20.0, 55.0, 15.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0],
        lower,
        upper,
        constraint_lower,
        constraint_upper,
        objective: |x| {
            sum((0..5).map(|k| {
                let (a, b, c) = (x[3 * k], x[3 * k + 1], x[3 * k + 2]);
                2.3 * a + 1e-4 * a * a + 1.7 * b + 1e-4 * b * b + 2.2 * c + 1.5e-4 * c * c
            }))
        },
        constraints: |x| {
            std::array::from_fn(|i| {
                if i < 12 {
                    x[i + 3] - x[i]
                } else {
                    let k = 3 * (i - 12);
                    x[k] + x[k + 1] + x[k + 2]
                }
            })
        },
    };
    assert_optimum(&problem, 664.82045, 1e-8, 20);
}

#[test]
fn problem_119() {
    const PAIRS: [(usize, usize); 42] = [
        (1, 4),
        (1, 7),
        (1, 8),
        (1, 16),
        (2, 3),
        (2, 7),
        (2, 10),
        (3, 7),
        (3, 9),
        (3, 10),
        (3, 14),
        (4, 7),
        (4, 11),
        (4, 15),
        (5, 6),
        (5, 10),
        (5, 12),
        (5, 16),
        (6, 8),
        (6, 15),
        (7, 11),
        (7, 13),
        (8, 10),
        (8, 15),
        (9, 12),
        (9, 16),
        (10, 14),
        (11, 13),
        (12, 14),
        (13, 14),
        (1, 1),
        (2, 2),
        (3, 3),
        (4, 4),
        (5, 5),
        (6, 6),
        (7, 7),
        (8, 8),
        (9, 9),
        (10, 10),
        (11, 11),
        (12, 12),
    ];
    const B: [[f64; 8]; 8] = [
        [0.22, 0.20, 0.19, 0.25, 0.15, 0.11, 0.12, 0.13],
        [-1.46, 0.0, -1.30, 1.82, -1.15, 0.0, 0.80, 0.0],
        [1.29, -0.89, 0.0, 0.0, -1.16, -0.96, 0.0, -0.49],
        [-1.10, -1.06, 0.95, -0.54, 0.0, -1.78, -0.41, 0.0],
        [0.0, 0.0, 0.0, -1.43, 1.51, 0.59, -0.33, -0.43],
        [0.0, -1.72, -0.33, 0.0, 1.62, 1.24, 0.21, -0.26],
        [1.12, 0.0, 0.0, 0.31, 0.0, 0.0, 1.12, 0.0],
        [0.0, 0.45, 0.26, -1.10, 0.58, 0.0, -1.03, 0.10],
    ];
    const C: [f64; 8] = [2.5, 1.1, -3.1, -3.5, 1.3, 2.1, 2.3, -1.5];
    let problem = Dense {
        start: [10.0; 16],
        lower: [0.0; 16],
        upper: [5.0; 16],
        constraint_lower: C,
        constraint_upper: C,
        objective: |x| {
            let q = x.map(|x| x * x + x + 1.0);
            let diagonal = sum((12..16).map(|i| q[i] * q[i]));
            diagonal + sum(PAIRS.iter().map(|&(i, j)| q[i - 1] * q[j - 1]))
        },
        constraints: |x| {
            std::array::from_fn(|i| {
                // The second half of the matrix is the identity but for one entry.
                let extra = if i == 6 { -0.36 } else { 0.0 };
                x[8 + i] + extra * x[8] + sum((0..8).map(|j| B[i][j] * x[j]))
            })
        },
    };
    assert_optimum(&problem, 244.899698, 1e-7, 20);
}
