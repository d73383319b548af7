//! A re-entry whose lift comes from the place of the centre of mass: optimised with its trim, and flown in six degrees of freedom with masses
//! that point the lift.
#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

/// Discretisation: the same at mesh tolerances from 1e-7 to 1e-10, MJ/m2.
const PLANNED_MJ_M2: f64 = 1e-4;
/// Discretisation: the steered flight follows the plan, heat load, relative.
const TRACKED: f64 = 1e-4;
/// Discretisation: the same for the time of flight, relative.
const TRACKED_TIME: f64 = 1e-3;

use apsides::pipeline::simulation::Simulated;

const MISSION: &str = "capsule-reentry-steered";

/// Discretisation: the bank angle that is steered against the plan, root mean square, deg.
const STEERED_RMS_DEG: f64 = 0.05;

/// The same at its peak, deg.
const STEERED_PEAK_DEG: f64 = 0.5;

/// The same at the end, deg.
const END_DEG: f64 = 0.01;

fn load(overrides: &[&str]) -> apsides::Pipeline {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    apsides::load(MISSION, &overrides).unwrap()
}

fn simulate(overrides: &[&str]) -> Simulated {
    load(overrides).simulate().unwrap()
}

fn nominal() -> &'static Simulated {
    static FLOWN: OnceLock<Simulated> = OnceLock::new();
    FLOWN.get_or_init(|| simulate(&[]))
}

/// The planned flight knows a trim, the flown one an attitude: they part by the time that the attitude takes to follow.
#[test]
fn the_flight_follows_the_optimal_bank_angle() {
    let flown = nominal();
    let result = |key: &str| flown.summary.results[key];
    assert_eq!(flown.summary.status, "completed", "{}", flown.summary.ending);
    assert!(
        result("bank_error_rms_deg") < STEERED_RMS_DEG && result("bank_error_peak_deg") < STEERED_PEAK_DEG
    );
    assert!(result("attack_error_rms_deg") < 0.1 && result("largest_attack_deg") < 30.0);
    // The same at mesh tolerances from 1e-7 to 1e-10.
    assert!((result("planned_heat_load_mj_m2") - 120.81716).abs() < PLANNED_MJ_M2);
    // Of a way of 2609 km.
    assert!(result("downrange_error_km").hypot(result("crossrange_error_km")) < 0.1);
    assert!((result("heat_load_mj_m2") / result("planned_heat_load_mj_m2") - 1.0).abs() < TRACKED);
    assert!((result("flight_time_s") / result("planned_flight_time_s") - 1.0).abs() < TRACKED_TIME);
    // Limits of the plan, 40 m/s2 and 800 kW/m2.
    assert!(result("peak_load_m_s2") < 40.1 && result("peak_heat_rate_kw_m2") < 801.0);
    assert!(result("saturation_time_s") == 0.0 && result("mass_rate_m_s") < 0.5);
    assert!(flown.summary.warnings.is_empty(), "{:?}", flown.summary.warnings);
    assert!(flown.rows.iter().flatten().all(|v| v.is_finite()));
}

#[test]
fn the_same_again() {
    assert_eq!(simulate(&[]).rows, nominal().rows);
}

/// The law does not know the offset: the integral finds it, and the end is where the bank errors until then lead.
#[test]
fn an_unknown_offset_is_found() {
    for offset in [
        ["steered.offset_y_m=0.01", "steered.offset_z_m=0"],
        ["steered.offset_y_m=0", "steered.offset_z_m=0.01"],
    ] {
        let flown = simulate(&offset);
        let result = |key: &str| flown.summary.results[key];
        assert_eq!(flown.summary.status, "completed");
        let miss = result("downrange_error_km").hypot(result("crossrange_error_km"));
        assert!(miss > 0.5 && miss < 3.0, "{offset:?}: {miss} km");
        assert!(result("bank_error_rms_deg") < 2.0);
        // In the end there is no error left.
        let [bank, planned] = ["bank angle", "planned bank angle"]
            .map(|name| flown.columns.iter().position(|c| c.0 == name).unwrap());
        let last = flown.rows.last().unwrap();
        assert!((last[bank] - last[planned]).abs() < END_DEG, "{offset:?}");
    }
}

/// Less offset is less lift: 8 cm no longer reach the target.
#[test]
fn the_offset_is_the_lift() {
    let solve = |offset: &str| {
        let overrides = [offset, "margins=false", "radau.tolerance=1e-6"];
        load(&overrides).solve(None, &mut ()).unwrap()
    };
    let (nine, ten) = (solve("trim_offset_m=0.09"), solve("trim_offset_m=0.1"));
    assert!(nine.status.is_success() && ten.status.is_success());
    let ratio = |o: &apsides::Outcome| o.summary.results["lift_to_drag"];
    assert!(ratio(&nine) > 0.2948 && ratio(&ten) > ratio(&nine), "{} {}", ratio(&nine), ratio(&ten));
    let eight = solve("trim_offset_m=0.08");
    assert_eq!(eight.summary.status, "infeasible");
    let why = eight.explanation.unwrap();
    assert!(why.contains("out of reach") && why.contains("least L/D that reaches it is 0.29"), "{why}");
}

#[test]
fn a_law_that_is_too_fast_for_its_masses_tumbles_and_says_when() {
    let flown = simulate(&["steered.bandwidth=5"]);
    assert_eq!(flown.summary.status, "tumbling", "{}", flown.summary.ending);
    assert!(flown.summary.end_time_s > 100.0 && flown.summary.end_time_s < 560.0);
    assert!(flown.rows.iter().flatten().all(|v| v.is_finite()));
}

#[test]
fn what_cannot_be_steered_is_refused() {
    let refused = |overrides: &[&str]| load(overrides).simulate().err().unwrap().to_string();
    let light = refused(&["steered.moving_mass_kg=50"]);
    assert!(light.contains("by 4.29 cm at most, the trim needs 9.00 cm"), "{light}");
    let constant = refused(&["aerodynamics=constant"]);
    assert!(constant.contains("set `aerodynamics` to \"apollo-offset\""), "{constant}");
    let beyond = apsides::load(MISSION, &["trim_offset_m=0.5".into()]).unwrap_err().to_string();
    assert!(beyond.contains("offset of the centre of mass") && beyond.contains("0.5"), "{beyond}");
    let geo = apsides::load("geo-2-burn", &[]).unwrap().simulate().err().unwrap().to_string();
    assert!(geo.contains("optimised, not simulated"), "{geo}");
}
