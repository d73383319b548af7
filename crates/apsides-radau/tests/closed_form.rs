//! Problems with a closed-form optimum: objective, costates, multi-phase links, free times, parameters.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_nlp::Status;
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, Sense, State, Term, Variable};
use apsides_radau::{Radau, RadauSettings, Transcription};

/// Solver: objectives of polynomials that the mesh contains, `NlpSettings::tolerance`.
const SOLVER: f64 = 1e-8;

/// Solver: controls and costates, which enter the objective by their squares.
const SOLVER_POINT: f64 = 1e-6;

/// Solver: the multiplier of a link, whose size is twelve.
const SOLVER_LINK: f64 = 1e-5;

/// Solver: least time with a switch.
const SOLVER_SWITCH: f64 = 1e-7;

/// Solver: a parameter that the boundary conditions determine.
const SOLVER_PARAMETER: f64 = 1e-10;

struct Cart;
impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

struct Effort;
impl PathFunction<2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5]
    }
}

fn cart(name: &str) -> Phase {
    Phase::new(name, Cart)
        .states([State::new("x", "m"), State::new("v", "m/s")])
        .controls([Variable::new("a", "m/s2")])
        .integral(Variable::new("effort", "m2/s3"), Effort)
}

/// Least effort from rest to rest over 1 m in 1 s: u = 6 - 12 t, J = 6, lambda_x = -12, lambda_v = -u.
#[test]
fn costates_of_the_double_integrator() {
    let mut phase = cart("move").final_time(Bounds::fixed(1.0));
    phase.states[0] = State::new("x", "m").starts_at(0.0).ends_at(1.0);
    phase.states[1] = State::new("v", "m/s").starts_at(0.0).ends_at(0.0);
    let ocp = Ocp::builder("cart").phase(phase).minimize_integral("move", "effort").build().unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert_eq!(s.status, Status::Optimal);
    assert!((s.trajectory.objective - 6.0).abs() < 0.1 * SOLVER, "{}", s.trajectory.objective);
    let p = &s.trajectory.phases[0];
    let costate = p.costate.as_ref().unwrap();
    let mut lambda = [0.0; 2];
    for t in [0.0, 0.13, 0.5, 0.77, 1.0] {
        let u = p.control_at(t)[0];
        assert!((u - (6.0 - 12.0 * t)).abs() < SOLVER_POINT, "u({t}) = {u}");
        costate.evaluate(t, &mut lambda);
        assert!((lambda[0] + 12.0).abs() < SOLVER_POINT, "{lambda:?}");
        assert!((lambda[1] + u).abs() < SOLVER_POINT, "{lambda:?} {u}");
    }
}

/// The same manoeuvre cut into two linked phases with a free time between them.
#[test]
fn two_linked_phases_make_one() {
    let mut first = cart("first").final_time(Bounds::fixed(0.4));
    first.states[0] = State::new("x", "m").starts_at(0.0);
    first.states[1] = State::new("v", "m/s").starts_at(0.0);
    let mut second = cart("second").initial_time(Bounds::new(0.1, 0.9)).final_time(Bounds::fixed(1.0));
    second.states[0] = State::new("x", "m").ends_at(1.0);
    second.states[1] = State::new("v", "m/s").ends_at(0.0);
    let ocp = Ocp::builder("cart in two")
        .phase(first)
        .phase(second)
        .link("first", "second")
        .objective(
            apsides_ocp::Sense::Minimize,
            "effort",
            "m2/s3",
            [
                apsides_ocp::Term::Integral("first", "effort", 1.0),
                apsides_ocp::Term::Integral("second", "effort", 1.0),
            ],
        )
        .build()
        .unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!((s.trajectory.objective - 6.0).abs() < SOLVER);
    assert!((s.trajectory.phases[1].initial_time - 0.4).abs() < 0.1 * SOLVER);
    // Multiplier of the link of x is the costate there.
    let nu = s.trajectory.constraint_multipliers.as_ref().unwrap();
    assert!((nu[1][0].abs() - 12.0).abs() < SOLVER_LINK, "{nu:?}");
}

