//! Problems that cannot be solved: what the explanation asks for is right, by an independent computation.
#![allow(clippy::unwrap_used)]

use apsides::ad::{Dynamics, PathFunction, Scalar};
use apsides::ocp::{At, Bounds, Guess, Mesh, Ocp, Phase, State, Variable};
use apsides::radau::{Explanation, Radau, RadauSettings, RadauSolution};
use apsides_problems::{Case, shuttle_heat_limit};

/// Relative agreement of a limit with the independent value.
const AGREEMENT: f64 = 1e-3;

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= AGREEMENT * expected.abs(), "{found}, expected {expected}");
}

fn explained(ocp: &Ocp, solution: &RadauSolution, radau: &Radau) -> Explanation {
    let meshes = solution.trajectory.phases.iter().map(|p| p.mesh.clone());
    let mesh = Mesh { phases: meshes.collect() };
    radau.explain(ocp, &Guess::earlier(&solution.trajectory), &mesh).unwrap()
}

/// The peak of the heating rate, BTU/ft2/s, when the entry begins with the largest lift, upwards: this least heated
/// attitude decides the first peak, and the later ones can be kept lower. Fourth-order Runge-Kutta method.
fn peak_with_full_lift(case: &Case) -> f64 {
    let phase = &case.ocp.phases[0];
    let attack = 90.0_f64.to_radians();
    let inputs = |x: &[f64; 6]| [x[0], x[1], x[2], x[3], x[4], x[5], attack, 0.0, 0.0];
    let rate = |x: &[f64; 6]| {
        let mut f = [0.0; 6];
        phase.dynamics.value(&inputs(x), &mut f);
        f
    };
    let ahead = |x: &[f64; 6], f: &[f64; 6], h: f64| std::array::from_fn::<f64, 6, _>(|k| x[k] + h * f[k]);
    let mut x = [260_000.0, 0.0, 0.0, 25_600.0, -1.0_f64.to_radians(), attack];
    let step = 0.01;
    let mut peak = 0.0_f64;
    for _ in 0..4000 {
        let mut heating = [0.0];
        phase.path[0].function.value(&inputs(&x), &mut heating);
        peak = peak.max(heating[0]);
        let a = rate(&x);
        let b = rate(&ahead(&x, &a, 0.5 * step));
        let c = rate(&ahead(&x, &b, 0.5 * step));
        let d = rate(&ahead(&x, &c, step));
        x = std::array::from_fn(|k| x[k] + step / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]));
    }
    peak
}

/// The least peak heating rate of any entry, as an optimal control problem.
fn least_peak() -> f64 {
    let case = shuttle_heat_limit::pose_least_peak().unwrap();
    let settings = RadauSettings { tolerance: 1e-6, ..RadauSettings::default() };
    let solution = Radau { settings }.solve(&case.ocp, &case.guess).unwrap();
    assert!(solution.status.is_success());
    solution.trajectory.objective
}

#[test]
fn a_heating_limit_that_no_entry_keeps() {
    let case = shuttle_heat_limit::pose_with_limit("entry_too_cold", 5.0).unwrap();
    let radau = Radau::default();
    let solution = radau.solve(&case.ocp, &case.guess).unwrap();
    assert!(!solution.status.is_success());
    let why = explained(&case.ocp, &solution, &radau);
    assert_eq!(why.conflicts[0].requirement.name, "heating rate", "{why}");
    let remedy = why.remedies.iter().find(|r| r.requirement.name == "heating rate").unwrap();
    let peak = peak_with_full_lift(&case);
    near(peak, 22.430_125);
    near(least_peak(), peak);
    near(remedy.to, peak);
}

/// With a limit a little above the least one there is an entry; a little below there is none.
#[test]
fn the_least_heating_limit_separates() {
    let radau = Radau { settings: RadauSettings { max_refinements: 0, ..RadauSettings::default() } };
    for (limit, possible) in [(22.43 * 1.02, true), (22.43 * 0.98, false)] {
        let case = shuttle_heat_limit::pose_with_limit("entry_at_the_limit", limit).unwrap();
        let why = radau.explain(&case.ocp, &case.guess, &Mesh::uniform(&case.ocp, 20, 8).unwrap()).unwrap();
        assert!(why.status.is_success(), "{why}");
        assert_eq!(why.conflicts.is_empty(), possible, "{limit}: {why}");
    }
}

struct Cart;

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

struct Speed;

impl PathFunction<2, 1, 2> for Speed {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], x[1]]
    }
}

/// A least and a largest speed that exclude each other by 0.2 m/s.
#[test]
fn two_path_constraints_that_exclude_each_other() {
    let rows = [
        Variable::new("cruise speed", "m/s").at_least(0.7),
        Variable::new("speed limit", "m/s").at_most(0.5),
    ];
    let phase = Phase::new("drive", Cart)
        .states([
            State::new("x", "m").starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").within(-10.0, 10.0),
        ])
        .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
        .path(rows, Speed)
        .final_time(Bounds::new(0.1, 10.0));
    let ocp =
        Ocp::builder("exclusive").phase(phase).minimize("time", "s", At::FinalTime("drive")).build().unwrap();
    let radau = Radau::default();
    let solution = radau.solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(!solution.status.is_success());
    let why = explained(&ocp, &solution, &radau);
    assert_eq!(why.conflicts.len(), 1, "{why}");
    near(why.conflicts[0].amount, 0.2);
    let to = |name: &str| why.remedies.iter().find(|r| r.requirement.name == name).unwrap().to;
    near(to("cruise speed"), 0.5);
    near(to("speed limit"), 0.7);
}

/// A final position beyond the bound of the state: both are named.
#[test]
fn an_end_beyond_a_bound() {
    let phase = Phase::new("drive", Cart)
        .states([
            State::new("x", "m").within(-1.0, 1.0).starts_at(0.0),
            State::new("v", "m/s").within(-10.0, 10.0),
        ])
        .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.1, 10.0));
    let ocp = Ocp::builder("beyond")
        .phase(phase)
        .constrain(
            "arrival",
            [Variable::new("position", "m").at_least(1.3)],
            [At::FinalState("drive", "x")],
            Position,
        )
        .minimize("time", "s", At::FinalTime("drive"))
        .build()
        .unwrap();
    let radau = Radau::default();
    let solution = radau.solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(!solution.status.is_success());
    let why = explained(&ocp, &solution, &radau);
    near(why.conflicts[0].amount, 0.3);
    let to = |name: &str| why.remedies.iter().find(|r| r.requirement.name == name).unwrap().to;
    near(to("x"), 1.3);
    near(to("arrival: position"), 1.0);
}

struct Position;

impl apsides::ad::VectorFunction<1, 1> for Position {
    fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
        *z
    }
}
