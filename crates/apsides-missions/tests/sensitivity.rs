//! Prices of keys against difference quotients of solved missions.
#![allow(clippy::unwrap_used)]

use apsides_missions::registry;
use apsides_pipeline::{Error, Outcome, Pipeline, Price, Summary};

/// Agreement of the objective, from the tolerance of the solves over the width.
const OBJECTIVE: f64 = 1e-5;
const FINAL_MASS: f64 = 1e-4;

/// Solver: the price of a limit that is not reached.
const NO_PRICE: f64 = 1e-6;

/// Discretisation: difference quotients of solves, relative.
const DIFFERENCES: f64 = 1e-3;

/// Solver: a price in closed form, relative.
const CLOSED_FORM: f64 = 1e-6;

/// Solver: prices of two keys that enter as a product, relative.
const SAME_PRICE: f64 = 1e-6;

fn solve(name: &str, overrides: &[String]) -> (Pipeline, Outcome) {
    let mission = registry().load(name, overrides).unwrap();
    let outcome = mission.solve(None, &mut ()).unwrap();
    assert!(outcome.explanation.is_none(), "{:?}", outcome.explanation);
    (mission, outcome)
}

fn price(prices: &[Price], key: &str) -> Price {
    prices.iter().find(|p| p.key == key).unwrap().clone()
}

fn assert_relative(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = ((found - expected) / expected).abs();
    assert!(error <= tolerance, "{what}: {found} instead of {expected}, relative error {error:.1e}");
}

/// `keys` with the half width of the difference quotient of solutions.
fn check(name: &str, keys: &[(&str, f64)]) {
    let (mission, outcome) = solve(name, &[]);
    let paths: Vec<&str> = keys.iter().map(|k| k.0).collect();
    let prices = mission.sensitivities(&outcome, &paths).unwrap();
    for &(key, h) in keys {
        let found = price(&prices, key);
        let at = |change: f64| {
            let start = Some(&outcome.trajectory);
            let set = format!("{key}={:?}", found.value + change);
            registry().load(name, &[set]).unwrap().solve(start, &mut ()).unwrap().summary
        };
        let (a, b) = (at(-h), at(h));
        let slope = |of: &dyn Fn(&Summary) -> f64| (of(&b) - of(&a)) / (2.0 * h);
        let time = slope(&|s| s.objective.value);
        let mass = slope(&|s| s.results["final_mass_kg"]);
        let angle = slope(&|s| s.results["initial_thrust_angle_deg"]);
        assert_relative(&format!("{name} {key} objective"), found.objective.unwrap(), time, OBJECTIVE);
        assert_relative(
            &format!("{name} {key} flight time"),
            found.results["flight_time_s"],
            time,
            OBJECTIVE,
        );
        assert_relative(
            &format!("{name} {key} final mass"),
            found.results["final_mass_kg"],
            mass,
            FINAL_MASS,
        );
        let found = found.results["initial_thrust_angle_deg"];
        assert_relative(&format!("{name} {key} thrust angle"), found, angle, DIFFERENCES);
    }
}

#[test]
fn prices_are_slopes_of_solutions() {
    check(
        "lunar-perilune",
        &[("thrust_n", 0.44), ("isp_s", 0.31), ("initial_mass_kg", 0.3), ("perilune_altitude_km", 0.02)],
    );
}

#[test]
fn prices_hold_across_a_linkage() {
    check("lunar-two-phase", &[("thrust_n", 0.44), ("gate_altitude_km", 0.004)]);
}

#[test]
fn every_number_of_the_flight_has_a_price() {
    // The touchdown speed stands at the end of its range.
    let (mission, outcome) = solve("lunar-direct", &["touchdown_radial_velocity_m_s=0".into()]);
    let keys: Vec<&str> = mission.priced_keys().map(|k| &*k.path).collect();
    let prices = mission.sensitivities(&outcome, &keys).unwrap();
    assert_eq!(prices.len(), 9);
    for p in &prices {
        assert!(p.objective.is_some_and(f64::is_finite), "{}", p.key);
        assert_eq!(p.results.len(), outcome.summary.results.len(), "{}", p.key);
        assert!(p.results.values().all(|v| v.is_finite()), "{}", p.key);
    }
    // More dry mass costs nothing while propellant is left.
    assert!(price(&prices, "dry_mass_kg").objective.unwrap().abs() < NO_PRICE);
    // Exhaust velocity is the product of the two.
    let (isp, gravity) = (price(&prices, "isp_s"), price(&prices, "standard_gravity_m_s2"));
    assert_relative(
        "isp",
        isp.objective.unwrap() * isp.value,
        gravity.objective.unwrap() * gravity.value,
        SAME_PRICE,
    );
    assert_eq!((isp.unit.as_str(), gravity.unit.as_str()), ("s", "m/s2"));
}

