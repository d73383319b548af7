//! `apsides reproduce capsule-reentry`: test functions and moon lander of Alami Naeini and Roshanian, Modares Mechanical Engineering
//! 14(13), 2014. Reduced sets of the other sheets are tested beside their code.
//!
//! Reference numbers: stationary points and scans of the test functions, the lander's closed form, by independent programs.
#![allow(clippy::unwrap_used)]

use apsides_publications::{Part, Reproduction, parts, reproduce};

/// Round-off: values of test functions at their minima.
const LEAST_VALUE: f64 = 1e-12;
/// Solver: places of minima.
const PLACE: f64 = 1e-11;
/// Solver: times and impulses of the lander against the closed form, which is printed to ten digits.
const CLOSED_FORM: f64 = 1e-9;

fn first(count: usize) -> Reproduction {
    let mut done = 0;
    let first = reproduce("capsule-reentry", 2, &mut (), |part| {
        done += usize::from(matches!(part, Part::Sheet(_)));
        done < count
    });
    first.unwrap()
}

#[test]
fn functions_and_lander() {
    let found = first(3);
    assert_eq!((found.complete, found.sheets.len(), parts("capsule-reentry").unwrap()), (false, 3, 8));
    for sheet in &found.sheets {
        assert_eq!((&sheet.failures[..], &sheet.unverified[..]), (&[][..], &[][..]), "{}", sheet.id);
    }
    let [functions, searches, lander] = &found.sheets[..] else { panic!("{:?}", found.sheets.len()) };
    let near = |row: &str, key: &str, expected: f64, tolerance: f64| {
        let value = functions.value(row, key).or_else(|| lander.value(row, key)).unwrap();
        assert!((value - expected).abs() <= tolerance, "{row}, {key}: found {value}, expected {expected}");
    };
    near("(6)", "least_value", -0.335_586_525_247, LEAST_VALUE);
    near("(6)", "x", 1.0, 0.0);
    near("(6)", "y", 1.660_605_319_779, PLACE);
    near("(5), exponent 0.25", "least_value", -0.247_405_194_039, LEAST_VALUE);
    near("(5), exponent 0.25", "value_at_printed", 0.0, 0.0);
    near("(5), exponent 0.5", "least_value", 0.0, 0.0);
    assert!(functions.findings[0].contains("is no global minimiser with the exponent 0.25"));
    // The smooth rings of (6) are found by every algorithm but the genetic one in every search.
    for row in searches.rows.iter().filter(|r| r.label.starts_with("(6)") && !r.label.contains("genetic")) {
        assert_eq!(row.values[0], Some(20.0), "{}", row.label);
    }
    for method in ["closed form", "Radau"] {
        near(method, "burn_starts", 1.4154037504, CLOSED_FORM);
        near(method, "landing", 4.1641408342, CLOSED_FORM);
        near(method, "impulse", 8.2462112513, CLOSED_FORM);
    }
    assert!(found.remarks.iter().any(|r| r.contains("right to left")));
}
