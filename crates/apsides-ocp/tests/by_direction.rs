//! Lengths of vectors of controls by length and direction: functions, guesses and trajectories are those of the problem as it was posed.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, ByDirection, Guess, Ocp, Phase, PhaseGuess, State, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// A vehicle with a thrust in a plane and a pump.
struct Vehicle;
impl Dynamics<3, 3> for Vehicle {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 3], u: &[S; 3], _p: &[S; 0]) -> [S; 3] {
        let thrust = (u[0] * u[0] + u[1].powi(2)).sqrt();
        [x[1] + u[0], u[1] * t + u[2], -thrust * 0.5 - u[2]]
    }
}
/// Length, and its square.
struct Limits;
impl PathFunction<3, 3, 2> for Limits {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 3], u: &[S; 3], _p: &[S; 0]) -> [S; 2] {
        let square = u[0] * u[0] + u[1] * u[1];
        [square.sqrt(), square]
    }
}
/// A pump that works against the thrust.
struct Pump;
impl PathFunction<3, 3, 1> for Pump {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 3], u: &[S; 3], _p: &[S; 0]) -> [S; 1] {
        [u[2] + u[0]]
    }
}
/// No length.
struct Smooth;
impl Dynamics<3, 3> for Smooth {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 3], _p: &[S; 0]) -> [S; 3] {
        [x[1], u[0] * u[0] + u[1], u[2]]
    }
}

fn problem<D: Dynamics<3, 3> + Send + Sync + 'static>(dynamics: D, [least, limit]: [f64; 2]) -> Ocp {
    let component = |name: &str| Variable::new(name, "N").within(-2.0, 3.0);
    let phase = Phase::new("go", dynamics)
        .states([State::new("x", "m"), State::new("v", "m/s"), State::new("m", "kg")])
        .controls([component("a"), component("b"), component("pump")])
        .path([Variable::new("pump", "N").within(-1.0, 9.0)], Pump)
        .path(
            [
                Variable::new("thrust", "N").within(least, limit),
                Variable::new("square", "N2").within(-1.0, 81.0),
            ],
            Limits,
        )
        .final_time(Bounds::new(1.0, 9.0));
    Ocp::builder("p").phase(phase).minimize("time", "s", At::FinalTime("go")).build().unwrap()
}

#[test]
fn a_length_in_limits_alone_becomes_its_square() {
    let by_direction = ByDirection::of(&problem(Smooth, [-0.5, 1.5])).unwrap();
    assert!(by_direction.rounded.is_none());
    let phase = &by_direction.ocp.phases[0];
    assert_eq!((phase.controls.len(), phase.path_rows()), (3, 3));
    assert_eq!(phase.path[1].rows[0].bounds, Bounds::new(-0.25, 2.25));
    assert_eq!(phase.path[1].rows[1].bounds, Bounds::new(-1.0, 81.0));
    let mut rows = [0.0; 2];
    phase.path[1].function.value(&[0.0, 0.0, 0.0, 3.0, 4.0, 7.0, 0.0], &mut rows);
    assert_eq!(rows, [25.0, 25.0]);
}

#[test]
fn limits_of_a_length_are_bounds_of_it() {
    let of = |limit: f64| ByDirection::of(&problem(Vehicle, [0.0, limit])).unwrap();
    let phase = &of(1.5).ocp.phases[0];
    let names: Vec<&str> = phase.controls.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["direction of a", "direction of b", "pump", "length of (a, b)"]);
    assert_eq!(phase.controls[3].bounds, Bounds::new(0.0, 1.5));
    // The pump's row and that of the direction: components of at most 1.5 are within their bounds.
    assert_eq!(phase.path_rows(), 2);
    // A thrust that is never nothing has a slope everywhere.
    assert!(ByDirection::of(&problem(Vehicle, [0.5, 1.5])).is_none());
    // Components of at most 8 are not.
    assert_eq!(of(8.0).ocp.phases[0].path_rows(), 4);
}

#[test]
fn functions_of_length_and_direction_are_those_of_the_vector() {
    let ocp = problem(Vehicle, [0.0, 8.0]);
    let by_direction = ByDirection::of(&ocp).unwrap();
    let (posed, split) = (&ocp.phases[0], &by_direction.ocp.phases[0]);
    for u in [[0.6, -0.8, 0.1], [3.0, 1.5, -2.0], [-1e-3, 2.0, 0.0]] {
        let guess =
            PhaseGuess::samples(&[1.0, 2.0], vec![vec![1.0, 4.0, 2.0]; 2], vec![u.to_vec(); 2]).unwrap();
        let guess = by_direction.guess(&Guess::from_phases(&ocp, vec![guess]));
        let mut controls = [0.0; 4];
        guess.phases[0].control(0.5, &mut controls);
        assert!((controls[0].hypot(controls[1]) - 1.0).abs() < 0.1 * ROUNDING, "{controls:?}");
        let at = |u: &[f64]| [&[1.0, 4.0, 2.0], u, &[1.5]].concat();
        let (mut expected, mut found) = ([0.0; 3], [0.0; 3]);
        posed.dynamics.value(&at(&u), &mut expected);
        split.dynamics.value(&at(&controls), &mut found);
        assert!(expected.iter().zip(&found).all(|(e, f)| (e - f).abs() < ROUNDING), "{expected:?} {found:?}");
        // Rows: pump, direction, both components.
        for (row, value) in split.path.iter().zip([u[2] + u[0], 1.0, u[0], u[1]]) {
            let mut out = [0.0];
            row.function.value(&at(&controls), &mut out);
            assert!((out[0] - value).abs() < ROUNDING, "{} {}", row.rows[0].name, out[0]);
        }
    }
}

#[test]
fn at_nothing_derivatives_are_finite() {
    let by_direction = ByDirection::of(&problem(Vehicle, [0.0, 8.0])).unwrap();
    let rounded = by_direction.rounded.as_ref().unwrap();
    for (phase, u) in
        [(&by_direction.ocp.phases[0], &[0.6, 0.8, 0.0, 0.0][..]), (&rounded.phases[0], &[0.0; 3])]
    {
        let z = [&[0.0; 3], u, &[0.0]].concat();
        let f = &phase.dynamics;
        let (mut value, mut jacobian) = ([0.0; 3], vec![0.0; f.pattern().jacobian_len()]);
        f.jacobian(&z, &mut value, &mut jacobian);
        assert!(jacobian.iter().all(|v| v.is_finite()), "{jacobian:?}");
    }
}
