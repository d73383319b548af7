//! Reduced sets of the sheets.
#![allow(clippy::unwrap_used)]

use apsides_terrain::hazard::SiteCriteria;

use super::{deviations, downrange, guidance, hazards, lower_stages, paths, segments, sensitivity, text};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 5e-5;

/// Published: half a unit of the last digit of a difference of masses, kg.
const PUBLISHED_KG: f64 = 0.05;

/// Published: prices by the adjoint of the reference, relative.
const ADJOINT: f64 = 1e-7;

/// Numbers by hand: half a unit of their sixth digit after the point, and a little more.
const BY_HAND: f64 = 1e-6;

/// Discretisation: prices by solving again, relative.
const DIFFERENCES: f64 = 1e-5;

fn on_two(work: impl FnOnce(&mut Workers<'_>) -> Result<Sheet, Stop>) -> Sheet {
    match work(&mut Workers { threads: 2, observer: &mut () }) {
        Ok(sheet) => {
            assert_eq!((&sheet.failures[..], &sheet.unverified[..]), (&[][..], &[][..]), "{}", sheet.id);
            sheet
        }
        Err(Stop::Refused(e)) => panic!("{e}"),
        Err(Stop::NotSolved(why)) => panic!("{why}"),
        Err(Stop::Interrupted) => panic!("interrupted"),
    }
}

fn near(sheet: &Sheet, row: &str, key: &str, expected: f64, tolerance: f64) {
    let value = sheet.value(row, key).unwrap();
    assert!((value - expected).abs() <= tolerance, "{row}, {key}: found {value}, expected {expected}");
}

/// Costs of longer arcs: 0.008 kg at 15 deg, 0.14 at 20, 0.98 at 25 by collocation with Ipopt (some 1e-3 kg).
#[test]
fn arcs_of_the_braking() {
    let sheet =
        on_two(|w| downrange::sheet(&[downrange::ARCS[6], downrange::ARCS[12], downrange::ARCS[14]], w));
    let key = "above_the_least_propellant_g";
    near(&sheet, "15.000 deg", key, 8.2, 1.0);
    near(&sheet, "20.000 deg", key, 140.2, 1.0);
    near(&sheet, "25.000 deg", key, 977.5, 1.0);
    // The paper's arc costs 1.5 g, its time 6 g.
    near(&sheet, "printed perilune: 14.027 deg", key, 1.5, 0.5);
    near(&sheet, "printed time: 450 s", key, 6.0, 1.0);
}

/// Gaps of an independent program, by multiple shooting with Ipopt.
#[test]
fn few_segments() {
    let sheet = on_two(|w| segments::sheet(&segments::ROWS[..2], w));
    for (row, gap) in [
        ("2 of equal lengths", 2.030_192),
        ("2 of free lengths", 1.922_719),
        ("5 of equal lengths", 0.273_453),
        ("5 of free lengths", 0.247_349),
    ] {
        near(&sheet, row, "gap_kg", gap, PUBLISHED);
    }
}

/// Adjoint of the reference, confirmed there by differences to 1e-6; a full thrust of 4900 N by collocation with Ipopt.
#[test]
fn prices_and_thrusts() {
    let sheet = on_two(sensitivity::sheet);
    for (row, expected) in [
        ("initial mass, kg/kg", 0.542_230_65),
        ("specific impulse, kg/s", 0.258_622_11 * 9.80665),
        ("full thrust, kg/N", 0.005_930_589),
    ] {
        near(&sheet, row, "by_multipliers", expected, ADJOINT * expected);
        near(&sheet, row, "by_solving_again", expected, DIFFERENCES * expected);
    }
    let sheet = on_two(|w| sensitivity::thrusts(&[sensitivity::THRUSTS[5]], w));
    near(&sheet, "4900 N", "less_than_nominal_kg", 32.3, PUBLISHED_KG);
}

/// Standard deviations by the state-transition matrix of the reference: 593.31 m up, 515.67 m along, 514.39 m across.
#[test]
fn flights_that_deviate() {
    let sheet = on_two(|w| deviations::near(400, 4, w));
    for (row, sigma) in [("upwards, m", 593.3052), ("along, m", 515.6662), ("across, m", 514.3924)] {
        near(&sheet, &format!("sigma by the matrix, {row}"), "found", sigma, 20.0 * PUBLISHED);
        // 400 flights: four standard errors of 3.5 %.
        near(&sheet, &format!("sigma {row}"), "found", sigma, 0.14 * sigma);
    }
    near(&sheet, "planned anew at the start: within 1 m, %", "found", 100.0, 0.0);
    let sheet = on_two(|w| deviations::far(200, 4, w));
    // Each start above the ground has a flight to the gate, as in the reference.
    let words: Vec<&str> = sheet.findings[1].split_whitespace().collect();
    let of = words.iter().position(|w| *w == "of").unwrap();
    assert_eq!(words[of - 1], words[of + 1], "{}", sheet.findings[1]);
    // 200 draws: three standard errors of 3.4 %.
    near(&sheet, "starts below the ground, %", "found", 38.75, 10.3);
}

/// With feed-forward errors of the start are left by less than a third of what the laws leave, along the course and across it; E-guidance
/// ends at the planned place. The laws alone end 1.5 to 2.7 km farther on than the plan, as in the tests of the mission.
#[test]
fn feed_forward_takes_back_what_errors_of_the_start_do() {
    let sheet = on_two(|w| guidance::sheet([40, 24, 2], w));
    let of = |row: &str, key: &str| sheet.value(&format!("start: {row}"), key).unwrap();
    for key in ["along_sigma_m", "across_sigma_m"] {
        let (law, corrected) = (of("laws of 5.3.5", key), of("with feed-forward", key));
        assert!(corrected < law / 3.0, "{key}: {law} {corrected}");
        assert!(of("E-guidance", key) < 1.0, "{key}");
    }
    assert!((1.5e3..2.7e3).contains(&of("laws of 5.3.5", "along_mean_m")));
    assert!(sheet.rows.iter().all(|r| r.values[1] == Some(0.0)), "{:?}", sheet.rows);
}

/// The braking ends at the gate of 3 km after 404 km, and the ways of all stages add up to the touchdown.
#[test]
fn paths_join_at_the_gates() {
    let sheet = on_two(paths::sheet);
    let of = |row: &str, key: &str| sheet.value(row, key).unwrap();
    near(&sheet, "braking", "end_altitude_m", of("adjustment", "start_altitude_m"), BY_HAND);
    near(&sheet, "descent", "end_altitude_m", 0.0, BY_HAND);
    for stages in sheet.rows.windows(2) {
        near(&sheet, &stages[1].label, "start_s", of(&stages[0].label, "end_s"), BY_HAND);
    }
    assert!((390e3..450e3).contains(&of("braking", "way_along_m")));
    assert_eq!(sheet.graphs.len(), 9);
}

/// The parts that the program states beside the rules of the contest are those of the sheet, and sites by our criteria keep them.
#[test]
fn the_rules_of_the_contest_are_unsafe() {
    let sheet = on_two(|_| hazards::sheet());
    let of_paper: Vec<f64> =
        sheet.rows.iter().filter_map(|r| sheet.value(&r.label, hazards::FALSE_SAFE)).collect();
    assert_eq!(of_paper.len(), 6);
    let least = of_paper.iter().copied().fold(f64::INFINITY, f64::min).round();
    let most = of_paper.iter().copied().fold(0.0, f64::max).round();
    assert_eq!([least, most], SiteCriteria::CONTEST_FALSE_SAFE_PERCENT, "{of_paper:?}");
    for row in sheet.rows.iter().filter(|r| r.label.ends_with("clearance")) {
        let fine = row.label.starts_with("fine");
        let (criteria, value) = (
            if fine { SiteCriteria::CHANG_E_3_FINE } else { SiteCriteria::CHANG_E_3_COARSE },
            |key: &str| sheet.value(&row.label, key).unwrap(),
        );
        assert!(value("slope_deg") <= criteria.slope_max_deg.unwrap());
        assert!(value("footpad_slope_deg") <= criteria.footpad_slope_max_deg.unwrap());
        assert!(value("roughness_m") <= criteria.roughness_max_m.unwrap());
        assert!(value("clearance_m") >= criteria.clearance_min_m);
    }
}

/// By hand: mu / r^2 = 1.6247534 m/s2 at 1737.113 km, r cos(44.12 deg) w^2 = 8.834867e-6 m/s2 with one turn in 27.321661 days. The flown hover
/// has the resultant of both accelerations, and no flight of the last stage takes less than the optimum.
#[test]
fn the_hover_and_the_last_stage() {
    let sheet = on_two(lower_stages::hover);
    near(&sheet, "centrifugal g_c' = r_c' omega^2, um/s2", "found", 8.834_867, BY_HAND);
    near(&sheet, "radial a_r = g_c' cos(theta) - g_c, m/s2", "found", -1.624_747_066, BY_HAND);
    near(&sheet, "along the meridian a_f = g_c' sin(theta), um/s2", "found", 6.150_511, BY_HAND);
    near(&sheet, "acceleration by the thrust, flown, m/s2", "found", 1.624_747_066, 2.0 * BY_HAND);
    near(&sheet, "acceleration by the thrust, flown, m/s2", "reference_is_reproduced", 1.0, 0.0);
    let sheet = on_two(lower_stages::last_stage);
    let propellant = |row: &str| sheet.value(row, "propellant_kg").unwrap();
    assert!(propellant("uniform deceleration") > propellant("optimum"), "{:?}", sheet.rows);
    assert!(sheet.value("uniform deceleration", "largest_thrust_n").unwrap() < 7500.0);
}

/// Relative errors from the printed values by hand: 6.34, 3.20 and 5.20 %.
#[test]
fn error_table() {
    let sheet = on_two(text::errors);
    assert_eq!(sheet.rows.len(), 15);
    for (row, expected) in
        [("1 %: first angle, deg", 6.34), ("2 %: second angle, deg", 3.20), ("2 %: thrust, N", 5.20)]
    {
        near(&sheet, row, "relative_error_percent", expected, 100.0 * PUBLISHED);
    }
    assert!(sheet.rows.iter().all(|r| r.values.last() == Some(&Some(0.0))));
    assert!(sheet.findings[1].starts_with("10 of 10 thrusts"), "{}", sheet.findings[1]);
}
