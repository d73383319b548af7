//! Case e: the relaxation is not tight, and what is flown instead.
//!
//! At first the relaxed program burns at the least rate without thrust. Least thrust within 90 deg of up that does not slow the fall is horizontal: to
//! one side, back, and to the first side again, over times that end at rest over the site, it is the same fall with the same propellant. So the bound
//! is reached, and the flight is the optimum.

use super::cases::{CASES, flight_time, graph, propellant};
use crate::sheet::{GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;

/// Points of a curve along each phase.
const POINTS: usize = 60;

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "not-tight",
        "Case e: the relaxation, and the flight whose thrust goes from side to side at first",
        "flight",
        &[
            ("propellant_at_best_time_kg", 4),
            ("best_time_s", 3),
            ("propellant_at_printed_time_kg", 4),
            ("sideways_m", 2),
        ],
    );
    let Some(case) = CASES.iter().find(|c| c.name == "e") else { return Ok(sheet) };
    let [printed_kg, printed_s] = case.printed;
    let (free, fixed) = (case.convex(None)?, case.convex(Some(printed_s))?);
    sheet.push("printed", vec![None, None, Some(printed_kg), None]);
    sheet.push(
        "relaxation: a bound, no flight",
        vec![Some(free.propellant), Some(free.flight_time), Some(fixed.propellant), None],
    );
    let [own, at_printed] =
        workers.each(&[None, Some(printed_s)], |time, observer| case.collocated(*time, observer))?;
    for outcome in [&own, &at_printed] {
        if !outcome.summary.certificate.is_verified() {
            sheet.unverified.push(format!("from side to side: {:?}", outcome.summary.certificate.verdict));
        }
    }
    let mut path = Vec::new();
    for p in own.trajectory.phases.iter() {
        let times = (0..=POINTS).map(|k| p.time_at(k as f64 / POINTS as f64));
        // Height, its rate, distance, its rate, mass.
        path.extend(times.filter_map(|t| Some([*p.state_at(t).get(2)?, *p.state_at(t).first()?])));
    }
    let aside = path.iter().map(|[z, _]| z.abs()).fold(0.0, f64::max);
    sheet.push(
        "from side to side",
        vec![propellant(&own), flight_time(&own), propellant(&at_printed), Some(aside)],
    );
    if let (Some(best), Some(then)) = (propellant(&own), propellant(&at_printed)) {
        sheet.findings.push(format!(
            "repaired: thrust from side to side at first, {aside:.0} m to the side, keeps the least thrust and takes {best:.3} kg, {:+.3} kg from the \
             relaxation, whose controls are linear on {} intervals: the bound is reached, so that this is the optimum",
            best - free.propellant,
            super::cases::INTERVALS
        ));
        sheet.findings.push(format!(
            "the printed {printed_kg} kg for {printed_s} s are {:+.2} kg from it at that time; the article allows 5 deg beyond 90 deg in the first 12 s \
             instead of a motion to the side",
            printed_kg - then
        ));
    }
    let mut graph = graph("aside.svg", "Case e: path of the flight from side to side", ("altitude", "m"));
    graph.x = ("distance from the vertical over the site", "m");
    graph.series.push(GraphSeries { label: "path".into(), line: path, dots: Vec::new() });
    sheet.graphs.push(graph);
    Ok(sheet)
}
