use super::*;

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

fn coefficients(table: &MachAlphaTable, mach: f64, angle: f64) -> [f64; 3] {
    let at = table.coefficients(mach, angle * angle);
    [at.axial, at.normal_by_angle * angle, at.moment_by_angle * angle]
}

const QUANTITIES: [&[[f64; 13]; 15]; 3] = [&apollo::AXIAL, &apollo::NORMAL, &apollo::MOMENT];

#[test]
fn knots_are_met() {
    for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
        let table = MachAlphaTable::apollo(interpolation);
        for (i, mach) in apollo::MACH.iter().enumerate() {
            for (j, angle) in apollo::ATTACK_DEG.iter().enumerate() {
                let found = coefficients(&table, *mach, angle.to_radians());
                for k in 0..3 {
                    let expected = QUANTITIES[k][i][j];
                    assert!(
                        (found[k] - expected).abs() < ROUNDING,
                        "{mach} {angle}: {} {expected}",
                        found[k]
                    );
                }
            }
        }
    }
}

/// Between Mach 1.65 and 2.41 and between 5 and 7.5 deg, at a half and a quarter.
#[test]
fn straight_lines_between() {
    let table = MachAlphaTable::apollo(Interpolation::Linear);
    let found = coefficients(&table, 0.5 * (1.65 + 2.41), 5.625_f64.to_radians());
    for (found, rows) in found.iter().zip(QUANTITIES) {
        let along = |row: [f64; 13]| 0.75 * row[2] + 0.25 * row[3];
        let expected = 0.5 * (along(rows[7]) + along(rows[8]));
        assert!((found - expected).abs() < ROUNDING, "{found} {expected}");
    }
}

/// Between knots of the Mach number the smooth table stays between their values; in axial flow, where no spline in the angle intervenes.
#[test]
fn no_overshoot_between_mach_numbers() {
    let table = MachAlphaTable::apollo(Interpolation::Smooth);
    for (i, ends) in apollo::MACH.windows(2).enumerate() {
        let (a, b) = (apollo::AXIAL[i][0], apollo::AXIAL[i + 1][0]);
        for k in 0..=50 {
            let [found, ..] = coefficients(&table, ends[0] + (ends[1] - ends[0]) * f64::from(k) / 50.0, 0.0);
            assert!(found > a.min(b) - 1e-12 && found < a.max(b) + 1e-12, "{} {found}", ends[0]);
        }
    }
}

/// First and second derivatives from both sides of every knot.
#[test]
fn two_continuous_derivatives() {
    let table = MachAlphaTable::apollo(Interpolation::Smooth);
    let jets = |mach: f64, q: f64| {
        [
            table.jet(0, table.place(mach, q.sqrt()), even),
            table.jet(1, table.place(mach, q.sqrt()), odd),
            table.jet(2, table.place(mach, q.sqrt()), odd),
        ]
    };
    let check = |a: [[f64; 6]; 3], b: [[f64; 6]; 3], place: &str| {
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() < DIFFERENCES * (1.0 + a.abs()), "{place}: {a} {b}");
        }
    };
    for mach in &apollo::MACH[1..14] {
        let q = 0.0123;
        check(jets(mach - 1e-12, q), jets(mach + 1e-12, q), "Mach number");
    }
    for angle in &apollo::ATTACK_DEG[1..12] {
        let q = angle.to_radians().powi(2);
        check(jets(1.3, q - 1e-13), jets(1.3, q + 1e-13), "angle");
    }
}

/// Against differences, inside the cells, and near axial flow.
#[test]
fn derivatives_of_the_jets() {
    for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
        let table = MachAlphaTable::apollo(interpolation);
        for (mach, q) in [(2.2, 0.03), (0.55, 1e-4), (8.0, 0.2), (12.0, 0.01), (2.2, 0.4)] {
            for k in 0..3 {
                let jet = |m: f64, q: f64| {
                    if k == 0 {
                        table.jet(k, table.place(m, q.sqrt()), even)
                    } else {
                        table.jet(k, table.place(m, q.sqrt()), odd)
                    }
                };
                let at = jet(mach, q);
                let (h, g) = (1e-5, 1e-5 * q);
                let by_m = |c: usize| (jet(mach + h, q)[c] - jet(mach - h, q)[c]) / (2.0 * h);
                let by_q = |c: usize| (jet(mach, q + g)[c] - jet(mach, q - g)[c]) / (2.0 * g);
                let pairs = [
                    (by_m(0), at[1]),
                    (by_q(0), at[2]),
                    (by_m(1), at[3]),
                    (by_q(1), at[4]),
                    (by_q(2), at[5]),
                ];
                for (found, expected) in pairs {
                    assert!(
                        (found - expected).abs() < 10.0 * DIFFERENCES * (1.0 + expected.abs()),
                        "{mach} {q} {k}: {found} {expected}"
                    );
                }
            }
        }
    }
}

