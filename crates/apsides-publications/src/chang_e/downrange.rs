//! The main braking in the plane over a given arc, and in a given time: how flat the optimum is.

use apsides_ocp::{Bounds, Guess, Trajectory};

use super::case::{BRAKING, PLANE, SolvedCase, load, solve};
use super::orbit::{PRINTED_PERILUNE, SITE, arc};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::{Stop, ended, keep};
use crate::workers::Workers;

/// Arcs (deg) with the final mass of the reference (kg), by collocation on a coarse mesh: accurate to some 1e-3 kg. Below 12.68 deg the
/// vehicle cannot stop without coming back.
pub(super) const ARCS: [(f64, f64); 15] = [
    (12.7, 1_345.830_084),
    (13.0, 1_345.831_354),
    (13.3237, 1_345.831_513),
    (13.7, 1_345.831_264),
    (14.0, 1_345.830_183),
    (14.5, 1_345.827_324),
    (15.0, 1_345.823_454),
    (16.0, 1_345.812_457),
    (17.0, 1_345.797_159),
    (18.0, 1_345.775_137),
    (18.5, 1_345.760_013),
    (19.0, 1_345.742_079),
    (20.0, 1_345.691_434),
    (22.0, 1_345.503_934),
    (25.0, 1_344.854_135),
];
/// Flight time of the paper, s.
pub(super) const PRINTED_TIME: f64 = 450.0;
const POLAR_ANGLE: usize = 1;

/// The quantity that is fixed of a braking that is otherwise that of the mission.
#[derive(Clone, Copy)]
pub(super) enum Given {
    /// Arc, deg.
    Arc(f64),
    /// Flight time, s.
    Time(f64),
}

/// The final mass (kg) with something given, and the trajectory, from a neighbour.
pub(super) fn braking(
    given: Given,
    start: &Trajectory,
    workers: &mut Workers<'_>,
) -> Result<Trajectory, Stop> {
    let mission = load(BRAKING, &[PLANE])?;
    let mut ocp = mission.pose()?.ocp;
    let Some(phase) = ocp.phases.first_mut() else { return Err(Stop::NotSolved("no phase".into())) };
    match given {
        Given::Arc(degrees) => phase.states[POLAR_ANGLE].terminal = Bounds::fixed(degrees.to_radians()),
        Given::Time(seconds) => phase.final_time = Bounds::fixed(seconds),
    }
    let mesh = mission.methods().first_mesh(&ocp)?;
    let method = mission.methods().radau.method();
    let solution = method.solve_on(&ocp, &Guess::earlier(start), mesh, &mut *workers.observer)?;
    let name = match given {
        Given::Arc(degrees) => format!("{BRAKING} over {degrees:.3} deg"),
        Given::Time(seconds) => format!("{BRAKING} in {seconds} s"),
    };
    ended(&name, "Radau", solution.status)?;
    Ok(solution.trajectory)
}

pub(super) fn sheet(arcs: &[(f64, f64)], workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "downrange",
        "Main braking in the plane over a given arc; the reference by collocation, some 1e-3 kg accurate",
        "arc or time",
        &[
            ("final_mass_kg", 6),
            ("reference_kg", 6),
            ("found_less_reference_kg", 4),
            ("above_the_least_propellant_g", 3),
            ("flight_time_s", 3),
        ],
    );
    let free = solve(BRAKING, &[PLANE], &mut *workers.observer)?;
    let best = free.trajectory.objective;
    let push = |sheet: &mut Sheet, label: String, found: Option<&Trajectory>, reference: Option<f64>| {
        let mass = found.map(|t| t.objective);
        let time = found.and_then(|t| t.phases.last()).map(|p| p.final_time);
        let off = mass.zip(reference).map(|(a, b)| a - b);
        sheet.push(label, vec![mass, reference, off, mass.map(|m| 1e3 * (best - m)), time]);
    };
    push(
        &mut sheet,
        format!("free: {:.3} deg", free.get("central_angle_deg")),
        Some(&free.trajectory),
        Some(1_345.831_672),
    );
    // From the free arc outwards to both sides, each from its neighbour.
    let middle = free.get("central_angle_deg");
    let printed = arc(PRINTED_PERILUNE, SITE);
    let mut all: Vec<(f64, Option<f64>)> =
        arcs.iter().map(|(a, m)| (*a, Some(*m))).chain([(printed, None)]).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (below, above): (Vec<_>, Vec<_>) = all.iter().partition(|a| a.0 < middle);
    let mut found: Vec<(f64, Option<f64>, Option<Trajectory>)> = Vec::new();
    for side in [below.iter().rev().collect::<Vec<_>>(), above.iter().collect()] {
        let mut start = free.trajectory.clone();
        for &&(degrees, reference) in &side {
            let solved = keep(&mut sheet, braking(Given::Arc(degrees), &start, workers))?;
            if let Some(t) = &solved {
                start = t.clone();
            }
            found.push((degrees, reference, solved));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (degrees, reference, solved) in &found {
        let label = if *degrees == printed { "printed perilune: " } else { "" };
        push(&mut sheet, format!("{label}{degrees:.3} deg"), solved.as_ref(), *reference);
    }
    let timed = keep(&mut sheet, braking(Given::Time(PRINTED_TIME), &free.trajectory, workers))?;
    push(&mut sheet, format!("printed time: {PRINTED_TIME} s"), timed.as_ref(), None);
    sheet.findings = findings(&free, printed, &found, timed.as_ref());
    let loss = |t: &Option<Trajectory>| t.as_ref().map(|t| 1e3 * (best - t.objective));
    sheet.graphs = vec![Graph {
        file: "downrange.svg",
        title: "Propellant above the least over the arc of the braking (line) and the reference (dots)"
            .into(),
        x: ("arc", "deg"),
        y: ("propellant above the least", "g"),
        series: vec![GraphSeries {
            label: "given arc".into(),
            line: found.iter().filter_map(|(a, _, t)| Some([*a, loss(t)?])).collect(),
            dots: found.iter().filter_map(|(a, r, _)| Some([*a, 1e3 * (best - (*r)?)])).collect(),
        }],
    }];
    Ok(sheet)
}

fn findings(
    free: &SolvedCase,
    printed: f64,
    found: &[(f64, Option<f64>, Option<Trajectory>)],
    timed: Option<&Trajectory>,
) -> Vec<String> {
    let best = free.trajectory.objective;
    let grams = |t: &Trajectory| 1e3 * (best - t.objective);
    let at = |degrees: f64| found.iter().find(|f| f.0 == degrees).and_then(|f| f.2.as_ref());
    let mut findings = Vec::new();
    findings.extend(at(printed).map(|t| {
        format!(
            "The printed perilune is {printed:.3} deg from the site and costs {:.2} g: not the optimum of {:.3} deg, but as good as it. \
             Only the final mass tells perilunes apart.",
            grams(t),
            free.get("central_angle_deg")
        )
    }));
    findings.extend(timed.map(|t| {
        format!(
            "The printed flight time of {PRINTED_TIME} s is not that of the optimum, {:.3} s, and costs {:.1} g.",
            free.get("flight_time_s"),
            grams(t)
        )
    }));
    findings
}
