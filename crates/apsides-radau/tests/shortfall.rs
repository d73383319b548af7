//! Meshes that stay too coarse say where, how the error went, and what stands there.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::method::{Deficiency, Remedy};
use apsides_ocp::{At, Bounds, Guess, Method, Ocp, Phase, PhaseGuess, Start, State, Variable};
use apsides_radau::{Radau, RadauSettings};

/// Motion through a medium that is thick on one side of a place: the force has a jump there, blurred to a width.
struct Layer {
    width: f64,
}
impl Dynamics<2, 1> for Layer {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        let drag = ((x[0] - 0.31) / self.width).tanh() + 1.0;
        [x[1], u[0] - x[1] * drag]
    }
}

struct Speed;
impl PathFunction<2, 1, 1> for Speed {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[1]]
    }
}

struct Effort;
impl PathFunction<2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}

/// The deficiency of least effort to a place in given time.
fn deficiency(width: f64, top_speed: f64, settings: RadauSettings) -> Deficiency {
    let phase = Phase::new("move", Layer { width })
        .states([
            State::new("x", "m").within(-1.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").within(-5.0, 5.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("a", "m/s2").within(-50.0, 50.0)])
        .path([Variable::new("speed", "m/s").at_most(top_speed)], Speed)
        .integral(Variable::new("effort", "m2/s3"), Effort)
        .final_time(Bounds::new(1.0, 1.0));
    let ocp: Ocp = Ocp::builder("layer")
        .phase(phase)
        .minimize("effort", "m2/s3", At::Integral("move", "effort"))
        .build()
        .unwrap();
    let ends = vec![vec![0.0, 1.0], vec![1.0, 1.0]];
    let guess = PhaseGuess::samples(&[0.0, 1.0], ends, vec![vec![0.0]; 2]).unwrap();
    let start = Start::from(Guess::from_phases(&ocp, vec![guess]));
    let solution = Method::solve(&Radau { settings }, &ocp, &start, &mut ()).unwrap();
    let place = solution.accuracy[0].place.as_deref().unwrap_or_default();
    assert!(place.starts_with("phase `move`, t = "), "{place}");
    solution.deficiency.unwrap()
}

fn few(max_refinements: usize) -> RadauSettings {
    RadauSettings { max_refinements, intervals: 3, points: 3, ..RadauSettings::default() }
}

#[test]
fn an_error_that_still_falls_asks_for_more_meshes() {
    let found = deficiency(0.05, 10.0, few(2));
    assert!(
        found.to_string().contains("it still falls (4.5e-3 at the least of the meshes before, then "),
        "{found}"
    );
    assert_eq!(found.remedies, [Remedy::Raise(&["max_refinements"])]);
}

#[test]
fn a_limit_that_is_met_where_the_error_is_largest_is_named() {
    let found = deficiency(0.05, 1.3, few(0));
    assert!(found.to_string().contains("there `speed` is at its limit"), "{found}");
}

#[test]
fn an_error_that_stands_still_asks_for_no_more_meshes() {
    let found = deficiency(1e-7, 10.0, few(9));
    assert_eq!(found.remedies, [Remedy::Raise(&["tolerance"])]);
    let told = found.to_string();
    assert!(told.contains("it no longer falls (") && told.contains("divide the phase there"), "{told}");
}
