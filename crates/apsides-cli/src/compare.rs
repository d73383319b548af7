//! `apsides compare`: results beside each other, flights over each other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use apsides::Pipeline;
use apsides::ephemeris::{Ephemeris, Sampling};
use apsides::pipeline::regular_file;
use apsides_report::{NamedFlight, Page, overlaid, replace};
use serde::Serialize;
use serde_json::{Value, json};

use crate::arguments::CompareArguments;
use crate::commands::{claim, probe_directory};
use crate::exit::{Exit, Refusal, refusal};
use crate::export::{mission_file, rows_of};
use crate::output::{print, print_json, print_words, written};
use crate::sentence::{name, wrapped};
use crate::speech::{is_json, title};

/// Rows of a flight that figures are drawn from.
const ROWS: u64 = 800;

/// A result directory.
struct Run {
    shown: RunSummary,
    mission: Pipeline,
    flight: Ephemeris,
}

/// The result in a few words.
#[derive(Serialize)]
struct RunSummary {
    directory: String,
    mission: String,
    status: String,
    /// The verdict of its certificate; none of a flight under a law.
    verdict: Option<String>,
    results: BTreeMap<String, f64>,
}

impl Run {
    fn read(directory: &Path) -> Result<Self, Refusal> {
        let mission = apsides::load(&mission_file(directory)?.to_string_lossy(), &[]).map_err(refusal)?;
        let file = directory.join("summary.json");
        let of_file = |e: &dyn std::fmt::Display| refusal(format!("{}: {e}", name(&file.to_string_lossy())));
        let summary = regular_file::read(&file).map_err(|e| of_file(&e))?;
        let summary: Value = serde_json::from_slice(&summary).map_err(|e| of_file(&e))?;
        let word = |value: Option<&Value>| value.and_then(Value::as_str).map(str::to_owned);
        let results = summary.get("results").and_then(Value::as_object).into_iter().flatten();
        let flight = rows_of(directory, &mission, Sampling::Points(ROWS))?;
        let shown = RunSummary {
            directory: directory.display().to_string(),
            mission: mission.name().to_owned(),
            status: word(summary.get("status")).unwrap_or_default(),
            verdict: word(summary.get("certificate").and_then(|c| c.get("verdict"))),
            results: results.filter_map(|(key, value)| Some((key.clone(), value.as_f64()?))).collect(),
        };
        Ok(Self { shown, mission, flight })
    }

    fn verdict(&self) -> &str {
        self.shown.verdict.as_deref().unwrap_or(&self.shown.status)
    }
}

pub(crate) fn compare(a: &CompareArguments) -> Result<Exit, Refusal> {
    if let Some(dir) = &a.out {
        // Before the work, not after it.
        probe_directory(dir)?;
    }
    let runs = a.directories.iter().map(|dir| Run::read(dir)).collect::<Result<Vec<_>, _>>()?;
    let rows = rows(&runs);
    let changed = changed(&runs);
    let _lock = a.out.as_deref().map(claim).transpose()?;
    let page = [("compare.html", Some(page(&runs, &rows, &changed).into_bytes()))];
    let files = a.out.as_deref().map(|dir| replace(dir, &page)).transpose()?;
    if is_json() {
        let shown: Vec<&RunSummary> = runs.iter().map(|run| &run.shown).collect();
        let changed: BTreeMap<&String, &Vec<String>> =
            changed.iter().map(|(key, values)| (key, values)).collect();
        print_json(&json!({ "runs": shown, "keys": changed }))?;
        return Ok(Exit::Verified);
    }
    print_words(&text(&runs, &rows, &changed));
    print(&files.as_deref().map(written).unwrap_or_default());
    Ok(Exit::Verified)
}

/// Each result with its value in each run, where it has one.
fn rows(runs: &[Run]) -> Vec<(&String, Vec<Option<f64>>)> {
    let keys: BTreeSet<&String> = runs.iter().flat_map(|run| run.shown.results.keys()).collect();
    let values = |key: &String| runs.iter().map(|run| run.shown.results.get(key).copied()).collect();
    keys.into_iter().map(|key| (key, values(key))).collect()
}

