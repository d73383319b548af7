//! Ill-posed problems are refused by name; guesses, meshes, scales and polynomials do what they say.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use apsides_ad::{Dynamics, Scalar, VectorFunction};
use apsides_basis::Barycentric;
use apsides_ocp::{
    At, Bounds, EndpointInput, Guess, Mesh, Ocp, OcpBuilder, OcpError, Phase, PhaseGuess, PhaseMesh,
    PiecewisePolynomial, Scaling, Segment, Sense, State, Term, Variable,
};
use proptest::prelude::*;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// Round-off at ends that a swing leaves as they are.
const ROUNDING_OF_ENDS: f64 = 1e-12;

/// Discretisation: a hundred steps of order four.
const RUNGE_KUTTA: f64 = 1e-6;

/// Round-off of numbers of some millions.
const ROUNDING_OF_MILLIONS: f64 = 1e-9;

struct Cart;
impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}
struct Sum;
impl VectorFunction<2, 1> for Sum {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] + z[1]]
    }
}

fn cart(name: &str) -> Phase {
    Phase::new(name, Cart)
        .states([State::new("x", "m").within(-1.0, 5.0), State::new("v", "m/s")])
        .controls([Variable::new("a", "m/s2").within(-2.0, 2.0)])
        .final_time(Bounds::new(1.0, 9.0))
}

fn problem(phase: Phase) -> OcpBuilder {
    Ocp::builder("p").phase(phase).minimize("time", "s", At::FinalTime("go"))
}

fn refusal(builder: OcpBuilder) -> String {
    builder.build().map(|_| ()).unwrap_err().to_string()
}

#[test]
fn missing_parts() {
    assert_eq!(refusal(Ocp::builder("p")), "problem `p` has no phase: add at least one with `phase`");
    let silent = Ocp::builder("p").phase(cart("go"));
    assert_eq!(refusal(silent), "problem `p` has no objective: state one with `objective`");
    let mut one_state = cart("go");
    one_state.states.pop();
    assert_eq!(
        refusal(problem(one_state)),
        "phase `go`: expected 2 states (one per equation of motion), found 1"
    );
    let mut no_control = cart("go");
    no_control.controls.clear();
    assert!(refusal(problem(no_control)).contains("inputs (states, controls, all parameters or none, time)"));
}

#[test]
fn names_must_exist_and_differ() {
    assert_eq!(
        refusal(problem(
            cart("go")
                .controls([Variable::new("a", "m/s2")])
                .states([State::new("x", "m"), State::new("x", "m")])
        )),
        "phase `go`: the state name `x` is used twice"
    );
    assert_eq!(
        refusal(Ocp::builder("p").phase(cart("go")).maximize("speed", "m/s", At::FinalState("go", "speed"))),
        "objective `speed`, phase `go`: no state is named `speed`; known: `x`, `v`"
    );
    assert_eq!(
        refusal(problem(cart("go")).link("go", "stop")),
        "constraint `link go-stop`: no phase is named `stop`; known: `go`"
    );
    let parameter = At::Parameter("k");
    assert!(refusal(problem(cart("go")).minimize("k", "-", parameter)).ends_with("known: none"));
    assert!(refusal(problem(cart("go")).phase(cart("go"))).contains("phase name `go` is used twice"));
    let integral = problem(cart("go")).minimize_integral("go", "fuel");
    assert!(refusal(integral).contains("no integral is named `fuel`"));
}

#[test]
fn bounds_must_be_intervals() {
    let with_x = |x: State| problem(cart("go").states([x, State::new("v", "m/s")]));
    for bad in [(2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN), (f64::INFINITY, f64::INFINITY)] {
        let message = refusal(with_x(State::new("x", "m").within(bad.0, bad.1)));
        assert!(message.starts_with("phase `go`, state `x`: bounds ["), "{message}");
    }
    assert_eq!(
        refusal(with_x(State::new("x", "m").within(0.0, 1.0).ends_at(3.0))),
        "phase `go`, state `x` at its end: [3, 3] m has no value in common with the bounds along the phase, [0, 1] m"
    );
    let scale = refusal(with_x(State::new("x", "m").scaled_by(0.0)));
    assert_eq!(scale, "phase `go`, state `x`: scale 0 must be positive and finite");
    assert!(refusal(with_x(State::new("x", "m").miss_below(-1.0))).contains("tolerance -1"));
    assert!(
        refusal(problem(cart("go").final_time(Bounds::new(-3.0, -1.0))))
            .contains("no solution of positive length")
    );
    assert!(
        refusal(problem(cart("go").duration(Bounds::at_least(20.0))))
            .contains("no solution of positive length")
    );
    let row = [Variable::new("sum", "m").within(1.0, 0.0)];
    let ends = [At::InitialState("go", "x"), At::FinalState("go", "x")];
    assert!(
        refusal(problem(cart("go")).constrain("ends", row, ends, Sum))
            .contains("constraint `ends`, row `sum`")
    );
    assert!(refusal(problem(cart("go")).objective_scale(f64::NAN)).contains("objective `time`: scale NaN"));
}