/// Minimum time over 1 m with |a| <= 1: 2 s, switch in the middle, H = 0 with lambda scaled to time.
#[test]
fn minimum_time_with_bang_bang_control() {
    let mut phase = cart("move").final_time(Bounds::new(0.5, 10.0));
    phase.states[0] = State::new("x", "m").starts_at(0.0).ends_at(1.0);
    phase.states[1] = State::new("v", "m/s").starts_at(0.0).ends_at(0.0);
    phase.controls[0] = Variable::new("a", "m/s2").within(-1.0, 1.0);
    let ocp =
        Ocp::builder("fast cart").phase(phase).minimize("time", "s", At::FinalTime("move")).build().unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!((s.trajectory.objective - 2.0).abs() < SOLVER_SWITCH, "{}", s.trajectory.objective);
}

/// A static parameter as the only unknown: x' = p x, x(1) = 2 needs p = ln 2.
struct Growth;
impl Dynamics<1, 0, 1> for Growth {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], _u: &[S; 0], p: &[S; 1]) -> [S; 1] {
        [x[0] * p[0]]
    }
}

#[test]
fn static_parameter() {
    let phase = Phase::new("grow", Growth)
        .states([State::new("x", "-").starts_at(1.0).ends_at(2.0)])
        .final_time(Bounds::fixed(1.0));
    let ocp = Ocp::builder("growth")
        .parameter(Variable::new("rate", "1/s").within(0.0, 5.0))
        .phase(phase)
        .minimize("rate", "1/s", At::Parameter("rate"))
        .build()
        .unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert_eq!(s.status, Status::Optimal);
    assert!((s.trajectory.parameters[0] - std::f64::consts::LN_2).abs() < SOLVER_PARAMETER);
}

/// Explicit time, integral bound, path constraint, endpoint function: every kind of derivative at once.
struct Everything;
impl Dynamics<2, 1, 1> for Everything {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[1] * (t * x[0]).sin() + p[0] * u[0], u[0].exp() * t.square() - x[0] * x[1] * p[0]]
    }
}
impl PathFunction<2, 1, 2, 1> for Everything {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[0] * u[0] + t.square(), p[0] * x[1].cos() * t]
    }
}
impl PathFunction<2, 1, 1, 1> for Everything {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 1] {
        [(x[0] * t).exp() + u[0] * x[1] * p[0]]
    }
}
impl VectorFunction<4, 1> for Everything {
    fn evaluate<S: Scalar>(&self, z: &[S; 4]) -> [S; 1] {
        [z[0] * z[1].sin() + z[2].exp() * z[3]]
    }
}

#[test]
fn derivatives_of_the_transcription_agree_with_differences() {
    let phase = Phase::new("all", Everything)
        .states([State::new("a", "-"), State::new("b", "-")])
        .controls([Variable::new("u", "-")])
        .initial_time(Bounds::new(0.0, 0.5))
        .final_time(Bounds::new(0.6, 3.0))
        .duration(Bounds::new(0.2, 2.0))
        .path::<_, 2, 1, 2, 1>(
            [Variable::new("c", "-").at_most(9.0), Variable::new("d", "-").at_least(-9.0)],
            Everything,
        )
        .integral(Variable::new("q", "-").at_most(50.0), Everything);
    let at =
        || [At::InitialTime("all"), At::FinalTime("all"), At::FinalState("all", "a"), At::Parameter("p")];
    let ocp = Ocp::builder("everything")
        .parameter(Variable::new("p", "-").within(0.1, 2.0))
        .phase(phase)
        .constrain("ends", [Variable::new("e", "-").at_most(4.0)], at(), Everything)
        .objective(
            apsides_ocp::Sense::Maximize,
            "mixed",
            "-",
            [
                apsides_ocp::Term::Integral("all", "q", 0.7),
                apsides_ocp::Term::function(at(), Everything),
                apsides_ocp::Term::End(At::InitialState("all", "b"), 2.0),
            ],
        )
        .build()
        .unwrap();
    let mesh = apsides_ocp::Mesh {
        phases: vec![apsides_ocp::PhaseMesh::new(vec![0.0, 0.3, 1.0], vec![2, 3]).unwrap()],
    };
    let mut nlp = Transcription::new(&ocp, &mesh, &Guess::linear(&ocp)).unwrap();
    let n = apsides_nlp::Nlp::variables(&nlp);
    let x: Vec<f64> = (0..n).map(|k| 0.4 + 0.3 * (1.7 * k as f64).sin()).collect();
    let report = apsides_nlp::check_derivatives(&mut nlp, &x).unwrap();
    assert!(report.is_within(1e-6), "{report:?}");
}

