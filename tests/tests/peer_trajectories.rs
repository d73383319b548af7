//! Trajectories of other programs, judged: `benches/peers/certified.py` makes the files.
#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::path::Path;

use apsides::verify::{Interpolation, Verdict, VerifySettings, sampled, verify};
use apsides_problems::find;
use apsides_report::read_samples;

/// Published: digits of the ratio that the README of the peers prints.
const PUBLISHED: f64 = 1e-5;

/// Discretisation: what a re-simulation differs by from nodes of a converged mesh.
const MESH: f64 = 1e-8;

/// The facts about a file.
struct Judged {
    verdict: Verdict,
    interpolation: Interpolation,
    /// Largest distance of the samples from the flight under their controls, relative to scales.
    deviation: f64,
    /// Objective over that of the gallery.
    ratio: f64,
}

fn judge(problem: &str, file: &str) -> Judged {
    let entry = find(problem).unwrap();
    let ocp = entry.pose().unwrap().ocp;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../benches/peers/certified").join(file);
    let samples = read_samples(File::open(path).unwrap(), &ocp).unwrap();
    let settings = VerifySettings::default();
    let flown = sampled(&ocp, &samples.phases, &samples.parameters, None, &settings).unwrap();
    let certificate = verify(&ocp, &flown.trajectory, &settings).unwrap().certificate;
    Judged {
        verdict: certificate.verdict,
        interpolation: flown.interpolation,
        deviation: flown.deviation,
        ratio: flown.trajectory.objective / entry.optimum.value,
    }
}

/// Constant controls on 100 segments: flown exactly, 0.018 % above the optimum among all controls.
#[test]
fn multiple_shooting_of_casadi_is_feasible_and_no_optimum_among_all_controls() {
    let judged = judge("van_der_pol", "casadi_van_der_pol.csv");
    assert_eq!(judged.verdict, Verdict::Feasible);
    assert_eq!(judged.interpolation, Interpolation::Constant);
    assert!(judged.deviation < MESH, "{}", judged.deviation);
    assert!((judged.ratio - 1.000182).abs() < PUBLISHED, "{}", judged.ratio);
}

/// 4e-11 above the cycloid; the control of its lower bound, 0.01 deg, is not that of the cycloid at the start.
#[test]
fn collocation_of_dymos_meets_the_optimum() {
    let judged = judge("brachistochrone_dymos", "dymos_brachistochrone.csv");
    assert_eq!(judged.verdict, Verdict::Feasible);
    assert!(judged.deviation < 100.0 * MESH, "{}", judged.deviation);
    assert!((0.0..1e-9).contains(&(judged.ratio - 1.0)), "{}", judged.ratio);
}

/// 4 % above the optimum with the default weights, and its controls miss the end by 2 cm.
#[test]
fn successive_convexification_of_openscvx_does_not_meet_the_end() {
    let judged = judge("brachistochrone_dymos", "openscvx_brachistochrone.csv");
    assert_eq!(judged.verdict, Verdict::Rejected);
    assert!(judged.deviation > 1e5 * MESH, "{}", judged.deviation);
    assert!((judged.ratio - 1.0414).abs() < 100.0 * PUBLISHED, "{}", judged.ratio);
}
