//! Piecewise-constant controls on segments of equal and of free lengths: by how much they miss the optimum.

use apsides_verify::Verdict;

use super::case::{BRAKING, PLANE, solve};
use crate::change::{Change, number, word};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;

/// Number of segments, and the gaps of the reference with equal and with free lengths (the best of its starts), kg.
pub(super) type SegmentGaps = (usize, f64, f64);

pub(super) const ROWS: [SegmentGaps; 6] = [
    (2, 2.030_192, 1.922_719),
    (5, 0.273_453, 0.247_349),
    (10, 0.068_220, 0.061_371),
    (20, 0.018_251, 0.016_272),
    (PRINTED, 0.007_791, 0.007_451),
    (60, 0.001_948, 0.001_7),
];

/// Segments of the paper.
const PRINTED: usize = 30;
/// The solver stops at some 1e-5 kg.
const ACCURACY_KG: f64 = 5e-5;

struct Job {
    label: String,
    changes: [Change<'static>; 5],
    reference: Option<f64>,
}

fn jobs(rows: &[SegmentGaps]) -> Vec<Job> {
    let job = |n: usize, lengths: &'static str, refine: bool, reference| Job {
        label: format!("{n} of {lengths} lengths{}", if refine { ", divided on" } else { "" }),
        changes: [
            PLANE,
            word("method", "piecewise"),
            number("piecewise.intervals", n as f64),
            word("piecewise.lengths", lengths),
            number("piecewise.max_refinements", if refine { 100.0 } else { 0.0 }),
        ],
        reference,
    };
    let sides = rows.iter().flat_map(|&(n, equal, free)| {
        [job(n, "equal", false, Some(equal)), job(n, "free", false, Some(free))]
    });
    let divided = rows.iter().filter(|r| r.0 == PRINTED);
    let divided = divided.flat_map(|_| ["equal", "free"].map(|lengths| job(PRINTED, lengths, true, None)));
    sides.chain(divided).collect()
}

pub(super) fn sheet(rows: &[SegmentGaps], workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "segments",
        "Main braking in the plane with piecewise-constant controls: what they miss of the optimum, beside the reference",
        "segments",
        &[
            ("final_mass_kg", 5),
            ("gap_kg", 5),
            ("reference_gap_kg", 5),
            ("found_less_reference_kg", 5),
            ("segments_at_the_end", 0),
            ("flight_time_s", 3),
        ],
    );
    let best = solve(BRAKING, &[PLANE], &mut *workers.observer)?.get("final_mass_kg");
    let jobs = jobs(rows);
    let solved = workers.all(&jobs, |job, observer| solve(BRAKING, &job.changes, observer))?;
    let mut found = Vec::new();
    for (job, solved) in jobs.iter().zip(solved) {
        let solved = match solved {
            Ok(s) => Some(s),
            Err(why) => {
                sheet.failures.push(why);
                None
            }
        };
        // Flown as planned is all that a certificate can say of controls that are no optimum.
        if let Some(s) = solved.as_ref().filter(|s| s.verdict == Verdict::Rejected) {
            sheet.unverified.push(format!("{}: {}", job.label, s.failed_checks.join(", ")));
        }
        let mass = solved.as_ref().map(|s| s.get("final_mass_kg"));
        let gap = mass.map(|m| best - m);
        let segments = solved.as_ref().and_then(|s| s.trajectory.phases.first());
        sheet.push(
            job.label.clone(),
            vec![
                mass,
                gap,
                job.reference,
                gap.zip(job.reference).map(|(a, b)| a - b),
                segments.map(|p| p.control.segments().len() as f64),
                solved.as_ref().map(|s| s.get("flight_time_s")),
            ],
        );
        found.push(gap);
    }
    sheet.findings = findings(&sheet, &jobs, &found);
    let side = |k: usize, label: &str| {
        let of =
            |(i, row): (usize, &SegmentGaps)| Some([row.0 as f64, found.get(2 * i + k).copied()??.log10()]);
        let reference = |row: &SegmentGaps| [row.0 as f64, [row.1, row.2][k].log10()];
        GraphSeries {
            label: label.into(),
            line: rows.iter().enumerate().filter_map(of).collect(),
            dots: rows.iter().map(reference).collect(),
        }
    };
    sheet.graphs = vec![Graph {
        file: "segments.svg",
        title: "Gap to the optimum over the number of segments (lines) and the reference (dots)".into(),
        x: ("segments", "-"),
        y: ("decimal logarithm of the gap by 1 kg", "-"),
        series: vec![side(0, "equal lengths"), side(1, "free lengths")],
    }];
    Ok(sheet)
}

fn findings(sheet: &Sheet, jobs: &[Job], found: &[Option<f64>]) -> Vec<String> {
    let known = || jobs.iter().zip(found).filter_map(|(job, gap)| Some((job, (*gap)? - job.reference?)));
    let outside: Vec<_> = known().filter(|(_, off)| off.abs() > ACCURACY_KG).collect();
    let mut findings = vec![format!(
        "{} of {} gaps are within {ACCURACY_KG} kg of the reference.",
        known().count() - outside.len(),
        known().count()
    )];
    for (job, off) in outside {
        let side = if off < 0.0 { "nearer to the optimum" } else { "farther from the optimum" };
        findings.push(format!("{}: {:.2} g {side}.", job.label, 1e3 * off.abs()));
    }
    let gap = |label: String| sheet.value(&label, "gap_kg");
    if let Some((equal, free)) =
        gap(format!("{PRINTED} of equal lengths")).zip(gap(format!("{PRINTED} of free lengths")))
    {
        findings.push(format!(
            "The {PRINTED} segments of the paper miss the optimum by {:.1} g with equal and by {:.1} g with free lengths: reproduced as a \
             method.",
            1e3 * equal,
            1e3 * free
        ));
    }
    findings
}
