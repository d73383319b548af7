//! Motions that turn many times in an interval of the first mesh: it cannot carry them, and that is no conflict of the requirements.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_nlp::{Side, Status};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::{Radau, RequirementKind};

/// Discretisation: the tolerance of the mesh, relative.
const MESH: f64 = 1e-7;
/// Solver: amounts of the elastic problem, relative, as in the tests of explanations.
const AMOUNT: f64 = 1e-3;
/// Points at which the integral of an absolute value is summed, and directions in which a reachable set is looked at.
const POINTS: usize = 20_000;
const DIRECTIONS: usize = 720;

struct Oscillator;
impl Dynamics<2, 1> for Oscillator {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - x[0]]
    }
}

struct Effort;
impl PathFunction<2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}

/// From rest at `x` to rest at zero, in time `t` with at most one unit of control, and the least integral of its square.
fn to_rest(x: f64, t: f64) -> Ocp {
    let phase = Phase::new("swing", Oscillator)
        .states([
            State::new("x", "-").starts_at(x).ends_at(0.0),
            State::new("v", "-").starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("u", "-").within(-1.0, 1.0)])
        .integral(Variable::new("effort", "-"), Effort)
        .final_time(Bounds::fixed(t));
    Ocp::builder("swing").phase(phase).minimize_integral("swing", "effort").build().unwrap()
}

/// `z^T W^-1 z` with the free motion `z` at the end and the Gramian `W` of the end.
fn least_effort(x: f64, t: f64) -> f64 {
    let (sin, cos) = t.sin_cos();
    let (a, b, d) = (0.5 * t - 0.5 * sin * cos, 0.5 * sin * sin, 0.5 * t + 0.5 * sin * cos);
    let z = [x * cos, -x * sin];
    (d * z[0] * z[0] - 2.0 * b * z[0] * z[1] + a * z[1] * z[1]) / (a * d - b * b)
}

/// The farthest start from which rest is reached: the least of `integral |p . (sin s, cos s)| ds / p . (cos t, -sin t)` over directions `p`.
fn farthest(t: f64) -> f64 {
    let step = t / POINTS as f64;
    let of = |k: usize| {
        let (q, p) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        let along = p * t.cos() - q * t.sin();
        let reach: f64 = (0..POINTS)
            .map(|i| {
                let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
                (p * sin + q * cos).abs() * step
            })
            .sum();
        if along > 0.0 { reach / along } else { f64::INFINITY }
    };
    (0..DIRECTIONS).map(of).fold(f64::INFINITY, f64::min)
}

#[test]
fn many_turns_are_no_conflict() {
    for t in [10.0, 30.0, 60.0, 100.0, 300.0] {
        let x = t / 3.0;
        let ocp = to_rest(x, t);
        let solution = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
        assert!(solution.status.is_success() && solution.accurate, "{t}: {}", solution.status);
        let (found, expected) = (solution.trajectory.objective, least_effort(x, t));
        assert!((found / expected - 1.0).abs() < MESH, "{t}: {found} instead of {expected}");
    }
}

#[test]
fn a_start_too_far_is_a_conflict_however_often_it_turns() {
    for t in [10.0, 30.0, 100.0] {
        let ocp = to_rest(0.8 * t, t);
        let radau = Radau::default();
        let solution = radau.solve(&ocp, &Guess::linear(&ocp)).unwrap();
        assert_eq!(solution.status, Status::Infeasible, "{t}");
        let why =
            radau.explain(&ocp, &Guess::earlier(&solution.trajectory), &solution.trajectory.mesh()).unwrap();
        let named = |r: &&apsides_radau::Remedy| {
            (r.requirement.kind, r.requirement.name.as_str(), r.requirement.side)
                == (RequirementKind::InitialState, "x", Side::Lower)
        };
        let found = why.remedies.iter().find(named).unwrap_or_else(|| panic!("{t}: {why}")).to;
        let expected = farthest(t);
        assert!((found / expected - 1.0).abs() < AMOUNT, "{t}: {found} instead of {expected}");
    }
}
