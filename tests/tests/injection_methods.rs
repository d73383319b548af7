//! The injections into geostationary orbit by indirect shooting and by multiple shooting: the same optimum as by collocation
//! (`injection.rs`, where the references are described), in few iterations from the analytic guess.
#![allow(clippy::unwrap_used)]

use apsides::Outcome;
use apsides_tests::mission::EQUATORIAL_INJECTIONS;
use apsides_tests::tolerance::PROPELLANT_KG;

/// Published: digits of the final mass by collocation.
const COLLOCATION_KG: f64 = 1e-2;

/// Newton iterations of the indirect method from the analytic guess, at most.
const NEWTON_ITERATIONS: usize = 6;

fn solve(name: &str, method: &str, overrides: &[&str]) -> Outcome {
    let mut all: Vec<String> = overrides.iter().map(|o| (*o).into()).collect();
    all.push(format!("method={method}"));
    apsides::load(name, &all).unwrap().solve(None, &mut ()).unwrap()
}

/// Verified, without a detour through another method, with this propellant.
fn injected(name: &str, method: &str, overrides: &[&str], propellant: f64, tolerance: f64) -> Outcome {
    let outcome = solve(name, method, overrides);
    let place = format!("{name} {overrides:?} by {method}");
    assert_eq!(outcome.summary.status, "optimal", "{place}: {:?}", outcome.explanation);
    assert!(outcome.summary.warnings.is_empty(), "{place}: {:?}", outcome.summary.warnings);
    let certificate = &outcome.summary.certificate;
    assert!(certificate.is_verified(), "{place}: {:#?}", certificate.failures().collect::<Vec<_>>());
    let found = outcome.summary.results["propellant_kg"];
    assert!((found - propellant).abs() < tolerance, "{place}: {found} kg, expected {propellant}");
    outcome
}

#[test]
fn equatorial() {
    for (mass, name, propellant) in EQUATORIAL_INJECTIONS {
        let mass = format!("initial_mass_kg={mass}");
        injected(name, "indirect", &[&mass], propellant, PROPELLANT_KG);
        injected(name, "multiple-shooting", &[&mass], propellant, PROPELLANT_KG);
    }
}

#[test]
fn newton_takes_few_iterations_for_every_stage() {
    for vehicle in ["breeze-m", "block-dm", "fregat", "fregat-sb", "centaur-d", "yastreb"] {
        for burns in 2..=6 {
            let outcome = solve(&format!("geo-{burns}-burn"), "indirect", &[&format!("vehicle={vehicle}")]);
            assert_eq!(outcome.summary.status, "optimal");
            let iterations = outcome.summary.counters.iterations;
            assert!(iterations <= NEWTON_ITERATIONS, "{vehicle}, {burns} burns: {iterations} iterations");
        }
    }
}

#[test]
fn with_plane_change() {
    for (name, inclination, propellant) in [
        ("geo-2-burn", "28.5", 16429.371201815775),
        ("geo-3-burn", "28.5", 16220.229740197341),
        ("geo-2-burn", "51.6", 17407.15532360812),
    ] {
        let key = format!("inclination_deg={inclination}");
        injected(name, "indirect", &[&key], propellant, PROPELLANT_KG);
        // At 51.6 deg the thrust of the last burn of two turns by more than its polynomials follow to 1e-5.
        if inclination == "28.5" {
            injected(name, "multiple-shooting", &[&key], propellant, PROPELLANT_KG);
        }
    }
}

/// 14.479 kg more than with optimal steering.
#[test]
fn thrust_along_the_velocity() {
    for method in ["indirect", "multiple-shooting"] {
        injected("geo-2-burn", method, &["steering=velocity"], 15764.7267480627, PROPELLANT_KG);
    }
}

/// Bounds that the solution of the unlimited problem exceeds: of the flight time (a point between those of the Pareto front, by
/// collocation), of burns (by collocation, `injection.rs`).
#[test]
fn limits() {
    let collocated =
        solve("geo-2-burn", "radau", &["max_flight_time_s=19076.4"]).summary.results["propellant_kg"];
    assert!((collocated - 15812.904).abs() < COLLOCATION_KG, "{collocated}");
    injected("geo-2-burn", "indirect", &["max_flight_time_s=19076.4"], collocated, PROPELLANT_KG);
    injected("geo-3-burn", "indirect", &["max_burn_time_s=980"], 15565.990952886, PROPELLANT_KG);
}

/// Oblateness: the coasts are phases of the problem.
#[test]
fn with_oblateness() {
    for method in ["indirect", "multiple-shooting"] {
        let outcome = solve("geo-2-burn", method, &["oblateness=true"]);
        assert_eq!(outcome.summary.status, "optimal", "{method}");
        let found = outcome.summary.results["propellant_kg"];
        assert!((found - 15753.873690).abs() < PROPELLANT_KG, "{method}: {found}");
    }
}