/// The slope in axial flow by the first interval: -0.0859 1/rad of the moment at Mach 2.41 and 2.5 deg times two.
#[test]
fn axial_flow() {
    let table = MachAlphaTable::apollo(Interpolation::Linear);
    let at = table.coefficients(2.41, 0.0);
    let width = 2.5_f64.to_radians();
    assert!(
        (at.moment_by_angle + 0.0077 / width).abs() < 100.0 * ROUNDING
            && (at.axial - 1.4316).abs() < ROUNDING
    );
    for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
        let table = MachAlphaTable::apollo(interpolation);
        for jet in [table.jet(0, table.place(2.2, 0.0), even), table.jet(1, table.place(2.2, 0.0), odd)] {
            assert!(jet.iter().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn edges_are_held_and_named() {
    let table = MachAlphaTable::apollo(Interpolation::Smooth);
    let top = 30_f64.to_radians();
    assert_eq!(coefficients(&table, 40.0, 0.1), coefficients(&table, 9.0, 0.1));
    assert_eq!(coefficients(&table, 0.1, 0.1), coefficients(&table, 0.4, 0.1));
    let (held, edge) = (coefficients(&table, 2.0, 3.0), coefficients(&table, 2.0, top));
    assert!((0..3).all(|k| (held[k] - edge[k]).abs() < ROUNDING), "{held:?} {edge:?}");
    assert_eq!(table.range_left(2.0, 0.2), Ok(()));
    let text = |mach, angle| table.range_left(mach, angle).unwrap_err().to_string();
    assert_eq!(text(40.0, 0.1), "Mach number is 40 -, the table covers 0.4 to 9");
    assert!(text(2.0, 1.0).starts_with("total angle of attack is 1 rad"));
    assert!(text(f64::NAN, 0.1).starts_with("Mach number is NaN"));
    let found = table.coefficients(f64::NAN, f64::NAN);
    assert!(found.axial.is_nan() || found.axial.is_finite()); // no panic
}

#[test]
fn tables_that_do_not_fit() {
    let (mach, attack) = ([0.5, 1.0, 2.0, 3.0], [0.0, 0.1, 0.2, 0.3]);
    let axial = [1.0; 16];
    let odd: Vec<f64> = (0..16).map(|k| f64::from(k % 4)).collect();
    let build = |mach: &[f64], attack: &[f64], axial: &[f64], normal: &[f64]| {
        MachAlphaTable::new(mach, attack, [axial, normal, &odd], Interpolation::Smooth)
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    assert_eq!(build(&mach, &attack, &axial, &odd), Ok(()));
    let error = |r: Result<(), String>, part: &str| {
        let text = r.unwrap_err();
        assert!(text.contains(part), "{text}");
    };
    error(build(&[0.5, 1.0, 1.0, 3.0], &attack, &axial, &odd), "Mach number in row 3");
    error(build(&[-0.5, 1.0, 2.0, 3.0], &attack, &axial, &odd), "-0.5 is not positive");
    error(build(&mach, &[0.1, 0.2, 0.3, 0.4], &axial, &odd), "0.1 is not 0");
    error(build(&mach, &attack, &axial[1..], &odd), "15 values for 16 rows");
    error(build(&mach, &attack, &axial, &[1.0; 16]), "coefficient of normal force in row 1");
    error(build(&mach[1..], &attack, &axial[4..], &odd[4..]), "3 rows, at least 4");
    error(
        build(&[0.5, 1.0, 1.0 + 1e-9, 3.0], &attack, &axial, &odd),
        "Mach number in row 3 of the table: 1.000000001 is too close",
    );
    error(build(&mach, &[0.0, 0.1, f64::NAN, 0.3], &axial, &odd), "NaN is not finite");
}
