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

/// The start of the mission as a message: positions in km with a micrometre, speeds with a micrometre per second.
#[test]
fn a_start_may_come_from_a_message() {
    use apsides_dynamics::frames::Local;
    use apsides_ephemeris::{CentralBody, Epoch};

    /// Round-off of what a message says, relative.
    const WRITTEN: f64 = 1e-9;

    let stated = capsule(&[]);
    let epoch: Epoch = "2027-06-05T04:03:02 UTC".parse().unwrap();
    let local = Local::at(stated.start.longitude, stated.start.latitude);
    let (sin, cos) = stated.start.path_angle.sin_cos();
    let (east, north) = stated.flight.heading.of_course(stated.start.azimuth).sin_cos();
    let radius = stated.flight.planet.body.radius + stated.start.altitude;
    let (r, v) = CentralBody::Earth.orientation(&epoch).to_icrf(
        local.up.map(|c| c * radius),
        local.vector([sin, cos * east, cos * north]).map(|c| c * stated.start.speed),
    );
    let [x, y, z] = r.map(|c| c / 1e3);
    let [u, w, q] = v.map(|c| c / 1e3);
    let mass = stated.flight.vehicle.mass;
    let text = format!(
        "CCSDS_OPM_VERS = 3.0\nOBJECT_NAME = CAPSULE\nCENTER_NAME = EARTH\nREF_FRAME = ICRF\nTIME_SYSTEM = UTC\n\
         EPOCH = {}\nX = {x:.9}\nY = {y:.9}\nZ = {z:.9}\nX_DOT = {u:.12}\nY_DOT = {w:.12}\nZ_DOT = {q:.12}\nMASS = {mass}\n",
        epoch.calendar()
    );
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("start.opm");
    std::fs::write(&file, &text).unwrap();
    let given = format!("initial_state={}", file.display());
    let mission = load(&[&given]).unwrap();
    let found = mission.mission_as::<CapsuleEntry>().unwrap();
    for (found, stated) in found.start.array().into_iter().zip(stated.start.array()) {
        assert!((found / stated - 1.0).abs() < WRITTEN, "{found} {stated}");
    }
    assert!(mission.placing().epoch.since(&epoch).abs() < WRITTEN);
    // The file that gives the same mission again has the message itself.
    let again = registry().parse(&mission.to_file(), "again", &[]).unwrap();
    assert_eq!(again.mission_as::<CapsuleEntry>().unwrap().start, found.start);
    assert!(!load(&[]).unwrap().to_file().contains("initial_state"));

    let refused = |text: &str, further: &[&str], words: &str| {
        std::fs::write(&file, text).unwrap();
        let message = load(&[&[&*given][..], further].concat()).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    };
    refused(&text, &["epoch=2030-01-01T00:00:00 TDB"], "take `epoch` off");
    refused(&text, &["body=mars"], "the message is about the EARTH, `body` is another one");
    refused(&text, &["initial_mass_kg=9"], "the message has a mass of");
    refused(&text.replace("X_DOT", "XDOT"), &[], "`initial_state`: line 13: `X_DOT` is missing");
    refused("", &[], "begins with `CCSDS_OPM_VERS");
}