/// The keys of the missions that differ, with their values.
fn changed(runs: &[Run]) -> Vec<(String, Vec<String>)> {
    let keys: BTreeSet<String> =
        runs.iter().flat_map(|run| run.mission.keys().map(|key| key.path.to_string())).collect();
    let value = |run: &Run, key: &str| {
        run.mission.values().get(key).map_or_else(|| "-".to_owned(), ToString::to_string)
    };
    let values = |key: &String| runs.iter().map(|run| value(run, key)).collect::<Vec<_>>();
    let differ = |values: &Vec<String>| values.iter().any(|v| Some(v) != values.first());
    keys.into_iter()
        .map(|key| (values(&key), key))
        .filter(|(v, _)| differ(v))
        .map(|(v, key)| (key, v))
        .collect()
}

/// Widths of a name and of a value: three values fit a terminal.
const NAME: usize = 32;
const VALUE: usize = 15;

fn text(runs: &[Run], rows: &[(&String, Vec<Option<f64>>)], changed: &[(String, Vec<String>)]) -> String {
    let mut text = String::new();
    for (k, run) in runs.iter().enumerate() {
        let head = format!("{}: {}, {}: ", k + 1, run.shown.directory, run.shown.mission);
        text += &wrapped("", &format!("{head}{}", run.verdict()));
    }
    if !changed.is_empty() {
        text += &format!("\n{}\n", title("keys that differ"));
    }
    for (key, values) in changed {
        text += &wrapped("  ", &format!("{key}: {}", values.join(" | ")));
    }
    let is_pair = runs.len() == 2;
    let mut heads: Vec<String> = (1..=runs.len()).map(|k| k.to_string()).collect();
    heads.extend(is_pair.then(|| "2 less 1".to_owned()));
    let line = |name: &str, cells: &[String]| {
        let cells: String = cells.iter().map(|cell| format!(" {cell:>VALUE$}")).collect();
        format!("{name:<NAME$}{cells}\n")
    };
    text += &format!("\n{}", title(&line("result", &heads)));
    for (key, values) in rows {
        text += &line(key, &cells(values));
    }
    text
}

/// The values of a row, of two with their difference.
fn cells(values: &[Option<f64>]) -> Vec<String> {
    let mut cells: Vec<String> =
        values.iter().map(|v| v.map_or_else(|| "-".to_owned(), |v| format!("{v:.6}"))).collect();
    if let [first, second] = values {
        let difference = first.zip(*second).map(|(first, second)| format!("{:+.6}", second - first));
        cells.push(difference.unwrap_or_else(|| "-".to_owned()));
    }
    cells
}

fn page(runs: &[Run], rows: &[(&String, Vec<Option<f64>>)], changed: &[(String, Vec<String>)]) -> String {
    let names: Vec<&str> = runs.iter().map(|run| run.shown.directory.as_str()).collect();
    let mut page = Page::new(&names.join(", "));
    let verdicts =
        runs.iter().map(|run| format!("{}: {} ({})", run.shown.directory, run.shown.mission, run.verdict()));
    page.lead(&format!(
        "{} flights beside each other. {}.",
        runs.len(),
        verdicts.collect::<Vec<_>>().join("; ")
    ));
    let flights: Vec<NamedFlight<'_>> =
        runs.iter().map(|run| NamedFlight { name: &run.shown.directory, rows: &run.flight }).collect();
    if !changed.is_empty() {
        page.heading("Keys that differ");
        let heads: Vec<&str> = std::iter::once("key").chain(names.iter().copied()).collect();
        let row = |(key, values): &(String, Vec<String>)| {
            std::iter::once(key.clone()).chain(values.iter().cloned()).collect()
        };
        page.table(&heads, &changed.iter().map(row).collect::<Vec<Vec<String>>>());
    }
    page.heading("Results");
    let difference = (runs.len() == 2).then_some("second less first");
    let heads: Vec<&str> = std::iter::once("result").chain(names.iter().copied()).chain(difference).collect();
    let row = |(key, values): &(&String, Vec<Option<f64>>)| {
        std::iter::once((*key).clone()).chain(cells(values)).collect()
    };
    page.table(&heads, &rows.iter().map(row).collect::<Vec<Vec<String>>>());
    page.heading("Flights");
    page.figures(&overlaid(&flights));
    page.finish()
}
