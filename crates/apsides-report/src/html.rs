//! `report.html`: one file with style and figures inside, no script and no reference to anything outside.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use apsides_ocp::Trajectory;
use apsides_pipeline::{Outcome, Summary};
use apsides_verify::{Certificate, Check, CheckKind, Verdict};

use crate::ReportError;
use crate::figure::{Figure, SeriesStyle};
use crate::markup::escape;
use crate::number::readable;
use crate::palette::{BOUND, reference_color, series_color};
use crate::standard_figures::StandardFigures;
use crate::units::{pretty, split_key};

/// Significant digits of results.
const DIGITS: usize = 7;

/// The page: facts, results, certificate, work, the mission's own `figures`, the standard ones, the mission file.
///
/// # Errors
/// [`ReportError::Shape`] when the trajectory does not fit the problem.
pub fn render_html(outcome: &Outcome, figures: &[Figure]) -> Result<String, ReportError> {
    let standard = StandardFigures::new(&outcome.ocp, &outcome.trajectory)?;
    let summary = &outcome.summary;
    let mut page = begin(&summary.mission);
    header(&mut page, summary, outcome.explanation.as_deref());
    page.push_str("<div class=\"columns\">\n<section>\n");
    results(&mut page, &summary.results);
    page.push_str("</section>\n<section>\n");
    work(&mut page, summary);
    page.push_str("</section>\n</div>\n");
    certificate(&mut page, &summary.certificate);
    phases(&mut page, outcome);
    let curves = "Lines are the polynomials of the solution, dots its nodes (left out on fine meshes), dashed grey lines bounds near the data.";
    section(&mut page, "Mission", None, figures);
    section(&mut page, "States", Some(curves), &standard.states);
    section(&mut page, "Controls", Some(curves), &standard.controls);
    let costates =
        "Derivatives of the minimised objective with respect to the state, in objective unit per state unit.";
    section(&mut page, "Costates", Some(costates), &standard.costates);
    section(
        &mut page,
        "Mesh",
        Some("Each dot starts an interval; fine meshes are drawn without dots."),
        &standard.mesh,
    );
    end(&mut page, &outcome.mission_file, "The nodes are in trajectory.csv, the numbers in summary.json.");
    Ok(page)
}

/// The head of a page up to its title.
pub(crate) fn begin(title: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n",
        include_str!("page.css")
    )
}

/// The end of a page: the mission file, and where the numbers are.
pub(crate) fn end(page: &mut String, mission_file: &str, where_numbers_are: &str) {
    let _ = write!(
        page,
        "<details>\n<summary>Mission file</summary>\n<pre class=\"card\">{}</pre>\n</details>\n\
         <footer>Written by apsides {}. {where_numbers_are}</footer>\n</main>\n</body>\n</html>\n",
        escape(mission_file),
        env!("CARGO_PKG_VERSION")
    );
}

// Writing into a `String` cannot fail, hence the discarded results.

fn header(page: &mut String, summary: &Summary, explanation: Option<&str>) {
    let _ = writeln!(
        page,
        "<p class=\"lead\">Method: {}. Verification: {}.</p>",
        escape(&summary.method),
        escape(&summary.certificate.words())
    );
    if let Some(explanation) = explanation {
        let _ = writeln!(page, "<p class=\"explanation\">{}</p>", escape(explanation));
    }
    for warning in &summary.warnings {
        let _ = writeln!(page, "<p class=\"explanation\">Warning: {}</p>", escape(warning));
    }
    let objective =
        format!("{} {}", readable(summary.objective.value, DIGITS), escape(&pretty(&summary.objective.unit)));
    let (verdict, class) = match summary.certificate.verdict {
        v @ (Verdict::GlobalOptimum | Verdict::StrictLocalOptimum | Verdict::Extremal) => (v.word(), "good"),
        v @ Verdict::Feasible if summary.certificate.is_verified() => (v.word(), "good"),
        v @ Verdict::Feasible => (v.word(), "warn"),
        v @ Verdict::Rejected => (v.word(), "bad"),
    };
    let status_class = if summary.status == "optimal" { "good" } else { "warn" };
    let time = summary.timing_ms.build + summary.timing_ms.solve + summary.timing_ms.verify;
    page.push_str("<dl class=\"facts\">\n");
    for (name, class, value) in [
        (escape(&summary.objective.name.replace('_', " ")), "", objective),
        ("status".to_owned(), status_class, escape(&summary.status)),
        ("verified as".to_owned(), class, verdict.to_owned()),
        ("total time".to_owned(), "", milliseconds(time)),
    ] {
        let _ = writeln!(page, "<div><dt>{name}</dt><dd class=\"{class}\">{value}</dd></div>");
    }
    page.push_str("</dl>\n");
}

pub(crate) fn milliseconds(value: f64) -> String {
    if value >= 1e4 {
        format!("{} s", readable(value / 1e3, 4))
    } else {
        format!("{} ms", readable(value, 4))
    }
}

