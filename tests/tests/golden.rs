//! Meshes and iterations of a few solves do not exceed the stored ones.
#![allow(clippy::unwrap_used)]

use apsides::Mission;
use apsides_tests::golden::{Counters, Work, blessing, load, store};
use apsides_tests::{radau, solve};

const PROBLEMS: &[&str] = &[
    "lqr_scalar",
    "brachistochrone_dymos",
    "linear_tangent",
    "hypersensitive",
    "hypersensitive_long",
    "cart_pole",
    "moon_lander_soft",
];
const MISSIONS: &[&str] = &["lunar-direct", "lunar-perilune", "lunar-two-phase"];

fn count() -> Counters {
    let problems = PROBLEMS.iter().map(|name| {
        let problem = apsides_problems::find(name).unwrap();
        let run = solve(problem, &radau(problem)).unwrap();
        (name.to_string(), Work { meshes: run.solution.meshes.len(), iterations: run.iterations() })
    });
    let missions = MISSIONS.iter().map(|name| {
        let outcome = Mission::load(name, &[]).unwrap().solve(None, &mut ()).unwrap();
        let counters = outcome.summary.counters;
        (name.to_string(), Work { meshes: counters.mesh_iterations, iterations: counters.iterations })
    });
    problems.chain(missions).collect()
}

#[test]
fn counters_do_not_exceed_the_stored_ones() {
    let found = count();
    if blessing() {
        store(&found).unwrap();
    }
    let stored = load().unwrap();
    for (name, work) in &found {
        let limit = stored.get(name).unwrap_or_else(|| panic!("`{name}` has no stored counters"));
        let within = work.meshes <= limit.meshes && work.iterations <= limit.iterations;
        assert!(within, "{name}: found {work:?}, stored {limit:?}; APSIDES_BLESS=1 stores the new counters");
    }
    assert!(stored.keys().all(|name| found.contains_key(name)), "a stored name is not solved any more");
}
