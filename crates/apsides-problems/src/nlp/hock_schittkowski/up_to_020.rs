//! Problems 1 to 20.

use apsides_ad::Scalar;

use crate::nlp::Program;
use crate::nlp::program::{INF, program};

/// The function of Rosenbrock.
fn rosenbrock<S: Scalar>(x: &[S; 2]) -> S {
    (x[1] - x[0].powi(2)).powi(2) * 100.0 + (-x[0] + 1.0).powi(2)
}

/// Objective of 19 at its optimum, where the circles of the two constraints meet: `x1 = 14.095`.
fn optimum_of_19() -> f64 {
    let x2 = 5.0 - (100.0_f64 - 9.095 * 9.095).sqrt();
    (14.095_f64 - 10.0).powi(3) + (x2 - 20.0).powi(3)
}

pub(super) fn programs() -> Vec<Program> {
    let (sqrt3, sqrt7) = (3.0_f64.sqrt(), 7.0_f64.sqrt());
    let third_of_pi = std::f64::consts::FRAC_PI_3;
    vec![
        program!(1, 2, 1, [-2.0, 1.0], ([-INF, -1.5], [INF; 2]), ([], []), 0.0, 1e-8, |x| [rosenbrock(x)]),
        program!(2, 2, 1, [-2.0, 1.0], ([-INF, 1.5], [INF; 2]), ([], []), 0.0504261879, 1e-8, |x| [
            rosenbrock(x)
        ]),
        program!(3, 2, 1, [10.0, 1.0], ([-INF, 0.0], [INF; 2]), ([], []), 0.0, 1e-8, |x| [
            x[1] + (x[1] - x[0]).powi(2) * 1e-5
        ]),
        program!(4, 2, 1, [1.125, 0.125], ([1.0, 0.0], [INF; 2]), ([], []), 8.0 / 3.0, 1e-8, |x| [(x[0]
            + 1.0)
            .powi(3)
            / 3.0
            + x[1]]),
        program!(
            5,
            2,
            1,
            [0.0; 2],
            ([-1.5, -3.0], [4.0, 3.0]),
            ([], []),
            -0.5 * sqrt3 - third_of_pi,
            1e-8,
            |x| [(x[0] + x[1]).sin() + (x[0] - x[1]).powi(2) - x[0] * 1.5 + x[1] * 2.5 + 1.0]
        ),
        program!(6, 2, 2, [-1.2, 1.0], ([-INF; 2], [INF; 2]), ([0.0], [0.0]), 0.0, 1e-8, |x| [
            (-x[0] + 1.0).powi(2),
            (x[1] - x[0].powi(2)) * 10.0,
        ]),
        program!(7, 2, 2, [2.0; 2], ([-INF; 2], [INF; 2]), ([4.0], [4.0]), -sqrt3, 1e-8, |x| {
            let a = x[0].powi(2) + 1.0;
            [a.ln() - x[1], a.powi(2) + x[1].powi(2)]
        }),
        program!(8, 2, 3, [2.0, 1.0], ([-INF; 2], [INF; 2]), ([25.0, 9.0], [25.0, 9.0]), -1.0, 1e-8, |x| [
            S::from(-1.0),
            x[0].powi(2) + x[1].powi(2),
            x[0] * x[1],
        ]),
        program!(9, 2, 2, [0.0; 2], ([-INF; 2], [INF; 2]), ([0.0], [0.0]), -0.5, 1e-8, |x| {
            let pi = std::f64::consts::PI;
            [(x[0] * (pi / 12.0)).sin() * (x[1] * (pi / 16.0)).cos(), x[0] * 4.0 - x[1] * 3.0]
        }),
        program!(10, 2, 2, [-10.0, 10.0], ([-INF; 2], [INF; 2]), ([-1.0], [INF]), -1.0, 1e-8, |x| [
            x[0] - x[1],
            x[0].powi(2) * -3.0 + x[0] * x[1] * 2.0 - x[1].powi(2),
        ]),
        program!(11, 2, 2, [4.9, 0.1], ([-INF; 2], [INF; 2]), ([0.0], [INF]), -8.498464223, 1e-8, |x| [
            (x[0] - 5.0).powi(2) + x[1].powi(2) - 25.0,
            x[1] - x[0].powi(2),
        ]),
        program!(12, 2, 2, [0.0; 2], ([-INF; 2], [INF; 2]), ([-INF], [25.0]), -30.0, 1e-8, |x| [
            x[0].powi(2) * 0.5 + x[1].powi(2) - x[0] * x[1] - x[0] * 7.0 - x[1] * 7.0,
            x[0].powi(2) * 4.0 + x[1].powi(2),
        ]),
        program!(13, 2, 2, [-2.0; 2], ([0.0; 2], [INF; 2]), ([0.0], [INF]), 1.0, 1e-8, |x| [
            (x[0] - 2.0).powi(2) + x[1].powi(2),
            (-x[0] + 1.0).powi(3) - x[1],
        ]),
        program!(
            14,
            2,
            3,
            [2.0; 2],
            ([-INF; 2], [INF; 2]),
            ([-INF, -1.0], [1.0, -1.0]),
            9.0 - 2.875 * sqrt7,
            1e-8,
            |x| [
                (x[0] - 2.0).powi(2) + (x[1] - 1.0).powi(2),
                x[0].powi(2) * 0.25 + x[1].powi(2),
                x[0] - x[1] * 2.0,
            ]
        ),
        program!(15, 2, 3, [-2.0, 1.0], ([-INF; 2], [0.5, INF]), ([1.0, 0.0], [INF; 2]), 306.5, 1e-8, |x| [
            rosenbrock(x),
            x[0] * x[1],
            x[0] + x[1].powi(2)
        ]),
        // 16, 17: a solver that limits the scaled gap to 1e-8 leaves up to 24 times as much per active bound, the
        // gradient of 2400 at the start being scaled to 100.
        program!(16, 2, 3, [-2.0, 1.0], ([-0.5, -INF], [0.5, 1.0]), ([0.0; 2], [INF; 2]), 0.25, 1e-7, |x| [
            rosenbrock(x),
            x[0] + x[1].powi(2),
            x[0].powi(2) + x[1]
        ]),
        program!(17, 2, 3, [-2.0, 1.0], ([-0.5, -INF], [0.5, 1.0]), ([0.0; 2], [INF; 2]), 1.0, 1e-7, |x| [
            rosenbrock(x),
            x[1].powi(2) - x[0],
            x[0].powi(2) - x[1]
        ]),
        program!(18, 2, 3, [2.0; 2], ([2.0, 0.0], [50.0; 2]), ([25.0; 2], [INF; 2]), 5.0, 1e-8, |x| [
            x[0].powi(2) * 0.01 + x[1].powi(2),
            x[0] * x[1],
            x[0].powi(2) + x[1].powi(2),
        ]),
        program!(
            19,
            2,
            3,
            [20.1, 5.84],
            ([13.0, 0.0], [100.0; 2]),
            ([100.0, -INF], [INF, 82.81]),
            optimum_of_19(),
            1e-8,
            |x| [
                (x[0] - 10.0).powi(3) + (x[1] - 20.0).powi(3),
                (x[0] - 5.0).powi(2) + (x[1] - 5.0).powi(2),
                (x[1] - 5.0).powi(2) + (x[0] - 6.0).powi(2),
            ]
        ),
        program!(
            20,
            2,
            4,
            [-2.0, 1.0],
            ([-0.5, -INF], [0.5, INF]),
            ([0.0, 0.0, 1.0], [INF; 3]),
            81.5 - 25.0 * sqrt3,
            1e-8,
            |x| [rosenbrock(x), x[0] + x[1].powi(2), x[0].powi(2) + x[1], x[0].powi(2) + x[1].powi(2),]
        ),
    ]
}
