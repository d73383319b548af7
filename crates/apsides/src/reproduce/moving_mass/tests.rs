//! The tables against the reference, and the verdicts.
#![allow(clippy::unwrap_used)]

use super::sheets;
use crate::reproduce::sheet::Sheet;
use crate::reproduce::stop::Stop;

fn made(sheet: Result<Sheet, Stop>) -> Sheet {
    match sheet {
        Ok(sheet) => sheet,
        Err(_) => panic!("a case is refused"),
    }
}

#[test]
fn figures_have_a_verdict() {
    let sheet = made(sheets::figures(2));
    let verdict = |label: &str| {
        let found = sheet.findings.iter().find(|f| f.starts_with(&format!("{label}: ")));
        found.unwrap()[label.len() + 2..].split(';').next().unwrap().to_owned()
    };
    for label in [
        "no law, 1 cm",
        "cross 10 kg, PID",
        "cross 5 kg, PID",
        "cross 5 kg, PID, gains of the reference",
        "radial 10 kg, PID on angles, neutral (0, 0)",
        "radial 10 kg, PID on angles, neutral (0, 180)",
        "radial 5 kg, PID on angles, neutral (0, 180)",
    ] {
        assert_eq!(verdict(label), "reproduced", "{label}");
    }
    assert!(verdict("radial 5 kg, nonlinear PID on angles").starts_with("open"));
    let value = |row: &str, key: &str| sheet.value(row, key).unwrap();
    // Root mean squares beside the reference: within 1 %, but for those that are round-off of a held angle.
    for row in &sheet.rows {
        if row.label.contains("nonlinear") || row.values[2].is_some_and(|r| !(0.2..100.0).contains(&r)) {
            continue;
        }
        for (found, expected) in [(0, 2), (1, 3)] {
            let (found, expected) = (row.values[found].unwrap(), row.values[expected].unwrap());
            assert!((found / expected - 1.0).abs() < 0.01, "{}: {found} {expected}", row.label);
        }
    }
    // `radial_direct_linear`: 0.004933 and 0.0052773 deg with gains that were tuned for this case.
    let tuned = value("radial 10 kg, PID on angles, gains of the reference", "attack_rms_deg");
    assert!((tuned / 0.004933 - 1.0).abs() < 0.01, "{tuned}");
    // At 10 kg both neutral in one place the capsule tumbles, as in the reference (180 deg).
    assert_eq!(sheet.value("radial 10 kg, PID on angles, neutral (0, 0)", "peak_deg"), None);
}

#[test]
fn an_offset_changes_amplitude_and_not_frequency() {
    let sheet = made(sheets::oscillation());
    let value = |row: &str, key: &str| sheet.value(row, key).unwrap();
    // Reference: 0.1 to 2.0 deg; 0.73 and 0.69 Hz at 10 km.
    assert!(value("1 cm", "attack_rms_deg") / value("none", "attack_rms_deg") > 15.0);
    for (row, expected) in [("none", 0.73), ("1 cm", 0.69)] {
        let counted = value(row, "frequency_at_10_km_hz");
        assert!((counted / expected - 1.0).abs() < 0.03, "{row}: {counted}");
    }
}

#[test]
fn the_mass_of_the_vehicle_decides() {
    let sheet = made(sheets::authority(2));
    assert!(sheet.findings[0].starts_with("held exactly where"), "{:?}", sheet.findings);
    for row in sheet.rows.iter().filter(|r| r.label.starts_with("cross")) {
        let (found, expected) = (row.values[2].unwrap(), row.values[4].unwrap());
        assert!((found / expected - 1.0).abs() < 0.01, "{}: {found} {expected}", row.label);
    }
}

#[test]
fn slow_masses_need_gains_of_their_own() {
    let sheet = made(sheets::rates(2));
    assert!(
        sheet.findings.iter().any(|f| f.contains("all eight directions are held")),
        "{:?}",
        sheet.findings
    );
    // `rate_limit_fixed_gains`: 10.08 and 10.05, 2.874 and 3.705 deg.
    for (rate, expected) in [("0.2", [10.08, 10.05]), ("0.05", [2.874, 3.705])] {
        let row = format!("(10, 5, 5), damped, {rate} m/s");
        for (key, expected) in ["attack_rms_deg", "sideslip_rms_deg"].into_iter().zip(expected) {
            let found = sheet.value(&row, key).unwrap();
            assert!((found / expected - 1.0).abs() < 0.01, "{row}: {found} {expected}");
        }
    }
}
