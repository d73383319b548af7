//! Figures 10 to 16: thrust and its angles over time; the paths of the braking, of both avoidances and of the whole landing, in space and in plan
//! view.

use apsides_ad::vector;

use super::case::outcome;
use super::orbit::RADIUS;
use crate::Error;
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::{Stop, keep};
use crate::workers::Workers;

/// The landing on maps: its avoidances go aside.
const ON_MAPS: &str = "chang-e-3";
const STAGES: [&str; 6] = ["braking", "adjustment", "avoidance", "hover", "fine-avoidance", "descent"];
/// Points of a curve along each stage.
const POINTS: usize = 120;
/// An oblique view: what is a metre to the right of the course is drawn so far to the right and upwards.
const OBLIQUE: f64 = 0.5;

/// Place of a flight: way to the touchdown along the course (negative before it), to the right of it, and altitude above the touchdown; m.
type Place = [f64; 3];

/// Time, position and thrust.
type PlaceAndThrust = (f64, [f64; 3], [f64; 3]);

/// The path of a stage with its times.
struct StagePath {
    name: String,
    times: [f64; 2],
    places: Vec<Place>,
    /// Time (s) and thrust upwards, along the course and to the right of it, N.
    thrusts: Vec<(f64, [f64; 3])>,
}

fn paths(workers: &mut Workers<'_>) -> Result<Vec<StagePath>, Stop> {
    let (mission, plan) = outcome(ON_MAPS, &[], &mut *workers.observer)?;
    let mission = mission.decided(&plan.decisions)?;
    let motion = mission.mission().motion(&plan.trajectory);
    let motion = motion.ok_or_else(|| Error::in_mission("the landing has no motion in space"))?;
    let mut stages = Vec::new();
    for (k, phase) in plan.trajectory.phases.iter().enumerate() {
        let position = |i: usize| {
            let time = phase.time_at(i as f64 / POINTS as f64);
            let control = if phase.control.dimension() > 0 { phase.control_at(time) } else { Vec::new() };
            motion
                .point(k, time, &phase.state_at(time), &control)
                .and_then(|p| Some((time, p.position, p.thrust?)))
        };
        let points: Vec<PlaceAndThrust> = (0..=POINTS).filter_map(position).collect();
        stages.push((phase.name.to_string(), [phase.initial_time, phase.final_time], points));
    }
    let first = stages.iter().find_map(|(_, _, p)| p.first().map(|p| p.1));
    let last = stages.iter().rev().find_map(|(_, _, p)| p.last().map(|p| p.1));
    let (first, last) =
        first.zip(last).ok_or_else(|| Error::in_mission("the landing has no path in space"))?;
    let unit = |v: [f64; 3]| vector::scale(&v, vector::norm(&v, 0.0).recip());
    let up = unit(last);
    let left = unit(vector::cross(&first, &last));
    let course = vector::cross(&left, &up);
    let ground = vector::norm(&last, 0.0);
    let place = |p: [f64; 3]| {
        let [above, ahead, aside] = [up, course, left].map(|axis| vector::dot(&p, &axis));
        let radius = vector::norm(&p, 0.0);
        [ground * ahead.atan2(above), -ground * (aside / radius).asin(), radius - ground]
    };
    let thrust = |(time, p, force): &PlaceAndThrust| {
        let up = unit(*p);
        let ahead = unit(vector::cross(&left, &up));
        let [above, along, aside] = [up, ahead, left].map(|axis| vector::dot(force, &axis));
        (*time, [above, along, -aside])
    };
    let path = |(name, times, points): (String, [f64; 2], Vec<PlaceAndThrust>)| StagePath {
        name,
        times,
        places: points.iter().map(|p| place(p.1)).collect(),
        thrusts: points.iter().map(thrust).collect(),
    };
    Ok(stages.into_iter().map(path).collect())
}

fn oblique(&[along, right, up]: &Place) -> [f64; 2] {
    [along + OBLIQUE * right, up + OBLIQUE * right]
}

fn on_ground(&[along, right, _]: &Place) -> [f64; 2] {
    [along + OBLIQUE * right, OBLIQUE * right]
}

fn plan_view(&[along, right, _]: &Place) -> [f64; 2] {
    [right, along]
}

fn side_view(&[along, _, up]: &Place) -> [f64; 2] {
    [along, up]
}

fn series(stage: &StagePath, label: &str, view: fn(&Place) -> [f64; 2]) -> GraphSeries {
    GraphSeries { label: label.into(), line: stage.places.iter().map(view).collect(), dots: Vec::new() }
}

/// Thrust and its angles as the paper counts them: from the vertical, and of its horizontal part from the direction against the course, to
/// the right of one who looks there. An upright thrust has no second angle.
const THRUSTS: [(&str, &str, (&str, &str)); 3] = [
    ("landing_thrust.svg", "Figs 10 to 13: thrust", ("thrust", "N")),
    ("landing_theta.svg", "Figs 10 to 13: angle theta of the thrust from the vertical", ("theta", "deg")),
    ("landing_psi.svg", "Figs 10 to 13: angle psi of the horizontal thrust from backwards", ("psi", "deg")),
];
/// A thrust whose horizontal part is less than this part of it is upright: what carries a hover along with the Moon is some millionths.
const UPRIGHT: f64 = 1e-4;

/// Thrust (N) and its angles (deg) of parts upwards, along the course and to the right of it.
fn thrust_angles([up, along, right]: [f64; 3]) -> [Option<f64>; 3] {
    let level = along.hypot(right);
    let size = up.hypot(level);
    let theta = level.atan2(up).to_degrees();
    let psi = (-right).atan2(-along).to_degrees();
    [Some(size), (size > 0.0).then_some(theta), (level > UPRIGHT * size).then_some(psi)]
}

