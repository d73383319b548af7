//! Reduced sets of each sheet.

use super::limits::{COMBINATIONS, Found};
use super::model::Model;
use super::profiles::FORMS;
use super::reference::{BASE, TABLE_E};
use super::{functions, lander, limits, overlays, profiles, starts};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;

/// Solver: the tolerances at which the iterations stop.
const SOLVER: f64 = 1e-10;

/// Published: half a unit of the last digit that the source prints.
const PUBLISHED: f64 = 1e-12;

/// Solver: the same heat load by two layouts, MJ/m2.
const SAME_LOAD_MJ_M2: f64 = 1e-5;

/// Solver: a limit that is active, relative, at the points of a figure.
const LIMIT_MET: f64 = 1e-3;

/// Altitude at the entry, km.
const ENTRY_KM: f64 = 120.0;

/// Discretisation: values of a function on its contour lines, which are straight within the squares of the figure.
const CONTOUR: f64 = 0.05;

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
    // Figs 1 and 2: the function has the value of the level along its lines.
    let rings =
        sheet.graphs.iter().find(|g| g.file == "figure_02.svg").unwrap_or_else(|| panic!("no Fig. 2"));
    let levels = rings
        .series
        .iter()
        .filter_map(|s| Some((s.label.strip_prefix("level ")?.parse::<f64>().ok()?, &s.line)));
    let mut lines = 0;
    for (level, line) in levels {
        for [x, y] in line.iter().filter(|p| p[0].is_finite()) {
            let value = libm::j0(x * x + y * y) + 0.1 * (1.0 - x).abs() + 0.1 * (1.0 - y).abs();
            assert!((value - level).abs() < CONTOUR, "({x}, {y}): {value} on {level}");
        }
        lines += usize::from(line.len() > 50);
    }
    assert_eq!((sheet.graphs.len(), lines), (3, 5));
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

/// Figs 14 to 16: under a limit of 850 kW/m2 the heat rate stays there for a while, without one it goes above.
#[test]
fn histories_under_a_limit() {
    let none =
        TABLE_E.iter().position(|r| r.limits == [f64::INFINITY; 3]).unwrap_or_else(|| panic!("no row"));
    let limit = [f64::INFINITY, f64::INFINITY, 850.0];
    let limited = TABLE_E.iter().position(|r| r.limits == limit).unwrap_or_else(|| panic!("no row"));
    let rows = [none, limited].map(|k| TABLE_E[k]);
    let (_, found) = on_two(|workers| limits::table(Model::E, &rows, workers));
    let graphs = overlays::graphs(Model::E, &found);
    let graph = |file: &str| {
        let found = graphs.iter().find(|g| g.file == file);
        found.unwrap_or_else(|| panic!("no {file}"))
    };
    let labels = |file: &str| graph(file).series.iter().map(|s| s.label.clone()).collect::<Vec<_>>();
    assert_eq!(labels("limits_heat_rate_e_heat_rate.svg"), ["850 kW/m²", "no limit"]);
    let peaks: Vec<f64> = graph("limits_heat_rate_e_heat_rate.svg")
        .series
        .iter()
        .map(|s| s.line.iter().map(|p| p[1]).fold(0.0, f64::max))
        .collect();
    assert!((peaks[0] / 850.0 - 1.0).abs() < LIMIT_MET && peaks[1] > 1.02 * 850.0, "{peaks:?}");
    // Bank angle and six states, from the entry at 120 km on.
    let altitude = graph("limits_heat_rate_e_state_1.svg");
    assert_eq!(altitude.y, ("altitude", "km"));
    assert!(
        altitude.series.iter().all(|s| s.line.len() == 401 && (s.line[0][1] - ENTRY_KM).abs() < SOLVER * 1e4)
    );
    assert_eq!(graphs.iter().filter(|g| g.title.starts_with("Figs 14 to 16")).count(), 8);
    assert_eq!(labels("limits_pressure_e_pressure.svg"), ["no limit"]);
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
    // The searches of the form; bank angle, six states and path of its best profile beside the optimum.
    assert_eq!(sheet.graphs.len(), 1 + 8);
    assert!(sheet.graphs[1].series.iter().all(|s| !s.line.is_empty()));
    assert!(sheet.graphs[2..].iter().all(|g| g.series.iter().all(|s| s.line.len() == 401)));
    // Both orders of the exchange against the five algorithms alone.
    let beside =
        sheet.findings.iter().find(|f| f.starts_with("Against single algorithms: in the order of the paper"));
    let counts: Vec<usize> = beside
        .unwrap_or_else(|| panic!("{:?}", sheet.findings))
        .split([' ', ',', ';', '.'])
        .filter_map(|word| word.parse().ok())
        .collect();
    assert_eq!(counts.len(), 6);
    assert!(counts.chunks(3).all(|c| c.iter().sum::<usize>() == 5), "{counts:?}");
    near(&sheet, "3 constants, energy, cooperation", "reference_excess_percent", 0.829, 0.0);
}

/// The string of the paper: 3 sub-intervals of 4 values each, their lengths and degrees, and their number; over time the end of the flight, too.
#[test]
fn searches_with_degrees_of_their_own() {
    let sheet = on_two(|workers| profiles::sheet(&FORMS[3..], 2, 600, workers));
    assert_eq!(sheet.rows.len(), 11);
    for row in &sheet.rows {
        let end = if row.label.contains(", time, ") { 1.0 } else { 0.0 };
        near(&sheet, &row.label, "variables", 12.0 + 3.0 + 3.0 + 1.0 + end, 0.0);
        assert!(row.values[2].is_some_and(|excess| excess > 0.0 && excess < 60.0), "{row:?}");
    }
}
