//! Numbers of the text that exclude each other or the problem.

use apsides_dynamics::powered_descent::MOON_ROTATION_RATE;

use super::case::{BRAKING, MASS, PLANE, SolvedCase, THRUST, solve};
use super::comparison::{self, Compared, row, to};
use super::downrange::PRINTED_TIME;
use super::orbit::{MU, RADIUS, SITE, arc};
use crate::sheet::Sheet;
use crate::stop::Stop;
use crate::workers::Workers;

/// The error table: size of the error (%), then for two angles (deg) and the thrust (N) the initial value, the one found, and the
/// relative error printed (%).
const ERRORS: [(f64, [[f64; 3]; 3]); 5] = [
    (1.0, [[30.3, 32.22, 1.39], [181.8, 192.3, 1.83], [7676.0, 7743.49, 1.89]]),
    (2.0, [[30.6, 30.89, 2.97], [183.6, 189.48, 3.27], [7752.0, 8154.88, 2.30]]),
    (3.0, [[30.9, 32.62, 3.73], [185.4, 198.13, 3.07], [7828.0, 7934.57, 3.40]]),
    (4.0, [[31.2, 31.03, 4.43], [187.2, 198.77, 5.43], [7904.0, 8148.62, 7.22]]),
    (5.0, [[31.5, 33.24, 5.81], [189.0, 195.29, 8.49], [7980.0, 8147.60, 7.21]]),
];
const QUANTITIES: [&str; 3] = ["first angle, deg", "second angle, deg", "thrust, N"];
/// Half a unit of the last printed digit.
const HALF_DIGIT: f64 = 5e-3;

/// The error table with its relative errors computed from its own values.
pub(super) fn errors(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "errors",
        "Error table: relative errors from the printed values themselves, and what no thrust can be",
        "error, quantity",
        &[
            ("initial", 2),
            ("with_error", 2),
            ("printed_relative_error_percent", 2),
            ("relative_error_percent", 2),
            ("initial_by_1_plus_error", 3),
            ("above_the_full_thrust_n", 2),
            ("printed_is_reproduced", 0),
        ],
    )
    .with_flags(&["printed_is_reproduced"]);
    let (mut right, mut rows, mut impossible, mut thrusts) = (0, 0, 0, 0);
    for (percent, quantities) in ERRORS {
        for (label, [initial, value, printed]) in QUANTITIES.iter().zip(quantities) {
            let relative = 100.0 * (value - initial).abs() / initial;
            let holds = (relative - printed).abs() <= HALF_DIGIT;
            let is_thrust = label.ends_with('N');
            let above = [initial, value].map(|v| v - THRUST);
            rows += 1;
            right += usize::from(holds);
            if is_thrust {
                thrusts += 2;
                impossible += above.iter().filter(|a| **a > 0.0).count();
            }
            sheet.push(
                format!("{percent} %: {label}"),
                vec![
                    Some(initial),
                    Some(value),
                    Some(printed),
                    Some(relative),
                    Some(initial / (1.0 + percent / 100.0)),
                    is_thrust.then_some(above[1]),
                    Some(f64::from(u8::from(holds))),
                ],
            );
        }
    }
    let base = solve(BRAKING, &[PLANE], &mut *workers.observer)?;
    let full = base.trajectory.phases.first().map_or(f64::NAN, |p| {
        (0..=100).map(|k| p.control_at(p.time_at(f64::from(k) / 100.0))[1]).fold(0.0, f64::max)
    });
    sheet.findings = vec![
        format!(
            "{right} of {rows} printed relative errors are those of the values beside them; no reading of the columns gives the others."
        ),
        format!(
            "{impossible} of {thrusts} thrusts are above the full thrust of {THRUST} N and impossible; the flight solved here takes {:.0} \
             N at most.",
            full * THRUST
        ),
        "The initial values are 30, 180 and 7600 with the error added; 7600 N itself is above the full thrust."
            .into(),
    ];
    Ok(sheet)
}

/// Single numbers of the text beside ours.
pub(super) fn numbers(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let flight = solve(BRAKING, &[PLANE], &mut *workers.observer)?;
    let rows = [braking(&flight), moon_and_sites()].into_iter().flatten().collect();
    let mut sheet = comparison::sheet("text", "Numbers of the text beside those of the problem", rows);
    flight.check("main braking in the plane", &mut sheet);
    Ok(sheet)
}

fn braking(flight: &SolvedCase) -> Vec<Compared<'static>> {
    let time = flight.get("flight_time_s");
    let speed = flight.get("gate_upward_speed_m_s").hypot(flight.get("gate_horizontal_speed_m_s"));
    let down = -flight.get("gate_upward_speed_m_s");
    let final_mass = flight.get("final_mass_kg");
    let way = flight.get("downrange_km");
    vec![
        row(
            "downward speed at 3 km, m/s",
            to(197.99, 5e-3),
            down,
            to(24.227_927, 1e-4),
            format!("it exceeds the speed of {speed:.0} m/s that the statement gives for the same gate"),
        ),
        row(
            "largest acceleration by the thrust at the start, m/s2",
            to(12.31, 5e-3),
            THRUST / MASS,
            to(3.125, 1e-9),
            format!(
                "no thrust of the vehicle gives it: full thrust at the least mass is {:.3} m/s2",
                THRUST / final_mass
            ),
        ),
        row(
            "way of the braking on the ground, km",
            to(11.443, 5e-4),
            way,
            to(403.930_3, 1e-3),
            "the printed speeds and times give 114.67 km, the printed coordinates 114.43 km: decimals are misplaced, and the way is \
             four times that",
        ),
        row(
            "flight time of the braking, s",
            to(PRINTED_TIME, 0.5),
            time,
            to(424.955_306, 1e-3),
            "not the optimum, though close to it in propellant (sheet `downrange`)",
        ),
    ]
}

