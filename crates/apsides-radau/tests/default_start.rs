//! Problems at default settings from straight lines: starts where nothing depends on a control to first order, maxima, directions.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_nlp::Status;
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::{Radau, RadauSolution};

/// Discretisation: ten times `RadauSettings::tolerance`.
const MESH: f64 = 1e-7;

/// Discretisation: twice `RadauSettings::path_tolerance`.
const BETWEEN_NODES: f64 = 1e-6;

fn solve(ocp: &Ocp) -> RadauSolution {
    let s = Radau::default().solve(ocp, &Guess::linear(ocp)).unwrap();
    assert_eq!(s.status, Status::Optimal, "{}", ocp.name);
    assert!(s.accurate, "{}", ocp.name);
    s
}

fn state(name: &str) -> State {
    State::new(name, "-")
}

fn control(name: &str) -> Variable {
    Variable::new(name, "-")
}

/// A boat in the current `x' = -y`, as angle or direction.
struct Angle;
impl Dynamics<2, 1> for Angle {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [u[0].cos() - x[1], u[0].sin()]
    }
}

struct Direction;
impl Dynamics<2, 2> for Direction {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [u[0] - x[1], u[1]]
    }
}

struct Square;
impl PathFunction<2, 2, 1> for Square {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square()]
    }
}

fn zermelo(phase: Phase) -> Ocp {
    let ends = [state("x").starts_at(3.66).ends_at(0.0), state("y").starts_at(-1.86).ends_at(0.0)];
    let phase = phase.states(ends).final_time(Bounds::at_least(0.0));
    Ocp::builder("zermelo").phase(phase).minimize("time", "-", At::FinalTime("cross")).build().unwrap()
}

/// Least time (A. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 2.7, example 2): the tangent of the angle grows with time
/// from `a` to `b`, `1 / cos(angle) - y` is constant, and the integral of `x'` gives the equation for `a`, here by bisection.
fn zermelo_time() -> f64 {
    let ends = |a: f64| {
        let (from, to) = (-a.hypot(1.0), 1.86 - a.hypot(1.0));
        let b = (to * to - 1.0).sqrt();
        let logarithm = ((to + b) / (from + a)).abs().ln();
        let miss = 0.5 * (logarithm - to * b + from * a) + to * (b - a) + 3.66;
        (miss, b - a)
    };
    let (mut low, mut high) = (-20.0, -2.68);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let same_side = (ends(middle).0 > 0.0) == (ends(low).0 > 0.0);
        if same_side { low = middle } else { high = middle }
    }
    ends(low).1
}

#[test]
fn a_boat_crosses_a_current_from_a_start_across_it() {
    let angle = solve(&zermelo(Phase::new("cross", Angle).controls([control("angle")])));
    let square = [control("square of the direction").equal_to(1.0)];
    let phase = Phase::new("cross", Direction).controls([control("ux"), control("uy")]).path(square, Square);
    let direction = solve(&zermelo(phase));
    for s in [&angle, &direction] {
        let miss = s.trajectory.objective - zermelo_time();
        assert!(miss.abs() < MESH, "{miss:e}");
    }
    // Between its nodes too the direction has length one.
    let p = &direction.trajectory.phases[0];
    for k in 0..=1000 {
        let u = p.control_at(p.final_time * f64::from(k) / 1000.0);
        assert!((u[0].hypot(u[1]) - 1.0).abs() < BETWEEN_NODES, "{u:?}");
    }
}

/// The double integrator from rest to rest with a cost.
struct Cart;
impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

struct Rate;
impl Dynamics<1, 1> for Rate {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// `a u^2 - b x^2` along `x' = u`.
struct Difference(f64, f64);
impl PathFunction<1, 1, 1> for Difference {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * self.0 - x[0].square() * self.1]
    }
}

struct Value;
impl PathFunction<1, 1, 1> for Value {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0]]
    }
}

fn least(phase: Phase, cost: Difference) -> Ocp {
    let phase = phase.integral(control("cost"), cost);
    Ocp::builder("cost").phase(phase).minimize_integral("p", "cost").build().unwrap()
}

/// Between -1 and 1 for a time beyond the conjugate point pi, `x = 0` is stationary and no minimum: `sin t` to the bound, along it, and back gives
/// `pi - T` for `T = 5` (the ends cost nothing: `cos^2 - sin^2` integrates to zero over a quarter of the period).
#[test]
fn an_extremal_beyond_its_conjugate_point_is_left() {
    let x = state("x").within(-1.0, 1.0).starts_at(0.0).ends_at(0.0);
    let phase = Phase::new("p", Rate).states([x]).controls([control("u")]).final_time(Bounds::fixed(5.0));
    let s = solve(&least(phase, Difference(1.0, 1.0)));
    let optimum = std::f64::consts::PI - 5.0;
    assert!((s.trajectory.objective - optimum).abs() < MESH, "{}", s.trajectory.objective);
}

