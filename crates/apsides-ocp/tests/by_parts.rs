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
