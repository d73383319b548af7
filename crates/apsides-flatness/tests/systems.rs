//! Other flat systems: PVTOL aircraft and powered descent in space, against closed forms and Radau collocation.
#![allow(clippy::unwrap_used)]

use apsides_ad::vector::norm;
use apsides_ad::{Dynamics, FlatMap, PathFunction, Scalar};
use apsides_flatness::{FlatSystem, Flatness, FlatnessSolution};
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Term, Variable};
use apsides_problems::Case;
use apsides_problems::pvtol::{self, AIRCRAFT, HoverEffort, rest_to_rest};
use apsides_radau::Radau;
use apsides_verify::{Verdict, VerifySettings, verify};

/// Objective of two methods, relative: mesh tolerance of Radau.
const MESH: f64 = 1e-7;
/// Objective of a problem whose optimum is a polynomial that the splines contain, relative: tolerance of the solver.
const SOLVER: f64 = 1e-9;

/// The control of such a problem at the start, m/s2: the same tolerance on the optimum.
const SOLVER_CONTROL: f64 = 1e-8;

fn feasible(ocp: &Ocp, solution: &FlatnessSolution) {
    assert!(solution.accurate, "{} {:#?}", solution.status, solution.solves);
    let certificate = verify(ocp, &solution.trajectory, &VerifySettings::default()).unwrap().certificate;
    // Of the attitude the splines have the second derivative, whose error the slope of the Hamiltonian shows.
    assert!(certificate.verdict >= Verdict::Feasible, "{certificate:#?}");
}

fn agree(ocp: &Ocp, systems: &[FlatSystem], guess: &Guess) -> FlatnessSolution {
    let flat = Flatness::default().solve(ocp, systems, guess).unwrap();
    feasible(ocp, &flat);
    let radau = Radau::default().solve(ocp, guess).unwrap();
    assert!(radau.status.is_success() && radau.accurate);
    let (a, b) = (flat.trajectory.objective, radau.trajectory.objective);
    assert!((a - b).abs() <= MESH * b.abs(), "flatness {a}, Radau {b}");
    flat
}

#[test]
fn pvtol_from_rest_to_rest_with_least_effort() {
    let Case { ocp, guess } = pvtol::PROBLEM.pose().unwrap();
    let system = FlatSystem::new(AIRCRAFT);
    assert_eq!((system.residuals, &system.highest[..]), (0, &[4, 4][..]));
    let solution = agree(&ocp, &[system], &guess);
    assert!(pvtol::PROBLEM.optimum.relative_difference(solution.trajectory.objective).abs() < MESH);
}

/// Bounded controls that the optimum touches: rows at the points, and the estimate of what happens between them.
#[test]
fn pvtol_in_free_time_with_a_price_on_time() {
    let phase = Phase::new("move", AIRCRAFT)
        .states(rest_to_rest())
        .controls([
            Variable::new("thrust", "-").within(0.2, 3.0),
            Variable::new("moment", "-").within(-9.0, 9.0),
        ])
        .final_time(Bounds::new(1.0, 20.0))
        .integral(Variable::new("effort", "-"), HoverEffort);
    let terms = [Term::End(At::FinalTime("move"), 0.5), Term::Integral("move", "effort", 1.0)];
    let ocp = Ocp::builder("pvtol")
        .phase(phase)
        .objective(apsides_ocp::Sense::Minimize, "price", "-", terms)
        .build()
        .unwrap();
    let rows = vec![vec![0.0; 6], vec![3.0, 1.0, 0.0, 0.0, 0.0, 0.0]];
    let guess = PhaseGuess::samples(&[0.0, 4.0], rows, vec![vec![1.0, 0.0]; 2]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![guess]);
    agree(&ocp, &[FlatSystem::new(AIRCRAFT)], &guess);
}

const GRAVITY: [f64; 3] = [0.0, 0.0, -3.7114];
const START: [f64; 6] = [400.0, -300.0, 1500.0, -20.0, 35.0, -75.0];
const TIME: f64 = 60.0;

/// Thrust acceleration as the control, in a uniform field; the outputs are the position.
#[derive(Clone, Copy)]
struct Acceleration;

impl Dynamics<6, 3> for Acceleration {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 3], _p: &[S; 0]) -> [S; 6] {
        let a: [S; 3] = std::array::from_fn(|k| u[k] + GRAVITY[k]);
        [x[3], x[4], x[5], a[0], a[1], a[2]]
    }
}

impl FlatMap<3, 3, 6, 3, 0> for Acceleration {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 3], _p: &[S; 0]) -> ([S; 6], [S; 3], [S; 0]) {
        let x = [y[0][0], y[1][0], y[2][0], y[0][1], y[1][1], y[2][1]];
        (x, std::array::from_fn(|k| y[k][2] - GRAVITY[k]), [])
    }

    fn outputs(&self, _t: f64, x: &[f64; 6], _u: &[f64; 3], _p: &[f64; 0]) -> [f64; 3] {
        [x[0], x[1], x[2]]
    }
}

