//! Every problem of the gallery by Radau collocation with mesh refinement, against its sourced optimum.
#![allow(clippy::unwrap_used)]

use apsides::nlp::Status;
use apsides::radau::Radau;
use apsides::verify::Verdict;
use apsides_problems::GALLERY;
use apsides_tests::{Run, solve};

/// The properties of a solution.
#[derive(Clone, Copy, PartialEq)]
enum Quality {
    /// The problem is convex and the first-order conditions hold.
    GlobalOptimum,
    /// The second-order sufficient conditions hold.
    StrictLocalOptimum,
    /// Pontryagin's minimum principle holds; the Hamiltonian is singular on an arc.
    Extremal,
}

fn solved(name: &str) -> Run {
    let problem = apsides_problems::find(name).unwrap();
    let run = solve(problem, &Radau::default()).unwrap();
    assert_eq!(run.solution.status, Status::Optimal, "{}", run.table_row());
    run
}

fn check(name: &str, quality: Quality) {
    let run = solved(name);
    assert!(run.solution.accurate, "mesh limit: {}", run.table_row());
    assert!(run.problem.optimum.agrees_with(run.solution.trajectory.objective), "{}", run.table_row());
    let (along, elsewhere) = run.infeasibilities();
    assert!(elsewhere.is_empty(), "{elsewhere:#?}");
    assert!(along.is_empty(), "{along:#?}");
    let verdict = match quality {
        Quality::GlobalOptimum => Verdict::GlobalOptimum,
        Quality::StrictLocalOptimum => Verdict::StrictLocalOptimum,
        Quality::Extremal => Verdict::Extremal,
    };
    assert_eq!(run.certificate.verdict, verdict, "{:#?}", run.certificate);
}

macro_rules! literature {
    ($($name:ident: $quality:ident,)*) => {
        $(#[test] fn $name() { check(stringify!($name), Quality::$quality); })*

        /// Problems of the gallery that have a test in this list.
        const LISTED: &[&str] = &[$(stringify!($name)),*];
    };
}

literature! {
    lqr_scalar: GlobalOptimum,
    di_min_energy: GlobalOptimum,
    di_min_energy_free_speed: GlobalOptimum,
    brachistochrone_free_y: StrictLocalOptimum,
    brachistochrone_dymos: StrictLocalOptimum,
    linear_tangent: StrictLocalOptimum,
    hanging_chain: StrictLocalOptimum,
    hypersensitive: StrictLocalOptimum,
    hypersensitive_long: StrictLocalOptimum,
    orbit_raising: StrictLocalOptimum,
    cart_pole: StrictLocalOptimum,
    pvtol: StrictLocalOptimum,
    shuttle_reentry: StrictLocalOptimum,
    shuttle_heat_limit: StrictLocalOptimum,
    min_time_climb: StrictLocalOptimum,
    delta_iii: StrictLocalOptimum,
    van_der_pol: StrictLocalOptimum,
    rayleigh_path: StrictLocalOptimum,
    brachistochrone_wall: StrictLocalOptimum,
    bryson_denham: GlobalOptimum,
    bryson_denham_contact: GlobalOptimum,
    di_bang_bang: GlobalOptimum,
    moon_lander_soft: StrictLocalOptimum,
    free_flying_robot: Extremal,
    powered_descent: StrictLocalOptimum,
    powered_descent_above_ground: StrictLocalOptimum,
    powered_descent_glide_slope: StrictLocalOptimum,
    di_singular_arc: Extremal,
    catmix: Extremal,
    catmix_reversed: Extremal,
    catmix_arcs: StrictLocalOptimum,
    goddard_cops: Extremal,
}

#[test]
fn every_problem_has_a_test() {
    for problem in GALLERY {
        assert!(LISTED.contains(&problem.name), "{}", problem.name);
    }
}