#[test]
fn links_join_time_and_states_of_the_same_name() {
    let ocp = Ocp::builder("p")
        .phase(cart("go"))
        .phase(cart("on").initial_time(Bounds::new(0.0, 9.0)).final_time(Bounds::new(2.0, 20.0)))
        .link("go", "on")
        .objective(Sense::Minimize, "time", "s", [Term::End(At::FinalTime("on"), 1.0)])
        .build()
        .unwrap();
    assert_eq!(ocp.constraints.len(), 3);
    assert_eq!(
        ocp.constraints[2].inputs,
        [
            EndpointInput::FinalState { phase: 0, state: 1 },
            EndpointInput::InitialState { phase: 1, state: 1 }
        ]
    );
}

#[test]
fn linear_guess_keeps_to_what_the_ends_allow() {
    let phase = cart("go").states([
        State::new("x", "m").within(-1.0, 5.0).starts_at(0.0).ends_at(4.0),
        State::new("v", "m/s").starts_at(2.0),
    ]);
    let ocp = problem(phase).build().unwrap();
    let guess = Guess::linear(&ocp);
    let mut x = [0.0; 2];
    guess.phases[0].state(0.25, &mut x);
    assert_eq!(x, [1.0, 2.0]);
    assert_eq!(guess.phases[0].final_time, 5.0);
    guess.check(&ocp).unwrap();
    let scaling = Scaling::new(&ocp, &guess);
    assert_eq!(scaling.phases[0].states, [6.0, 2.0], "width of the bounds, else the guess");
    assert_eq!(scaling.phases[0].time, 5.0);
}

/// A guess in motion flies with the middle of the controls, -0.75 m/s2 from 1 m/s at rest, unless that misses what is asked of a state.
#[test]
fn a_guess_is_in_motion_where_nothing_is_asked_that_it_misses() {
    let pushed = |x: State| {
        let states = [x.starts_at(0.0), State::new("v", "m/s").starts_at(1.0)];
        let phase = cart("go").states(states).controls([Variable::new("a", "m/s2").within(-2.0, 0.5)]);
        let ocp = problem(phase.final_time(Bounds::fixed(2.0))).build().unwrap();
        let (guess, mut middle, mut end) = (Guess::linear(&ocp).in_motion(&ocp), [0.0; 2], [0.0; 2]);
        guess.check(&ocp).unwrap();
        guess.phases[0].state(0.5, &mut middle);
        guess.phases[0].state(1.0, &mut end);
        // A straight line is as fast in its middle as on average.
        ((2.0 * middle[0] - end[0]).abs() < ROUNDING, end)
    };
    let (is_straight, end) = pushed(State::new("x", "m"));
    assert!(!is_straight && (end[0] - 0.5).abs() < ROUNDING && (end[1] + 0.5).abs() < ROUNDING, "{end:?}");
    let misses = [
        State::new("x", "m").ends_at(1.0),
        State::new("x", "m").ends_within(0.6, 2.0),
        State::new("x", "m").within(-1.0, 0.6),
    ];
    assert!(misses.into_iter().all(|x| pushed(x).0), "the highest point is 2/3 m");
}

/// A motion that grows by `e^40` says nothing of the size of a solution.
#[test]
fn a_guess_does_not_run_away() {
    struct Unstable;
    impl Dynamics<1, 1> for Unstable {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
            [x[0] * 2.0 + u[0]]
        }
    }
    let end = |duration: f64| {
        let phase = Phase::new("go", Unstable)
            .states([State::new("x", "m").starts_at(1.0)])
            .controls([Variable::new("u", "m/s")])
            .final_time(Bounds::fixed(duration));
        let ocp =
            Ocp::builder("run").phase(phase).minimize("x", "m", At::FinalState("go", "x")).build().unwrap();
        let mut end = [0.0];
        Guess::linear(&ocp).in_motion(&ocp).phases[0].state(1.0, &mut end);
        end[0]
    };
    assert!((end(1.0) - 2.0_f64.exp()).abs() < RUNGE_KUTTA);
    assert_eq!(end(20.0), 1.0);
}