struct Square;

impl PathFunction<6, 3, 1> for Square {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 6], u: &[S; 3], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square() + u[2].square()]
    }
}

fn position_and_speed() -> [State; 6] {
    let scales = [1e3, 1e3, 1e3, 100.0, 100.0, 100.0];
    std::array::from_fn(|k| {
        let (name, unit) = if k < 3 { (["x", "y", "z"][k], "m") } else { (["vx", "vy", "vz"][k - 3], "m/s") };
        State::new(name, unit).starts_at(START[k]).ends_at(0.0).scaled_by(scales[k])
    })
}

/// The acceleration of least square is linear in time: `a = -6 x0 / T^2 - 4 v0 / T` at the start, per axis, to
/// `6 x0 / T^2 + 2 v0 / T` at the end (E-guidance).
#[test]
fn powered_descent_in_space_with_least_square() {
    let phase = Phase::new("descent", Acceleration)
        .states(position_and_speed())
        .controls(["ax", "ay", "az"].map(|n| Variable::new(n, "m/s2").scaled_by(10.0)))
        .final_time(Bounds::fixed(TIME))
        .integral(Variable::new("square", "m2/s3"), Square);
    let ocp = Ocp::builder("descent").phase(phase).minimize_integral("descent", "square").build().unwrap();
    let solution =
        Flatness::default().solve(&ocp, &[FlatSystem::new(Acceleration)], &Guess::linear(&ocp)).unwrap();
    feasible(&ocp, &solution);
    let mut expected = 0.0;
    for k in 0..3 {
        let (x0, v0) = (START[k], START[k + 3]);
        let first = -6.0 * x0 / TIME.powi(2) - 4.0 * v0 / TIME - GRAVITY[k];
        let last = 6.0 * x0 / TIME.powi(2) + 2.0 * v0 / TIME - GRAVITY[k];
        expected += TIME * (first * first + first * last + last * last) / 3.0;
        let found = solution.trajectory.phases[0].control_at(0.0)[k];
        assert!((found - first).abs() < SOLVER_CONTROL, "{found} {first}");
    }
    let found = solution.trajectory.objective;
    assert!((found - expected).abs() < SOLVER * expected, "{found} {expected}");
}

/// Thrust as the control: position and mass are outputs, and the equation of the mass remains.
#[derive(Clone, Copy)]
struct Lander {
    exhaust_velocity: f64,
}

impl Dynamics<7, 3> for Lander {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 7] {
        let a: [S; 3] = std::array::from_fn(|k| u[k] / x[6] + GRAVITY[k]);
        [x[3], x[4], x[5], a[0], a[1], a[2], -norm(u, 0.0) / self.exhaust_velocity]
    }
}

impl FlatMap<4, 3, 7, 3, 1> for Lander {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 4], _p: &[S; 0]) -> ([S; 7], [S; 3], [S; 1]) {
        let m = y[3];
        let thrust: [S; 3] = std::array::from_fn(|k| m[0] * (y[k][2] - GRAVITY[k]));
        let flow = m[1] + norm(&thrust, 0.0) / self.exhaust_velocity;
        ([y[0][0], y[1][0], y[2][0], y[0][1], y[1][1], y[2][1], m[0]], thrust, [flow])
    }

    fn outputs(&self, _t: f64, x: &[f64; 7], _u: &[f64; 3], _p: &[f64; 0]) -> [f64; 4] {
        [x[0], x[1], x[2], x[6]]
    }
}

struct SquaredThrust;

impl PathFunction<7, 3, 1> for SquaredThrust {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 1] {
        [(u[0].square() + u[1].square() + u[2].square()) * 1e-6]
    }
}

#[test]
fn powered_descent_in_space_with_the_mass() {
    let model = Lander { exhaust_velocity: 225.0 * 9.807 };
    let mass = State::new("mass", "kg").starts_at(1905.0).within(1000.0, 1905.0);
    let states = position_and_speed().into_iter().chain([mass]);
    let phase = Phase::new("descent", model)
        .states(states)
        .controls(["fx", "fy", "fz"].map(|n| Variable::new(n, "N").scaled_by(1e4)))
        .final_time(Bounds::fixed(TIME))
        .integral(Variable::new("square", "kN2 s"), SquaredThrust);
    let ocp = Ocp::builder("descent").phase(phase).minimize_integral("descent", "square").build().unwrap();
    let end = vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1600.0];
    let start = START.into_iter().chain([1905.0]).collect();
    let guess = PhaseGuess::samples(&[0.0, TIME], vec![start, end], vec![vec![0.0, 0.0, 7000.0]; 2]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![guess]);
    let system = FlatSystem::new(model);
    assert_eq!((system.residuals, &system.highest[..]), (1, &[2, 2, 2, 1][..]));
    agree(&ocp, &[system], &guess);
}
