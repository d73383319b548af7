//! `apsides reproduce geo-injection`: Tables 2 to 7 of Alavipour, Nikkhah and Roshanian, Modares Mechanical Engineering 18(1), and the
//! costates of single burns.
//!
//! Reference numbers: the same problems by independent programs, multi-point shooting with DOP853 and hybrid Powell steps, and
//! collocation with Ipopt.
#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use apsides_publications::{Part, Reproduction, Sheet, reproduce};
use apsides_tests::Patience;

/// Half of the last digit of the reference for burns by the rule, s.
const BURN_S: f64 = 5e-4;
/// Published: a unit of the last digit of a root mean square, s.
const RMS_S: f64 = 1e-3;
/// Published: half a unit of the last digit of a mean, s.
const BIAS_S: f64 = 0.05;
/// Propellant of joint optima against shooting, kg.
const OPTIMUM_KG: f64 = 1e-3;
/// The same with free orbits and symmetric burns, kg.
const SEQUENCE_KG: f64 = 1e-3;

fn reproduction() -> &'static Reproduction {
    static DONE: OnceLock<Reproduction> = OnceLock::new();
    DONE.get_or_init(|| reproduce("geo-injection", 1, &mut (), |_| true).unwrap())
}

fn sheet(id: &str) -> &'static Sheet {
    reproduction().sheets.iter().find(|s| s.id == id).unwrap()
}

fn value(id: &str, row: &str, key: &str) -> f64 {
    sheet(id).value(row, key).unwrap_or_else(|| panic!("{id}: no {key} in row {row}"))
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() < tolerance, "{what}: found {found}, expected {expected}");
}

fn finds(id: &str, text: &str) {
    assert!(sheet(id).findings.iter().any(|f| f.contains(text)), "{text}: {:?}", sheet(id).findings);
}

#[test]
fn everything_is_solved_and_verified() {
    let done = reproduction();
    assert!(done.complete);
    for s in &done.sheets {
        assert_eq!((&s.failures[..], &s.unverified[..]), (&[][..], &[][..]), "{}", s.id);
    }
    let ids: Vec<&str> = done.sheets.iter().map(|s| s.id).collect();
    let tables = ["table-2", "table-3", "table-4", "table-5", "table-6", "table-7"];
    assert_eq!(ids[..6], tables);
    assert_eq!(
        ids[6..],
        ["burn-times", "sequences", "detours", "costates", "guesses", "profiles", "reference-20"]
    );
}

/// Published: half of the last digit of the eccentricities of reference [20], and what its times leave.
const ECCENTRICITY: f64 = 5e-5;
/// Published: propellants of [20] to 0.1 kg, of a mass that is fitted to 1 kg.
const REFERENCE_20_KG: f64 = 2.0;

