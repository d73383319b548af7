//! Missions by successive convexification: its controls are linear between the nodes, so that it ends above the optimum.
#![allow(clippy::unwrap_used)]

use apsides_missions::registry;
use apsides_pipeline::{Error, Outcome};
use apsides_verify::Verdict;

/// Discretisation: what controls linear on 40 intervals of each phase miss of the optimum, relative.
const LINEAR_CONTROLS: f64 = 1e-5;

fn solve(name: &str, overrides: &[&str]) -> Result<Outcome, Error> {
    let overrides = overrides.iter().map(|o| (*o).to_owned());
    let all: Vec<String> =
        std::iter::once("method=successive-convexification".into()).chain(overrides).collect();
    registry().load(name, &all)?.solve(None, &mut ())
}

/// Optima by collocation: 997.3758488 s, and 15565.672402671438 kg with an independent program (`tests/tests/injection.rs`).
#[test]
fn landings_and_injections_are_flown_as_planned_just_above_the_optimum() {
    let cases = [
        ("lunar-perilune", "flight_time_s", 997.375_848_8),
        ("geo-3-burn", "propellant_kg", 15_565.672_402_671_438),
    ];
    for (name, key, optimum) in cases {
        let outcome = solve(name, &[]).unwrap();
        assert_eq!(outcome.summary.status, "optimal", "{name}: {:?}", outcome.explanation);
        assert_eq!(outcome.summary.certificate.verdict, Verdict::Feasible, "{name}");
        let above = outcome.summary.results[key] / optimum - 1.0;
        assert!((0.0..LINEAR_CONTROLS).contains(&above), "{name}: {above}");
    }
}

#[test]
fn what_it_cannot_fly_is_said() {
    let refused = |name: &str, overrides: &[&str]| solve(name, overrides).err().unwrap().to_string();
    let bank = refused("capsule-reentry", &["margins=false"]);
    assert!(bank.contains("they cannot keep the equality `") && bank.contains("of phase `entry`"), "{bank}");
    let intervals = refused("lunar-perilune", &["convexification.intervals=0"]);
    assert!(intervals.contains("`convexification.intervals` is 0"), "{intervals}");
    let outcome = solve("lunar-perilune", &["convexification.max_iterations=2"]).unwrap();
    assert_eq!(outcome.summary.status, "iteration-limit");
}