/// The states of a guess at a part of its first phase.
fn states_at(guess: &Guess, fraction: f64) -> [f64; 2] {
    let mut x = [0.0; 2];
    guess.phases[0].state(fraction, &mut x);
    x
}

/// A free velocity moves what the guess has moving, 4 m in 5 s; one that is stated or has an end stays, and where nothing moves it is
/// left alone.
#[test]
fn free_states_move_the_others() {
    let moved = |x: State, v: State, is_stated: bool| {
        let ocp = problem(cart("go").states([x, v])).build().unwrap();
        states_at(&Guess::linear(&ocp).with_free_states_moving(&ocp, |_, s| is_stated && s == 1), 0.5)[1]
    };
    let (x, v) = (State::new("x", "m").starts_at(0.0).ends_at(4.0), State::new("v", "m/s"));
    assert!((moved(x.clone(), v.clone(), false) - 0.8).abs() < ROUNDING);
    assert_eq!(moved(x.clone(), v.clone(), true), 0.0);
    assert_eq!(moved(x.clone(), v.clone().within(-1.0, 0.5), false), 0.5);
    assert_eq!(moved(x, v.clone().starts_at(3.0), false), 3.0);
    assert_eq!(moved(State::new("x", "m").starts_at(2.0).ends_at(2.0), v, false), 0.0);
}

/// The free velocity at the start takes what a constraint of the start asks for, within its bounds, and all along where nothing is asked at
/// its end; a constraint that takes the end as well is left to the solver, as is one that nothing free stands in.
#[test]
fn starts_meet_what_is_asked_of_them_alone() {
    let met = |v: State, second: At<'_>, sum: f64| {
        let phase = cart("go").states([State::new("x", "m").starts_at(1.0), v]);
        let row = Variable::new("sum", "m").equal_to(sum);
        let inputs = [At::InitialState("go", "x"), second];
        let ocp = problem(phase).constrain("sum", [row], inputs, Sum).build().unwrap();
        let guess = Guess::linear(&ocp).with_starts_that_meet(&ocp);
        [states_at(&guess, 0.0)[1], states_at(&guess, 1.0)[1]]
    };
    let v = State::new("v", "m/s");
    let start = At::InitialState("go", "v");
    assert_eq!(met(v.clone(), start.clone(), 8.0), [7.0, 7.0]);
    assert_eq!(met(v.clone().ends_at(0.0), start.clone(), 8.0), [7.0, 0.0]);
    assert_eq!(met(v.clone().within(-4.0, 4.0), start.clone(), 8.0), [4.0, 4.0]);
    assert_eq!(met(v.clone().starts_at(3.0), start.clone(), 8.0), [3.0, 3.0]);
    assert_eq!(met(v.clone(), At::FinalState("go", "v"), 8.0), [0.0, 0.0]);
    assert_eq!(met(v, start, 1.0), [0.0, 0.0]);
}

/// A quantity of which nothing is known has the size of what has its unit; plain numbers need not be of one kind.
#[test]
fn unknown_sizes_are_those_of_the_same_unit() {
    let sizes = |unit: &str| {
        let states = [State::new("x", unit).starts_at(300.0).ends_at(0.0), State::new("y", unit)];
        let ocp = problem(cart("go").states(states)).build().unwrap();
        Scaling::new(&ocp, &Guess::linear(&ocp)).phases[0].states.clone()
    };
    assert_eq!(sizes("m"), [300.0, 300.0]);
    assert_eq!(sizes("-"), [300.0, 1.0]);
}

/// A bent guess keeps its fixed ends and moves the free ones, keeps to the bounds, is the same each time and another one for another number.
#[test]
fn a_bent_guess_has_no_symmetry() {
    let ocp = problem(cart("go")).build().unwrap();
    let straight = Guess::linear(&ocp);
    let middle = |guess: &Guess| {
        let (mut x, mut u) = ([0.0; 2], [0.0]);
        guess.phases[0].state(0.5, &mut x);
        guess.phases[0].control(0.3, &mut u);
        assert!((-1.0..=5.0).contains(&x[0]) && (-2.0..=2.0).contains(&u[0]), "{x:?}, {u:?}");
        [x[0], x[1], u[0], guess.phases[0].final_time]
    };
    let mut seen = vec![middle(&straight)];
    for number in 1..=5 {
        let bent = straight.bent(&ocp, number);
        bent.check(&ocp).unwrap();
        for fraction in [0.0, 1.0] {
            let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
            straight.phases[0].state(fraction, &mut before);
            bent.phases[0].state(fraction, &mut after);
            for ((state, before), after) in ocp.phases[0].states.iter().zip(before).zip(after) {
                let end = if fraction == 0.0 { state.initial } else { state.terminal };
                let moved = (before - after).abs();
                assert!(
                    if end.is_fixed() { moved < ROUNDING_OF_ENDS } else { moved > 1e-3 },
                    "{}: {moved}",
                    state.variable.name
                );
            }
        }
        let found = middle(&bent);
        assert_eq!(found.map(f64::to_bits), middle(&straight.bent(&ocp, number)).map(f64::to_bits));
        assert!(seen.iter().all(|s| s.iter().zip(&found).all(|(a, b)| (a - b).abs() > 1e-3)), "{found:?}");
        seen.push(found);
    }
}

