//! A sweep starts each case from its neighbour: fewer interior-point iterations than from the mission's own guess.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use apsides_missions::registry;
use apsides_pipeline::sweep::{Axis, cases, sweep};

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
