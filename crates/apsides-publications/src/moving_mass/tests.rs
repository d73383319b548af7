//! The tables against the reference, and the verdicts.
#![allow(clippy::unwrap_used)]

use super::{entry, full, items, sheets};
use crate::sheet::Sheet;
use crate::stop::Stop;

/// Published: figures of the reference, as its steps leave them, relative.
const PUBLISHED: f64 = 0.01;

/// Discretisation: an angle that is held by slow masses off the plane of the centre of mass, deg; without a law it is 2 deg.
const HELD_OFF_THE_PLANE_DEG: f64 = 0.02;

/// Published: frequencies of two digits, counted from crossings, relative.
const COUNTED: f64 = 0.03;

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
        "no law, no offset",
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
    // The items of the figures take their verdicts from here.
    let derived = |item: &str| {
        let found = items::ITEMS.iter().find(|i| i.item == item).unwrap();
        found.verdict_by(std::slice::from_ref(&sheet)).split(';').next().unwrap().to_owned()
    };
    assert_eq!(derived("Figs 2 and 3, no law, no offset"), "reproduced");
    assert_eq!(derived("Figs 10 and 11, cross 10 kg, linear"), "reproduced");
    assert_eq!(derived("Figs 20 and 21, rim 5 kg, nonlinear law"), "partly");
    // Its own case is held, as Figs 20 and 21 claim, other directions of the offset are not.
    assert_eq!(verdict("radial 5 kg, nonlinear PID on angles"), "partly");
    assert_eq!(verdict("cross 5 kg, nonlinear PID"), "reproduced");
    let value = |row: &str, key: &str| sheet.value(row, key).unwrap();
    // Root mean squares beside the reference: within 1 %, but for those that are round-off of a held angle.
    for row in &sheet.rows {
        if row.label.contains("nonlinear") || row.values[2].is_some_and(|r| !(0.2..100.0).contains(&r)) {
            continue;
        }
        for (found, expected) in [(0, 2), (1, 3)] {
            let (found, expected) = (row.values[found].unwrap(), row.values[expected].unwrap());
            assert!((found / expected - 1.0).abs() < PUBLISHED, "{}: {found} {expected}", row.label);
        }
    }
    // `radial_direct_linear`: 0.004933 and 0.0052773 deg with gains that were tuned for this case.
    let tuned = value("radial 10 kg, PID on angles, gains of the reference", "attack_rms_deg");
    assert!((tuned / 0.004933 - 1.0).abs() < PUBLISHED, "{tuned}");
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
        assert!((counted / expected - 1.0).abs() < COUNTED, "{row}: {counted}");
    }
}

#[test]
fn the_mass_of_the_vehicle_decides() {
    let sheet = made(sheets::authority(2));
    assert!(sheet.findings[0].starts_with("held exactly where"), "{:?}", sheet.findings);
    for row in sheet.rows.iter().filter(|r| r.label.starts_with("cross")) {
        let (found, expected) = (row.values[2].unwrap(), row.values[4].unwrap());
        assert!((found / expected - 1.0).abs() < PUBLISHED, "{}: {found} {expected}", row.label);
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
            assert!((found / expected - 1.0).abs() < PUBLISHED, "{row}: {found} {expected}");
        }
    }
}

/// Towards the offset: down is short. The dispersion of a capsule without lift has no reference; its sizes are those of this model.
#[test]
fn an_offset_moves_the_end_of_a_re_entry() {
    let sheet = made(entry::sheet(2, &mut ()));
    let value = |row: &str, key: &str| sheet.value(row, key).unwrap();
    let without = |direction: &str| {
        let row = format!("without lift, 1 cm at {direction} deg");
        ["downrange_error_km", "crossrange_error_km"].map(|key| value(&row, key))
    };
    let ([down, _], [up, _]) = (without("90"), without("270"));
    assert!(down < -35.0 && up > 40.0, "{down} {up}");
    let ([_, right], [_, left]) = (without("0"), without("180"));
    assert!(right > 7.0 && left < -7.0, "{right} {left}");
    for row in sheet.rows.iter().filter(|row| row.label.starts_with("lift")) {
        let [along, across] = [row.values[0].unwrap(), row.values[1].unwrap()];
        let most = if row.label.ends_with("no offset") { 0.1 } else { 3.0 };
        assert!(along.hypot(across) < most, "{}: {along} {across}", row.label);
    }
}

/// In the plane of the centre of mass a cross does what quasi-static masses do. A fifth of a metre off it the derivative gain of 5 m s/rad feeds itself
/// with `m b k / (J T)` = 10 * 0.2 * 5 / (85.2 * 0.01) = 11.7 at each sample of ideal drives: no law holds with more than 1.
#[test]
fn full_masses_beside_quasi_static_ones() {
    let sheet = made(full::sheet(2));
    let value = |row: String, key: &str| sheet.value(&row, key);
    let rms = |row: &str, station: &str| value(format!("{row}, {station} m"), "full_rms_deg");
    let changed = |row: &str, station: &str| {
        let label = format!("{row}, {station} m: ");
        sheet.findings.iter().find_map(|f| f.strip_prefix(&label).map(str::to_owned))
    };
    for drives in ["ideal drives", "1 m/s and 10 m/s2"] {
        let row = format!("cross 10 kg, 1 cm, {drives}");
        let quasi = value(format!("{row}, 0 m"), "quasi_static_rms_deg").unwrap();
        assert!((rms(&row, "0").unwrap() / quasi - 1.0).abs() < PUBLISHED, "{drives}");
        assert_eq!(changed(&row, "0"), None);
        // 0.59 deg is what statics leaves of the cross of 5 kg.
        let saturated = rms(&format!("Figs 18, 19: cross 5 kg, 1 cm, {drives}"), "0").unwrap();
        assert!((saturated / 0.59 - 1.0).abs() < PUBLISHED, "{drives}: {saturated}");
    }
    for station in ["0.2", "-0.2"] {
        let ideal = changed("cross 10 kg, 1 cm, ideal drives", station).unwrap();
        assert!(
            ideal.starts_with("held with quasi-static masses") && !ideal.contains(", held with full ones"),
            "{ideal}"
        );
        // With the gains of `RATE_LIMITED_GAINS` for 0.1 m/s it is held off the plane, too.
        let slow = "cross 10 kg, 1 cm, 0.1 m/s with gains for it";
        assert!(rms(slow, station).unwrap() < HELD_OFF_THE_PLANE_DEG && changed(slow, station).is_none());
    }
    assert!(sheet.findings[0].starts_with("what the neglect does: with the masses in the plane"));
    assert_eq!((sheet.rows.len(), sheet.graphs.len()), (33, 11));
}
