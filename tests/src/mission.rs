//! A mission through the facade: loaded with other values, solved, verified, compared.

use apsides::{Error, Outcome, Pipeline};

/// A mission with other values, each `key=value`.
///
/// # Errors
/// As of [`apsides::load`].
pub fn load(name: &str, overrides: &[&str]) -> Result<Pipeline, Error> {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).into()).collect();
    apsides::load(name, &overrides)
}

/// The outcome of a mission with other values.
///
/// # Panics
/// Where the mission cannot be posed.
#[must_use]
pub fn solve(name: &str, overrides: &[&str]) -> Outcome {
    let solved = load(name, overrides).and_then(|mission| mission.solve(None, &mut ()));
    solved.unwrap_or_else(|e| panic!("{name} {overrides:?}: {e}"))
}

/// Asserts that a result has this value.
///
/// # Panics
/// Where it has not.
pub fn near(outcome: &Outcome, key: &str, expected: f64, tolerance: f64) {
    let found = outcome.summary.results[key];
    assert!((found - expected).abs() < tolerance, "{key}: found {found}, expected {expected}");
}

/// Asserts that the outcome is an optimum that the certificate confirms.
///
/// # Panics
/// Where it is not.
pub fn verified(outcome: &Outcome) {
    assert_eq!(outcome.summary.status, "optimal", "{:?}", outcome.explanation);
    let certificate = &outcome.summary.certificate;
    assert!(certificate.is_verified(), "{:#?}", certificate.failures().collect::<Vec<_>>());
}

/// Initial mass (kg), mission and propellant (kg) of equatorial injections with two to six burns: indirect shooting in modified equinoctial
/// elements and collocation, which agree to 1.3e-8 kg.
pub const EQUATORIAL_INJECTIONS: [(&str, &str, f64); 10] = [
    ("22100", "geo-2-burn", 15750.247336058106),
    ("22100", "geo-3-burn", 15565.672402671438),
    ("22100", "geo-4-burn", 15524.886148083533),
    ("22100", "geo-5-burn", 15510.099937002784),
    ("22100", "geo-6-burn", 15503.165417920809),
    ("22170", "geo-2-burn", 15801.500887467913),
    ("22170", "geo-3-burn", 15615.431377139967),
    ("22170", "geo-4-burn", 15574.273849856629),
    ("22170", "geo-5-burn", 15559.349782895875),
    ("22170", "geo-6-burn", 15552.350024452735),
];
