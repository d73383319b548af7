//! The work of solves is that of the stored counters: the whole gallery, and missions.
#![allow(clippy::unwrap_used)]

use apsides::radau::Radau;
use apsides_problems::GALLERY;
use apsides_tests::golden::{Counters, Work, blessing, kkt_nonzeros, load, store};
use apsides_tests::solve;

const MISSIONS: &[&str] = &[
    "lunar-direct",
    "lunar-perilune",
    "lunar-two-phase",
    "lunar-vertical",
    "lunar-throttled",
    "lunar-coast",
    "geo-1-burn",
    "geo-2-burn",
    "geo-3-burn",
    "chang-e-3-braking",
];

fn count() -> Counters {
    let problems = GALLERY.iter().map(|problem| {
        let run = solve(problem, &Radau::default()).unwrap();
        let work = Work {
            meshes: run.solution.meshes.len(),
            iterations: run.iterations(),
            factorisations: run.factorisations(),
            nonzeros: kkt_nonzeros(&problem.pose().unwrap().ocp, &run.solution.trajectory).unwrap(),
        };
        (problem.name.to_string(), work)
    });
    let missions = MISSIONS.iter().map(|name| {
        let outcome = apsides::load(name, &[]).unwrap().solve(None, &mut ()).unwrap();
        let counters = outcome.summary.counters;
        let (ocp, trajectory) = outcome.solved();
        let work = Work {
            meshes: counters.mesh_iterations,
            iterations: counters.iterations,
            factorisations: counters.factorisations,
            nonzeros: kkt_nonzeros(ocp, trajectory).unwrap(),
        };
        (name.to_string(), work)
    });
    problems.chain(missions).collect()
}

#[test]
fn counters_are_near_the_stored_ones() {
    let found = count();
    assert!(found.len() >= 25);
    if blessing() {
        store(&found).unwrap();
    }
    let stored = load().unwrap();
    let mut wrong = Vec::new();
    for (name, work) in &found {
        match stored.get(name) {
            None => wrong.push(format!("`{name}` has no stored counters")),
            Some(limit) if !work.is_near(limit) => {
                wrong.push(format!("{name}: found {work:?}, stored {limit:?}"))
            }
            Some(_) => {}
        }
    }
    assert!(wrong.is_empty(), "{}\nAPSIDES_BLESS=1 stores the new counters", wrong.join("\n"));
    assert!(stored.keys().all(|name| found.contains_key(name)), "a stored name is not solved any more");
}

#[test]
fn more_work_and_much_less_work_are_seen() {
    let stored = Work { meshes: 1, iterations: 50, factorisations: 60, nonzeros: 1000 };
    assert!(stored.is_near(&stored));
    assert!(Work { iterations: 45, ..stored }.is_near(&stored));
    assert!(!Work { iterations: 44, ..stored }.is_near(&stored));
    assert!(!Work { iterations: 51, ..stored }.is_near(&stored));
    assert!(!Work { nonzeros: 899, ..stored }.is_near(&stored));
}
