//! Problems 81 to 87; 82 does not exist.

use apsides_ad::Scalar;

use super::colville::{A, B, C, D, E};
use super::sum;
use super::up_to_080::{POWELL, powell};
use crate::nlp::Program;
use crate::nlp::program::{INF, program};

/// Objective and constraints of 85. Names of intermediate quantities are those of the book. Its pairs of bounds on one
/// quantity are ranges here: 21 constraints instead of 38.
fn ammonia<S: Scalar>(x: &[S; 5]) -> [S; 22] {
    let [x1, x2, x3, x4, x5] = *x;
    let y1 = x2 + x3 + 41.6;
    let c1 = x4 * 0.024 - 4.62;
    let y2 = c1.recip() * 12.5 + 12.0;
    let c2 = x1 * x1 * 0.0003535 + x1 * 0.5311 + y2 * x1 * 0.08705;
    let c3 = x1 * 0.052 + y2 * x1 * 0.002377 + 78.0;
    let y3 = c2 / c3;
    let y4 = y3 * 19.0;
    let c4 = (x1 - y3) * 0.04782 + (x1 - y3).powi(2) / x2 * 0.1956 + y4 * 0.6376 + y3 * 1.594;
    let c5 = x2 * 100.0;
    let c6 = x1 - y3 - y4;
    let c7 = -(c4 / c5) + 0.95;
    let y5 = c6 * c7;
    let y6 = x1 - y5 - y4 - y3;
    let c8 = (y5 + y4) * 0.995;
    let y7 = c8 / y1;
    let y8 = c8 / 3798.0;
    let c9 = y7 - y7 / y8 * 0.0663 - 0.3153;
    let y9 = c9.recip() * 96.82 + y1 * 0.321;
    let y10 = y5 * 1.29 + y4 * 1.258 + y3 * 2.29 + y6 * 1.71;
    let y11 = x1 * 1.71 - y4 * 0.452 + y3 * 0.58;
    let c11 = y2 * x1 * (1.75 * 0.995);
    let c12 = y10 * 0.995 + 1998.0;
    let y12 = x1 * (12.3 / 752.3) + c11 / c12;
    let y13 = c12 - y2 * 1.75;
    let c17 = y9 + x5;
    let y14 = x2 * 64.4 + x3 * 58.4 + c17.recip() * 146312.0 + 3623.0;
    let c13 = y10 * 0.995 + x2 * 60.8 + x4 * 48.0 - y14 * 0.1121 - 5095.0;
    let y15 = y13 / c13;
    let y16 = -(y15 * 331000.0) + y13 * 40.0 - y15 * y13 * 61.0 + 148000.0;
    let c14 = y10 * 2324.0 - y2 * 28740000.0;
    let y17 = -(y10 * 1328.0) - y11 * 531.0 + c14 / c12 + 14130000.0;
    let c15 = y13 / y15 - y13 / 0.52;
    let c16 = -(y15 * 0.72) + 1.104;
    let f = -(y17 * 5.843e-7)
        + y14 * 1.17e-4
        + y13 * 2.358e-5
        + y16 * 1.502e-6
        + y12 * 0.0321
        + y5 * 0.004324
        + c15 / c16 * 1e-4
        + y2 / c12 * 37.48
        + 0.1365;
    [
        f,
        x2 * 1.5 - x3,
        y1,
        y4 - y5 * (0.28 / 0.72),
        y2 / c12 * 3496.0,
        c17.recip() * 62212.0 - y1,
        y2,
        y3,
        y4,
        y5,
        y6,
        y7,
        y8,
        y9,
        y10,
        y11,
        y12,
        y13,
        y14,
        y15,
        y16,
        y17,
    ]
}

const LOW: [f64; 21] = [
    0.0, 213.1, 0.0, -INF, 110.6, 17.505, 11.275, 214.228, 7.458, 0.961, 1.612, 0.146, 107.99, 922.693,
    926.832, 18.766, 1072.163, 8961.448, 0.063, 71084.33, 2802713.0,
];
const HIGH: [f64; 21] = [
    INF, 405.23, INF, 21.0, INF, 1053.6667, 35.03, 665.585, 584.463, 265.916, 7.046, 0.222, 273.366,
    1286.105, 1444.046, 537.141, 3247.039, 26844.086, 0.386, 140000.0, 12146108.0,
];

/// In 87, to the digits of the book.
#[expect(clippy::approx_constant, reason = "a bound as published")]
const LARGEST_ANGLE: f64 = 0.5236;