pub(crate) fn results(page: &mut String, results: &BTreeMap<String, f64>) {
    page.push_str("<h2>Results</h2>\n");
    if results.is_empty() {
        page.push_str("<p class=\"note\">The mission states no results.</p>\n");
        return;
    }
    page.push_str(
        "<div class=\"card\"><table>\n<thead><tr><th>Quantity</th><th class=\"number\">Value</th>\
         <th>Unit</th></tr></thead>\n<tbody>\n",
    );
    for (key, value) in results {
        let (name, unit) = split_key(key);
        let _ = writeln!(
            page,
            "<tr title=\"{} = {value:?}\"><td>{}</td><td class=\"number\">{}</td><td>{}</td></tr>",
            escape(key),
            escape(&name),
            readable(*value, DIGITS),
            escape(&pretty(&unit))
        );
    }
    page.push_str("</tbody>\n</table></div>\n");
}

fn work(page: &mut String, summary: &Summary) {
    let (c, t) = (&summary.counters, &summary.timing_ms);
    page.push_str(
        "<h2>Work</h2>\n<div class=\"card\"><table>\n<thead><tr><th>Quantity</th>\
         <th class=\"number\">Value</th></tr></thead>\n<tbody>\n",
    );
    for (name, value) in [
        ("meshes solved", c.mesh_iterations.to_string()),
        ("iterations", c.iterations.to_string()),
        ("factorisations", c.factorisations.to_string()),
        ("variables of the last problem", c.variables.to_string()),
        ("constraints of the last problem", c.constraints.to_string()),
        ("time to build", milliseconds(t.build)),
        ("time to solve", milliseconds(t.solve)),
        ("time to verify", milliseconds(t.verify)),
    ] {
        let _ = writeln!(page, "<tr><td>{name}</td><td class=\"number\">{value}</td></tr>");
    }
    page.push_str("</tbody>\n</table></div>\n");
}

fn certificate(page: &mut String, certificate: &Certificate) {
    let failed = certificate.checks.iter().filter(|c| !c.passed).count();
    let _ = writeln!(
        page,
        "<h2>Certificate</h2>\n<p class=\"note\">Verdict: <strong>{}</strong>. {} {} of {} checks passed. A check passes \
         when its value does not exceed its limit.</p>",
        certificate.verdict,
        certificate.verdict.meaning(),
        certificate.checks.len() - failed,
        certificate.checks.len()
    );
    for remark in &certificate.remarks {
        let _ = writeln!(page, "<p class=\"note\">{}.</p>", escape(remark));
    }
    if certificate.checks.is_empty() {
        return;
    }
    table_of(page, &certificate.checks);
    if let Some(claim) = &certificate.claim {
        let _ = writeln!(page, "<h3>Claim: {}</h3>", escape(&claim.words()));
        table_of(page, &claim.checks);
    }
}

fn table_of(page: &mut String, checks: &[Check]) {
    page.push_str(
        "<div class=\"card\"><table>\n<thead><tr><th>Check, and where it is largest</th><th class=\"number\">Value</th>\
         <th class=\"number\">Limit</th><th class=\"number\">Margin</th><th>Unit</th><th>Used</th><th>Result</th>\
         </tr></thead>\n<tbody>\n",
    );
    for (kind, name) in [
        (CheckKind::Feasibility, "Feasibility"),
        (CheckKind::Optimality, "First order"),
        (CheckKind::Curvature, "Second order, necessary"),
        (CheckKind::Strictness, "Second order, sufficient"),
        (CheckKind::Convexity, "Convexity"),
    ] {
        let mut of_kind = checks.iter().filter(|c| c.kind == kind).peekable();
        if of_kind.peek().is_some() {
            let _ = writeln!(page, "<tr class=\"group\"><th colspan=\"7\">{name}</th></tr>");
        }
        of_kind.for_each(|c| check(page, c));
    }
    page.push_str("</tbody>\n</table></div>\n");
}

fn check(page: &mut String, check: &Check) {
    let used = 100.0 * check.value / check.limit;
    let used = if used.is_finite() {
        format!(
            "<span class=\"used\"><span class=\"bar\"><i{} style=\"width:{:.1}%\"></i></span>{}</span>",
            if check.passed { "" } else { " class=\"over\"" },
            used.clamp(0.0, 100.0),
            if used > 0.0 && used < 0.01 {
                "under 0.01 %".to_owned()
            } else {
                format!("{} %", readable(used, 3))
            },
        )
    } else {
        "-".to_owned()
    };
    let (class, word) = if check.passed { ("good", "passed") } else { ("bad", "failed") };
    let _ = writeln!(
        page,
        "<tr><td{}>{}<small>{}</small></td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
         <td class=\"number\">{}</td><td>{}</td><td>{used}</td><td class=\"{class}\">{word}</td></tr>",
        check.meaning().map(|m| format!(" title=\"{}\"", escape(m))).unwrap_or_default(),
        escape(&check.name),
        escape(&check.at),
        readable(check.value, 3),
        readable(check.limit, 3),
        readable(check.margin, 3),
        escape(&pretty(&check.unit))
    );
}

