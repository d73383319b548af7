//! Problems 101 to 119.

use apsides_ad::Scalar;

use crate::nlp::Program;
use crate::nlp::program::{INF, program};

/// Objective and constraints of 101 to 103, which differ in one exponent.
fn geometric<S: Scalar>(x: &[S; 7], a: f64) -> [S; 6] {
    let [x1, x2, x3, x4, x5, x6, x7] = *x;
    let p = |x: S, k: f64| x.powf(k);
    let f = x1 * x4.powi(2) * p(x7, a) / (x2 * x6.powi(3)) * 10.0
        + x3 * x4 / (x1 * x2.powi(2) * x5 * p(x7, 0.5)) * 15.0
        + x2 * x6 / (x1.powi(2) * x4 * x5.powi(2)) * 20.0
        + x1.powi(2) * x2.powi(2) * p(x5, 0.5) * x7 / (x3 * x6.powi(2)) * 25.0;
    let third = 1.0 / 3.0;
    [
        f,
        p(x1, 0.5) * x7 / (x3 * x6.powi(2)) * 0.5
            + x1.powi(3) * x2 * x6 * p(x7, 0.5) / x3.powi(2) * 0.7
            + x3 * p(x6, 2.0 * third) * p(x7, 0.25) / (x2 * p(x4, 0.5)) * 0.2,
        x2 * x6 / (p(x1, 0.5) * x3 * x5) * 1.3
            + x3 * x6.powi(2) / (x4 * x5) * 0.8
            + p(x2, 0.5) * p(x6, third) / (x1 * x4.powi(2) * x5) * 3.1,
        x1 * x5 * p(x7, third) / (p(x3, 1.5) * x6) * 2.0
            + x2 * x5 / (p(x3, 0.5) * x6 * p(x7, 0.5)) * 0.1
            + x2 * p(x3, 0.5) * x5 / x1
            + x3 * x5 * x7 / (x2.powi(2) * x6) * 0.65,
        x2 * p(x5, 0.5) * p(x7, third) / (x1.powi(2) * x4) * 0.2
            + p(x1, 0.5) * x2.powi(2) * x3 * p(x4, third) * p(x7, 0.25) / p(x5, 2.0 * third) * 0.3
            + x3 * x5 * p(x7, 0.75) / (x1.powi(3) * x2.powi(2)) * 0.4
            + x4 * p(x7, 0.5) / x3.powi(2) * 0.5,
        f,
    ]
}

/// The AMPL model of 101 gives 0.001 for the last; the optima of the collection are met with 0.01.
const LOWER: [f64; 7] = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.01];
const LOW: [f64; 5] = [-INF, -INF, -INF, -INF, 100.0];
const HIGH: [f64; 5] = [1.0, 1.0, 1.0, 1.0, 3000.0];

pub(super) fn programs() -> Vec<Program> {
    vec![
        program!(101, 7, 6, [6.0; 7], (LOWER, [10.0; 7]), (LOW, HIGH), 1809.76476, 1e-6, |x| geometric(
            x, -0.25
        )),
        program!(102, 7, 6, [6.0; 7], (LOWER, [10.0; 7]), (LOW, HIGH), 911.880571, 1e-6, |x| geometric(
            x, 0.125
        )),
        program!(103, 7, 6, [6.0; 7], (LOWER, [10.0; 7]), (LOW, HIGH), 543.667958, 1e-6, |x| geometric(
            x, 0.5
        )),
        program!(
            104,
            8,
            6,
            [6.0, 3.0, 0.4, 0.2, 6.0, 6.0, 1.0, 0.5],
            ([0.1; 8], [10.0; 8]),
            ([-INF, -INF, -INF, -INF, 0.1], [1.0, 1.0, 1.0, 1.0, 4.2]),
            3.9511634396,
            1e-6,
            |x| {
                let f = (x[0] / x[6]).powf(0.67) * 0.4 + (x[1] / x[7]).powf(0.67) * 0.4 - x[0] - x[1] + 10.0;
                let stage = |i: usize| {
                    x[2 + i] / x[4 + i] * 4.0
                        + (x[2 + i].powf(0.71) * x[4 + i]).recip() * 2.0
                        + x[6 + i] / x[2 + i].powf(1.3) * 0.0588
                };
                [
                    f,
                    x[4] * x[6] * 0.0588 + x[0] * 0.1,
                    x[5] * x[7] * 0.0588 + x[0] * 0.1 + x[1] * 0.1,
                    stage(0),
                    stage(1),
                    f,
                ]
            }
        ),
        program!(
            107,
            9,
            7,
            [0.8, 0.8, 0.2, 0.2, 1.0454, 1.0454, 1.0454, 0.0, 0.0],
            (
                [0.0, 0.0, -INF, -INF, 0.90909, 0.90909, 0.90909, -INF, -INF],
                [INF, INF, INF, INF, 1.0909, 1.0909, 1.0909, INF, INF]
            ),
            ([-0.4, -0.4, -0.8, -0.2, -0.2, 0.337], [-0.4, -0.4, -0.8, -0.2, -0.2, 0.337]),
            5055.011803,
            1e-6,
            |x| {
                let (c, d) = (48.4 / 50.176 * 0.25_f64.sin(), 48.4 / 50.176 * 0.25_f64.cos());
                let ((s1, c1), (s2, c2)) = (x[7].sin_cos(), x[8].sin_cos());
                let (s3, c3) = (x[7] - x[8]).sin_cos();
                let (a, b, e) = (x[4] * x[5], x[4] * x[6], x[5] * x[6]);
                [
                    x[0] * 3000.0 + x[0].powi(3) * 1000.0 + x[1] * 2000.0 + x[1].powi(3) * 666.667,
                    x[4].powi(2) * (2.0 * c) - x[0] - a * (s1 * d + c1 * c) - b * (s2 * d + c2 * c),
                    x[5].powi(2) * (2.0 * c) - x[1] + a * (s1 * d - c1 * c) + e * (s3 * d - c3 * c),
                    x[6].powi(2) * (2.0 * c) + b * (s2 * d - c2 * c) - e * (s3 * d + c3 * c),
                    x[4].powi(2) * (2.0 * d) - x[2] + a * (s1 * c - c1 * d) + b * (s2 * c - c2 * d),
                    x[5].powi(2) * (2.0 * d) - x[3] - a * (s1 * c + c1 * d) - e * (s3 * c + c3 * d),
                    x[6].powi(2) * (2.0 * d) - b * (s2 * c + c2 * d) + e * (s3 * c - c3 * d),
                ]
            }
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
    ]
}
