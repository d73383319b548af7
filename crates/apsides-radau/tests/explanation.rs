//! Explanations of infeasible problems, with amounts in closed form.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Guess, Mesh, Ocp, OcpError, Phase, State, Variable};
use apsides_radau::{Explanation, Radau, Requirement, RequirementKind, Side};

/// Solver: amounts of the elastic problem, relative, or absolute below one.
const SOLVER: f64 = 1e-3;

/// Solver: the smallest amounts, relative to themselves.
const SMALL: f64 = 1e-2;

/// Iterations times variables of the explanation of a limit; 700 000 where what has no remedy is tried on the last mesh.
const MOST_WORK: usize = 500_000;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

struct Cart;
impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// The square of the acceleration.
struct Load;
impl PathFunction<2, 1, 1> for Load {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}

/// The acceleration.
struct Push;
impl PathFunction<2, 1, 1> for Push {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        *u
    }
}

/// The square of the distance from the middle of the way.
struct Wall;
impl PathFunction<1, 1, 1> for Wall {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(x[0] - S::from(0.5)).square()]
    }
}

struct Walk;
impl Dynamics<1, 1> for Walk {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// From rest to rest over 1 m.
fn cart(time: Bounds) -> Phase {
    Phase::new("move", Cart)
        .states([
            State::new("x", "m").starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("a", "m/s2")])
        .final_time(time)
}

fn fast(phase: Phase) -> Result<Ocp, OcpError> {
    let name = phase.name.clone();
    Ocp::builder("fast").phase(phase).minimize("time", "s", At::FinalTime(&name)).build()
}

fn explained(ocp: &Ocp) -> Explanation {
    let method = Radau::default();
    let guess = Guess::linear(ocp);
    let failed = method.solve(ocp, &guess).unwrap();
    assert!(!failed.status.is_success());
    let mesh = Mesh { phases: failed.trajectory.phases.iter().map(|p| p.mesh.clone()).collect() };
    let found = method.explain(ocp, &Guess::earlier(&failed.trajectory), &mesh).unwrap();
    assert!(found.status.is_success(), "{found}");
    assert!(!found.conflicts.is_empty());
    found
}

/// The bound that a remedy asks for.
#[track_caller]
fn remedy(e: &Explanation, kind: RequirementKind, name: &str, side: Side) -> f64 {
    let fits = |r: &Requirement| (r.kind, r.name.as_str(), r.side) == (kind, name, side);
    let found = e.remedies.iter().find(|r| fits(&r.requirement));
    found.unwrap_or_else(|| panic!("no remedy {kind:?} {name}: {e}")).to
}

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < SOLVER * expected.abs().max(1.0), "{found} instead of {expected}");
}

/// 1 m in 1 s at no more than 0.5 m/s.
#[test]
fn contradictory_ends_and_a_speed_limit() {
    let phase = Phase::new("walk", Walk)
        .states([State::new("x", "m").starts_at(0.0).ends_at(1.0)])
        .controls([Variable::new("v", "m/s").within(-0.5, 0.5)])
        .final_time(Bounds::fixed(1.0));
    let e = explained(&fast(phase).unwrap());
    assert_eq!(e.conflicts.len(), 1, "{e}");
    near(remedy(&e, RequirementKind::Control, "v", Side::Upper), 1.0);
    near(remedy(&e, RequirementKind::FinalTime, "final time", Side::Upper), 2.0);
    near(remedy(&e, RequirementKind::FinalState, "x", Side::Lower), 0.5);
    near(remedy(&e, RequirementKind::InitialState, "x", Side::Upper), 0.5);
    let text = e.to_string();
    assert!(text.contains("phase `walk`: v is raised from 0.5 to 1 m/s"), "{text}");
}

/// Rest to rest over 1 m in 1 s takes 4 m/s2 at least.
#[test]
fn a_path_limit_that_is_too_low() {
    let phase =
        cart(Bounds::fixed(1.0)).path([Variable::new("load", "m2/s4").within(0.0, 9.0).scaled_by(9.0)], Load);
    let e = explained(&fast(phase).unwrap());
    near(remedy(&e, RequirementKind::Path, "load", Side::Upper), 16.0);
    // Rest to rest with 3 m/s2 takes 2 sqrt(1/3) s, and leads 0.75 m far in 1 s.
    near(remedy(&e, RequirementKind::FinalTime, "final time", Side::Upper), 2.0 / 3f64.sqrt());
    near(remedy(&e, RequirementKind::FinalState, "x", Side::Lower), 0.75);
}

/// Rest to rest over 1 m at 1 m/s2 takes 2 s.
#[test]
fn a_flight_time_that_is_too_short() {
    let mut phase = cart(Bounds::new(0.1, 1.5));
    phase.controls[0] = Variable::new("a", "m/s2").within(-1.0, 1.0);
    let e = explained(&fast(phase).unwrap());
    near(remedy(&e, RequirementKind::FinalTime, "final time", Side::Upper), 2.0);
    near(remedy(&e, RequirementKind::FinalState, "x", Side::Lower), 1.5 * 1.5 / 4.0);
}

