//! Angles that may turn on past their bounds, and come back between them.
#![allow(clippy::unwrap_used)]

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use apsides_ad::{Dynamics, Scalar};
use apsides_basis::Barycentric;
use apsides_ocp::{
    At, Bounds, Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, State, Trajectory,
    Turns, Variable,
};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// A thrust in a plane, of which a spin takes twice the angle.
struct Plane;
impl Dynamics<2, 1> for Plane {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [u[0].cos() + (u[0] * 2.0).sin() * x[1], u[0].sin()]
    }
}
/// A cosine alone.
struct Line;
impl Dynamics<2, 1> for Line {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [u[0].cos() + x[1], u[0].cos()]
    }
}

fn problem<D: Dynamics<2, 1> + Send + Sync + 'static>(dynamics: D, angle: [f64; 2]) -> Ocp {
    let phase = Phase::new("go", dynamics)
        .states([State::new("x", "m"), State::new("y", "m")])
        .controls([Variable::new("angle", "rad").within(angle[0], angle[1])])
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("p").phase(phase).minimize("x", "m", At::FinalState("go", "x")).build().unwrap()
}

#[test]
fn bounds_are_wider_by_a_turn_where_they_leave_one() {
    let turns = Turns::of(&problem(Plane, [-PI, PI])).unwrap();
    let Bounds { lower, upper } = turns.ocp.phases[0].controls[0].bounds;
    assert!((lower + 3.0 * PI).abs() < ROUNDING && (upper - 3.0 * PI).abs() < ROUNDING, "{lower} {upper}");
    assert!(Turns::of(&problem(Plane, [-PI, 0.9 * PI])).is_none());
    assert!(Turns::of(&problem(Plane, [f64::NEG_INFINITY, PI])).is_none());
    assert!(Turns::of(&problem(Line, [-PI, PI])).is_none());
}

#[test]
fn an_angle_that_turned_on_comes_back_with_an_end_where_it_passed() {
    let posed = problem(Plane, [-PI, PI]);
    let turns = Turns::of(&posed).unwrap();
    // From 3 rad at a constant rate to 5 rad, past pi on the way.
    let line = |dimension: usize, values: Vec<f64>| {
        let basis = Arc::new(Barycentric::new(&[-1.0, 1.0]).unwrap());
        PiecewisePolynomial::new(dimension, vec![0.0, 1.0], vec![Segment { basis, values }]).unwrap()
    };
    let phase = PhaseTrajectory {
        name: "go".into(),
        initial_time: 0.0,
        final_time: 1.0,
        mesh: PhaseMesh::uniform(1, 2).unwrap(),
        state: line(2, vec![0.0, 0.0, 1.0, 2.0]),
        control: line(1, vec![3.0, 5.0]),
        costate: None,
        path_multipliers: None,
        contacts: Vec::new(),
        integral_multipliers: None,
        interval_errors: vec![0.0],
    };
    let wider =
        Trajectory { phases: vec![phase], parameters: vec![], objective: 1.0, constraint_multipliers: None };
    assert!(turns.are_stopped(&wider));
    let back = turns.as_posed(&wider).unwrap();
    let control = &back.phases[0].control;
    assert_eq!(control.segments().len(), 2);
    assert!((control.breaks()[1] - 0.5 * (PI - 3.0)).abs() < ROUNDING, "{:?}", control.breaks());
    for (t, expected) in [(0.05, 3.1), (0.5, 4.0 - TAU), (1.0, 5.0 - TAU)] {
        let mut u = [0.0];
        control.evaluate(t, &mut u);
        assert!((u[0] - expected).abs() < ROUNDING, "{t} {u:?}");
    }
}

/// Between -4 and 4 an angle may go back by a turn from any value above `4 - pi`, before it comes to a bound.
#[test]
fn an_angle_that_leaps_by_a_turn_is_stopped() {
    let turns = Turns::of(&problem(Plane, [-4.0, 4.0])).unwrap();
    let stops = |leap: f64, end: f64| {
        let basis = Arc::new(Barycentric::new(&[-1.0, 1.0]).unwrap());
        let line = |values: Vec<f64>| Segment { basis: Arc::clone(&basis), values };
        let control = vec![line(vec![3.0, 3.5]), line(vec![3.5, 3.5 - leap]), line(vec![3.5 - leap; 2])];
        let state = (0..3).map(|_| line(vec![0.0; 4])).collect();
        let breaks = vec![0.0, 0.5, end, 1.0];
        let phase = PhaseTrajectory {
            name: "go".into(),
            initial_time: 0.0,
            final_time: 1.0,
            mesh: PhaseMesh::new(breaks.clone(), vec![2; 3]).unwrap(),
            state: PiecewisePolynomial::new(2, breaks.clone(), state).unwrap(),
            control: PiecewisePolynomial::new(1, breaks, control).unwrap(),
            costate: None,
            path_multipliers: None,
            contacts: Vec::new(),
            integral_multipliers: None,
            interval_errors: vec![0.0; 3],
        };
        let phases = vec![phase];
        turns.are_stopped(&Trajectory {
            phases,
            parameters: vec![],
            objective: 1.0,
            constraint_multipliers: None,
        })
    };
    assert!(stops(TAU, 0.51));
    // A thrust that turns round, and one that takes its time.
    assert!(!stops(PI, 0.51));
    assert!(!stops(TAU, 0.6));
}
