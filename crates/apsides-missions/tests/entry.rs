//! Re-entries as typed missions: what the values of a file become.
#![allow(clippy::unwrap_used)]

use apsides_dynamics::atmosphere::{Atmosphere, Exponential};
use apsides_missions::entry::{CapsuleEntry, Goal};
use apsides_missions::registry;
use apsides_pipeline::{Error, Pipeline};

/// Relative error of an exponential function.
const ROUNDING: f64 = 1e-14;

fn load(overrides: &[&str]) -> Result<Pipeline, Error> {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    registry().load("capsule-reentry", &overrides)
}

fn capsule(overrides: &[&str]) -> CapsuleEntry {
    load(overrides).unwrap().mission_as::<CapsuleEntry>().unwrap().clone()
}

fn atmosphere(overrides: &[&str]) -> Atmosphere {
    capsule(overrides).flight.planet.atmosphere
}

/// 1.225 kg/m3 and 7200 m on Earth, as in the reference; 0.0158 kg/m3 and 9354.5 m on Mars (doi 10.2514/1.47577).
#[test]
fn a_planet_has_its_own_atmosphere() {
    for (planet, density, height) in [("body=earth", 1.225, 7200.0), ("body=mars", 0.0158, 9354.5)] {
        let found = atmosphere(&[planet]);
        for (altitude, expected) in [(0.0, density), (height, density / std::f64::consts::E)] {
            let density = found.density(altitude);
            assert!((density / expected - 1.0).abs() < ROUNDING, "{planet}, {altitude} m: {density}");
        }
    }
    // The law and the gas of Mars, at the temperature of hydrostatic equilibrium under its gravity.
    let planet = capsule(&["body=mars"]).flight.planet;
    let gravity = planet.body.surface_gravity();
    let expected = Exponential::new(0.0158, 0.0, 9354.5, Exponential::MARS.gas, gravity).unwrap();
    assert_eq!(planet.atmosphere, Atmosphere::Exponential(expected));
    assert_eq!(atmosphere(&["atmosphere=exponential"]), atmosphere(&[]));
}

#[test]
fn a_file_may_state_another_atmosphere() {
    let stated =
        ["body=mars", "atmosphere=exponential", "surface_density_kg_m3=0.02", "scale_height_m=11100"];
    assert!((atmosphere(&stated).density(0.0) - 0.02).abs() < ROUNDING);
    assert_eq!(atmosphere(&["body=mars", "atmosphere=us-1976"]), Atmosphere::UsStandard1976);
    let former = load(&["planet=mars"]).unwrap_err().to_string();
    assert!(former.contains("has no key `planet`; it is now `body`"), "{former}");
}

/// Lift by drag has no coefficient of pressure in it. Sphere-cone of Viking (nose 0.88 m, base 1.75 m, half angle 70 deg) at -11.2 deg and
/// the heat shield of Apollo (4.694 m, 1.956 m) at -20 deg by the formulas of `apsides_dynamics::aerodynamics::Newtonian`, in 30 digits.
#[test]
fn the_impact_of_the_air_makes_lift_at_an_angle_of_attack() {
    let lift_to_drag = |nose: f64, base: f64, more: &[&str]| {
        let area = format!("reference_area_m2={}", std::f64::consts::PI * base * base);
        let nose = format!("nose_radius_m={nose}");
        let all: Vec<&str> = ["aerodynamics=newtonian", &area, &nose].iter().chain(more).copied().collect();
        let vehicle = capsule(&all).flight.vehicle;
        [5.0, 25.0].map(|mach| vehicle.lift_to_drag(mach))
    };
    for found in lift_to_drag(0.88, 1.75, &["cone_half_angle_deg=70", "angle_of_attack_deg=-11.2"]) {
        assert!((found - 0.17140574353065812).abs() < 10.0 * ROUNDING, "{found}");
    }
    for found in lift_to_drag(4.694, 1.956, &["angle_of_attack_deg=-20"]) {
        assert!((found - 0.32550829294889886).abs() < 10.0 * ROUNDING, "{found}");
    }
    load(&["aerodynamics=newtonian"]).unwrap().pose().unwrap();
    let refused = |set: &[&str]| {
        let all: Vec<&str> = ["aerodynamics=newtonian"].iter().chain(set).copied().collect();
        load(&all).unwrap_err().to_string()
    };
    let steep = refused(&["cone_half_angle_deg=30", "nose_radius_m=0.1", "angle_of_attack_deg=40"]);
    assert!(steep.contains("`angle_of_attack_deg` is 40, but beyond 30.000 deg"), "{steep}");
    let wide = refused(&["cone_half_angle_deg=10", "nose_radius_m=50"]);
    assert!(
        wide.starts_with("--set nose_radius_m=50 (mission `capsule-reentry`): `nose_radius_m`, "),
        "{wide}"
    );
}

#[test]
fn the_file_with_every_value_is_the_same_mission() {
    for overrides in [&["body=mars"][..], &[], &["goal=reach", "reach_half_width_km=20"]] {
        let mission = load(overrides).unwrap();
        let again = registry().parse(&mission.to_file(), "text", &[]).unwrap();
        assert_eq!(mission, again);
        let [one, other] = [&mission, &again].map(|m| m.mission_as::<CapsuleEntry>().unwrap());
        assert_eq!((&one.flight, one.goal), (&other.flight, other.goal));
    }
}

#[test]
fn what_is_not_limited_is_none() {
    let free = capsule(&["heat_rate_limit_kw_m2=inf", "steered.rate_limit_m_s=inf"]);
    assert_eq!((free.dynamic_pressure_limit, free.acceleration_limit), (Some(15e3), Some(40.0)));
    assert_eq!((free.heat_rate_limit, free.steered.rate_limit), (None, None));
    let reach = capsule(&["goal=reach", "reach_bearing_deg=90"]).goal;
    assert_eq!(reach, Goal::Reach { bearing: 90_f64.to_radians(), half_width: None });
}