/// The same limit as bounds on the duration of a phase that may start when it wants.
#[test]
fn a_duration_that_is_too_short() {
    let mut phase = cart(Bounds::new(1.0, 9.0)).initial_time(Bounds::new(0.0, 3.0));
    phase = phase.duration(Bounds::new(0.1, 1.5));
    phase.controls[0] = Variable::new("a", "m/s2").within(-1.0, 1.0);
    let e = explained(&fast(phase).unwrap());
    near(remedy(&e, RequirementKind::Duration, "duration", Side::Upper), 2.0);
}

/// Two phases with limits of their own that are too low: both are named, and none helps alone.
#[test]
fn independent_conflicts_have_no_single_remedy() {
    let walk = |name: &str, limit: f64| {
        Phase::new(name, Walk)
            .states([State::new(format!("x {name}"), "m").starts_at(0.0).ends_at(1.0)])
            .controls([Variable::new("v", "m/s").within(-limit, limit)])
            .final_time(Bounds::fixed(1.0))
    };
    let ocp = Ocp::builder("two")
        .phase(walk("one", 0.6))
        .phase(walk("two", 0.8))
        .minimize("time", "s", At::FinalTime("one"))
        .build()
        .unwrap();
    let e = explained(&ocp);
    assert!(e.remedies.is_empty(), "{e}");
    let mut amounts: Vec<(&str, f64)> = Vec::new();
    for c in &e.conflicts {
        assert_eq!(c.requirement.kind, RequirementKind::Control, "{e}");
        amounts.push((c.requirement.phase.as_deref().unwrap(), c.amount));
    }
    amounts.sort_by(|a, b| a.0.cmp(b.0));
    assert_eq!(amounts.len(), 2, "{e}");
    near(amounts[0].1, 0.4);
    near(amounts[1].1, 0.2);
    assert!(e.to_string().contains("no single relaxation"), "{e}");
}

/// Rest to rest over 1 m in 1 s takes 1 / V + V / A = 1.0115 s with the limits V = 1.5 m/s and A = 4.35 m/s2.
///
/// Relative to the scales below, what is missing is 0.083 of the speed (to V^2 - A V + A = 0), 0.069 of the acceleration,
/// half of it forwards and half backwards (to A = 4.5 m/s2), or 0.011 of the time.
fn too_slow(time: Bounds) -> Phase {
    let mut phase = cart(time);
    phase.states[1] = State::new("v", "m/s").within(-1.5, 1.5).scaled_by(0.7).starts_at(0.0).ends_at(0.0);
    phase
}

fn acceleration() -> Variable {
    Variable::new("a", "m/s2").within(-4.35, 4.35).scaled_by(4.35)
}

fn conflicting(phase: Phase) -> (Explanation, Vec<RequirementKind>) {
    let e = explained(&fast(phase).unwrap());
    let kinds = e.conflicts.iter().map(|c| c.requirement.kind).collect();
    (e, kinds)
}

/// Bounds on a control and a fixed time give way last, though less of them is missing.
#[test]
fn a_limit_is_named_before_a_control_and_a_fixed_time() {
    let mut phase = too_slow(Bounds::fixed(1.0));
    phase.controls[0] = acceleration();
    let (e, kinds) = conflicting(phase);
    assert_eq!(kinds, [RequirementKind::State], "{e}");
    near(e.conflicts[0].amount, 0.5 * (4.35 - (4.35_f64 * 0.35).sqrt()) - 1.5);
}

/// The same limit on the acceleration as a path constraint, which is no bound on a control.
#[test]
fn a_limit_that_is_no_bound_on_a_control_is_named_first() {
    let phase = too_slow(Bounds::fixed(1.0)).path([acceleration()], Push);
    let (e, kinds) = conflicting(phase);
    assert_eq!(kinds, [RequirementKind::Path; 2], "{e}");
    near(e.conflicts.iter().map(|c| c.amount).sum(), 0.3);
}

/// The same time as an upper bound, which is not meant as exactly.
#[test]
fn a_time_that_is_not_fixed_is_named_first() {
    let mut phase = too_slow(Bounds::new(0.1, 1.0));
    phase.controls[0] = acceleration();
    let (e, kinds) = conflicting(phase);
    assert_eq!(kinds, [RequirementKind::FinalTime], "{e}");
    near(e.conflicts[0].amount, 1.0 / 1.5 + 1.5 / 4.35 - 1.0);
}

/// A feasible problem has no conflict.
#[test]
fn nothing_to_explain() {
    let ocp = fast(cart(Bounds::fixed(1.0))).unwrap();
    let method = Radau::default();
    let e = method.explain(&ocp, &Guess::linear(&ocp), &Mesh::uniform(&ocp, 4, 3).unwrap()).unwrap();
    assert!(e.conflicts.is_empty() && e.remedies.is_empty(), "{e}");
}

