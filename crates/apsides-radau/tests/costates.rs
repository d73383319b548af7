//! Accuracy of costates against a closed form.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_radau::{Radau, RadauSettings};

const DURATION: f64 = 20.0;

/// Discretisation: ten times `RadauSettings::costate_tolerance`.
const MESH: f64 = 5e-5;

struct Integrator;
impl Dynamics<1, 1> for Integrator {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

struct Cost;
impl PathFunction<1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(x[0].square() + u[0].square()) * 0.5]
    }
}

/// `x' = u`, least `int (x^2 + u^2) / 2`, `x(0) = 1`: `lambda = x tanh(T - t)`, `x = cosh(T - t) / cosh(T)` (A. Bryson and Y.-C. Ho, Applied
/// Optimal Control, 1975, section 5.2).
fn regulator() -> Ocp {
    let phase = Phase::new("rest", Integrator)
        .states([State::new("x", "-").starts_at(1.0)])
        .controls([Variable::new("u", "-")])
        .integral(Variable::new("cost", "-"), Cost)
        .final_time(Bounds::fixed(DURATION));
    Ocp::builder("regulator").phase(phase).minimize_integral("rest", "cost").build().unwrap()
}

fn largest_costate_error(settings: RadauSettings) -> (f64, usize) {
    let ocp = regulator();
    let solution = Radau { settings }.solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(solution.accurate);
    let costate = solution.trajectory.phases[0].costate.as_ref().unwrap();
    let error = |k: usize| {
        let t = DURATION * k as f64 / 1000.0;
        (costate.component(t, 0) - (DURATION - t).sinh() / DURATION.cosh()).abs()
    };
    ((0..=1000).map(error).fold(0.0, f64::max), solution.meshes.len())
}

#[test]
fn costates_get_meshes_of_their_own_where_states_are_accurate_before_them() {
    let coarse = RadauSettings { tolerance: 1e-4, ..RadauSettings::default() };
    let (error, meshes) = largest_costate_error(coarse.clone());
    let (before, fewer) = largest_costate_error(RadauSettings { costate_tolerance: f64::INFINITY, ..coarse });
    assert!(fewer < meshes, "{fewer} {meshes}");
    assert!(before > 1e-4, "{before:e}");
    assert!(error < MESH, "{error:e}");
}

/// The last mesh for the states has the points that the costates ask for, so that none follows for them.
#[test]
fn meshes_for_the_states_are_meshes_for_the_costates() {
    let settings = RadauSettings::default();
    let costate_tolerance = settings.costate_tolerance;
    let (error, meshes) = largest_costate_error(settings.clone());
    let (before, least) =
        largest_costate_error(RadauSettings { costate_tolerance: f64::INFINITY, ..settings });
    assert_eq!(meshes, least);
    assert!(error < costate_tolerance && costate_tolerance < before, "{error:e} {before:e}");
}

#[test]
fn a_tolerance_that_is_no_number_is_refused() {
    let ocp = regulator();
    for costate_tolerance in [0.0, -1.0, f64::NAN] {
        let settings = RadauSettings { costate_tolerance, ..RadauSettings::default() };
        let refused = Radau { settings }.solve(&ocp, &Guess::linear(&ocp)).unwrap_err().to_string();
        assert!(refused.contains("costate_tolerance"), "{refused}");
    }
}