/// Bortakovskii and Konovalova 2013: eccentricities 0.11689 to 0.728 are those of 22 848 kg, and 16037.5 kg are within 1.4 kg of the optimum.
#[test]
fn the_sequence_that_table_6_is_compared_with() {
    for (burn, eccentricity) in [("1", 0.11689), ("2", 0.26119), ("3", 0.44576), ("4", 0.728)] {
        let found = value("reference-20", burn, "along_velocity_fitted_eccentricity");
        near(found, eccentricity, ECCENTRICITY, burn);
    }
    finds("reference-20", "22848 kg at the start give the eccentricities");
    // With the mass of the tables the eccentricities are others.
    assert!(value("reference-20", "4", "along_velocity_22170_eccentricity") > 0.76);
    let optimum = sheet("reference-20").findings.iter().find(|f| f.contains("optimal steering")).unwrap();
    let kg: f64 = optimum.split("take ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    near(kg, 16_036.43, REFERENCE_20_KG, "optimum of five burns");
}

/// Figs 4 to 9: the optimum ends on the target, the same burns along the velocity do not.
#[test]
fn profiles_of_the_burns() {
    near(value("profiles", "burn 2, optimal", "radius_km"), 42_164.0, 0.01, "end of the optimum");
    near(value("profiles", "burn 2, optimal", "radial_speed_m_s"), 0.0, 1e-3, "end of the optimum");
    assert!(value("profiles", "burn 1, optimal", "largest_angle_between_deg") > 1.0);
    assert_eq!(sheet("profiles").graphs.len(), 7);
}

/// Table, burn, minimum times with 22170 and with 22100 kg, s.
const BURNS: [(&str, &str, f64, f64); 15] = [
    ("table-2", "1", 2032.8029, 2025.4398),
    ("table-2", "2", 561.9706, 557.9244),
    ("table-3", "1", 904.5710, 901.5000),
    ("table-3", "2", 1047.1166, 1042.6237),
    ("table-3", "3", 600.6002, 596.4849),
    ("table-4", "1", 574.2708, 572.4122),
    ("table-4", "2", 649.9722, 647.4526),
    ("table-4", "3", 703.0749, 699.5990),
    ("table-4", "4", 618.2966, 614.1964),
    ("table-5", "1", 434.9944, 433.7721),
    ("table-5", "2", 357.0722, 355.7909),
    ("table-5", "3", 345.2819, 343.9436),
    ("table-5", "4", 387.2211, 385.4485),
    ("table-5", "5", 403.9361, 401.7009),
    ("table-5", "6", 611.8937, 607.7483),
];

#[test]
fn burns_by_the_printed_rule() {
    for (table, burn, used, stated) in BURNS {
        near(value(table, burn, "rule_22170_s"), used, BURN_S, table);
        near(value(table, burn, "rule_22100_s"), stated, BURN_S, table);
    }
}

/// The printed times are those of 22170 kg. The mass at ignition is that of the printed propellants, as in the reference for single
/// burns; with the rounded burn times in their place the two numbers are 0.153 and 3.53 s.
#[test]
fn printed_burn_times_have_another_mass() {
    near(value("burn-times", "22170", "rms_s"), 0.134, BURN_S, "22170 kg");
    near(value("burn-times", "22100", "rms_s"), 3.509, RMS_S, "22100 kg");
    near(value("burn-times", "22100", "bias_s"), 3.1, BIAS_S, "22100 kg");
    finds("burn-times", "computed with 22170 kg, not with the 22100 kg of Table 1");
}

#[test]
fn propellant_of_the_sequences() {
    // Burns; joint optimum with 22170 and 22100 kg, free orbits with symmetric burns and fixed apses with 22170 kg, penalty of thrust
    // along the velocity with 22170 and 22100 kg, hours of the optimum.
    let cases = [
        ("2", 15801.500887, 15750.247336, 15841.891157, 14.581128, 14.479412, 5.762),
        ("3", 15615.431377, 15565.672403, 15622.012248, 2.543153, 2.521100, 8.000),
        ("4", 15574.273850, 15524.886148, 15575.877305, 1.059682, 1.050069, 10.787),
        ("5", 15559.349783, 15510.099937, 15559.906425, 0.630650, 0.624831, 13.780),
        ("6", 15552.350024, 15503.165418, 15552.593777, 0.449426, 0.445245, 16.877),
    ];
    for (burns, used, stated, free, penalty, stated_penalty, hours) in cases {
        let of = |key: &str| value("sequences", burns, key);
        near(of("optimum_22170_kg"), used, OPTIMUM_KG, burns);
        near(of("optimum_22100_kg"), stated, OPTIMUM_KG, burns);
        near(of("free_orbits_22170_kg"), free, SEQUENCE_KG, burns);
        near(of("velocity_penalty_22170_kg"), penalty, OPTIMUM_KG, burns);
        near(of("velocity_penalty_22100_kg"), stated_penalty, OPTIMUM_KG, burns);
        near(of("flight_time_optimum_h"), hours, 5e-4, burns);
        near(of("impulses_22170_kg"), 15539.634560, 1e-6, burns);
    }
    // Flight times of the printed sequences, h, with the printed burn times: these differ from those by the rule by up to 0.3 s each.
    for (burns, hours) in [("2", 5.702079), ("3", 7.748364), ("4", 10.276971), ("6", 16.211902)] {
        near(value("sequences", burns, "flight_time_printed_h"), hours, 2e-4, burns);
    }
    finds(
        "sequences",
        "three burns, jointly optimal, take 19.8 kg more than the printed six; four take 21.3 kg less",
    );
    finds("sequences", "take 114.9 kg less than the printed two with optimal steering");
    finds("sequences", "chosen by hand, cost 43 to 89 kg");
}

/// Printed less shortest burn to the same apogee, s.
#[test]
fn detours_of_the_printed_orbits() {
    for (row, excess) in [("2, burn 1", 10.6), ("3, burn 1", 13.3), ("5, burn 1", 16.1), ("5, burn 3", 3.6)] {
        near(value("detours", row, "excess_s"), excess, 0.05, row);
    }
    near(value("detours", "2, burn 1", "perigee_of_shortest_km"), 7211.0, 0.5, "natural perigee");
    finds("detours", "costs most in Table 5, burn 1");
}

#[test]
fn slips_of_the_printed_tables() {
    finds("table-2", "2033 s at 6.14 kg/s are 12482.6 kg, printed 12480 kg, which take 2032.57 s");
    finds("table-3", "the printed burn times add to 2552.7 s, printed 2552.4 s");
    finds("table-4", "the printed burn times add to 2545.0 s, printed 2546 s");
    finds("table-6", "the printed propellants add to 15604.50 kg, printed 15604 kg");
    finds("table-6", "no semi-major axes are printed");
    assert!(reproduction().remarks.iter().any(|r| r.contains("36786 km") && r.contains("35786 km")));
}

#[test]
fn table_7() {
    // Radius, radial and horizontal speed (canonical), km and m/s from the target.
    let cases = [
        ("second burn, 22170 kg", 6.40817, 6.942e-4, 0.39538, -10.18, 6.21),
        ("second burn, 22100 kg", 6.40819, 7.714e-4, 0.39707, -10.06, 17.27),
        ("both burns, 22170 kg", 6.62626, 8.2e-4, 0.39278, 1424.4, 18.29),
    ];
    for (row, radius, radial, horizontal, distance, speed) in cases {
        let of = |key: &str| value("table-7", row, key);
        near(of("radius"), radius, 5e-6, row);
        near(of("radial_speed"), radial, 3e-6, row);
        near(of("horizontal_speed"), horizontal, 6e-6, row);
        near(of("radius_less_target_km"), distance, 0.05, row);
        near(of("speed_from_target_m_s"), speed, 6e-3, row);
    }
    finds("table-7", "takes 3.8 m/s and 7.3 kg, not about 100 kg");
    finds("table-7", "reaches a semi-major axis of 25462 km, the printed one is 24588 km");
}

#[test]
fn costates_of_single_burns() {
    // Burn time, costates; burn time and costates of the guess with constant mass: to the digits that the reference prints. Where the
    // thrust turns by half a revolution within seconds (Centaur D) it has no more.
    let cases = [
        ("Breeze-M, 1.05", [1077.89, -0.5255, -0.3590], [1209.8, -0.716, 0.032]),
        ("Breeze-M, 1.5", [2648.11, -0.4161, -1.1770], [3914.9, -2.316, 0.368]),
        ("Block DM, 1.1", [534.99, -0.3787, -0.1588], [728.3, -0.431, 0.010]),
        ("Fregat, 1.1", [787.46, -0.4726, -0.2705], [1003.9, -0.594, 0.020]),
        ("Fregat-SB, 1.2", [1434.69, -0.5928, -0.6505], [1899.0, -1.124, 0.082]),
        ("Centaur D, 1.05", [314.57, -0.2217, -0.0497], [389.8, -0.231, 0.002]),
        ("Centaur D, 1.15", [450.03, -0.3576, -0.1405], [675.5, -0.400, 0.008]),
        ("Yastreb, 1.3", [1631.81, -0.5938, -0.7393], [2132.1, -1.262, 0.099]),
    ];
    for (row, solved, guess) in cases {
        let of = |key: &str| value("costates", row, key);
        near(of("burn_time_s"), solved[0], 6e-3, row);
        near(of("lambda_u"), solved[1], 6e-5, row);
        near(of("lambda_v"), solved[2], 6e-5, row);
        near(of("constant_mass_time_s"), guess[0], 0.06, row);
        near(of("constant_mass_lambda_u"), guess[1], 6e-4, row);
        near(of("constant_mass_lambda_v"), guess[2], 6e-4, row);
    }
    finds("costates", "the costate of the horizontal speed has the opposite sign");
}

#[test]
fn guesses_at_the_limit_of_the_propellant() {
    // Where the propellant is burnt, s; largest ratio of the radii to the digits that the reference has right.
    for (stage, time, ratio) in [("Breeze-M", 19_800.0 / 6.14, 1.9894), ("Yastreb", 19_700.0 / 8.5, 1.9104)] {
        near(value("guesses", stage, "largest_ratio"), ratio, 1e-3, stage);
        let last = sheet("costates").rows.iter().rfind(|r| r.label.starts_with(stage)).unwrap();
        near(last.values[0].unwrap(), time, 1e-3, stage);
    }
    // Constant mass: 48 to 72 % too long at the limit. Mean acceleration: below 6 %.
    for row in &sheet("guesses").rows {
        let of = |key: &str| value("guesses", &row.label, key);
        let error = of("constant_mass_largest_time_error");
        assert!((0.47..0.73).contains(&error), "{}: {error}", row.label);
        assert!(of("mean_acceleration_largest_time_error") < 0.06, "{}", row.label);
        // Four stages of moderate arcs, from nearly every radius; the two long ones from a part.
        let most = if ["Breeze-M", "Yastreb"].contains(&&*row.label) { 5.0 } else { 20.0 };
        assert!(of("constant_mass_converged") >= most, "{}", row.label);
        assert!(of("mean_acceleration_converged") >= most + 3.0, "{}", row.label);
        assert!(of("constant_mass_median_iterations") <= 12.0, "{}", row.label);
    }
    let graphs = &sheet("costates").graphs;
    assert_eq!(graphs.len(), 6);
    assert!(
        graphs.iter().all(|g| g.series.len() == 6 && g.series.iter().all(|s| s.dots.len() == s.line.len()))
    );
}

#[test]
fn an_interruption_keeps_the_sheets_done() {
    let stopped = reproduce("geo-injection", 1, &mut Patience(120), |_| true).unwrap();
    assert!(!stopped.complete);
    assert!((1..5).contains(&stopped.sheets.len()), "{}", stopped.sheets.len());
    // But for the time that they took.
    let timeless = |sheets: &[Sheet]| {
        sheets.iter().map(|sheet| Sheet { seconds: 0.0, ..sheet.clone() }).collect::<Vec<_>>()
    };
    assert_eq!(timeless(&stopped.sheets), timeless(&reproduction().sheets[..stopped.sheets.len()]));
    let mut count = 0;
    let two = reproduce("geo-injection", 1, &mut (), |part| {
        count += usize::from(matches!(part, Part::Sheet(_)));
        count < 2
    });
    let two = two.unwrap();
    assert_eq!((two.complete, two.sheets.len()), (false, 2));
}