fn phases(page: &mut String, outcome: &Outcome) {
    let Outcome { ocp, trajectory, .. } = outcome;
    page.push_str(
        "<h2>Phases</h2>\n<div class=\"card\"><table>\n<thead><tr><th class=\"number\">No.</th><th>Phase</th>\
         <th class=\"number\">Start</th><th class=\"number\">End</th><th class=\"number\">Duration</th><th>Unit</th>\
         <th class=\"number\">Intervals</th><th class=\"number\">Points</th>\
         <th class=\"number\">Largest error</th></tr></thead>\n<tbody>\n",
    );
    for (k, (phase, t)) in ocp.phases.iter().zip(&trajectory.phases).enumerate() {
        let error = match t.interval_errors.as_slice() {
            [] => "-".to_owned(),
            // A NaN among them is the worst of all, and `f64::max` would drop it.
            errors if errors.iter().any(|e| e.is_nan()) => readable(f64::NAN, 3),
            errors => readable(errors.iter().copied().fold(0.0, f64::max), 3),
        };
        let _ = writeln!(
            page,
            "<tr><td class=\"number\">{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{error}</td></tr>",
            k + 1,
            escape(&phase.name),
            readable(t.initial_time, DIGITS),
            readable(t.final_time, DIGITS),
            readable(t.final_time - t.initial_time, DIGITS),
            escape(&pretty(&phase.time_unit)),
            t.mesh.intervals(),
            t.mesh.total_points()
        );
    }
    page.push_str("</tbody>\n</table></div>\n");
    parameters(page, outcome, trajectory);
}

fn parameters(page: &mut String, outcome: &Outcome, trajectory: &Trajectory) {
    if trajectory.parameters.is_empty() {
        return;
    }
    page.push_str(
        "<h2>Static parameters</h2>\n<div class=\"card\"><table>\n<thead><tr><th>Parameter</th>\
         <th class=\"number\">Value</th><th>Unit</th></tr></thead>\n<tbody>\n",
    );
    for (variable, value) in outcome.ocp.parameters.iter().zip(&trajectory.parameters) {
        let _ = writeln!(
            page,
            "<tr><td>{}</td><td class=\"number\">{}</td><td>{}</td></tr>",
            escape(&variable.name),
            readable(*value, DIGITS),
            escape(&pretty(&variable.unit))
        );
    }
    page.push_str("</tbody>\n</table></div>\n");
}

pub(crate) fn section(page: &mut String, title: &str, note: Option<&str>, figures: &[Figure]) {
    if figures.is_empty() {
        return;
    }
    let _ = writeln!(page, "<h2>{title}</h2>");
    if let Some(note) = note {
        let _ = writeln!(page, "<p class=\"note\">{note}</p>");
    }
    self::figures(page, figures);
}

/// Figures with their legends, side by side where there is room.
pub(crate) fn figures(page: &mut String, figures: &[Figure]) {
    if figures.is_empty() {
        return;
    }
    page.push_str("<div class=\"figures\">\n");
    for figure in figures {
        let _ = writeln!(page, "<figure>\n<figcaption>{}</figcaption>", escape(&figure.title));
        legend(page, figure);
        page.push_str(&figure.to_svg());
        page.push_str("</figure>\n");
    }
    page.push_str("</div>\n");
}

/// Labels with a sample of their line, outside of the drawing so that they never cover data.
fn legend(page: &mut String, figure: &Figure) {
    let series = figure.series.iter().zip(figure.colors()).map(|(s, color)| {
        let color = series_color(color);
        let sample = match s.style {
            SeriesStyle::Line => format!("<path d=\"M1 5H25\" stroke=\"{color}\" stroke-width=\"2\"/>"),
            SeriesStyle::Dots => format!("<circle cx=\"13\" cy=\"5\" r=\"3\" fill=\"{color}\"/>"),
            SeriesStyle::Bound => dashed(BOUND),
        };
        (s.label.as_str(), sample)
    });
    let references = figure.references.iter().enumerate();
    let references = references.map(|(k, r)| (r.label(), dashed(reference_color(k))));
    let mut entries = series.chain(references).filter(|(label, _)| !label.is_empty()).peekable();
    if entries.peek().is_none() {
        return;
    }
    page.push_str("<ul class=\"legend\">\n");
    for (label, sample) in entries {
        let _ = writeln!(
            page,
            "<li><svg viewBox=\"0 0 26 10\" aria-hidden=\"true\">{sample}</svg>{}</li>",
            escape(label)
        );
    }
    page.push_str("</ul>\n");
}

fn dashed(color: &str) -> String {
    format!("<path d=\"M1 5H25\" stroke=\"{color}\" stroke-width=\"1.6\" stroke-dasharray=\"6 4\"/>")
}
