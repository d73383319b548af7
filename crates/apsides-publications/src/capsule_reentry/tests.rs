//! Reduced sets of each sheet.

use super::limits::{COMBINATIONS, Found};
use super::model::Model;
use super::profiles::FORMS;
use super::reference::{BASE, TABLE_E};
use super::{functions, lander, limits, profiles, starts};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;

/// Solver: the tolerances at which the iterations stop.
const SOLVER: f64 = 1e-10;

/// Published: half a unit of the last digit that the source prints.
const PUBLISHED: f64 = 1e-12;

/// Solver: the same heat load by two layouts, MJ/m2.
const SAME_LOAD_MJ_M2: f64 = 1e-5;

fn on_two<T>(work: impl FnOnce(&mut Workers<'_>) -> Result<T, Stop>) -> T {
    match work(&mut Workers { threads: 2, observer: &mut () }) {
        Ok(done) => done,
        Err(Stop::Refused(e)) => panic!("{e}"),
        Err(Stop::NotSolved(why)) => panic!("{why}"),
        Err(Stop::Interrupted) => panic!("interrupted"),
    }
}

fn near(sheet: &Sheet, row: &str, key: &str, expected: f64, tolerance: f64) {
    let found = sheet.value(row, key).unwrap_or_else(|| panic!("no {key} in {row}"));
    assert!((found - expected).abs() <= tolerance, "{row}, {key}: found {found}, expected {expected}");
}

/// Stationary points and the scan of the whole box; reference A1.
#[test]
fn minima_of_the_test_functions() {
    let sheet = functions::optima();
    near(&sheet, "(6)", "least_value", -0.335_586_525_247, PUBLISHED);
    near(&sheet, "(6)", "y", 1.660_605_319_779, 10.0 * PUBLISHED);
    near(&sheet, "(5), exponent 0.25", "least_value", -0.247_405_194_039, PUBLISHED);
    near(&sheet, "(5), exponent 0.25", "x", -0.202_149_94, 1e4 * PUBLISHED);
    near(&sheet, "(5), exponent 0.25", "value_at_printed", 0.0, 0.0);
    near(&sheet, "(5), exponent 0.5", "least_value", 0.0, 0.0);
    assert!(sheet.findings[0].contains("no global minimiser with the exponent 0.25"));
    let sheet = on_two(|workers| functions::searches(3, 6000, workers));
    for row in sheet.rows.iter().filter(|r| r.label.starts_with("(6)")) {
        assert!(row.values[2].is_some_and(|v| v < -0.3), "{row:?}");
    }
}

/// Reference A5.
#[test]
fn moon_lander() {
    let sheet = on_two(|workers| lander::sheet(1, 600, workers));
    for (key, expected) in
        [("burn_starts", 1.4154037504), ("landing", 4.1641408342), ("impulse", 8.2462112513)]
    {
        near(&sheet, "closed form", key, expected, SOLVER);
        near(&sheet, "Radau", key, expected, 100.0 * SOLVER);
    }
}

/// Reference A3: three rows of model E, and the search layer for one of them.
#[test]
fn limits_of_model_e() {
    let picked = [[f64::INFINITY; 3], BASE, [f64::INFINITY, f64::INFINITY, 850.0]];
    for limits in picked {
        let k = TABLE_E.iter().position(|r| r.limits == limits).unwrap_or_else(|| panic!("{limits:?}"));
        let (sheet, found) = on_two(|workers| limits::table(Model::E, &TABLE_E[k..=k], workers));
        assert!(sheet.failures.is_empty(), "{:?}", sheet.failures);
        assert!(sheet.findings[0].starts_with("1 of 1 rows are within"), "{:?}", sheet.findings);
        assert!(sheet.unverified.is_empty(), "{:?}", sheet.unverified);
        assert!(sheet.findings.iter().any(|f| f.contains("those of the reference in every row")));
        let Some(Found { solved: Some(solved), .. }) = found.first() else { panic!("{limits:?}") };
        let expected = [(picked[0], 121.6841, 2e-4), (BASE, 122.9272, 5e-4)];
        for (_, heat_load, error) in expected.iter().filter(|e| e.0 == limits) {
            assert!((solved.heat_load - heat_load).abs() < *error, "{}", solved.heat_load);
        }
        if limits == BASE {
            assert!(COMBINATIONS.contains(&BASE));
            let layers = on_two(|workers| limits::layers(&[(Model::E, &found)], &[BASE], workers));
            let row = "E, 15 / 40 / 800";
            near(&layers, row, "two_layer_solved", 1.0, 0.0);
            near(&layers, row, "heat_loads_differ_by_mj_m2", 0.0, SAME_LOAD_MJ_M2);
            let [straight, two] = ["straight", "two_layer"]
                .map(|m| layers.value(row, &format!("{m}_first_mesh_iterations")).unwrap_or(f64::NAN));
            assert!(two < straight && two <= 40.0, "{two} {straight}");
        }
    }
}

/// Reference A4: 40 iterations in the median from a search.
#[test]
fn starts_of_model_e() {
    let sheet = on_two(|workers| starts::sheet(2, workers));
    for start in ["straight lines, random bank and time", "best of 3000 flights of the cooperation"] {
        near(&sheet, &format!("{start}, cosine and sine"), "successes", 2.0, 0.0);
    }
    let warm = sheet.value("best of 3000 flights of the cooperation, cosine and sine", "median_iterations");
    assert!(warm.is_some_and(|m| m <= 40.0), "{warm:?}");
}

#[test]
fn searches_over_profiles() {
    let sheet = on_two(|workers| profiles::sheet(&FORMS[..1], 2, 600, workers));
    assert_eq!(sheet.rows.len(), 11);
    for row in &sheet.rows {
        // No flight is better than the optimum by more than its misses are worth.
        assert!(row.values[1].is_some_and(|excess| excess > 0.0 && excess < 60.0), "{row:?}");
    }
    assert_eq!(sheet.graphs.len(), 2);
    assert!(sheet.graphs[1].series.iter().all(|s| s.line.len() == 401));
    near(&sheet, "3 constants, energy, cooperation", "reference_excess_percent", 0.829, 0.0);
}
