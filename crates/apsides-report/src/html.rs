//! `report.html`: one file with style, figures and a small script inside, and no reference to anything outside.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use apsides_ocp::Trajectory;
use apsides_pipeline::unit_ending::in_words;
use apsides_pipeline::{Outcome, Summary};
use apsides_verify::Verdict;

use crate::ReportError;
use crate::certificate_page;
use crate::figure::Figure;
use crate::flight_figures::Presentation;
use crate::legend::entries;
use crate::limits::limits as limits_of;
use crate::map_picture::MapPicture;
use crate::markup::escape;
use crate::number::readable;
use crate::site_files::site_pictures;
use crate::standard_figures::StandardFigures;
use crate::units::{display_unit, pretty};

/// Significant digits of results.
const DIGITS: usize = 7;

/// Results from which they stand in two columns.
const LONG: usize = 8;

/// The page of an outcome with `figures` of the mission's own: [`render_page`] without a flight about a body.
///
/// # Errors
/// [`ReportError::Shape`] when the trajectory does not fit the problem.
pub fn render_html(outcome: &Outcome, figures: &[Figure]) -> Result<String, ReportError> {
    render_page(outcome, &Presentation { paths: figures.to_vec(), ..Presentation::default() })
}

/// The page: what was flown and what it cost in a sentence, the flight in figures, results, limits, the certificate folded, quantities over
/// time; then, folded, what those look at who check the solver: costates, mesh, work, the mission file.
///
/// # Errors
/// [`ReportError::Shape`] when the trajectory does not fit the problem; [`ReportError::Map`] when a map cannot be drawn.
pub fn render_page(outcome: &Outcome, shown: &Presentation) -> Result<String, ReportError> {
    let standard = StandardFigures::new(&outcome.ocp, &outcome.trajectory)?;
    let summary = &outcome.summary;
    let mut page = begin(if shown.heading.is_empty() { &summary.mission } else { &shown.heading });
    header(&mut page, outcome, &shown.title);
    figures(&mut page, &shown.paths);
    let sites = site_pictures(&outcome.decisions.sites)?;
    if !sites.is_empty() {
        page.push_str("<div class=\"figures\">\n");
        sites.iter().for_each(|site| map(&mut page, &site.title, site.picture()));
        page.push_str("</div>\n");
    }
    let besides =
        summary.results.iter().filter(|(key, _)| !is_named_after_objective(key, &summary.objective.name));
    results(&mut page, &besides.map(|(key, value)| (key.clone(), *value)).collect());
    limits(&mut page, outcome);
    certificate_page::certificate(&mut page, &summary.certificate);
    phases(&mut page, outcome);
    let curves = "Lines are the polynomials of the solution, dots its nodes (left out on fine meshes), dashed grey lines bounds near the data.";
    // A control that the mission draws over time, too, is drawn once, with its nodes and bounds.
    let unit = |figure: &Figure| display_unit(&figure.y.unit, 1.0).name;
    let is_control = |history: &&Figure| {
        let same = |control: &Figure| control.y.label == history.y.label && unit(control) == unit(history);
        history.series.len() == 1 && standard.controls.iter().any(same)
    };
    let histories: Vec<Figure> = shown.histories.iter().filter(|h| !is_control(h)).cloned().collect();
    section(&mut page, "Over time", None, &histories);
    section(&mut page, "Controls", Some(curves), &standard.controls);
    // Where the flight is drawn about its body the states of the problem are the same in other coordinates.
    let is_told = !shown.histories.is_empty();
    folded(&mut page, "States of the problem", !is_told, Some(curves), &standard.states);
    let costates =
        "Derivatives of the minimised objective with respect to the state, in objective unit per state unit.";
    folded(&mut page, "Costates", false, Some(costates), &standard.costates);
    let mesh = "Each dot starts an interval; fine meshes are drawn without dots.";
    folded(&mut page, "Mesh", false, Some(mesh), &standard.mesh);
    work(&mut page, summary);
    end(&mut page, &outcome.mission_file, "The nodes are in trajectory.csv, the numbers in summary.json.");
    Ok(page)
}

