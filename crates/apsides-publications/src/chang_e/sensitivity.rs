//! The worth of mass, exhaust velocity, thrust and the start at the optimum: by the multipliers and by solving again.

use apsides_dynamics::engine::STANDARD_GRAVITY;

use super::case::{BRAKING, MASS, PLANE, SolvedCase, THRUST, load, solve};
use crate::change::{Change, number};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::{Stop, ended};
use crate::workers::Workers;

/// Label, key, its value, the step of solving again, and the derivative of the final mass in the reference, in units of the key.
const KEYS: [(&str, &str, f64, f64, f64); 6] = [
    ("initial mass, kg/kg", "initial_mass_kg", MASS, 1.0, 0.542_230_649_9),
    ("specific impulse, kg/s", "isp_s", 2940.0 / STANDARD_GRAVITY, 0.1, 0.258_622_112_3 * STANDARD_GRAVITY),
    ("full thrust, kg/N", "thrust_n", THRUST, 5.0, 0.005_930_588_7),
    ("least thrust, kg/N", "min_thrust_n", 1500.0, 5.0, -8.687_369_6e-7),
    ("speed at the start, kg s/m", "start_speed_m_s", 1692.0, 0.5, -0.442_360_910_4),
    ("altitude of the start, kg/km", "perilune_altitude_km", 15.0, 0.01, -0.735_388_974_6),
];

/// Agreement of a derivative between the two ways, and to the reference.
const AGREEMENT: f64 = 1e-4;

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "sensitivity",
        "Final mass of the main braking in the plane by one more unit of each key",
        "key",
        &[
            ("by_multipliers", 9),
            ("by_solving_again", 9),
            ("reference", 9),
            ("elasticity", 6),
            ("found_by_reference_less_one", 6),
        ],
    );
    // A solve that was kept by an earlier sheet has no prices.
    let mission = load(BRAKING, &[PLANE])?.with_prices(true);
    let base = mission.solve(None, &mut *workers.observer)?;
    ended(BRAKING, "Radau", base.status)?;
    let keys = KEYS.map(|k| k.1);
    let prices = mission.sensitivities(&base, &keys)?;
    let jobs: Vec<Change<'_>> = KEYS
        .iter()
        .flat_map(|(_, key, value, step, _)| [-1.0, 1.0].map(|s| number(key, value + s * step)))
        .collect();
    let again = workers
        .all(&jobs, |set, observer| Ok(solve(BRAKING, &[PLANE, *set], observer)?.get("final_mass_kg")))?;
    let mass = base.trajectory.objective;
    let (mut off, mut apart): (f64, f64) = (0.0, 0.0);
    for (k, ((label, _, value, step, reference), price)) in KEYS.iter().zip(&prices).enumerate() {
        let difference = match (&again[2 * k], &again[2 * k + 1]) {
            (Ok(below), Ok(above)) => Some((above - below) / (2.0 * step)),
            (Err(why), _) | (_, Err(why)) => {
                sheet.failures.push(why.clone());
                None
            }
        };
        let Some(price) = price.objective else {
            sheet.failures.push(format!("{label}: the price is not unique"));
            continue;
        };
        let ratio = price / reference - 1.0;
        off = off.max(ratio.abs());
        apart = difference.map_or(apart, |d| apart.max((d / price - 1.0).abs()));
        sheet.push(
            *label,
            vec![Some(price), difference, Some(*reference), Some(price * value / mass), Some(ratio)],
        );
    }
    SolvedCase::of(base).check("main braking in the plane", &mut sheet);
    sheet.findings = vec![
        format!(
            "The derivatives by the multipliers are those of the reference to {off:.0e}{}, those of solving again to {apart:.0e}.",
            if off > AGREEMENT { " at worst" } else { "" }
        ),
        "One per cent more initial mass leaves 0.97 % more at the end, one per cent of exhaust velocity 0.56 %, one of thrust 0.03 %."
            .into(),
    ];
    Ok(sheet)
}

/// Full thrusts (N) with the final mass of the reference (kg): by collocation, 0.8 g above its optimum at 7500 N.
pub(super) const THRUSTS: [(f64, f64); 14] = [
    (2800.0, 1_172.540_114),
    (3000.0, 1_201.997_876),
    (3500.0, 1_252.166_127),
    (4000.0, 1_282.558_468),
    (4500.0, 1_302.319_639),
    (PRINTED_THRUST, 1_313.540_730),
    (5500.0, 1_325.611_941),
    (6000.0, 1_332.805_250),
    (6500.0, 1_338.266_689),
    (6750.0, 1_340.512_894),
    (7000.0, 1_342.499_082),
    (THRUST, 1_345.832_505),
    (8000.0, 1_348.491_640),
    (9000.0, 1_352.573_965),
];
/// Above it the paper sees no effect of the thrust, N.
const PRINTED_THRUST: f64 = 4900.0;

pub(super) fn thrusts(thrusts: &[(f64, f64)], workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "thrust",
        "Main braking in the plane over the full thrust, nominal 7500 N; the reference by collocation, some 1e-3 kg accurate",
        "full thrust",
        &[
            ("final_mass_kg", 4),
            ("reference_kg", 4),
            ("found_less_reference_kg", 4),
            ("less_than_nominal_kg", 3),
            ("flight_time_s", 2),
            ("central_angle_deg", 3),
        ],
    );
    let base = solve(BRAKING, &[PLANE], &mut *workers.observer)?.get("final_mass_kg");
    let solved = workers.all(thrusts, |(thrust, _), observer| {
        solve(BRAKING, &[PLANE, number("thrust_n", *thrust)], observer)
    })?;
    let mut line = Vec::new();
    for ((thrust, reference), solved) in thrusts.iter().zip(solved) {
        let label = format!("{thrust} N");
        let s = match solved {
            Ok(s) => Some(s),
            Err(why) => {
                sheet.failures.push(why);
                None
            }
        };
        let of = |key: &str| s.as_ref().map(|s| s.get(key));
        let mass = of("final_mass_kg");
        if let Some(s) = &s {
            s.check(&label, &mut sheet);
        }
        if let Some(mass) = mass {
            line.push([*thrust, mass]);
            if *thrust == PRINTED_THRUST {
                sheet.findings.push(format!(
                    "\"No visible effect above {PRINTED_THRUST} N\" is not reproduced: with {PRINTED_THRUST} N {:.1} kg less arrive than \
                     with {THRUST} N.",
                    base - mass
                ));
            }
        }
        sheet.push(
            label,
            vec![
                mass,
                Some(*reference),
                mass.map(|m| m - reference),
                mass.map(|m| base - m),
                of("flight_time_s"),
                of("central_angle_deg"),
            ],
        );
    }
    sheet.graphs = vec![Graph {
        file: "thrust.svg",
        title: "Final mass over full thrust: found (line), reference (dots)".into(),
        x: ("full thrust", "N"),
        y: ("final mass", "kg"),
        series: vec![GraphSeries {
            label: "main braking".into(),
            line,
            dots: thrusts.iter().map(|(t, m)| [*t, *m]).collect(),
        }],
    }];
    Ok(sheet)
}
