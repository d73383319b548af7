//! A sweep starts each case from its neighbour: fewer interior-point iterations than from the mission's own guess.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::cell::Cell;

use apsides_missions::registry;
use apsides_pipeline::sweep::{Axis, cases, sweep};
use common::Panicking;

/// Discretisation: the same case from two starts, relative.
const MESH: f64 = 1e-6;

/// Solves a sweep, and each of its cases from the mission's own guess.
fn compare(mission: &str, axis: &str) {
    let cases = cases(&registry(), mission, &[Axis::parse(axis).unwrap()]).unwrap();
    let mut place = 0;
    sweep(&cases, &mut (), |case, warm| {
        let warm = warm.unwrap();
        let cold = case.mission.solve(None, &mut ()).unwrap();
        let (a, b) = (&cold.summary, &warm.summary);
        println!(
            "{mission} {:<26} cold {:>3} iterations on {} meshes, warm {:>3} on {}",
            case.overrides[0],
            a.counters.iterations,
            a.counters.mesh_iterations,
            b.counters.iterations,
            b.counters.mesh_iterations
        );
        assert_eq!((a.status.as_str(), b.status.as_str()), ("optimal", "optimal"));
        let error = (a.objective.value - b.objective.value).abs() / a.objective.value;
        assert!(error < MESH, "{} and {}", a.objective.value, b.objective.value);
        if place > 0 {
            assert!(b.counters.iterations < a.counters.iterations, "{mission} {:?}", case.overrides);
        }
        place += 1;
        true
    })
    .unwrap();
    assert_eq!(place, cases.len());
}

#[test]
fn perilune_altitudes() {
    compare("lunar-perilune", "perilune_altitude_km=50,25,20,15,10,5");
}

#[test]
fn thrusts() {
    compare("lunar-direct", "thrust_n=480,440,400,360");
}

#[test]
fn two_phases() {
    compare("lunar-two-phase", "isp_s=320,310,300");
}

/// A panic costs its own case; those before and after it are what they are without.
#[test]
fn a_panic_is_a_case_that_failed() {
    let cases =
        cases(&registry(), "lunar-direct", &[Axis::parse("thrust_n=480,440,400,360").unwrap()]).unwrap();
    let (mut told, planted) = (Vec::new(), Cell::new(false));
    sweep(&cases, &mut Panicking(&planted), |case, solved| {
        told.push((
            case.overrides[0].clone(),
            solved.map(|o| o.summary.objective.value).map_err(str::to_owned),
        ));
        planted.set(told.len() == 2);
        true
    })
    .unwrap();
    let overrides: Vec<&str> = told.iter().map(|(case, _)| case.as_str()).collect();
    assert_eq!(overrides, ["thrust_n=480", "thrust_n=440", "thrust_n=400", "thrust_n=360"]);
    let fault = told[2].1.as_ref().unwrap_err();
    assert_eq!(fault, "planted in iteration 0");
    for k in [0, 1, 3] {
        let expected = cases[k].mission.solve(None, &mut ()).unwrap().summary.objective.value;
        let found = *told[k].1.as_ref().unwrap();
        assert!((found / expected - 1.0).abs() < MESH, "{found} and {expected}");
    }
}
