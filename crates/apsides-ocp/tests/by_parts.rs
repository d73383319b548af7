//! Magnitudes of controls by parts: the functions are those of the problem as it was posed, and so are trajectories and guesses.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, ByParts, Guess, Ocp, Phase, PhaseGuess, State, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// A cart whose propellant flows by the magnitude of its thrust, beside a pump that works by the larger of two powers.
struct Cart;
impl Dynamics<3, 2> for Cart {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 3], u: &[S; 2], _p: &[S; 0]) -> [S; 3] {
        let power = u[0] * x[1];
        [x[1], u[0] + u[1] * t, -u[0].abs() - power.max(power * 0.7)]
    }
}
/// The negative part of the thrust, and its distance from a clamp of the other control.
struct Limits;
impl PathFunction<3, 2, 2> for Limits {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 3], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [u[0].min(S::from(0.0)), u[0] - u[1].max(S::from(-0.5)).min(S::from(0.5))]
    }
}
/// No magnitude of a control.
struct Smooth;
impl Dynamics<3, 2> for Smooth {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 2], _p: &[S; 0]) -> [S; 3] {
        [x[1].abs(), u[0], u[1] * u[0]]
    }
}

fn problem<D: Dynamics<3, 2> + Send + Sync + 'static>(dynamics: D) -> Phase {
    Phase::new("go", dynamics)
        .states([State::new("x", "m"), State::new("v", "m/s").within(-2.0, 2.0), State::new("m", "kg")])
        .controls([Variable::new("u", "N").within(-1.0, 3.0), Variable::new("w", "N").within(-4.0, 4.0)])
        .final_time(Bounds::new(1.0, 9.0))
}

fn posed(phase: Phase) -> Ocp {
    Ocp::builder("p").phase(phase).minimize("time", "s", At::FinalTime("go")).build().unwrap()
}

fn with_limits() -> Phase {
    problem(Cart).path([Variable::new("a", "N"), Variable::new("b", "N")], Limits)
}

#[test]
fn without_magnitudes_of_controls_there_are_no_parts() {
    assert!(ByParts::of(&posed(problem(Smooth))).is_none());
}

#[test]
fn functions_of_the_parts_are_those_of_the_magnitudes() {
    let ocp = posed(with_limits());
    let parts = ByParts::of(&ocp).unwrap();
    let phase = &parts.ocp.phases[0];
    let names: Vec<&str> = phase.controls.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names[..3], ["positive part of u", "w", "negative part of u"], "{names:?}");
    assert_eq!((phase.controls[0].bounds.upper, phase.controls[2].bounds.upper), (3.0, 1.0));
    // Two powers, and two sides of a clamp.
    assert_eq!(names.len(), 3 + 3 * 2);
    assert_eq!(phase.path_rows(), 2 + 3);
    for (u, w, v, t) in
        [(0.7, 0.2, 1.5, 0.3), (-0.4, 3.0, 1.0, 2.0), (0.0, -2.0, -1.0, 1.0), (2.0, 0.5, 0.0, 5.0)]
    {
        let guess =
            PhaseGuess::samples(&[t, t + 1.0], vec![vec![1.0, v, 2.0]; 2], vec![vec![u, w]; 2]).unwrap();
        let guess = parts.guess(&Guess::from_phases(&ocp, vec![guess]));
        let mut controls = vec![0.0; names.len()];
        guess.phases[0].control(0.0, &mut controls);
        let at = |controls: &[f64]| [&[1.0, v, 2.0], controls, &[t]].concat();
        let (mut expected, mut found) = ([0.0; 3], [0.0; 3]);
        ocp.phases[0].dynamics.value(&at(&[u, w]), &mut expected);
        phase.dynamics.value(&at(&controls), &mut found);
        assert!(expected.iter().zip(&found).all(|(a, b)| (a - b).abs() < ROUNDING), "{expected:?} {found:?}");
        let (mut expected, mut found) = ([0.0; 2], [0.0; 2]);
        ocp.phases[0].path[0].function.value(&at(&[u, w]), &mut expected);
        phase.path[0].function.value(&at(&controls), &mut found);
        assert!(expected.iter().zip(&found).all(|(a, b)| (a - b).abs() < ROUNDING), "{expected:?} {found:?}");
        for c in &phase.path[1..] {
            let mut balance = [f64::NAN];
            c.function.value(&at(&controls), &mut balance);
            assert!(balance[0].abs() < ROUNDING, "{balance:?}");
            assert_eq!(c.rows[0].bounds, Bounds::fixed(0.0));
        }
    }
}

/// The hinges of a thrust to both sides, and the distance of two controls by its hinges.
struct Hinges;
impl PathFunction<3, 2, 3> for Hinges {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 3], u: &[S; 2], _p: &[S; 0]) -> [S; 3] {
        let zero = S::from(0.0);
        [u[0].max(zero) + (-u[0]).max(zero), (u[0] - u[1]).max(zero), (u[1] - u[0]).max(zero)]
    }
}

#[test]
fn hinges_to_both_sides_have_the_same_parts() {
    let rows = ["a", "b", "c"].map(|name| Variable::new(name, "N"));
    let parts = ByParts::of(&posed(problem(Smooth).path(rows, Hinges))).unwrap();
    let phase = &parts.ocp.phases[0];
    // The parts of the thrust, the other control, and the parts of the difference, with one row that binds these.
    assert_eq!(phase.controls.len(), 5);
    assert_eq!(phase.path_rows(), 3 + 1);
    let hinges = phase.path[0].function.as_ref();
    for (u, w) in [(2.0, 0.5), (-1.5, 3.0), (0.0, -2.0)] {
        let both = |e: f64| [e.max(0.0), (-e).max(0.0)];
        let (of_u, of_both) = (both(u), both(u - w));
        let names = phase.controls.iter().map(|c| match c.name.as_str() {
            "positive part of u" => of_u[0],
            "negative part of u" => of_u[1],
            "w" => w,
            name if name.starts_with("positive") => of_both[0],
            _ => of_both[1],
        });
        let mut z = vec![0.0; hinges.inputs()];
        z[3..8].copy_from_slice(&names.collect::<Vec<f64>>());
        let mut values = [0.0; 3];
        hinges.value(&z, &mut values);
        assert_eq!(values, [u.abs(), of_both[0], of_both[1]]);
    }
}

#[test]
fn magnitudes_of_states_have_parts_on_request() {
    let ocp = posed(problem(Smooth));
    let parts = ByParts::of_states_too(&ocp).unwrap();
    let phase = &parts.ocp.phases[0];
    assert_eq!((phase.controls.len(), phase.path_rows()), (4, 1));
    // The bounds of the parts are those of the speed.
    assert_eq!(phase.controls[2..].iter().map(|c| c.bounds.upper).collect::<Vec<_>>(), [2.0, 2.0]);
    // Where those of controls are all there are no more.
    struct Thrust;
    impl Dynamics<3, 2> for Thrust {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 2], _p: &[S; 0]) -> [S; 3] {
            [x[1], u[0].abs(), u[1]]
        }
    }
    assert!(ByParts::of_states_too(&posed(problem(Thrust))).is_none());
}