fn thrust_graph(k: usize, stages: &[StagePath]) -> Graph {
    let (file, title, y) = THRUSTS[k];
    let line = |s: &StagePath| {
        s.thrusts.iter().filter_map(|(time, thrust)| Some([*time, thrust_angles(*thrust)[k]?])).collect()
    };
    let series = stages
        .iter()
        .map(|s| GraphSeries { label: s.name.clone(), line: line(s), dots: Vec::new() })
        .collect();
    Graph { file, title: title.into(), x: ("time", "s"), y, series }
}

/// The axes of an oblique view.
const IN_SPACE: [(&str, &str); 2] = [
    ("to the touchdown along the course, and half of what is to the right", "m"),
    ("altitude, and half of what is to the right", "m"),
];
const IN_PLAN: [(&str, &str); 2] = [("to the right of the course", "m"), ("along the course", "m")];

/// A path in space with its shadow on the ground: file, title, and the stage of the landing.
const SPACE: [(&str, &str, &str); 3] = [
    ("braking_in_space.svg", "Fig. 14: the main braking in space", "braking"),
    ("avoidance_in_space.svg", "Fig. 15: the coarse avoidance in space", "avoidance"),
    ("fine_avoidance_in_space.svg", "Fig. 15: the fine avoidance in space", "fine-avoidance"),
];
/// Paths in plan view.
const PLANS: [(&str, &str, &[&str]); 2] = [
    ("braking_plan.svg", "Fig. 14: the main braking from above", &["braking"]),
    (
        "avoidances_plan.svg",
        "Fig. 15: the stages below 3 km from above",
        &["adjustment", "avoidance", "fine-avoidance"],
    ),
];

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "paths",
        "Figs 10 to 16: thrust, paths in space and in plan view of a landing on maps, from its touchdown along the course from perilune to site",
        "stage",
        &[
            ("start_s", 3),
            ("end_s", 3),
            ("start_altitude_m", 2),
            ("end_altitude_m", 2),
            ("way_along_m", 2),
            ("way_to_the_right_m", 2),
        ],
    );
    let found = paths(workers);
    let Some(stages) = keep(&mut sheet, found)? else { return Ok(sheet) };
    for stage in &stages {
        let (Some(first), Some(last)) = (stage.places.first(), stage.places.last()) else { continue };
        let [start, end] = stage.times;
        let values = [start, end, first[2], last[2], last[0] - first[0], last[1] - first[1]];
        sheet.push(stage.name.clone(), values.map(Some).to_vec());
    }
    let of = |name: &str| stages.iter().find(|s| s.name == name);
    sheet.graphs = (0..THRUSTS.len()).map(|k| thrust_graph(k, &stages)).collect();
    let whole = STAGES.iter().filter_map(|name| of(name)).map(|s| series(s, &s.name, side_view)).collect();
    sheet.graphs.push(Graph {
        file: "landing_path.svg",
        title: "Fig. 16: the whole landing from the side".into(),
        x: ("to the touchdown along the course", "m"),
        y: ("altitude", "m"),
        series: whole,
    });
    for (file, title, name) in SPACE {
        let Some(stage) = of(name) else { continue };
        let [x, y] = IN_SPACE;
        let series =
            vec![series(stage, "path", oblique), series(stage, "its shadow on the ground", on_ground)];
        sheet.graphs.push(Graph { file, title: title.into(), x, y, series });
    }
    for (file, title, names) in PLANS {
        let [x, y] = IN_PLAN;
        // Each stage has the colour that it has in the other figures.
        let series = stages.iter().map(|s| {
            let line = if names.contains(&s.name.as_str()) {
                s.places.iter().map(plan_view).collect()
            } else {
                Vec::new()
            };
            GraphSeries { label: s.name.clone(), line, dots: Vec::new() }
        });
        let series = series.collect();
        sheet.graphs.push(Graph { file, title: title.into(), x, y, series });
    }
    let aside = stages.iter().flat_map(|s| &s.places).map(|p| p[1].abs()).fold(0.0, f64::max);
    sheet.findings.push(format!(
        "The paths stay within {aside:.0} m of the plane through perilune, site and centre: the Moon turns under the braking. The paper draws its \
         own maps; sites here are those that the mission chooses on generated ground. Altitudes are above the touchdown, the mean radius is {:.3} km.",
        RADIUS / 1e3
    ));
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic, deg.
    const ROUNDING: f64 = 1e-12;

    /// By hand: straight back and as much up is 45 deg from the vertical and 0 deg from backwards; forwards is half a turn; to the right of the
    /// course, which is to the left of one who looks back, a quarter.
    #[test]
    fn angles_by_hand() {
        for (thrust, theta, psi) in [
            ([1.0, -1.0, 0.0], 45.0, Some(0.0)),
            ([0.0, 1.0, 0.0], 90.0, Some(-180.0)),
            ([-1.0, 0.0, 1.0], 135.0, Some(-90.0)),
            ([2.0, 0.0, 0.0], 0.0, None),
        ] {
            let [_, found, aside] = thrust_angles(thrust);
            assert!((found.unwrap() - theta).abs() < ROUNDING, "{found:?}");
            match (aside, psi) {
                (Some(a), Some(b)) => assert!((a - b).abs() < ROUNDING, "{a} {b}"),
                (found, expected) => assert_eq!(found, expected),
            }
        }
        assert_eq!(thrust_angles([0.0; 3]), [Some(0.0), None, None]);
    }
}
