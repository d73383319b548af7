//! Problems of the gallery on the double integrator, which is flat in its position, against their closed forms.
#![allow(clippy::unwrap_used)]

use apsides_ad::{FlatMap, Scalar};
use apsides_flatness::{FlatSystem, Flatness};
use apsides_verify::{VerifySettings, verify};

/// Discretisation: ten times `FlatSettings::objective_tolerance` as it is set here, relative.
const OBJECTIVE: f64 = 1e-4;

/// `x' = v`, `v' = u` in the output `x`.
#[derive(Clone, Copy)]
struct Position;

impl FlatMap<1, 3, 2, 1, 0> for Position {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 1], _p: &[S; 0]) -> ([S; 2], [S; 1], [S; 0]) {
        ([y[0][0], y[0][1]], [y[0][2]], [])
    }

    fn outputs(&self, _t: f64, x: &[f64; 2], _u: &[f64; 1], _p: &[f64; 0]) -> [f64; 1] {
        [x[0]]
    }
}

#[test]
fn double_integrators() {
    for name in ["di_min_energy", "di_bang_bang"] {
        let problem = apsides_problems::find(name).unwrap();
        let case = problem.pose().unwrap();
        let solution =
            Flatness::default().solve(&case.ocp, &[FlatSystem::new(Position)], &case.guess).unwrap();
        assert!(solution.accurate, "{name}: {} {:?}", solution.status, solution.solves);
        let objective = solution.trajectory.objective;
        assert!(problem.optimum.agrees_with(objective), "{name}: {objective}");
        let certificate =
            verify(&case.ocp, &solution.trajectory, &VerifySettings::default()).unwrap().certificate;
        assert!(certificate.is_verified(), "{name}: {certificate:#?}");
    }
}

/// A bound on the output that holds at the points and is exceeded between them: the segments are refined until it holds.
#[test]
fn state_bound_between_the_points() {
    let problem = apsides_problems::find("bryson_denham").unwrap();
    let case = problem.pose().unwrap();
    let mut method = Flatness::default();
    // The contact begins and ends between the breaks, where the control has a kink.
    method.settings.objective_tolerance = 1e-5;
    method.settings.path_tolerance = 1e-5;
    let solution = method.solve(&case.ocp, &[FlatSystem::new(Position)], &case.guess).unwrap();
    assert!(solution.accurate, "{} {:?}", solution.status, solution.solves);
    assert!(
        (solution.trajectory.objective - 4.0).abs() < OBJECTIVE * 4.0,
        "{}",
        solution.trajectory.objective
    );
    assert!(solution.splines[0].breaks.len() > 5, "segments were halved");
}