#[test]
fn malformed_guesses_and_meshes_are_refused() {
    let rows = |n: usize, w: usize| vec![vec![0.0; w]; n];
    assert!(PhaseGuess::samples(&[0.0], rows(1, 2), rows(1, 1)).is_err());
    assert!(PhaseGuess::samples(&[0.0, 0.0], rows(2, 2), rows(2, 1)).is_err());
    assert!(PhaseGuess::samples(&[0.0, f64::NAN], rows(2, 2), rows(2, 1)).is_err());
    assert!(PhaseGuess::samples(&[0.0, 1.0], vec![vec![0.0; 2], vec![0.0; 3]], rows(2, 1)).is_err());
    let ocp = problem(cart("go")).build().unwrap();
    let wrong = PhaseGuess::samples(&[0.0, 1.0], rows(2, 3), rows(2, 1)).unwrap();
    let message = Guess::from_phases(&ocp, vec![wrong]).check(&ocp).unwrap_err().to_string();
    assert_eq!(message, "guess of go: expected (states, controls) = (2, 1) per row, found (3, 1)");
    assert!(Guess::from_phases(&ocp, vec![]).check(&ocp).is_err());

    for (fractions, points) in [
        (vec![], vec![]),
        (vec![0.0, 1.0], vec![0]),
        (vec![0.0, 0.5], vec![3]),
        (vec![0.0, 0.6, 0.5, 1.0], vec![3, 3, 3]),
        (vec![0.0, f64::NAN, 1.0], vec![3, 3]),
        (vec![0.0, 1.0], vec![3, 3]),
    ] {
        assert!(matches!(PhaseMesh::new(fractions, points), Err(OcpError::Mesh { .. })));
    }
    assert!(Mesh::uniform(&ocp, 0, 3).is_err());
}

#[test]
fn piecewise_polynomials_check_their_shape() {
    let basis = Arc::new(Barycentric::new(&[-1.0, 1.0]).unwrap());
    let segment = |values: Vec<f64>| Segment { basis: Arc::clone(&basis), values };
    assert!(PiecewisePolynomial::new(1, vec![0.0, 1.0], vec![]).is_err());
    assert!(PiecewisePolynomial::new(1, vec![1.0, 0.0], vec![segment(vec![0.0, 1.0])]).is_err());
    assert!(PiecewisePolynomial::new(1, vec![0.0, 1.0], vec![segment(vec![0.0])]).is_err());
    let p = PiecewisePolynomial::new(
        1,
        vec![0.0, 1.0, 3.0],
        vec![segment(vec![0.0, 1.0]), segment(vec![5.0, 9.0])],
    )
    .unwrap();
    let mut v = [0.0];
    p.evaluate(1.0, &mut v);
    assert_eq!(v, [5.0], "the later piece at a break");
    p.evaluate_in(0, 1.0, &mut v);
    assert_eq!(v, [1.0]);
    p.derivative_in(1, 2.0, &mut v);
    assert!((v[0] - 2.0).abs() < ROUNDING);
    assert_eq!((p.segment_at(-4.0), p.segment_at(9.0)), (0, 1));
    assert_eq!(p.node_times(1).collect::<Vec<_>>(), [1.0, 3.0]);
    let pairs = p.map_nodes(2, |one, two| two.copy_from_slice(&[10.0, one[0]]));
    assert_eq!((pairs.dimension(), pairs.component(2.0, 0), pairs.component(2.0, 1)), (2, 10.0, 7.0));
    assert_eq!(
        pairs.map_nodes(0, |_, _| ()).map_nodes(1, |none, v| v[0] = none.len() as f64).component(2.0, 0),
        0.0
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn clamping_and_excess_agree(a in -1e6..1e6f64, w in 0.0..1e6f64, v in -3e6..3e6f64) {
        let b = Bounds::new(a, a + w);
        let inside = b.clamp(v);
        prop_assert!(b.excess(inside) <= 0.0);
        prop_assert!(((v - inside).abs() - b.excess(v).max(0.0)).abs() <= ROUNDING_OF_MILLIONS);
    }
}
