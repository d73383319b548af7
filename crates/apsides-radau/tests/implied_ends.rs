//! Final states that the motion implies, and those that it only seems to.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::Radau;

/// Distance of a final state from where it is posed: the error of the mesh.
const AT_END: f64 = 1e-7;
/// Accuracy of the objective on a mesh of default tolerance.
const SMOOTH: f64 = 1e-7;

/// A vector that turns, and a clock; late by the clock the vector grows, where `growth` is not zero.
struct Turn {
    growth: f64,
}

impl Dynamics<3, 1> for Turn {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let late = (x[2] - 60.0).exp() * self.growth;
        [-x[1] * u[0], x[0] * u[0] + late, S::from(60.0)]
    }
}

struct Effort;

impl PathFunction<3, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}

fn turn(growth: f64) -> Ocp {
    let phase = Phase::new("turn", Turn { growth })
        .states([
            State::new("c", "m").starts_at(1.0).ends_at(0.6),
            State::new("s", "m").starts_at(0.0).ends_at(0.8),
            State::new("clock", "-").starts_at(0.0),
        ])
        .controls([Variable::new("w", "rad/s")])
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("j", "-"), Effort);
    Ocp::builder("turn").phase(phase).minimize_integral("turn", "j").build().unwrap()
}

/// The least effort turns at one rate by the angle between both ends.
#[test]
fn an_end_that_the_motion_implies_is_reached() {
    let ocp = turn(0.0);
    let found = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(found.status.is_success(), "{}", found.status);
    let optimum = 0.8_f64.asin().powi(2);
    assert!((found.trajectory.objective / optimum - 1.0).abs() <= SMOOTH, "{}", found.trajectory.objective);
    let [c, s, _] = found.trajectory.phases[0].final_state()[..] else { panic!() };
    assert!((c - 0.6).abs() <= AT_END && (s - 0.8).abs() <= AT_END, "{c} {s}");
}

/// Samples near the start show a vector of constant length; at the end of the flight it grows by a sixtieth.
#[test]
fn an_end_that_the_motion_only_seems_to_imply_is_reached() {
    let ocp = turn(1.0);
    let found = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(found.status.is_success(), "{}", found.status);
    let [c, s, _] = found.trajectory.phases[0].final_state()[..] else { panic!() };
    assert!((c - 0.6).abs() <= AT_END && (s - 0.8).abs() <= AT_END, "{c} {s}");
}
