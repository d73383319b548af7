//! Every problem of the gallery by Radau collocation with mesh refinement, against its sourced optimum.
#![allow(clippy::unwrap_used)]

use apsides::nlp::Status;
use apsides::ode::{FnSystem, Integrator, OdeSettings};
use apsides::verify::Verdict;
use apsides_problems::GALLERY;
use apsides_tests::{Run, radau, solve, tolerance};

/// What holds of a solution.
#[derive(Clone, Copy, PartialEq)]
enum Quality {
    /// The first-order conditions are verified.
    LocalOptimum,
    /// Every check of feasibility holds; the control is not determined somewhere, or a state bound is active.
    Feasible,
    /// Feasible up to the bounds between the nodes: near a jump or kink the polynomials overshoot there.
    FeasibleAtNodes,
}

fn solved(name: &str) -> Run {
    let problem = apsides_problems::find(name).unwrap();
    let run = solve(problem, &radau(problem)).unwrap();
    assert_eq!(run.solution.status, Status::Optimal, "{}", run.table_row());
    run
}

fn check(name: &str, quality: Quality) {
    let run = solved(name);
    assert!(run.solution.accurate, "mesh limit: {}", run.table_row());
    assert!(run.problem.optimum.agrees_with(run.solution.trajectory.objective), "{}", run.table_row());
    let (along, elsewhere) = run.infeasibilities();
    assert!(elsewhere.is_empty(), "{elsewhere:#?}");
    if quality != Quality::FeasibleAtNodes {
        assert!(along.is_empty(), "{along:#?}");
    }
    if quality == Quality::LocalOptimum {
        assert_eq!(run.certificate.verdict, Verdict::LocalOptimum, "{:#?}", run.certificate);
    }
}

macro_rules! literature {
    ($($name:ident: $quality:ident,)*) => {
        $(#[test] fn $name() { check(stringify!($name), Quality::$quality); })*

        /// Problems of the gallery that have a test in this list.
        const LISTED: &[&str] = &[$(stringify!($name)),*];
    };
}

literature! {
    lqr_scalar: LocalOptimum,
    di_min_energy: LocalOptimum,
    di_min_energy_free_speed: LocalOptimum,
    brachistochrone_free_y: Feasible,
    brachistochrone_dymos: Feasible,
    linear_tangent: LocalOptimum,
    hanging_chain: Feasible,
    hypersensitive: LocalOptimum,
    hypersensitive_long: LocalOptimum,
    orbit_raising: FeasibleAtNodes,
    cart_pole: LocalOptimum,
    shuttle_reentry: LocalOptimum,
    shuttle_heat_limit: FeasibleAtNodes,
    min_time_climb: Feasible,
    delta_iii: LocalOptimum,
    van_der_pol: FeasibleAtNodes,
    rayleigh_path: FeasibleAtNodes,
    brachistochrone_wall: Feasible,
    bryson_denham: Feasible,
    di_bang_bang: Feasible,
    moon_lander_soft: FeasibleAtNodes,
    free_flying_robot: FeasibleAtNodes,
    powered_descent: FeasibleAtNodes,
    powered_descent_glide_slope: FeasibleAtNodes,
    di_singular_arc: FeasibleAtNodes,
    catmix_reversed: FeasibleAtNodes,
    catmix_arcs: LocalOptimum,
    goddard_cops: FeasibleAtNodes,
}

/// Along the singular arc the control chatters and gains from the error of the rule, which falls with the first power of
/// the number of nodes. The equations of motion take nothing of it: the same control within its bounds is no better than
/// the optimum.
#[test]
fn catmix() {
    let run = solved("catmix");
    assert!(run.difference() < 0.0 && run.difference() > -tolerance::CHATTERING, "{}", run.table_row());
    let phase = &run.solution.trajectory.phases[0];
    let mut integrator = Integrator::new(2, OdeSettings::default()).unwrap();
    let mut x = [1.0, 0.0];
    for (segment, ends) in phase.control.breaks().windows(2).enumerate() {
        let reactor = FnSystem::new(2, |t, x: &[f64], dx: &mut [f64]| {
            let mut u = [0.0];
            phase.control.evaluate_in(segment, t, &mut u);
            let exchange = u[0].clamp(0.0, 1.0) * (10.0 * x[1] - x[0]);
            dx.copy_from_slice(&[exchange, -exchange - (1.0 - u[0].clamp(0.0, 1.0)) * x[1]]);
        });
        let start = x;
        integrator.integrate(&reactor, ends[0], &start, ends[1], &mut x).unwrap();
    }
    let simulated = run.problem.optimum.relative_difference(x[0] + x[1] - 1.0);
    assert!(simulated > 0.0, "simulated: {simulated:e}");
}

#[test]
fn every_problem_has_a_test() {
    for problem in GALLERY {
        let alone = ["catmix"];
        assert!(LISTED.contains(&problem.name) || alone.contains(&problem.name), "{}", problem.name);
    }
}
