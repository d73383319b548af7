//! Bodies, vehicles and sites that missions name, and former paths of keys.
#![allow(clippy::unwrap_used)]

use apsides_missions::data::{BODIES, BODY, SITE, SITES, VEHICLE, VEHICLES};
use apsides_missions::entry::CapsuleEntry;
use apsides_missions::lunar::DirectLanding;
use apsides_missions::registry;

/// Round-off of a product of two numbers.
const ROUNDING: f64 = 1e-15;

/// The gravitational parameters of WGS 84 and MRO120D, the oblateness of each and its gas.
#[test]
fn a_body_is_all_that_changes_between_planets() {
    for (body, parameter, radius, heat_ratio) in
        [("earth", 3.986_004_418e14, 6_378_137.0, 1.4), ("mars", 4.282_837_52e13, 3.396_19e6, 1.29)]
    {
        let overrides = [format!("body={body}"), "oblateness=true".into()];
        let mission = registry().load("capsule-reentry", &overrides).unwrap();
        let planet = &mission.mission_as::<CapsuleEntry>().unwrap().flight.planet;
        assert!((planet.body.gravitational_parameter / parameter - 1.0).abs() < ROUNDING);
        assert!((planet.body.radius / radius - 1.0).abs() < ROUNDING);
        let apsides_dynamics::atmosphere::Atmosphere::Exponential(law) = &planet.atmosphere else {
            panic!("not exponential")
        };
        assert_eq!(law.gas.heat_ratio, heat_ratio);
        assert!(planet.j2 > 0.0 && planet.rotation_rate > 0.0);
    }
}

#[test]
fn the_moon_of_grail_is_another_body_than_the_printed_one() {
    let moon = |overrides: &[String]| {
        let mission = registry().load("lunar-direct", overrides).unwrap();
        mission.mission_as::<DirectLanding>().unwrap().lander.flight.body
    };
    assert!((moon(&[]).gravitational_parameter / 4.904_869_5e12 - 1.0).abs() < ROUNDING);
    let grail = moon(&["body=moon".into()]);
    assert!((grail.gravitational_parameter / 4.902_800_1e12 - 1.0).abs() < ROUNDING);
    // A number of the mission comes before that of the body.
    let own = moon(&["body=moon".into(), "body_radius_km=1738".into()]);
    assert_eq!((own.radius, own.gravitational_parameter), (1.738e6, grail.gravitational_parameter));
}

/// A name that is set from Rust brings the numbers of the body, as one in the file does.
#[test]
fn a_body_that_is_set_brings_its_numbers() {
    let body = |mission: &apsides_pipeline::Pipeline| {
        mission.mission_as::<DirectLanding>().unwrap().lander.flight.body
    };
    let mut mission = registry().load("lunar-direct", &[]).unwrap();
    mission.set("body", "moon").unwrap();
    let named = registry().load("lunar-direct", &["body=moon".into()]).unwrap();
    assert_eq!(body(&mission), body(&named));
    assert_eq!(mission, named);
    // A number of the mission stays.
    mission.set("body_radius_km", 1738.0).unwrap();
    mission.set("body", "moon-2014").unwrap();
    assert_eq!(body(&mission).radius, 1.738e6);
    assert_eq!(mission.values().number("gravitational_parameter_km3_s2").unwrap(), 4_902.793_455);
    let unknown = mission.set("body", "pluto").unwrap_err().to_string();
    assert!(unknown.contains("`moon-2014`"), "{unknown}");
    assert_eq!(mission.values().word("body").unwrap(), "moon-2014");

    let typed = registry().load_with("lunar-direct", [("body", "moon".into()), ("thrust_n", 500.0.into())]);
    let texts = registry().load("lunar-direct", &["body=moon".into(), "thrust_n=500".into()]);
    assert_eq!(typed.unwrap(), texts.unwrap());
    let refused =
        registry().load_with("lunar-direct", [("thrust_n", (-1.0).into())]).unwrap_err().to_string();
    assert!(refused.starts_with("thrust_n = -1: `thrust_n` is -1, allowed is"), "{refused}");
}

#[test]
fn every_file_says_where_its_numbers_come_from() {
    for data in [BODIES, VEHICLES, SITES] {
        for name in data.names() {
            let [source, _] = data.words(name);
            assert!(source.is_some_and(|s| !s.is_empty()), "{} `{name}`", data.key);
        }
    }
    let registry = registry();
    for (key, data) in [(BODY, BODIES), (VEHICLE, VEHICLES), (SITE, SITES)] {
        assert_eq!(registry.data(key), Some(&data));
    }
}

#[test]
fn what_a_mission_needs_and_the_data_lack_is_named() {
    let message =
        |mission: &str, set: &str| registry().load(mission, &[set.to_owned()]).unwrap_err().to_string();
    let of_moon = message("capsule-reentry", "body=moon");
    assert!(of_moon.contains("body `moon`: `surface_density_kg_m3` is missing"), "{of_moon}");
    let stage = message("lunar-direct", "vehicle=breeze-m");
    assert!(stage.contains("vehicle `breeze-m`: `dry_mass_kg` is missing"), "{stage}");
    let unknown = message("chang-e-3-braking", "site=mare-imbrium");
    assert!(unknown.contains("allowed is one of `chang-e-3-2014`"), "{unknown}");
}

#[test]
fn former_paths_of_keys_name_those_of_today() {
    let cases = [
        ("lunar-perilune", "moon_radius_km", "body_radius_km"),
        ("geo-2-burn", "earth_radius_km", "body_radius_km"),
        ("geo-2-burn", "mass_flow_kg_s", "isp_s"),
        ("geo-2-burn", "max_burn_s", "max_burn_time_s"),
        ("geo-2-burn", "max_flight_time_h", "max_flight_time_s"),
        ("chang-e-3-braking", "exhaust_velocity_m_s", "isp_s"),
        ("chang-e-3-braking", "least_thrust_n", "min_thrust_n"),
        ("chang-e-3-braking", "moon_rotation", "body_rotation"),
        ("capsule-reentry", "planet", "body"),
        ("capsule-reentry", "planet_rotation", "body_rotation"),
        ("capsule-reentry", "mass_kg", "initial_mass_kg"),
        ("capsule-reentry", "longest_flight_s", "max_flight_time_s"),
        ("capsule-reentry", "steered.pitch_gyration_radius", "steered.pitch_gyration_radius_m"),
        ("lunar-perilune", "flatness.segments", "flatness.intervals"),
        ("lunar-perilune", "indirect.segments", "indirect.intervals"),
        ("lunar-perilune", "piecewise.refine", "piecewise.max_refinements"),
        ("lunar-perilune", "radau.mesh_tolerance", "radau.tolerance"),
        ("lunar-perilune", "shooting.control_points", "shooting.points"),
        ("moving-mass-cross", "vehicle_mass_kg", "initial_mass_kg"),
        ("moving-mass-cross", "time_limit_s", "max_flight_time_s"),
    ];
    for (mission, former, today) in cases {
        let found = registry().load(mission, &[format!("{former}=1")]).unwrap_err().to_string();
        assert!(found.ends_with(&format!("has no key `{former}`; it is now `{today}`")), "{found}");
    }
    // Refinements are one less than meshes.
    let found =
        registry().load("lunar-perilune", &["radau.max_meshes=5".to_owned()]).unwrap_err().to_string();
    let today = "it is now `radau.max_refinements` = 4, one less: the first mesh does not count";
    assert!(found.ends_with(today), "{found}");
}
