//! Cases a to e by the convex program, and by collocation without a relaxation.

use std::f64::consts::FRAC_PI_2;

use apsides_convex::{
    DescentLimits, DescentProblem, DescentSettings, DescentSolution, DescentSolver, FlightTime,
    Outcome as Descent,
};

use crate::change::{Change, number};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::{Stop, solved};
use crate::workers::Workers;
use crate::{Error, Outcome};

/// Intervals of the convex program.
pub(super) const INTERVALS: usize = 150;
/// Dots of a curve along each phase.
const DOTS: usize = 12;

/// A case of the article.
pub(super) struct DescentCase {
    pub(super) name: &'static str,
    subject: &'static str,
    /// Printed propellant (kg) and flight time (s).
    pub(super) printed: [f64; 2],
    /// Position and velocity at the start: height and distance, m and m/s.
    start: [[f64; 2]; 2],
    limits: DescentLimits,
    /// The mission file, and what changes in it.
    mission: &'static str,
    pub(super) changes: &'static [Change<'static>],
}

const NONE: DescentLimits =
    DescentLimits { pointing: None, glide_slope: None, speed: None, thrust_rate: None, upright_end: false };
/// In motion beside the site; at rest above it.
const BESIDE: [[f64; 2]; 2] = [[1500.0, 2000.0], [-75.0, 100.0]];
const ABOVE: [[f64; 2]; 2] = [[5000.0, 0.0], [0.0, 0.0]];

/// The mission of the cases in motion beside the site.
const BESIDE_IT: &str = "mars-descent";

/// Elevation of the glide slope of case c, 86 deg from the vertical.
const SLOPE_DEG: f64 = 4.0;

pub(super) const CASES: [DescentCase; 5] = [
    DescentCase {
        name: "a",
        subject: "no limit",
        printed: [387.9, 72.0],
        start: BESIDE,
        limits: NONE,
        mission: BESIDE_IT,
        changes: &[],
    },
    DescentCase {
        name: "b",
        subject: "not below the ground",
        printed: [390.4, 75.0],
        start: BESIDE,
        limits: DescentLimits { glide_slope: Some(0.0), ..NONE },
        mission: BESIDE_IT,
        changes: &[number("constants.lowest", 0.0)],
    },
    DescentCase {
        name: "c",
        subject: "glide slope",
        printed: [399.5, 81.0],
        start: BESIDE,
        limits: DescentLimits { glide_slope: Some(SLOPE_DEG * std::f64::consts::PI / 180.0), ..NONE },
        mission: BESIDE_IT,
        changes: &[number("constants.elevation", SLOPE_DEG), number("constants.below_slope", 0.0)],
    },
    DescentCase {
        name: "d",
        subject: "from rest above",
        printed: [293.6, 69.0],
        start: ABOVE,
        limits: NONE,
        mission: "mars-descent-down",
        changes: &[],
    },
    DescentCase {
        name: "e",
        subject: "from rest, thrust within 90 deg of up",
        printed: [303.0, 78.0],
        start: ABOVE,
        limits: DescentLimits { pointing: Some(FRAC_PI_2), ..NONE },
        mission: "mars-descent-aside",
        changes: &[],
    },
];

impl DescentCase {
    /// By the convex program, at a given flight time (s) or the best one.
    pub(super) fn convex(&self, time: Option<f64>) -> Result<DescentSolution, Stop> {
        let [[height, distance], [climb, drift]] = self.start;
        let problem = DescentProblem {
            position: [distance, 0.0, height],
            velocity: [drift, 0.0, climb],
            limits: self.limits,
            ..DescentProblem::mars_lander()
        };
        let mut settings = DescentSettings { intervals: INTERVALS, ..DescentSettings::default() };
        settings.flight_time = time.map_or(settings.flight_time, FlightTime::Fixed);
        let refused = |e: apsides_convex::ConvexError| Error::in_mission(e.to_string());
        let found = DescentSolver::new(&problem, settings).and_then(|mut s| s.solve()).map_err(refused)?;
        match found.outcome {
            Descent::Landed | Descent::Relaxed { .. } => Ok(found),
            other => Err(Stop::NotSolved(format!("case {}: {other}", self.name))),
        }
    }

    /// By collocation of the mission, at a given flight time (s) or the best one.
    pub(super) fn collocated(
        &self,
        time: Option<f64>,
        observer: &mut dyn crate::Observer,
    ) -> Result<Outcome, Stop> {
        let fixed = time.map(|t| [number("constants.shortest", t), number("constants.longest", t)]);
        let changes: Vec<Change<'_>> =
            self.changes.iter().copied().chain(fixed.into_iter().flatten()).collect();
        Ok(solved(self.mission, &changes, 1, None, observer)?.1)
    }
}

/// A thrust that is shorter by a larger part than what the propellant counts is no rounding of the conic program.
const LOOSE: f64 = 1e-3;

/// Propellant of a solution, kg: the mass is its last state.
pub(super) fn propellant(outcome: &Outcome) -> Option<f64> {
    Some(DescentProblem::mars_lander().mass - outcome.trajectory.phases.last()?.final_state().last()?)
}

