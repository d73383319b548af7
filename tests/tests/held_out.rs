//! Problems that no other file of the project has: what each is solved to at default settings, along the way of the program.
//!
//! The statements are files in `problems`, the optima stand in `problems/expected.toml` with their sources: closed forms, whose figures
//! `references/held_out_closed_forms.py` prints, and collocation with Ipopt from many starts, `references/held_out.py`. Known limits are rows that
//! assert the outcome of today and say which would be right.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use apsides::verify::Verdict;
use serde::Deserialize;

/// Solver: closed forms, where the active set is found or nothing is active.
const CLOSED_FORM: f64 = 1e-9;
/// Solver: closed forms with controls along bounds, which are above them by what the barrier leaves.
const BARRIER: f64 = 1e-8;
/// Discretisation: collocation of order five on 480 intervals, smooth solutions.
const SMOOTH: f64 = 1e-8;
/// Discretisation: the same where the control has corners or path constraints are met between the points.
const GRID: f64 = 2e-5;
/// Published: four digits behind the point.
const PUBLISHED: f64 = 2e-5;
/// Published: three digits behind the point.
const PUBLISHED_SHORT: f64 = 2e-4;
/// Optima of zero are held against one.
const NOTHING: f64 = 1e-12;

/// Tolerances by the word of a row.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Tolerance {
    ClosedForm,
    Barrier,
    Smooth,
    Grid,
    Published,
    PublishedShort,
}

impl Tolerance {
    fn value(self) -> f64 {
        match self {
            Self::ClosedForm => CLOSED_FORM,
            Self::Barrier => BARRIER,
            Self::Smooth => SMOOTH,
            Self::Grid => GRID,
            Self::Published => PUBLISHED,
            Self::PublishedShort => PUBLISHED_SHORT,
        }
    }
}

/// A row of `expected.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    optimum: Option<f64>,
    tolerance: Option<Tolerance>,
    verdict: Verdict,
    status: Option<String>,
    #[serde(default)]
    conflict: Vec<String>,
    source: String,
    right: Option<String>,
    #[serde(default)]
    missed: bool,
}

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/problems"))
}

fn rows() -> BTreeMap<String, Expected> {
    toml::from_str(&std::fs::read_to_string(folder().join("expected.toml")).unwrap()).unwrap()
}

/// The differences of an outcome from what is expected, one sentence each.
fn differences(name: &str, expected: &Expected) -> Vec<String> {
    let path = folder().join(format!("{name}.toml"));
    let summary = match apsides::load(&path.to_string_lossy(), &[]).and_then(|m| m.solve(None, &mut ())) {
        Ok(outcome) => outcome.summary,
        Err(e) => return vec![format!("{name}: {e}")],
    };
    let mut wrong = Vec::new();
    let solved = ["optimal", "acceptable"].contains(&summary.status.as_str());
    match &expected.status {
        Some(status) if *status != summary.status => {
            wrong.push(format!("status `{}` instead of `{status}`", summary.status));
        }
        None if !solved => wrong.push(format!("status `{}`", summary.status)),
        _ => {}
    }
    let verdict = summary.certificate.verdict;
    if verdict != expected.verdict {
        wrong.push(format!("verdict `{verdict}` instead of `{}`", expected.verdict));
    }
    if let Some(optimum) = expected.optimum {
        let size = if optimum.abs() < NOTHING { 1.0 } else { optimum.abs() };
        let difference = (summary.objective.value - optimum) / size;
        let met = difference.abs() <= expected.tolerance.unwrap_or(Tolerance::ClosedForm).value();
        if met == expected.missed {
            let found = summary.objective.value;
            wrong.push(format!("objective {found} for an optimum of {optimum} ({difference:+.1e})"));
        }
    }
    let message = summary.message.unwrap_or_default();
    for words in &expected.conflict {
        if !message.contains(words.as_str()) {
            wrong.push(format!("`{words}` is not named in `{message}`"));
        }
    }
    let limit = expected.right.as_ref().map_or(String::new(), |r| format!(" (a known limit; right: {r})"));
    wrong.into_iter().map(|w| format!("{name}: {w}{limit}")).collect()
}

/// Solves the files that a filter chooses.
fn check(chosen: impl Fn(&str, &Expected) -> bool) {
    let rows = rows();
    let rows = rows.iter().filter(|(name, row)| chosen(name, row));
    let (mut count, mut wrong) = (0, Vec::new());
    for (name, row) in rows {
        count += 1;
        wrong.extend(differences(name, row));
    }
    assert!(count > 0 && wrong.is_empty(), "{count} problems\n{}", wrong.join("\n"));
}

#[test]
fn every_file_has_a_row_with_a_source() {
    let files = std::fs::read_dir(folder()).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap());
    let mut files: Vec<_> = files.filter(|f| f != "expected.toml").collect();
    files.sort();
    let rows = rows();
    let named: Vec<_> = rows.keys().map(|name| format!("{name}.toml")).collect();
    assert_eq!(files, named);
    assert!(rows.values().all(|row| !row.source.is_empty()));
    assert!(rows.values().all(|row| !row.missed || row.right.is_some()));
}

#[test]
fn optima_in_closed_form() {
    check(|name, row| {
        row.right.is_none() && row.optimum.is_some() && !is_trap(name) && row.source != "held_out.py"
    });
}

#[test]
fn optima_by_collocation() {
    check(|name, row| row.right.is_none() && !is_trap(name) && row.source == "held_out.py");
}

/// Stationary points that are no minima, local optima beside better ones, optima that are not strict.
#[test]
fn traps() {
    check(|name, row| row.right.is_none() && is_trap(name));
}

#[test]
fn conflicts_are_named_and_unbounded_objectives_said() {
    check(|_, row| row.right.is_none() && row.optimum.is_none());
}

#[test]
fn known_limits() {
    check(|_, row| row.right.is_some());
}

fn is_trap(name: &str) -> bool {
    name.starts_with("trap_")
}