#[test]
fn ill_posed_settings_are_refused() {
    let mut phase = cart("move").final_time(Bounds::fixed(1.0));
    phase.states[0] = State::new("x", "m").starts_at(0.0);
    let ocp = Ocp::builder("c").phase(phase).minimize_integral("move", "effort").build().unwrap();
    for settings in [
        RadauSettings { intervals: 0, ..Default::default() },
        RadauSettings { points: 61, ..Default::default() },
        RadauSettings { tolerance: f64::NAN, ..Default::default() },
        RadauSettings { max_refinements: 1000, ..Default::default() },
    ] {
        assert!(Radau { settings }.solve(&ocp, &Guess::linear(&ocp)).is_err());
    }
}

/// A solve that failed early may end where a phase does not last: the trajectory is then that of the start.
#[test]
fn a_point_without_duration_is_replaced_by_the_start() {
    let phase = cart("move").final_time(Bounds::new(0.5, 10.0));
    let ocp = Ocp::builder("c").phase(phase).minimize("time", "s", At::FinalTime("move")).build().unwrap();
    let guess = Guess::linear(&ocp);
    let mesh = apsides_ocp::Mesh::uniform(&ocp, 2, 3).unwrap();
    let mut nlp = Transcription::new(&ocp, &mesh, &guess).unwrap();
    let mut report = apsides_nlp::InteriorPoint::default().solve(&mut nlp).unwrap();
    for broken in [0.0, f64::NAN] {
        report.x.fill(broken);
        let t = nlp.trajectory(&ocp, &report).unwrap();
        assert_eq!(t.phases[0].final_time, guess.phases[0].final_time);
    }
}

struct Line;
impl Dynamics<1, 1> for Line {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}
struct Square;
impl PathFunction<1, 1, 1> for Square {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}
struct Height;
impl PathFunction<1, 1, 1> for Height {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0]]
    }
}
struct EffortPerSquaredArea;
impl VectorFunction<2, 1> for EffortPerSquaredArea {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] / z[1].square()]
    }
}

/// Effort over the square of the area below the curve: u = 2 (1 - t), J = 3, and the costates of the two integrals are the derivatives of
/// the objective, `1 / area^2 = 9/4` and `-2 effort / area^3 = -9`.
#[test]
fn a_ratio_of_integrals() {
    let phase = Phase::new("a", Line)
        .states([State::new("x", "m").starts_at(0.0).ends_at(1.0)])
        .controls([Variable::new("u", "m/s")])
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("effort", "m2/s"), Square)
        .integral(Variable::new("area", "m s"), Height);
    let ratio =
        Term::function([At::Integral("a", "effort"), At::Integral("a", "area")], EffortPerSquaredArea);
    let ocp =
        Ocp::builder("ratio").phase(phase).objective(Sense::Minimize, "ratio", "-", [ratio]).build().unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert_eq!(s.status, Status::Optimal);
    assert!((s.trajectory.objective - 3.0).abs() < SOLVER, "{}", s.trajectory.objective);
    let p = &s.trajectory.phases[0];
    for t in [0.0, 0.3, 1.0] {
        assert!((p.control_at(t)[0] - 2.0 * (1.0 - t)).abs() < SOLVER_POINT, "{t}");
        let mut costate = [0.0; 3];
        p.costate.as_ref().unwrap().evaluate(t, &mut costate);
        assert!(
            (costate[1] - 2.25).abs() < SOLVER_POINT && (costate[2] + 9.0).abs() < SOLVER_POINT,
            "{costate:?}"
        );
    }
}