pub(super) fn programs() -> Vec<Program> {
    vec![
        program!(
            81,
            5,
            4,
            [-2.0, 2.0, 2.0, -1.0, -1.0],
            ([-2.3, -2.3, -3.2, -3.2, -3.2], [2.3, 2.3, 3.2, 3.2, 3.2]),
            (POWELL, POWELL),
            0.0539498478,
            1e-8,
            |x| {
                let (product, [a, b, c]) = powell(x);
                [product.exp() - (c + 1.0).powi(2) * 0.5, a, b, c]
            }
        ),
        program!(
            83,
            5,
            4,
            [78.0, 33.0, 27.0, 27.0, 27.0],
            ([78.0, 33.0, 27.0, 27.0, 27.0], [102.0, 45.0, 45.0, 45.0, 45.0]),
            ([0.0, 90.0, 20.0], [92.0, 110.0, 25.0]),
            -30665.53867,
            1e-6,
            |x| [
                x[2] * x[2] * 5.3578547 + x[0] * x[4] * 0.8356891 + x[0] * 37.293239 - 40792.141,
                x[1] * x[4] * 0.0056858 + x[0] * x[3] * 0.0006262 - x[2] * x[4] * 0.0022053 + 85.334407,
                x[1] * x[4] * 0.0071317 + x[0] * x[1] * 0.0029955 + x[2] * x[2] * 0.0021813 + 80.51249,
                x[2] * x[4] * 0.0047026 + x[0] * x[2] * 0.0012547 + x[2] * x[3] * 0.0019085 + 9.300961,
            ]
        ),
        program!(
            84,
            5,
            4,
            [2.52, 2.0, 37.5, 9.25, 6.8],
            ([0.0, 1.2, 20.0, 9.0, 6.5], [1000.0, 2.4, 60.0, 9.3, 7.0]),
            ([0.0; 3], [294000.0, 294000.0, 277200.0]),
            -5280335.133,
            1e-8,
            |x| {
                let row = |a: [f64; 5]| (x[1] * a[1] + x[2] * a[2] + x[3] * a[3] + x[4] * a[4] + a[0]) * x[0];
                [
                    -row([-8720288.849, 150512.5253, -156.6950325, 476470.3222, 729482.8271]) + 24345.0,
                    row([-145421.402, 2931.1506, -40.427932, 5106.192, 15711.36]),
                    row([-155011.1084, 4360.53352, 12.9492344, 10236.884, 13176.786]),
                    row([-326669.5104, 7390.68412, -27.8986976, 16643.076, 30988.146]),
                ]
            }
        ),
        program!(
            85,
            5,
            22,
            [900.0, 80.0, 115.0, 267.0, 27.0],
            ([704.4148, 68.6, 0.0, 193.0, 25.0], [906.3855, 288.88, 134.75, 287.0966, 84.1988]),
            (LOW, HIGH),
            // The book gives -1.90513375; the feasible point found here is better.
            -1.905155259,
            1e-8,
            |x| ammonia(x)
        ),
        program!(
            86,
            5,
            11,
            [0.0, 0.0, 0.0, 0.0, 1.0],
            ([0.0; 5], [INF; 5]),
            (B, [INF; 10]),
            -32.34867897,
            1e-8,
            |x| {
                let f = sum((0..5).map(|j| {
                    let quadratic = sum((0..5).map(|i| x[i] * x[j] * C[i][j]));
                    x[j] * E[j] + quadratic + x[j].powi(3) * D[j]
                }));
                std::array::from_fn(|i| if i == 0 { f } else { sum((0..5).map(|j| x[j] * A[i - 1][j])) })
            }
        ),
        program!(
            87,
            6,
            5,
            [390.0, 1000.0, 419.5, 340.5, 198.175, 0.5],
            ([0.0, 0.0, 340.0, 340.0, -1000.0, 0.0], [400.0, 1000.0, 420.0, 420.0, 10000.0, LARGEST_ANGLE]),
            ([-300.0, 0.0, 0.0, -200.0], [-300.0, 0.0, 0.0, -200.0]),
            8927.5977,
            1e-6,
            |x| {
                // The book prints 1.48577; its solution satisfies the equations with this, the value of Himmelblau (1972).
                const ANGLE: f64 = 1.48477;
                // The objective jumps where its slope changes, as in the book: value and slope of the piece at the point.
                let (cos, sin) = (1.47588_f64.cos(), 1.47588_f64.sin());
                let cost = |x: S, slope: fn(f64) -> f64| x.map(|x| [slope(x) * x, slope(x), 0.0]);
                let first = cost(x[0], |x| if x < 300.0 { 30.0 } else { 31.0 });
                let second = cost(x[1], |x| {
                    if x < 100.0 {
                        28.0
                    } else if x < 200.0 {
                        29.0
                    } else {
                        30.0
                    }
                });
                let product = x[2] * x[3] / 131.078;
                let (sm, cm) = (-x[5] + ANGLE).sin_cos();
                let (sp, cp) = (x[5] + ANGLE).sin_cos();
                let (q3, q4) = (x[2] * x[2] * (0.90798 / 131.078), x[3] * x[3] * (0.90798 / 131.078));
                [
                    first + second,
                    q3 * cos - product * cm - x[0],
                    q4 * cos - product * cp - x[1],
                    q4 * sin - product * sp - x[4],
                    q3 * sin - product * sm,
                ]
            }
        ),
    ]
}
