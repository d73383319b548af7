//! Path constraints that keep a vector in a cone, by its length.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::cones::with_lengths;
use apsides_ocp::{At, Bounds, ByDirection, Ocp, Phase, State, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// A mass that a thrust moves.
struct Thrust;
impl Dynamics<2, 3> for Thrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 3], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] + u[1]]
    }
}
/// `a^2 + b^2 - r^2`, its negative, four times the radius, and a state in the radius.
struct Rows;
impl PathFunction<2, 3, 4> for Rows {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 3], _p: &[S; 0]) -> [S; 4] {
        let [a, b, r] = *u;
        [
            a * a + b.powi(2) - r * r,
            r * r - b * b - a * a,
            a * a + b * b - r * r * 4.0,
            x[1].powi(2) - x[0].powi(2),
        ]
    }
}

fn problem(radius: [f64; 2], bounds: [Bounds; 4]) -> Ocp {
    let row = |(k, bounds): (usize, &Bounds)| Variable {
        bounds: *bounds,
        ..Variable::new(format!("row {k}"), "-")
    };
    let rows: Vec<Variable> = bounds.iter().enumerate().map(row).collect();
    let rows: [Variable; 4] = rows.try_into().unwrap();
    let phase = Phase::new("go", Thrust)
        .states([State::new("x", "m").at_least(0.0), State::new("v", "m/s")])
        .controls([
            Variable::new("a", "N").within(-2.0, 3.0),
            Variable::new("b", "N").within(-2.0, 3.0),
            Variable::new("r", "N").within(radius[0], radius[1]),
        ])
        .path(rows, Rows)
        .final_time(Bounds::new(1.0, 9.0));
    Ocp::builder("p").phase(phase).minimize("time", "s", At::FinalTime("go")).build().unwrap()
}

const UPPER: Bounds = Bounds { lower: f64::NEG_INFINITY, upper: 0.0 };
const LOWER: Bounds = Bounds { lower: 0.0, upper: f64::INFINITY };

#[test]
fn rows_of_cones_are_those_of_lengths() {
    let ocp = problem([0.0, 2.0], [UPPER, LOWER, UPPER, UPPER]);
    let phase = &ocp.phases[0];
    let by_length = with_lengths(phase, &phase.path[0]).unwrap();
    let mut rows = [0.0; 4];
    by_length.function.value(&[7.0, 4.0, 3.0, -4.0, 1.5, 0.0], &mut rows);
    for (row, expected) in rows.iter().zip([5.0 - 1.5, 1.5 - 5.0, 5.0 - 3.0, 4.0 - 7.0]) {
        assert!((row - expected).abs() < ROUNDING, "{rows:?}");
    }
}

#[test]
fn rows_that_are_no_cones_stay() {
    // A radius of either sign, a square above a bound, a square between two bounds; the speed has no bound, but the place has.
    let ocp = problem([-1.0, 2.0], [UPPER, Bounds::new(-1.0, 0.0), LOWER, LOWER]);
    let phase = &ocp.phases[0];
    assert!(with_lengths(phase, &phase.path[0]).is_none());
    let ocp = problem([0.0, 2.0], [Bounds::FREE, Bounds::new(0.0, 1.0), LOWER, LOWER]);
    let phase = &ocp.phases[0];
    assert!(with_lengths(phase, &phase.path[0]).is_none());
}

#[test]
fn a_vector_in_a_cone_with_a_tip_has_length_and_direction() {
    let ocp = problem([0.0, 2.0], [UPPER, Bounds::FREE, Bounds::FREE, Bounds::FREE]);
    let by_direction = ByDirection::of(&ocp).unwrap();
    let phase = &by_direction.ocp.phases[0];
    assert_eq!(phase.controls[3].bounds, LOWER);
    let mut rows = [0.0; 4];
    // Half of the thrust of 5 that the direction (0.6, -0.8) would have, under a radius of 3.
    phase.path[0].function.value(&[0.0, 0.0, 0.6, -0.8, 3.0, 2.5, 0.0], &mut rows);
    assert!((rows[0] - (2.5 - 3.0)).abs() < ROUNDING, "{rows:?}");
    // Away from the tip the square is smooth.
    let rounded = problem([0.5, 2.0], [UPPER, Bounds::FREE, Bounds::FREE, Bounds::FREE]);
    assert!(ByDirection::of(&rounded).is_none());
}

/// `a^2`, doubled sixty times, below `r^2`, and its length: more terms than there is time for.
struct Doubled;
impl PathFunction<2, 3, 2> for Doubled {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 3], _p: &[S; 0]) -> [S; 2] {
        let sum = (0..60).fold(u[0] * u[0], |sum, _| sum + sum);
        let radius = (0..60).fold(u[2], |sum, _| sum + sum);
        [sum - radius * radius, sum.sqrt()]
    }
}

#[test]
fn sums_in_which_values_occur_again_and_again_end() {
    let ocp = problem([0.0, 2.0], [UPPER; 4]);
    let rows = ["doubled", "its length"].map(|name| Variable { bounds: UPPER, ..Variable::new(name, "-") });
    let phase = ocp.phases[0].clone().path(rows, Doubled);
    assert!(with_lengths(&phase, &phase.path[1]).is_none());
    let all = Ocp::builder("p").phase(phase).minimize("time", "s", At::FinalTime("go")).build().unwrap();
    assert!(ByDirection::of(&all).is_some());
}