/// The Moon, and the sites of the stages.
fn moon_and_sites() -> Vec<Compared<'static>> {
    // The text counts them from the centre to the ground at the site.
    let ground = RADIUS - 2641.0;
    let orbital = (MU / ground.powi(3)).sqrt();
    let carried = MOON_ROTATION_RATE * ground * SITE[1].to_radians().cos();
    let flattening: f64 = 1.0 / 963.7256;
    let km = |from, to| arc(from, to).to_radians() * RADIUS / 1e3;
    let (coarse, fine) = ([-19.51, 35.12], [-18.4, 33.7]);
    vec![
        row(
            "semi-major axis of the Moon, km",
            to(384_339.0, 0.5),
            RADIUS / 1e3,
            to(1_737.013, 1e-9),
            "about the distance of the Moon from the Earth",
        ),
        row(
            "eccentricity of the ellipsoid of the Moon",
            to(flattening, 1e-7),
            (2.0 * flattening - flattening * flattening).sqrt(),
            None,
            "1/963.7256 is a flattening f; the eccentricity is sqrt(2 f - f^2)",
        ),
        row(
            "angular velocity of the hover over that of the Moon",
            to(orbital / MOON_ROTATION_RATE, 1e-6),
            1.0,
            to(1.0, 0.0),
            format!(
                "sqrt(mu / r^3) is the rate of an orbit, {:.1} m/s at the ground; a hover moves with it, {carried:.3} m/s",
                orbital * ground
            ),
        ),
        row(
            "speed of the site in inertial space, m/s",
            to(orbital * ground, 1e-6),
            carried,
            to(3.314_020_2, 1e-5),
            "as above",
        ),
        row(
            "distance of the site of the coarse stage from the target, km",
            to(0.0, 1.15),
            km(coarse, SITE),
            to(272.849_364, 1e-4),
            "its map is 2.3 km wide",
        ),
        row(
            "distance of the site of the fine stage from the target, km",
            to(0.0, 1.15),
            km(fine, SITE),
            to(316.973_501, 1e-4),
            "its map is 0.1 km wide",
        ),
        row(
            "distance between both sites, km",
            to(0.0, 1.15),
            km(coarse, fine),
            to(51.224_432, 1e-4),
            "the fine stage begins where the coarse one ends",
        ),
    ]
}
/// The printed table of sensitivities: label, initial and changed value, printed change in %.
const SENSITIVITIES: [(&str, f64, f64, f64); 9] = [
    ("full thrust: theta, deg", 30.34, 35.56, 16.67),
    ("full thrust: psi, deg", 180.78, 178.56, 1.11),
    ("full thrust: F, N", 1500.53, 3800.89, 153.33),
    ("exhaust velocity: theta, deg", 51.65, 40.84, 20.92),
    ("exhaust velocity: psi, deg", 265.05, 309.81, 16.89),
    ("exhaust velocity: F, N", 2926.15, 6620.20, 126.24),
    ("initial mass: theta, deg", 30.70, 48.31, 57.37),
    ("initial mass: psi, deg", 231.85, 287.10, 23.83),
    ("initial mass: F, N", 2065.74, 6419.71, 210.77),
];
/// Changes of two digits behind the point, rounded or cut, of values with two.
const DIGITS: f64 = 0.05;

/// The changes that the printed values give.
pub(super) fn sensitivities() -> Sheet {
    let mut sheet = Sheet::new(
        "printed-sensitivity",
        "Table of sensitivities: relative changes from the printed values themselves",
        "changed parameter, quantity",
        &[
            ("printed_initial", 2),
            ("printed_changed", 2),
            ("printed_change_percent", 2),
            ("change_percent", 2),
        ],
    );
    let mut wrong = Vec::new();
    for (label, initial, changed, printed) in SENSITIVITIES {
        let change = 100.0 * ((changed - initial) / initial).abs();
        sheet.push(label, vec![Some(initial), Some(changed), Some(printed), Some(change)]);
        if (change - printed).abs() > DIGITS {
            wrong.push(format!("{label} ({printed} printed, {change:.2})"));
        }
    }
    sheet.findings.push(format!("changes that do not follow from the printed values: {}", wrong.join("; ")));
    sheet.findings.push(
        "by how much the parameters were changed is not said, so that no row can be computed; prices of the optimum by each parameter are in the \
         sheet sensitivity"
            .into(),
    );
    sheet
}