/// The head of a page up to its title.
pub(crate) fn begin(title: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{}</style>\n<script type=\"module\">\n{}</script>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n",
        include_str!("page.css"),
        include_str!("page.js")
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

fn header(page: &mut String, outcome: &Outcome, title: &str) {
    let summary = &outcome.summary;
    let _ = writeln!(page, "<p class=\"lead\">{}</p>", escape(&sentence(outcome, title)));
    if let Some(explanation) = outcome.explanation.as_deref() {
        let _ = writeln!(page, "<p class=\"explanation\">{}</p>", escape(explanation));
    }
    for warning in &summary.warnings {
        let _ = writeln!(page, "<p class=\"explanation\">Warning: {}</p>", escape(warning));
    }
    let (verdict, class) = match summary.certificate.verdict {
        v @ (Verdict::GlobalOptimum | Verdict::StrictLocalOptimum | Verdict::Extremal) => (v.word(), "good"),
        v @ Verdict::Feasible if summary.certificate.is_verified() => (v.word(), "good"),
        v @ Verdict::Feasible => (v.word(), "warn"),
        v @ Verdict::Rejected => (v.word(), "bad"),
    };
    let status_class = if summary.status == "optimal" { "good" } else { "warn" };
    let name = escape(&summary.objective.name.replace('_', " "));
    let mut facts = vec![(name, "", escape(&objective(summary)))];
    for (key, value) in headline(outcome) {
        let (name, unit) = in_words(key);
        let value = format!("{} {}", readable(value, FACT_DIGITS), escape(&pretty(&unit)));
        facts.push((escape(&name), "", value.trim_end().to_owned()));
    }
    facts.push(("status".to_owned(), status_class, escape(&summary.status)));
    facts.push(("verified as".to_owned(), class, verdict.to_owned()));
    self::facts(page, &facts);
}

/// Key figures: name, class and value of each.
pub(crate) fn facts(page: &mut String, facts: &[(String, &str, String)]) {
    page.push_str("<dl class=\"facts\">\n");
    for (name, class, value) in facts {
        let _ = writeln!(page, "<div><dt>{name}</dt><dd class=\"{class}\">{value}</dd></div>");
    }
    page.push_str("</dl>\n");
}

/// Significant digits of key figures and of the sentence.
const FACT_DIGITS: usize = 5;

/// Results that stand among the key figures.
const FACTS: usize = 4;

/// The objective with its unit.
fn objective(summary: &Summary) -> String {
    format!("{} {}", readable(summary.objective.value, DIGITS), pretty(&summary.objective.unit))
}

/// Keys of the results that name a case, without that of the objective, which has a place of its own beside them.
pub fn headline_beside_objective(outcome: &Outcome) -> impl Iterator<Item = &str> {
    let objective = outcome.summary.objective.name.replace('_', " ");
    let is_objective = move |key: &str| {
        is_named_after_objective(key, &outcome.summary.objective.name) || in_words(key).0 == objective
    };
    outcome.headline.iter().map(String::as_str).filter(move |key| !is_objective(key))
}

/// True of the key that own problems give the objective, with its name; a unit may follow.
fn is_named_after_objective(key: &str, objective: &str) -> bool {
    let words = |text: &str| text.replace(|c: char| !c.is_alphanumeric(), "_");
    let rest = key.strip_prefix("objective_").and_then(|rest| rest.strip_prefix(&words(objective)));
    rest.is_some_and(|unit| unit.is_empty() || unit.starts_with('_'))
}

/// The results that name the case, without the objective.
fn headline(outcome: &Outcome) -> Vec<(&str, f64)> {
    let results = &outcome.summary.results;
    headline_beside_objective(outcome).filter_map(|key| Some((key, *results.get(key)?))).take(FACTS).collect()
}

/// One sentence: the flight, its cost, its verdict.
fn sentence(outcome: &Outcome, title: &str) -> String {
    let summary = &outcome.summary;
    let subject = if title.is_empty() { &summary.mission } else { title.trim_end_matches('.') };
    let mut costs = vec![format!("{} {}", summary.objective.name.replace('_', " "), objective(summary))];
    costs.extend(headline(outcome).into_iter().map(|(key, value)| {
        let (name, unit) = in_words(key);
        format!("{name} {} {}", readable(value, FACT_DIGITS), pretty(&unit)).trim_end().to_owned()
    }));
    let method = if summary.solved_by.is_empty() { &summary.method } else { &summary.solved_by };
    let claim = summary.certificate.claim.as_ref().map(|c| format!(" Among {}: {}.", c.among, c.verdict));
    format!(
        "{subject}: {}. Solved by {method}. {}{}",
        costs.join(", "),
        summary.certificate.verdict.meaning(),
        claim.unwrap_or_default()
    )
}

/// The limits that the flight comes near to.
fn limits(page: &mut String, outcome: &Outcome) {
    let limits = limits_of(&outcome.ocp, &outcome.trajectory);
    if limits.is_empty() {
        return;
    }
    page.push_str(
        "<h2>Limits and margins</h2>\n<p class=\"note\">Bounds that the flight comes within a tenth of their range of, and all path \
         constraints.</p>\n<div class=\"card\"><table>\n<thead><tr><th>Limit</th><th class=\"number\">Reached</th>\
         <th class=\"number\">Allowed</th><th class=\"number\">Margin</th><th>Unit</th><th class=\"number\">At the limit for</th>\
         <th>Closest at</th></tr></thead>\n<tbody>\n",
    );
    for limit in limits {
        let size = limit.value.abs().max(limit.reached.abs());
        let shown = display_unit(&limit.unit, size);
        let number = |v: f64| readable(v * shown.factor, FACT_DIGITS);
        let at = 100.0 * limit.time_at / limit.duration;
        let at = if limit.time_at > 0.0 { format!("{} %", readable(at, 3)) } else { "-".into() };
        // What is left below rounding is nothing.
        let margin = if limit.margin().abs() < NO_MARGIN * size { 0.0 } else { limit.margin() };
        let _ = writeln!(
            page,
            "<tr><td>{}<small>{}</small></td><td class=\"number\">{}</td><td class=\"number\">{} {}</td><td class=\"number\">{}</td>\
             <td>{}</td><td class=\"number\">{at}</td><td>{} s</td></tr>",
            escape(&limit.name),
            escape(&limit.phases.join(", ")),
            number(limit.reached),
            if limit.is_upper { "\u{2264}" } else { "\u{2265}" },
            number(limit.value),
            number(margin),
            escape(&shown.name),
            readable(limit.time, FACT_DIGITS),
        );
    }
    page.push_str("</tbody>\n</table></div>\n");
}

/// A margin below this part of its limit is rounding.
const NO_MARGIN: f64 = 1e-7;

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
    // Long lists stand in two columns where there is room.
    let half = if results.len() > LONG { results.len().div_ceil(2) } else { results.len() };
    let rows: Vec<(&String, &f64)> = results.iter().collect();
    page.push_str("<div class=\"columns\">\n");
    for rows in rows.chunks(half) {
        page.push_str(
            "<div class=\"card\"><table>\n<thead><tr><th>Quantity</th><th class=\"number\">Value</th>\
             <th>Unit</th></tr></thead>\n<tbody>\n",
        );
        for (key, value) in rows {
            let (name, unit) = in_words(key);
            let _ = writeln!(
                page,
                "<tr title=\"{} = {value:?}\"><td>{}</td><td class=\"number\">{}</td><td>{}</td></tr>",
                escape(key),
                escape(&name),
                readable(**value, DIGITS),
                escape(&pretty(&unit))
            );
        }
        page.push_str("</tbody>\n</table></div>\n");
    }
    page.push_str("</div>\n");
}