/// Most effort of a control between -1 and 1 that comes back: 1, whatever the number of switches.
#[test]
fn the_greatest_effort_is_not_none() {
    let x = state("x").starts_at(0.0).ends_at(0.0);
    let phase = Phase::new("p", Rate)
        .states([x])
        .controls([control("u").within(-1.0, 1.0)])
        .final_time(Bounds::fixed(1.0));
    let s = solve(&least(phase, Difference(-1.0, 0.0)));
    assert!((s.trajectory.objective + 1.0).abs() < MESH, "{}", s.trajectory.objective);
}

/// The greatest effort without a bound on the control has no greatest value.
#[test]
fn an_unbounded_problem_is_called_diverging() {
    let phase = Phase::new("p", Rate).states([state("x").starts_at(0.0)]).controls([control("u")]);
    let ocp = least(phase.final_time(Bounds::fixed(1.0)), Difference(-1.0, 0.0));
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert_eq!(s.status, Status::Diverging);
}

/// Least effort with the mean of `x` prescribed to vanish: `u = 6 t - 2`, cost 4.
#[test]
fn an_integral_vanishes() {
    let x = state("x").starts_at(0.0).ends_at(1.0);
    let phase = Phase::new("p", Rate).states([x]).controls([control("u")]).final_time(Bounds::fixed(1.0));
    let s = solve(&least(phase.integral(control("mean").equal_to(0.0), Value), Difference(1.0, 0.0)));
    assert!((s.trajectory.objective - 4.0).abs() < MESH, "{}", s.trajectory.objective);
}

/// The start is free: an effort of `u^2 / 2 + 2` per unit of time over the distance 1 costs least in half a unit, 2.
#[test]
fn a_free_start() {
    struct WithTime;
    impl PathFunction<1, 1, 1> for WithTime {
        fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
            [u[0].square() * 0.5 + 2.0]
        }
    }
    let x = state("x").starts_at(0.0).ends_at(1.0);
    let phase = Phase::new("p", Rate)
        .states([x])
        .controls([control("u")])
        .initial_time(Bounds::new(-10.0, 0.9))
        .final_time(Bounds::fixed(1.0))
        .integral(control("cost"), WithTime);
    let ocp = Ocp::builder("free start").phase(phase).minimize_integral("p", "cost").build().unwrap();
    let s = solve(&ocp);
    assert!((s.trajectory.objective - 2.0).abs() < MESH, "{}", s.trajectory.objective);
    assert!((s.trajectory.phases[0].initial_time - 0.5).abs() < MESH.sqrt());
}

/// Fuller's problem (A. Fuller, Study of an optimum non-linear control system, J. Electronics Control 15 (1963)): the control switches
/// infinitely often before the origin, each arc `k` times as long as the one before.
#[test]
fn a_control_that_chatters_takes_few_meshes() {
    struct Square;
    impl PathFunction<2, 1, 1> for Square {
        fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
            [x[0].square()]
        }
    }
    // On the switching curve `x = zeta v^2`; the cost of an arc goes with the fifth power of its speed.
    let zeta = ((33.0_f64.sqrt() - 1.0) / 24.0).sqrt();
    let k = ((0.5 - zeta) / (0.5 + zeta)).sqrt();
    // The integral of (zeta - t + t^2 / 2)^2 over the first arc, of length 1 + k.
    let arc = |t: f64| {
        zeta.powi(2) * t - zeta * t.powi(2) + (1.0 + zeta) * t.powi(3) / 3.0 - t.powi(4) / 4.0
            + t.powi(5) / 20.0
    };
    let optimum = arc(1.0 + k) / (1.0 - k.powi(5));
    let phase = Phase::new("p", Cart)
        .states([state("x").starts_at(zeta).ends_at(0.0), state("v").starts_at(-1.0).ends_at(0.0)])
        .controls([control("u").within(-1.0, 1.0)])
        .final_time(Bounds::fixed(3.0))
        .integral(control("cost"), Square);
    let ocp = Ocp::builder("fuller").phase(phase).minimize_integral("p", "cost").build().unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert_eq!(s.status, Status::Optimal);
    assert!((s.trajectory.objective - optimum).abs() < MESH, "{} {optimum}", s.trajectory.objective);
    assert!(s.meshes.len() <= 6, "{}", s.meshes.len());
}