pub(super) fn flight_time(outcome: &Outcome) -> Option<f64> {
    Some(outcome.trajectory.phases.last()?.final_time)
}

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "cases",
        "Cases a to e: as printed, by the convex program at the printed and at the best time, and by collocation without a relaxation",
        "case",
        &[
            ("printed_propellant_kg", 1),
            ("printed_time_s", 0),
            ("convex_at_printed_time_kg", 3),
            ("convex_kg", 3),
            ("convex_time_s", 2),
            ("relaxation_gap", 6),
            ("collocation_kg", 4),
            ("collocation_time_s", 3),
            ("lowest_altitude_m", 1),
        ],
    );
    let found = workers.all(&CASES, |case, observer| {
        let printed = case.convex(Some(case.printed[1]))?;
        let best = case.convex(None)?;
        Ok((printed, best, case.collocated(None, observer)?))
    })?;
    let mut altitudes = graph("altitudes.svg", "Cases a to e: altitude", ("altitude", "m"));
    let mut thrusts = graph("thrusts.svg", "Cases a to e: thrust", ("thrust", "N"));
    for (case, found) in CASES.iter().zip(found) {
        let label = format!("{}: {}", case.name, case.subject);
        let (printed, best, collocated) = match found {
            Ok(found) => found,
            Err(why) => {
                sheet.failures.push(why);
                continue;
            }
        };
        let certificate = &collocated.summary.certificate;
        if !certificate.is_verified() {
            sheet.unverified.push(format!("case {} by collocation: {:?}", case.name, certificate.verdict));
        }
        let lowest = best.positions.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        sheet.push(
            label.clone(),
            vec![
                Some(case.printed[0]),
                Some(case.printed[1]),
                Some(printed.propellant),
                Some(best.propellant),
                Some(best.flight_time),
                Some(best.relaxation_gap),
                propellant(&collocated),
                flight_time(&collocated),
                Some(lowest),
            ],
        );
        if let Descent::Relaxed { from, until, gap } = best.outcome {
            sheet.findings.push(format!(
                "case {}: the relaxation is not tight: from {from:.1} to {until:.1} s the thrust is below the least one by up to {:.0} %, \
                 so that {:.2} kg is a lower bound and no flight; the flight by collocation has thrust from side to side instead (next sheet)",
                case.name,
                100.0 * gap,
                best.propellant
            ));
        } else {
            sheet.findings.push(format!(
                "case {}: printed {} kg, {:+.2} kg from the convex program at the printed {} s, {:+.2} kg from the best time",
                case.name,
                case.printed[0],
                case.printed[0] - printed.propellant,
                case.printed[1],
                case.printed[0] - best.propellant
            ));
        }
        if best.outcome == Descent::Landed
            && let Some(said) = loose_points(case.name, &best)
        {
            sheet.findings.push(said);
        }
        altitudes.series.push(altitude(&label, &best, &collocated));
        thrusts.series.push(thrust(&label, &best));
    }
    sheet.graphs = vec![altitudes, thrusts];
    Ok(sheet)
}

/// A sentence about single control points where the thrust is shorter than what the propellant counts there; none without any.
fn loose_points(case: &str, found: &DescentSolution) -> Option<String> {
    let gap = |(thrust, counted): (&[f64; 3], &f64)| {
        1.0 - thrust.iter().map(|c| c * c).sum::<f64>().sqrt() / counted
    };
    let gaps: Vec<f64> = found.thrusts.iter().zip(&found.throttles).map(gap).collect();
    let loose: Vec<usize> = (0..gaps.len()).filter(|&k| gaps[k] > LOOSE).collect();
    let first = *loose.first()?;
    Some(format!(
        "case {case}: at {} of {} control points, the first at {:.1} s, the thrust is shorter than what the propellant counts there, by up to {:.1} %: \
         {:.2} kg is a lower bound, and collocation without a relaxation gives the flight",
        loose.len(),
        gaps.len(),
        found.times[first],
        100.0 * found.relaxation_gap,
        found.propellant
    ))
}

pub(super) fn graph(file: &'static str, title: &str, y: (&'static str, &'static str)) -> Graph {
    Graph { file, title: title.into(), x: ("time", "s"), y, series: Vec::new() }
}

/// Altitude by the convex program as a line, by collocation as dots.
fn altitude(label: &str, convex: &DescentSolution, collocated: &Outcome) -> GraphSeries {
    let line = convex.times.iter().zip(&convex.positions).map(|(t, p)| [*t, p[2]]).collect();
    let points = |p: &apsides_ocp::PhaseTrajectory| {
        (0..=DOTS)
            .map(|k| p.time_at(k as f64 / DOTS as f64))
            .filter_map(|t| Some([t, *p.state_at(t).first()?]))
            .collect::<Vec<_>>()
    };
    let dots = collocated.trajectory.phases.iter().flat_map(points).collect();
    GraphSeries { label: label.into(), line, dots }
}

fn thrust(label: &str, convex: &DescentSolution) -> GraphSeries {
    let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let line = convex.times.iter().zip(&convex.thrusts).map(|(t, v)| [*t, size(v)]).collect();
    GraphSeries { label: label.into(), line, dots: Vec::new() }
}
