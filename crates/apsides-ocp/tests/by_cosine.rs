//! Controls that occur in one cosine or sine alone, by its value: functions, guesses and trajectories are those of the problem as it was posed.
#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, ByCosine, Guess, Ocp, Phase, PhaseGuess, State, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// An altitude and its rate under lift by a bank angle in degrees and a flap.
struct Lift;
impl Dynamics<2, 2> for Lift {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        let lift = (u[0] * (PI / 180.0)).cos() * (x[0] + t);
        [x[1] + u[1], lift + (-(u[0] / (180.0 / PI))).sin() * 0.5]
    }
}
/// The same with the cosine alone.
struct Vertical;
impl Dynamics<2, 2> for Vertical {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        let lift = (u[0] * (PI / 180.0)).cos() * (x[0] + t);
        [x[1] + u[1] * u[1], lift * lift]
    }
}
/// The sine of an angle.
struct Rise;
impl Dynamics<2, 2> for Rise {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [(u[0] * 2.0 + 1.0).sin() + x[1], u[1]]
    }
}
/// An angle beside its cosine.
struct Beside;
impl Dynamics<2, 2> for Beside {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [u[0].cos() + x[1], u[1] + u[0]]
    }
}

fn problem<D: Dynamics<2, 2> + Send + Sync + 'static>(dynamics: D, angle: [f64; 2]) -> Ocp {
    let phase = Phase::new("go", dynamics)
        .states([State::new("h", "m"), State::new("w", "m/s")])
        .controls([
            Variable::new("angle", "-").within(angle[0], angle[1]),
            Variable::new("flap", "-").within(-2.0, 3.0),
        ])
        .final_time(Bounds::new(1.0, 9.0));
    Ocp::builder("p").phase(phase).minimize("time", "s", At::FinalTime("go")).build().unwrap()
}

fn bounds(by_cosine: &ByCosine) -> [f64; 2] {
    let Bounds { lower, upper } = by_cosine.ocp.phases[0].controls[0].bounds;
    [lower, upper]
}

#[test]
fn the_value_of_a_cosine_takes_the_place_of_its_angle() {
    let posed = problem(Vertical, [0.0, 180.0]);
    let by_cosine = ByCosine::of(&posed).unwrap();
    assert_eq!(bounds(&by_cosine), [-1.0, 1.0]);
    let [mut values, mut of_posed] = [[0.0; 2]; 2];
    for angle in [0.0_f64, 30.0, 90.0, 171.0] {
        posed.phases[0].dynamics.value(&[2.0, 0.7, angle, 0.3, 0.5], &mut of_posed);
        let cosine = (angle * PI / 180.0).cos();
        by_cosine.ocp.phases[0].dynamics.value(&[2.0, 0.7, cosine, 0.3, 0.5], &mut values);
        for (a, b) in values.iter().zip(&of_posed) {
            assert!((a - b).abs() < ROUNDING, "{values:?} {of_posed:?}");
        }
    }
    assert!(ByCosine::of(&by_cosine.ocp).is_none());
}

#[test]
fn angles_with_another_use_or_without_a_stationary_point_stay() {
    assert!(ByCosine::of(&problem(Beside, [0.0, PI])).is_none());
    assert!(ByCosine::of(&problem(Lift, [0.0, 180.0])).is_none());
    for free in [[10.0, 170.0], [0.0, f64::INFINITY], [f64::NEG_INFINITY, 180.0], [0.0, 0.0]] {
        assert!(ByCosine::of(&problem(Vertical, free)).is_none(), "{free:?}");
    }
}

#[test]
fn bounds_are_those_of_all_values() {
    let half = 0.5_f64.sqrt();
    let cases: [([f64; 2], [f64; 2]); 7] = [
        ([0.0, 90.0], [0.0, 1.0]),
        ([-90.0, 90.0], [0.0, 1.0]),
        ([-45.0, 60.0], [0.5, 1.0]),
        ([-180.0, 180.0], [-1.0, 1.0]),
        ([45.0, 180.0], [-1.0, half]),
        ([135.0, 360.0], [-1.0, 1.0]),
        ([-1000.0, 1000.0], [-1.0, 1.0]),
    ];
    for (angles, expected) in cases {
        let found = bounds(&ByCosine::of(&problem(Vertical, angles)).unwrap());
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < ROUNDING), "{angles:?} {found:?}");
    }
    let sine = ByCosine::of(&problem(Rise, [-0.5 - 0.5 * FRAC_PI_2, -0.5 + 0.5 * FRAC_PI_2])).unwrap();
    assert_eq!(bounds(&sine), [-1.0, 1.0]);
}

#[test]
fn guesses_have_the_values_of_their_angles() {
    let posed = problem(Vertical, [-180.0, 180.0]);
    let by_cosine = ByCosine::of(&posed).unwrap();
    for (angle, cosine) in [(0.0, 1.0), (60.0, 0.5), (-60.0, 0.5), (180.0, -1.0)] {
        let controls = vec![vec![angle, 2.0]; 2];
        let guess = PhaseGuess::samples(&[1.0, 2.0], vec![vec![1.0, 4.0]; 2], controls).unwrap();
        let guess = by_cosine.guess(&Guess::from_phases(&posed, vec![guess]));
        let mut u = [0.0; 2];
        guess.phases[0].control(0.5, &mut u);
        assert!((u[0] - cosine).abs() < ROUNDING && u[1] == 2.0, "{u:?}");
    }
}
