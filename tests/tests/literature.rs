//! Every problem of the gallery by Radau collocation with mesh refinement, against its sourced optimum.
#![allow(clippy::unwrap_used)]

use apsides::nlp::Status;
use apsides::verify::Verdict;
use apsides_problems::GALLERY;
use apsides_tests::{Run, radau, solve};

/// What holds of a solution.
#[derive(Clone, Copy, PartialEq)]
enum Quality {
    /// The first-order conditions are verified.
    LocalOptimum,
    /// Every check of feasibility holds; the control is not determined somewhere, or a state bound is active.
    Feasible,
    /// Feasible up to the path constraints between the nodes.
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
    pvtol: LocalOptimum,
    shuttle_reentry: LocalOptimum,
    shuttle_heat_limit: LocalOptimum,
    min_time_climb: Feasible,
    delta_iii: LocalOptimum,
    van_der_pol: LocalOptimum,
    rayleigh_path: LocalOptimum,
    brachistochrone_wall: Feasible,
    bryson_denham: Feasible,
    bryson_denham_contact: LocalOptimum,
    di_bang_bang: LocalOptimum,
    moon_lander_soft: LocalOptimum,
    free_flying_robot: Feasible,
    powered_descent: LocalOptimum,
    powered_descent_glide_slope: Feasible,
    di_singular_arc: LocalOptimum,
    catmix: LocalOptimum,
    catmix_reversed: LocalOptimum,
    catmix_arcs: LocalOptimum,
    goddard_cops: LocalOptimum,
}

#[test]
fn every_problem_has_a_test() {
    for problem in GALLERY {
        assert!(LISTED.contains(&problem.name), "{}", problem.name);
    }
}
