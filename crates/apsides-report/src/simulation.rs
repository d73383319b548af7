//! Simulated flights: states as CSV, numbers as JSON, a report with figures of all states.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use apsides_pipeline::{Simulated, regular_file};

use crate::files::{Item, failed, json, replace, table_error, with_stale_ephemerides};
use crate::html;
use crate::markup::escape;
use crate::number::readable;
use crate::root_locus;
use crate::trajectory_csv::shortest;
use crate::{Figure, ReportError};

const SUMMARY: &str = "summary.json";
const STATES: &str = "states.csv";
const MISSION: &str = "mission.toml";
const REPORT: &str = "report.html";

/// Writes `summary.json`, `states.csv`, `mission.toml` and `report.html` with the `figures` of a simulated flight into a directory, and
/// the files of its `ephemeris`, if there are any; returns the paths written.
///
/// # Errors
/// [`ReportError`] with the path and the reason. The earlier content of the directory is then as it was.
pub fn write_simulation(
    dir: &Path,
    flight: &Simulated,
    figures: &[Figure],
    ephemeris: Vec<Item>,
) -> Result<Vec<PathBuf>, ReportError> {
    let mut items: Vec<Item> = vec![
        (SUMMARY, Some(json(SUMMARY, &flight.summary)?)),
        (STATES, Some(states(flight)?)),
        (MISSION, Some(flight.mission_file.clone().into_bytes())),
        (REPORT, Some(page(flight, figures).into_bytes())),
    ];
    items.extend(with_stale_ephemerides(ephemeris));
    replace(dir, &items)
}

/// Reads headers and rows of the record in the directory of a simulated flight.
///
/// # Errors
/// [`ReportError`] when the file cannot be read, or is no table of numbers.
pub fn read_states(dir: &Path) -> Result<(Vec<String>, Vec<Vec<f64>>), ReportError> {
    let path = dir.join(STATES);
    let file = regular_file::open(&path).map_err(failed("read", &path))?;
    let mut reader = csv::Reader::from_reader(file);
    let refused = |e: csv::Error| table_error(STATES, e);
    let headers = reader.headers().map_err(refused)?.iter().map(str::to_owned).collect();
    let rows = reader.deserialize::<Vec<f64>>().collect::<Result<_, _>>().map_err(refused)?;
    Ok((headers, rows))
}

fn states(flight: &Simulated) -> Result<Vec<u8>, ReportError> {
    let failed = |e: csv::Error| table_error(STATES, e);
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(flight.headers()).map_err(failed)?;
    for row in &flight.rows {
        table.write_record(row.iter().map(|v| shortest(*v))).map_err(failed)?;
    }
    table.into_inner().map_err(|e| table_error(STATES, e.into_error()))
}

// Writing into a `String` cannot fail, hence the discarded results.

fn page(flight: &Simulated, figures: &[Figure]) -> String {
    let s = &flight.summary;
    let mut page = html::begin(&s.mission);
    let _ = writeln!(
        page,
        "<p class=\"lead\">Flight under the law {}: {}, at {} s.</p>",
        escape(&s.law),
        escape(&s.ending),
        readable(s.end_time_s, 6)
    );
    for warning in &s.warnings {
        let _ = writeln!(page, "<p class=\"explanation\">Warning: {}</p>", escape(warning));
    }
    let class = if s.status == "completed" { "good" } else { "bad" };
    let _ = writeln!(
        page,
        "<dl class=\"facts\">\n<div><dt>status</dt><dd class=\"{class}\">{}</dd></div>\n\
         <div><dt>end</dt><dd>{} s</dd></div>\n<div><dt>total time</dt><dd>{}</dd></div>\n</dl>",
        escape(&s.status),
        readable(s.end_time_s, 6),
        html::milliseconds(s.time_ms)
    );
    html::section(&mut page, "Flight", None, figures);
    html::results(&mut page, &s.results);
    margins(&mut page, flight);
    if let Some(locus) = &flight.root_locus {
        let note = format!(
            "Poles of the loops at the largest dynamic pressure, {} kPa at {} km: logarithms of those of the sampled loop over the \
             sample time. The gain of one loop from a tenth to ten times, dots where it is nominal; the other loop is closed, and its \
             poles hardly move. Poles that decay within a sample are left out.",
            readable(locus.dynamic_pressure / 1e3, 4),
            readable(locus.altitude / 1e3, 4)
        );
        html::section(&mut page, "Root locus", Some(&note), &root_locus::figures(locus));
    }
    html::end(&mut page, &flight.mission_file, "The states are in states.csv, the numbers in summary.json.");
    page
}

fn margins(page: &mut String, flight: &Simulated) {
    if flight.summary.margins.is_empty() {
        return;
    }
    page.push_str(
        "<h2>Margins</h2>\n<p class=\"note\">Of the linear loop at a height, the least of both angles; a dash where the \
         response has no crossing.</p>\n<div class=\"card\"><table>\n<thead><tr><th class=\"number\">Height (km)</th>\
         <th class=\"number\">Dynamic pressure (kPa)</th><th>Loop</th><th class=\"number\">Gain</th>\
         <th class=\"number\">Phase (deg)</th><th class=\"number\">Delay (s)</th>\
         <th class=\"number\">Crossover (Hz)</th></tr></thead>\n<tbody>\n",
    );
    for m in &flight.summary.margins {
        let (class, word) = if m.stable { ("good", "stable") } else { ("bad", "unstable") };
        let _ = write!(
            page,
            "<tr><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"{class}\">{word}</td>",
            readable(m.altitude_km, 4),
            readable(m.dynamic_pressure_kpa, 4)
        );
        for value in [m.gain, m.phase_deg, m.delay_s, m.crossover_hz] {
            let text = value.map_or_else(|| "-".into(), |v| readable(v, 4));
            let _ = write!(page, "<td class=\"number\">{text}</td>");
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody>\n</table></div>\n");
}
