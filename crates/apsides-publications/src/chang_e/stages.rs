//! The six stages: one after the other, as in the paper, and together.

use super::case::{LANDING, MASS, PLANE, SolvedCase, solve};
use crate::change::{Change, number, word};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;

/// Label, keys of the mission whose sum it is, references by stages and together. The reference scans the angle at the gate in steps of
/// 5 deg for the gates together: the total is that of the best step, its parts are those of this step.
type StageRow = (&'static str, &'static [&'static str], Option<f64>, Option<f64>);

const ROWS: [StageRow; 16] = [
    ("braking to 3 km, kg", &["braking_propellant_kg"], Some(1_054.168_328), Some(1_059.807_406)),
    ("adjustment to 2.4 km, kg", &["adjustment_propellant_kg"], Some(23.529_420), Some(13.742_474)),
    (
        "coarse avoidance to hover at 100 m, kg",
        &["avoidance_propellant_kg"],
        Some(55.053_024),
        Some(56.390_977),
    ),
    (
        "fine avoidance to 30 m and descent to 4 m, kg",
        &["fine_avoidance_propellant_kg", "descent_propellant_kg"],
        Some(15.290_759),
        Some(15.285_239),
    ),
    ("all, kg", &["propellant_kg"], Some(1_148.041_531), Some(1_145.226_097)),
    ("mass at the end, kg", &["final_mass_kg"], Some(1_251.958_469), Some(1_254.773_903)),
    ("braking, s", &["braking_time_s"], Some(424.955_306), Some(433.244_253)),
    ("adjustment, s", &["adjustment_time_s"], Some(16.569_647), Some(10.878_035)),
    ("coarse avoidance, s", &["avoidance_time_s"], Some(48.675_193), Some(43.743_038)),
    (
        "fine avoidance and descent, s",
        &["fine_avoidance_time_s", "descent_time_s"],
        Some(21.965_586),
        Some(21.908_732),
    ),
    ("fine avoidance alone, kg", &["fine_avoidance_propellant_kg"], None, None),
    ("descent alone, kg", &["descent_propellant_kg"], None, None),
    ("upward speed at 3 km, m/s", &["gate_upward_speed_m_s"], Some(-24.227_927), None),
    ("horizontal speed at 3 km, m/s", &["gate_horizontal_speed_m_s"], Some(51.594_647), None),
    ("speed at touchdown, m/s", &["touchdown_speed_m_s"], Some(3.605_485), Some(3.605_485)),
    ("hover at 1267.25 kg, kg/s", &[HOVER], None, Some(0.700_329_509)),
];
/// Not a result of the mission: from a flight that hovers.
const HOVER: &str = "hover";
/// Mass at which the reference hovers, kg.
const HOVERING_MASS: f64 = 1_267.25;

const CASES: [&[Change<'static>]; 4] =
    [&[PLANE, word("optimised", "by-stages")], &[PLANE], &[], &[PLANE, number("hover_time_s", 5.0)]];
const LABELS: [&str; 3] = ["stages one after the other", "gates together", "gates together, in space"];

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "stages",
        "The stages from 15 km to 4 m with the gates of the contest and the thrust upright from 2.4 km on",
        "quantity",
        &[
            ("one_after_the_other", 4),
            ("reference_one_after_the_other", 4),
            ("together", 4),
            ("reference_together", 4),
            ("together_in_space", 4),
        ],
    );
    let [alone, plane, space, hovering] = workers.each(&CASES, |c, observer| solve(LANDING, c, observer))?;
    let rate = HOVERING_MASS * mass_rate(&hovering).unwrap_or(f64::NAN);
    let value = |s: &SolvedCase, keys: &[&str]| {
        Some(keys.iter().map(|k| s.get(k)).sum()).filter(|v: &f64| v.is_finite())
    };
    for (label, keys, by_stages, together) in ROWS {
        if keys.contains(&HOVER) {
            sheet.push(label, vec![None, None, Some(rate), together, None]);
            continue;
        }
        sheet.push(
            label,
            vec![value(&alone, keys), by_stages, value(&plane, keys), together, value(&space, keys)],
        );
    }
    for (label, solved) in LABELS.iter().zip([&alone, &plane, &space]) {
        solved.check(label, &mut sheet);
    }
    hovering.check("with a hover", &mut sheet);
    sheet.findings = findings(&alone, &plane, &space);
    sheet.graphs = vec![graph(&[&alone, &plane])];
    Ok(sheet)
}

/// Rate of the logarithm of the mass in the hover, 1/s: the thrust is the weight.
fn mass_rate(solved: &SolvedCase) -> Option<f64> {
    let hover = solved.trajectory.phases.iter().find(|p| p.name == "hover")?;
    let mass = |time: f64| hover.state_at(time).last().copied();
    let (start, end) = (hover.initial_time, hover.final_time);
    Some((mass(start)? / mass(end)?).ln() / (end - start))
}

fn findings(alone: &SolvedCase, plane: &SolvedCase, space: &SolvedCase) -> Vec<String> {
    let all = |s: &SolvedCase| s.get("propellant_kg");
    let gates = [all(alone), all(plane)];
    vec![
        format!(
            "One after the other: {:.3} kg, reference 1148.042 kg; together: {:.3} kg, reference 1145.226 kg from a scan of the angle \
             at 3 km. Optimising the main braking for itself costs {:.3} kg of {:.1} kg.",
            gates[0],
            gates[1],
            gates[0] - gates[1],
            MASS - plane.get("final_mass_kg")
        ),
        format!("Over the rotating Moon the stages together take {:.2} g more.", 1e3 * (all(space) - all(plane))),
        "The gates are printed: 15 km, 3 km and 57 m/s, 2.4 km, 100 m, 30 m, 4 m; all are met. Without a rule for the attitude the least \
         thrust of 1500 N makes the optimum fly head down from 100 to 30 m: the rule stated here is an upright thrust."
            .into(),
    ]
}

const SAMPLES: usize = 120;

/// Upward speed (m/s) and altitude (m) of a state of a flight in the plane or along the vertical; none of another one.
fn upward_speed_and_altitude(state: &[f64]) -> Option<[f64; 2]> {
    match *state {
        [radius, upward, _mass] | [radius, _, _, upward, _mass] => {
            Some([upward, radius - super::orbit::RADIUS])
        }
        _ => None,
    }
}

/// Altitude and upward speed below the first gate, of flights in the plane.
fn graph(cases: &[&SolvedCase]) -> Graph {
    let series = cases.iter().zip(LABELS).map(|(s, label)| {
        let points = s.trajectory.phases.iter().skip(1).flat_map(|p| {
            let sample = |k| p.state_at(p.time_at(k as f64 / SAMPLES as f64));
            (0..=SAMPLES).filter_map(move |k| upward_speed_and_altitude(&sample(k)))
        });
        GraphSeries { label: label.into(), line: points.collect(), dots: Vec::new() }
    });
    Graph {
        file: "stages.svg",
        title: "Below 3 km: altitude over the upward speed".into(),
        x: ("upward speed", "m/s"),
        y: ("altitude", "m"),
        series: series.collect(),
    }
}