/// 1 s at no more than 0.5 m/s, to a place that is `beyond` 0.5 m.
fn walk(beyond: f64) -> Ocp {
    let phase = Phase::new("walk", Walk)
        .states([State::new("x", "m").starts_at(0.0).ends_at(0.5 + beyond)])
        .controls([Variable::new("v", "m/s").within(-0.5, 0.5)])
        .final_time(Bounds::fixed(1.0));
    fast(phase).unwrap()
}

fn explained_from_straight_lines(ocp: &Ocp) -> Explanation {
    let method = Radau::default();
    method.explain(ocp, &Guess::linear(ocp), &Mesh::uniform(ocp, 4, 3).unwrap()).unwrap()
}

/// A requirement that is missed by a part in a million is missed: the size is said, and no trajectory is claimed.
#[test]
fn a_conflict_of_a_millionth_is_named_with_its_size() {
    for beyond in [5e-7, 5e-8] {
        let e = explained_from_straight_lines(&walk(beyond));
        let total: f64 = e.conflicts.iter().map(|c| c.amount).sum();
        assert!((total - beyond).abs() < SMALL * beyond, "{e}");
        assert!(!e.to_string().contains("exists"), "{e}");
        let lowered = format!("final x is lowered from {} to 0.5 m", 0.5 + beyond);
        assert!(e.to_string().contains(&lowered), "{e}");
    }
}

/// A requirement with a thousandth of a millionth to spare is met.
#[test]
fn a_margin_of_a_billionth_is_no_conflict() {
    let e = explained_from_straight_lines(&walk(-1e-9));
    assert!(e.conflicts.is_empty() && e.remedies.is_empty(), "{e}");
    assert!(e.to_string().contains("a feasible trajectory exists"), "{e}");
}

/// Where the relaxation is not exact enough to tell, nothing is claimed.
#[test]
fn without_exact_amounts_no_trajectory_is_claimed() {
    let e = Explanation { resolution: 1e-5, ..explained_from_straight_lines(&walk(-1e-9)) };
    assert!(!e.to_string().contains("exists") && e.to_string().contains("1e-5"), "{e}");
}

/// Rest to rest over 5 m in 2 s at no more than 2 m/s and 10 m/s2 takes the speed of the trapezium `V (2 - V/10) = 5`. A candidate that is no
/// remedy is refused on a coarse mesh.
#[test]
fn candidates_are_tried_on_a_coarse_mesh() {
    let phase = Phase::new("a", Cart)
        .states([
            State::new("x", "m").starts_at(0.0).ends_at(5.0),
            State::new("v", "m/s").at_most(2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("u", "m/s2").within(-10.0, 10.0)])
        .final_time(Bounds::fixed(2.0));
    let e = explained(&fast(phase).unwrap());
    near(remedy(&e, RequirementKind::State, "v", Side::Upper), 10.0 - 50f64.sqrt());
    let work: usize = e.meshes.iter().map(|m| m.counters.iterations * m.counters.variables).sum();
    assert!(work < MOST_WORK, "{work}");
}

/// The straight line from 0 to 1 m with v = 0 misses the first equation of motion by the speed it lacks.
#[test]
fn residuals_of_a_guess_by_name() {
    let ocp = fast(cart(Bounds::fixed(1.0))).unwrap();
    let mesh = Mesh::uniform(&ocp, 4, 3).unwrap();
    let worst = Radau::default().guess_residuals(&ocp, &Guess::linear(&ocp), &mesh, 8).unwrap();
    assert_eq!(worst.len(), 1, "{worst:?}");
    assert_eq!(worst[0].origin.name, "equation of motion of x");
    // On an interval of a quarter: dx/dtau = 1/8.
    assert!((worst[0].amount - 0.125).abs() < ROUNDING, "{worst:?}");
}

/// From one side of a wall to the other: points of a mesh leap over it, and a thinner wall is no help, as its middle has to be passed.
#[test]
fn leaps_between_points_are_no_remedy() {
    let phase = Phase::new("walk", Walk)
        .states([State::new("x", "m").starts_at(0.0).ends_at(1.0)])
        .controls([Variable::new("v", "m/s").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.1, 3.0))
        .path([Variable::new("wall", "m2").at_least(0.01)], Wall);
    let ocp = fast(phase).unwrap();
    let method = Radau::default();
    let mesh = Mesh::uniform(&ocp, 10, 4).unwrap();
    let e = method.explain(&ocp, &Guess::linear(&ocp), &mesh).unwrap();
    for remedy in e.remedies.iter().filter(|remedy| remedy.shown_with.is_some()) {
        let r = &remedy.requirement;
        match r.kind {
            RequirementKind::Path => assert!(remedy.to < SMALL * 0.01, "{e}"),
            RequirementKind::FinalState => assert!(remedy.to <= 0.4 + SOLVER, "{e}"),
            RequirementKind::InitialState => assert!(remedy.to >= 0.6 - SOLVER, "{e}"),
            _ => panic!("{e}"),
        }
    }
}
