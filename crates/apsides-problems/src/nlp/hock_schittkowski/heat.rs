//! Problems 88 to 92: time-optimal heat conduction, which differ in the number of variables.

use std::sync::LazyLock;

use apsides_ad::Scalar;

use super::sum;
use crate::nlp::Program;
use crate::nlp::program::{INF, program};

/// The first positive roots of mu tan(mu) = 1.
const MU: [f64; 30] = [
    8.6033358901938017e-01,
    3.4256184594817283e+00,
    6.4372981791719468e+00,
    9.5293344053619631e+00,
    1.2645287223856643e+01,
    1.5771284874815882e+01,
    1.8902409956860023e+01,
    2.2036496727938566e+01,
    2.5172446326646664e+01,
    2.8309642854452012e+01,
    3.1447714637546234e+01,
    3.4586424215288922e+01,
    3.7725612827776501e+01,
    4.0865170330488070e+01,
    4.4005017920830845e+01,
    4.7145097736761031e+01,
    5.0285366337773652e+01,
    5.3425790477394663e+01,
    5.6566344279821521e+01,
    5.9707007305335459e+01,
    6.2847763194454451e+01,
    6.5988598698490392e+01,
    6.9129502973895256e+01,
    7.2270467060308960e+01,
    7.5411483488848148e+01,
    7.8552545984242926e+01,
    8.1693649235601683e+01,
    8.4834788718042290e+01,
    8.7975960552493220e+01,
    9.1117161394464745e+01,
];

fn sign(i: usize) -> f64 {
    if i.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// The numbers of the statement for one root mu.
struct Mode {
    /// -mu^2.
    rate: f64,
    /// A of the book.
    factor: f64,
    /// Coefficients of z^2 (`square`) and of z (`linear`) in the distance.
    square: f64,
    linear: f64,
    /// Coefficients of z times that of each later root.
    products: Vec<f64>,
}

/// Computed once: sines cost more than the rest of an evaluation.
static MODES: LazyLock<[Mode; 30]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let mu = MU[i];
        let (sin, cos) = mu.sin_cos();
        let product = |nu: &f64| (mu + nu).sin() / (mu + nu) + (mu - nu).sin() / (mu - nu);
        Mode {
            rate: -mu * mu,
            factor: 2.0 * sin / (mu + sin * cos),
            square: 0.5 * ((2.0 * mu).sin() / (2.0 * mu) + 1.0),
            linear: 2.0 * (sin / mu.powi(3) - cos / mu.powi(2)),
            products: MU[i + 1..].iter().map(product).collect(),
        }
    })
});

/// Sum of squares, and the squared distance from the wanted temperature. With z the negative of the book's mu^2 A rho,
/// the distance is a quadratic form in z; its double sum is taken over pairs.
fn distance<S: Scalar, const N: usize>(x: &[S; N]) -> [S; 2] {
    // Sums of the squares from each variable to the last.
    let mut tails = x.map(|x| x * x);
    for i in (0..N - 1).rev() {
        let next = tails[i + 1];
        tails[i] += next;
    }
    let modes = &*MODES;
    let z: [S; 30] = std::array::from_fn(|j| {
        let pulses = sum(tails
            .iter()
            .enumerate()
            .map(|(i, tail)| (*tail * modes[j].rate).exp() * (if i == 0 { 1.0 } else { 2.0 * sign(i) })));
        (pulses + sign(N)) * modes[j].factor
    });
    let mut total = S::from(2.0 / 15.0);
    for (i, mode) in modes.iter().enumerate() {
        total += z[i] * z[i] * mode.square;
        total += z[i] * mode.linear;
        for (later, weight) in z[i + 1..].iter().zip(&mode.products) {
            total += z[i] * *later * *weight;
        }
    }
    [tails[0], total]
}

macro_rules! heat {
    ($number:literal, $n:literal) => {
        program!(
            $number,
            $n,
            2,
            std::array::from_fn(|i| 0.5 * sign(i)),
            ([-INF; $n], [INF; $n]),
            ([-INF], [1e-4]),
            1.36265681,
            1e-6,
            |x| distance(x)
        )
    };
}

pub(super) fn programs() -> Vec<Program> {
    vec![heat!(88, 2), heat!(89, 3), heat!(90, 4), heat!(91, 5), heat!(92, 6)]
}