/// The flight that is solved has the bank angle as a vector; both limits are touched.
#[test]
fn limits_of_a_reentry_have_prices() {
    let (mission, outcome) = solve_loosely("capsule-reentry", &[]);
    let keys = ["heat_rate_limit_kw_m2", "load_limit_m_s2", "dynamic_pressure_limit_kpa"];
    let prices = mission.sensitivities(&outcome, &keys).unwrap();
    for (key, h) in [(keys[0], 1.0), (keys[1], 0.1)] {
        let found = price(&prices, key);
        let at = |change: f64| {
            let set = format!("{key}={:?}", found.value + change);
            let (_, outcome) = solve_loosely("capsule-reentry", &[set]);
            outcome.summary.objective.value
        };
        let slope = (at(h) - at(-h)) / (2.0 * h);
        assert_relative(key, found.objective.unwrap(), slope, DIFFERENCES);
    }
    // Not reached: 13.76 of 15 kPa.
    assert!(price(&prices, keys[2]).objective.unwrap().abs() < NO_PRICE);
}

/// To an accuracy that the meshes around touched limits reach soon.
fn solve_loosely(name: &str, overrides: &[String]) -> (Pipeline, Outcome) {
    let loose = ["radau.tolerance=1e-8".to_owned(), "margins=false".to_owned()];
    let mission = registry().load(name, &[overrides, &loose].concat()).unwrap();
    let outcome = mission.solve(None, &mut ()).unwrap();
    assert!(outcome.status.is_success(), "{:?}", outcome.explanation);
    (mission, outcome)
}

/// From rest over `a` in one second by the least integral of `u^2`, `12 a^2 - 12 a c + 4 c^2` with the speed `c` at the end, with
/// conditions of the end that depend on each other.
fn push(constants: &str, boundary: &str, keys: &[&str]) -> Vec<Option<f64>> {
    let text = format!(
        r#"kind = "problem"
        {constants}
        [phase.push]
        time = {{ end = 1 }}
        states.x = {{ start = 0 }}
        states.v = {{ start = 0 }}
        controls.u = [-100, 100]
        dynamics = {{ x = "v", v = "u" }}
        integrals.e = "u^2"
        [boundary]
        {boundary}
        [objective]
        minimize = "e"
        "#
    );
    let mission = registry().parse(&text, "push", &[]).unwrap();
    let outcome = mission.solve(None, &mut ()).unwrap();
    assert!(outcome.explanation.is_none(), "{:?}", outcome.explanation);
    let prices = mission.sensitivities(&outcome, keys).unwrap();
    prices.into_iter().map(|p| p.objective).collect()
}

/// The derivatives 24 a - 12 c and 8 c - 12 a, where a key moves dependent conditions alike; none where it moves one of them: then no motion
/// meets both, or more and less of the key differ.
#[test]
fn prices_beside_dependent_conditions() {
    let near = |found: Option<f64>, expected: f64| {
        let found = found.expect("a price");
        assert!((found - expected).abs() < CLOSED_FORM * expected.abs(), "{found} instead of {expected}");
    };
    let one = "constants.a = 1.0";
    let found =
        push(one, "x = \"end.x == a\"\nv = \"end.v == 0\"\nboth = \"end.x + end.v == a\"", &["constants.a"]);
    near(found[0], 24.0);
    let two = "constants.a = 1.0\nconstants.c = 0.5";
    let keys = ["constants.a", "constants.c"];
    let found =
        push(two, "x = \"end.x == a\"\nv = \"end.v == c\"\nboth = \"2*end.x + 3*end.v == 2*a + 3*c\"", &keys);
    near(found[0], 18.0);
    near(found[1], -8.0);
    let two = "constants.a = 1.0\nconstants.b = 1.0";
    let keys = ["constants.a", "constants.b"];
    for contradictory in [
        "x = \"end.x == a\"\nv = \"end.v == 0\"\nboth = \"end.x + end.v == b\"",
        "x = \"end.x == a\"\nv = \"end.v == 0\"\nboth = \"end.v^2/2 + end.x == b\"",
        "x = \"end.x >= a\"\ny = \"end.x >= b\"\nv = \"end.v == 0\"",
    ] {
        assert_eq!(push(two, contradictory, &keys), [None, None], "{contradictory}");
    }
    // A second condition that is not active takes no part.
    let found = push(two, "x = \"end.x >= a\"\ny = \"2*end.x >= b\"\nv = \"end.v == 0\"", &keys);
    near(found[0], 24.0);
    assert!(found[1].unwrap().abs() < NO_PRICE);
}

#[test]
fn requests_without_an_answer_are_refused() {
    let (mission, outcome) = solve("lunar-direct", &[]);
    let refused = mission.sensitivities(&outcome, &["thurst_n"]).unwrap_err();
    assert!(matches!(refused, Error::UnknownKey { .. }), "{refused}");
    assert!(refused.to_string().contains("`thrust_n`"));
    assert!(mission.sensitivities(&outcome, &["radau.points"]).is_err());
    let unsolved = Outcome { report: None, ..outcome };
    assert!(mission.sensitivities(&unsolved, &["thrust_n"]).is_err());
}
