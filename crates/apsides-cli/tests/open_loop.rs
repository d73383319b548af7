//! Flights of any optimised mission along the controls of its plan.
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;

use serde_json::Value;
use support::{apsides, path, stderr};

/// Samples of a run.
const SAMPLES: &str = "300";
/// Sampling: five standard deviations of a standard deviation of so many samples, `5 / sqrt(2 N)`, relative.
const SAMPLING: f64 = 0.2;

fn statistics(mission: &str, deviations: &[&str]) -> Value {
    let run = ["montecarlo", mission, "--quiet", "--json", "--samples", SAMPLES];
    let o = apsides(&[&run[..], deviations].concat());
    assert_eq!(o.status.code(), Some(0), "{mission}: {}", stderr(&o));
    serde_json::from_slice(&o.stdout).unwrap()
}

/// Small deviations spread as the state-transition matrix says, over any phases and equations.
#[test]
fn every_kind_of_mission_spreads_as_its_state_transition_matrix_says() {
    let dir = tempfile::tempdir().unwrap();
    let own = path(&dir.path().join("own.toml"));
    assert_eq!(apsides(&["new", "problem", &own]).status.code(), Some(0));
    for (mission, state) in [
        ("lunar-perilune", "radius=10"),
        ("geo-2-burn", "semi-latus rectum=10"),
        ("capsule-reentry", "altitude=1"),
        (&*own, OWN_STATE),
    ] {
        let found = statistics(mission, &["--state", state]);
        let mut compared = 0;
        for spread in found["spreads"].as_array().unwrap() {
            let [sampled, linear] = ["sigma", "linear_sigma"].map(|key| spread[key].as_f64().unwrap());
            // States that do not depend on the deviation have no more than rounding.
            if linear > spread["largest"].as_f64().unwrap() * 1e-3 {
                assert!((sampled / linear - 1.0).abs() < SAMPLING, "{mission}: {spread}");
                compared += 1;
            }
        }
        assert!(compared > 0, "{mission}: {found}");
    }
    // A second phase with fewer states has no matrix over both, and is flown all the same.
    let found = statistics("lunar-two-phase", &["--state", "radius=10"]);
    assert!(found["spreads"][0]["linear_sigma"].is_null() && found["success"]["part"] == 1.0, "{found}");
}

/// The state of a problem that was begun by `apsides new problem`.
const OWN_STATE: &str = "h=0.1";

/// Round-off of two integrations, relative.
const ROUNDING: f64 = 1e-6;

/// Standard gravity of the lunar missions (their key `standard_gravity_m_s2`), m/s2.
const GRAVITY: f64 = 9.807;

/// Thrust that is larger by one newton burns `t / (I g)` more in the time of the plan.
#[test]
fn numbers_of_a_mission_deviate_along_its_controls() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir.path().join("flights"));
    let run = ["montecarlo", "lunar-perilune", "--quiet", "--samples", "8", "--vary", "thrust_n=2"];
    let o = apsides(&[&run[..], &["--out", &out]].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    let solved = apsides(&["solve", "lunar-perilune", "--quiet", "--json"]);
    let summary: Value = serde_json::from_slice(&solved.stdout).unwrap();
    let time = summary["results"]["flight_time_s"].as_f64().unwrap();
    let missions = apsides(&["missions", "lunar-perilune"]);
    let text = String::from_utf8(missions.stdout).unwrap();
    let line = text.lines().find(|line| line.starts_with("isp_s")).unwrap();
    let impulse: f64 = line.split('=').nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap();
    let expected = -time / (impulse * GRAVITY);
    let mut table = csv::Reader::from_path(format!("{out}/montecarlo.csv")).unwrap();
    let heads = table.headers().unwrap().clone();
    let column = |name: &str| heads.iter().position(|head| head == name).unwrap();
    let (thrust, mass) = (column("thrust_n"), column("end_mass_kg"));
    let mut rows = 0;
    for row in table.records() {
        let row = row.unwrap();
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let burnt = number(mass) / number(thrust);
        assert!((burnt / expected - 1.0).abs() < ROUNDING, "{burnt} {expected}");
        rows += 1;
    }
    assert_eq!(rows, 8);
    assert!(fs::metadata(format!("{out}/montecarlo.html")).is_ok());
}

#[test]
fn what_does_not_go_together_is_refused() {
    for (arguments, words) in [
        (
            &["lunar-perilune", "--state", "radus=1"][..],
            "no state is named `radus`; states of the first phase: `radius` (m), ",
        ),
        (&["lunar-perilune", "--vary", "thrst_n=1"], "the nearest is `thrust_n`"),
        (&["lunar-perilune", "--vary", "method=1"], "allowed is a number"),
        (&["lunar-perilune", "--state", "radius=-1"], "it must be finite and not negative"),
        (&["lunar-perilune", "--state", "radius=nan"], "it must be finite and not negative"),
        (&["lunar-perilune", "--state", "radius=1", "--sigma", "thrust_n=1"], "take one of them"),
        (&["lunar-perilune", "--state", "radius=1", "--guidance", "polynomial"], "without `--guidance`"),
        (&["lunar-perilune", "--state", "radius=1", "--thrust-percent", "1"], "--thrust-percent"),
        (&["moving-mass-cross", "--state", "radius=1"], "simulated under its law"),
        (&["chang-e-3-braking", "--feed-forward", "1,2,3,4"], "needs `--guidance linear-radial`"),
        (
            &["chang-e-3-braking", "--guidance", "linear-radial", "--feed-forward", "1,2"],
            "takes four gains, not 2",
        ),
        (
            &["chang-e-3-braking", "--guidance", "linear-radial", "--feed-forward", "1,2,3,nan"],
            "is not a gain",
        ),
        (&["geo-2-burn"], "every optimised one flies its controls in open loop"),
    ] {
        let o = apsides(&[&["montecarlo"], arguments].concat());
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {}", stderr(&o));
        assert!(stderr(&o).contains(words), "{arguments:?}: {}", stderr(&o));
    }
}
