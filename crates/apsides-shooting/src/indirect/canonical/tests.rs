use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, Sense, State, Term, Variable};
use proptest::prelude::*;

use super::*;
use crate::indirect::hamiltonian::Place;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Explicit time, parameters, and the first and third control joined by an equality; the second one is at its lower bound.
struct Everything;

impl Dynamics<2, 3, 2> for Everything {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 3], p: &[S; 2]) -> [S; 2] {
        [
            x[1] * (t * x[0]).sin() + p[0] * u[0] + u[2],
            u[0] * (x[0] * 0.3).exp() * t - x[0] * x[1] * p[1] + u[1] * x[1].square() + (u[2] * 0.3).sin(),
        ]
    }
}

/// The integrand: convex in the controls, and steep enough in the second one to hold it at its bound.
impl PathFunction<2, 3, 1, 2> for Everything {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 3], p: &[S; 2]) -> [S; 1] {
        let squares = u[0].square() * (x[0].square() + 1.5) + u[1].square() + u[2].square() * 2.0;
        [squares * 2.0 + (u[1] + 1.0) * (x[1].square() + 6.0) + (x[0] * t * p[0]).exp() + u[0] * x[1] * p[1]]
    }
}

struct Joined;

impl PathFunction<2, 3, 1, 2> for Joined {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 3], p: &[S; 2]) -> [S; 1] {
        [u[0] * p[1] + u[2] * (x[0].square() + 1.0) + u[2].square() * 0.1 + t * x[1] * p[0]]
    }
}

const WEIGHT: f64 = 0.7;

fn hamiltonian() -> Hamiltonian {
    let control = |name: &str| Variable::new(name, "-");
    let phase = Phase::new("all", Everything)
        .states([State::new("a", "-").starts_at(0.0), State::new("b", "-").starts_at(0.0)])
        .controls([
            control("u").within(-50.0, 50.0),
            control("v").within(-0.25, 8.0),
            control("w").within(-50.0, 50.0),
        ])
        .final_time(Bounds::fixed(1.0))
        .path::<_, 2, 3, 1, 2>([Variable::new("joined", "-").within(0.4, 0.4)], Joined)
        .integral(Variable::new("cost", "-"), Everything);
    let ocp: Ocp = Ocp::builder("all")
        .parameter(Variable::new("p", "-").within(0.0, 2.0))
        .parameter(Variable::new("q", "-").within(0.0, 2.0))
        .phase(phase)
        .objective(Sense::Minimize, "cost", "-", [Term::End(At::FinalTime("all"), 1.0)])
        .build()
        .unwrap();
    Hamiltonian::new(&ocp, 0, &[WEIGHT], 0.0)
}

/// Step of central differences, whose error is then of the order of 1e-10 for functions of the order of one.
const STEP: f64 = 2e-5;
const TOLERANCE: f64 = 1e-7;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs()).max(1.0)
}

/// `[x, lambda, q]` and parameters with one of them moved.
fn moved(y: &[f64], p: &[f64], k: usize, by: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut y, mut p) = (y.to_vec(), p.to_vec());
    if k < y.len() {
        y[k] += by
    } else {
        p[k - y.len()] += by
    }
    (y, p)
}

proptest! {
    /// With the controls eliminated `H*(x, lambda, p, t)` is a function, and the rates are its derivatives: `x' = dH*/dlambda`,
    /// `lambda' = -dH*/dx`, `q' = dH*/dp`. No derivative of the controls enters these differences.
    #[test]
    fn rates_are_slopes_of_the_least_hamiltonian(
        x in prop::array::uniform2(-1.0..1.0),
        costate in prop::array::uniform2(-2.0..2.0),
        p in prop::array::uniform2(0.5..1.5),
        t in 0.1..1.0,
    ) {
        let mut h = hamiltonian();
        let y = [x[0], x[1], costate[0], costate[1], 0.0, 0.0];
        let mut rates = [0.0; 6];
        h.rates(t, &y, &p, &mut rates);
        prop_assert_eq!(h.control_places[1], Place::Lower);
        prop_assert!((h.row_values[0] - 0.4).abs() < ROUNDING);
        let time_slope = h.gradient[h.inputs() - 1];
        let mut least = |t: f64, y: &[f64], p: &[f64]| {
            assert!(h.find_control(t, &y[..2], &y[2..4], p));
            h.hamiltonian()
        };
        let mut slope = |k: usize| {
            let [up, down] = [STEP, -STEP].map(|by| {
                let (y, p) = moved(&y, &p, k, by);
                least(t, &y, &p)
            });
            (up - down) / (2.0 * STEP)
        };
        for i in 0..2 {
            prop_assert!(close(rates[i], slope(2 + i)), "state {i}: {} {}", rates[i], slope(2 + i));
            prop_assert!(close(rates[2 + i], -slope(i)), "costate {i}: {} {}", rates[2 + i], -slope(i));
            prop_assert!(close(rates[4 + i], slope(6 + i)), "parameter {i}: {} {}", rates[4 + i], slope(6 + i));
        }
        let explicit = (least(t + STEP, &y, &p) - least(t - STEP, &y, &p)) / (2.0 * STEP);
        prop_assert!(close(time_slope, explicit), "time: {time_slope} {explicit}");
    }

    /// All slopes of the rates against differences of the rates.
    #[test]
    fn slopes_are_differences_of_rates(
        x in prop::array::uniform2(-1.0..1.0),
        costate in prop::array::uniform2(-2.0..2.0),
        p in prop::array::uniform2(0.5..1.5),
        t in 0.1..1.0,
    ) {
        let mut h = hamiltonian();
        let y = [x[0], x[1], costate[0], costate[1], 0.3, -0.2];
        let (mut rates, mut again, mut slopes) = ([0.0; 6], [0.0; 6], [0.0; 6 * 8]);
        h.rates_and_slopes(t, &y, &p, &mut rates, &mut slopes);
        prop_assert_eq!(h.control_places[1], Place::Lower);
        h.rates(t, &y, &p, &mut again);
        for (a, b) in rates.iter().zip(&again) {
            prop_assert!((a - b).abs() <= ROUNDING * a.abs().max(1.0));
        }
        for k in 0..8 {
            let [up, down] = [STEP, -STEP].map(|by| {
                let (y, p) = moved(&y, &p, k, by);
                let mut out = [0.0; 6];
                h.rates(t, &y, &p, &mut out);
                out
            });
            for i in 0..6 {
                let (slope, difference) = (slopes[i * 8 + k], (up[i] - down[i]) / (2.0 * STEP));
                prop_assert!(close(slope, difference), "row {i}, column {k}: {slope} {difference}");
            }
        }
    }
}
