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