fn work(page: &mut String, summary: &Summary) {
    let (c, t) = (&summary.counters, &summary.timing_ms);
    page.push_str(
        "<details>\n<summary>Work</summary>\n<div class=\"card\"><table>\n<thead><tr><th>Quantity</th>\
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
    page.push_str("</tbody>\n</table></div>\n</details>\n");
}

fn phases(page: &mut String, outcome: &Outcome) {
    let Outcome { ocp, trajectory, .. } = outcome;
    page.push_str(
        "<h2>Phases</h2>\n<div class=\"card\"><table>\n<thead><tr><th class=\"number wide\">No.</th><th>Phase</th>\
         <th class=\"number\">Start</th><th class=\"number\">End</th><th class=\"number\">Duration</th><th>Unit</th>\
         <th class=\"number wide\">Intervals</th><th class=\"number\">Points</th>\
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
            "<tr><td class=\"number wide\">{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td><td>{}</td><td class=\"number wide\">{}</td><td class=\"number\">{}</td>\
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

/// A section that is folded, or open at first.
fn folded(page: &mut String, title: &str, open: bool, note: Option<&str>, figures: &[Figure]) {
    if figures.is_empty() {
        return;
    }
    let open = if open { " open=\"\"" } else { "" };
    let _ = writeln!(page, "<details{open}>\n<summary>{title}</summary>");
    if let Some(note) = note {
        let _ = writeln!(page, "<p class=\"note\">{note}</p>");
    }
    self::figures(page, figures);
    page.push_str("</details>\n");
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

/// A picture of a map in its frame, with its title.
pub(crate) fn map(page: &mut String, title: &str, picture: MapPicture<'_>) {
    let drawn = picture.to_svg(title);
    let _ = writeln!(
        page,
        "<figure class=\"map\">\n<figcaption>{}</figcaption>\n{drawn}</figure>",
        escape(title)
    );
}

/// Labels with a sample of their line, outside of the drawing so that they never cover data.
fn legend(page: &mut String, figure: &Figure) {
    let entries = entries(figure);
    if entries.is_empty() {
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
