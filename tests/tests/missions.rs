//! The lunar missions through the facade, against an independent solution.
//!
//! Reference numbers: indirect shooting (DOP853, 1e-13) of the same equations and constants, which an independent
//! collocation with 10 x 5 Radau points meets to 1e-9 s (one phase) and 2e-8 s (two phases).
#![allow(clippy::unwrap_used)]

use apsides::verify::Check;
use apsides::{Error, Mission, Outcome};
use apsides_tests::tolerance::{
    FINAL_MASS_KG, FLIGHT_TIME_S, GATE_SPEED_M_S, POSITION_MISS_M, SPEED_MISS_M_S, TWO_PHASE_TIME_S,
};

fn solve(name: &str, overrides: &[&str]) -> Outcome {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).into()).collect();
    Mission::load(name, &overrides).unwrap().solve(None, &mut ()).unwrap()
}

fn near(outcome: &Outcome, key: &str, expected: f64, tolerance: f64) {
    let found = outcome.summary.results[key];
    assert!((found - expected).abs() < tolerance, "{key}: found {found}, expected {expected}");
}

fn verified(outcome: &Outcome) {
    assert_eq!(outcome.summary.status, "optimal", "{:?}", outcome.explanation);
    assert!(outcome.explanation.is_none());
    let certificate = &outcome.summary.certificate;
    assert!(certificate.is_verified(), "{certificate:#?}");
    let misses: Vec<&Check> =
        certificate.checks.iter().filter(|c| c.name.starts_with("re-simulated")).collect();
    assert!(!misses.is_empty());
    for c in misses {
        let limit = match c.unit.as_str() {
            "m" => POSITION_MISS_M,
            "m/s" => SPEED_MISS_M_S,
            _ => c.limit,
        };
        assert!(c.value < limit, "{c:?}");
    }
}

fn single_phase(name: &str, overrides: &[&str], time: f64, mass: f64) {
    let outcome = solve(name, overrides);
    verified(&outcome);
    near(&outcome, "flight_time_s", time, FLIGHT_TIME_S);
    near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
}

#[test]
fn direct_from_100_km() {
    single_phase("lunar-direct", &[], 1037.2005909330594, 149.8872563012772);
}

#[test]
fn from_perilune() {
    let cases = [
        ("50", 1012.291947788343, 152.37822362745808),
        ("25", 1001.3902427828095, 153.38599494117895),
        ("20", 999.3569839960355, 153.56519464235802),
        ("15", 997.3758488117479, 153.73649062922414),
        ("10", 995.4480792466301, 153.89970137117336),
        ("5", 993.5748653764407, 154.0546528425521),
    ];
    for (altitude, time, mass) in cases {
        single_phase("lunar-perilune", &[&format!("perilune_altitude_km={altitude}")], time, mass);
    }
}

#[test]
fn two_phases() {
    let cases = [
        ("5", 1036.346337936439, -109.64263848880935, 148.096340501151),
        ("4", 1031.730449948327, -98.20080827163227, 148.7643921939081),
        ("3", 1026.5994207858944, -85.20648581660842, 149.5069996242394),
        ("2", 1020.6553452674615, -69.77251745004816, 150.36727823632705),
        ("1", 1013.1302850041927, -49.61513567030749, 151.45637079228223),
    ];
    for (gate, time, speed, mass) in cases {
        let outcome = solve("lunar-two-phase", &[&format!("gate_altitude_km={gate}")]);
        verified(&outcome);
        near(&outcome, "flight_time_s", time, TWO_PHASE_TIME_S);
        near(&outcome, "gate_radial_velocity_m_s", speed, GATE_SPEED_M_S);
        near(&outcome, "final_mass_kg", mass, FINAL_MASS_KG);
    }
}

#[test]
fn too_little_thrust_is_explained() {
    let outcome = solve("lunar-direct", &["thrust_n=100", "dry_mass_kg=60"]);
    assert_ne!(outcome.summary.status, "optimal");
    let explanation = outcome.explanation.unwrap();
    assert!(explanation.contains("phase `braking`: mass at least 60 kg: short by"), "{explanation}");
    assert!(!outcome.summary.certificate.is_verified());
}

#[test]
fn contradictions_are_refused_with_numbers() {
    let cases: [(&[&str], &str); 4] = [
        (&["thrust_n=50"], "thrust_n"),
        (&["dry_mass_kg=300"], "dry_mass_kg"),
        (&["dry_mass_kg=200", "thrust_n=2000"], "propellant"),
        (&["perilune_altitude_km=100"], "perilune_altitude_km"),
    ];
    for (overrides, word) in cases {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).into()).collect();
        match Mission::load("lunar-perilune", &overrides) {
            Err(e @ Error::Conflict { .. }) => assert!(e.to_string().contains(word), "{e}"),
            other => panic!("{overrides:?}: {other:?}"),
        }
    }
}

#[test]
fn bad_input_is_refused_with_place_and_key() {
    let load = |o: &str| Mission::load("lunar-perilune", &[o.into()]).unwrap_err().to_string();
    for o in
        ["thrust_n=nan", "thrust_n=-1", "thrust_n=0", "thrust_n=inf", "thrust_n=\"strong\"", "radau.points=0"]
    {
        let message = load(o);
        assert!(message.contains(o.split('=').next().unwrap()), "{message}");
    }
    assert!(load("perilune_altitude=15").contains("perilune_altitude_km"));
    assert!(load("thrust_n").contains("key=value"));
    let message = Mission::load("lunar-perilun", &[]).unwrap_err().to_string();
    assert!(message.contains("lunar-perilune"), "{message}");
}
