//! `apsides verify`: every number of a result directory that can be computed again is, and the ones that differ are named.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::num::NonZero;
use std::path::Path;

use apsides::pipeline::regular_file;
use apsides_ocp::Trajectory;
use apsides_report::{changed_files, read_outcome_trajectory};
use apsides_verify::{Certificate, Check, CheckKind, Verdict};
use serde::Serialize;
use serde_json::Value;

use crate::exit::{Exit, Refusal, refusal};
use crate::output::{certificate, number, print_json, print_words};
use crate::speech::is_json;

const MISSION: &str = "mission.toml";
const SUMMARY: &str = "summary.json";
const CERTIFICATE: &str = "certificate.json";
const MULTIPLIERS: &str = "multipliers.json";

/// Files without which a result is not complete.
const NEEDED: [&str; 4] = [MISSION, SUMMARY, CERTIFICATE, "trajectory.csv"];
/// Files that must have a digest where they are there.
const USUAL: [&str; 2] = [MULTIPLIERS, "report.html"];

/// Numbers computed twice from the same trajectory agree to this, relative to their size; some take solves of their own.
const AGREEMENT: f64 = 1e-6;
/// Numbers below this are zero in all units of files.
const NOTHING: f64 = 1e-9;
/// Costates inside of an interval are this close to the costate equation, relative to the largest one of the phase.
const COSTATE: f64 = 1e-4;
/// Residuals agree to this part of their limits.
const RESIDUAL: f64 = 1e-3;

/// The certificate of today, and what differs from it.
#[derive(Serialize)]
struct Found {
    #[serde(flatten)]
    certificate: Certificate,
    /// One sentence for each file and number that is not what it should be.
    differences: Vec<String>,
}

pub(crate) fn verify(directory: &Path) -> Result<Exit, Refusal> {
    let file = directory.join(MISSION);
    if !file.is_file() {
        let place = directory.display();
        return Err(refusal(format!(
            "{place}: no result directory (it has no mission.toml); give one that `apsides solve --out` wrote"
        )));
    }
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    let mission = apsides::load(&file.to_string_lossy(), &[]).map_err(refusal)?.with_threads(cores);
    let posed = mission.pose().map_err(refusal)?;
    let trajectory = read_outcome_trajectory(directory, posed.flight()).map_err(refusal)?;
    let mut differences = Differences(Vec::new());
    let summary = differences.read(directory, SUMMARY);
    let status = summary.as_ref().and_then(|s| s.get("status")?.as_str());
    let solved = matches!(status, Some("optimal" | "acceptable"));
    let (certificate, results) = mission.recomputed(&trajectory, solved).map_err(refusal)?;
    let stored = differences.read(directory, CERTIFICATE);
    let claimed =
        stored.as_ref().and_then(|c| serde_json::from_value::<Verdict>(c.get("verdict")?.clone()).ok());
    if Some(certificate.verdict).max(claimed) >= Some(Verdict::Extremal) {
        // Costates by which nothing is proved, nor was, may be what they are.
        let stated = mission.stated_costates(&trajectory).map_err(refusal)?;
        differences.0.extend(stated.iter().filter(|c| c.miss.is_nan() || c.miss > COSTATE).map(|c| {
            format!(
                "trajectory.csv, {}: {:e} of the largest costate from the costate equation",
                c.place, c.miss
            )
        }));
    }
    let usual = USUAL.into_iter().filter(|name| directory.join(name).exists());
    let needed: Vec<&str> = NEEDED.into_iter().chain(usual).collect();
    for (name, state) in changed_files(directory, &needed).map_err(refusal)? {
        differences.0.push(format!("{name} {}", state.words()));
    }
    if let Some(stored) = stored
        && differences.certificate(CERTIFICATE, &stored, &certificate)
    {
        differences.costates(&mission.verify_as_stated(&trajectory).map_err(refusal)?);
    }
    if let Some(stored) = summary {
        let is_whole = certificate.verdict > Verdict::Rejected;
        differences.summary(&stored, &mission, &trajectory, &results, is_whole);
        differences.certificate(SUMMARY, member(&stored, "certificate"), &certificate);
    }
    let found = Found { certificate, differences: differences.0 };
    if is_json() {
        print_json(&found)?;
    } else {
        print_words(&text(directory, mission.name(), &found));
    }
    Ok(if found.certificate.is_verified() && found.differences.is_empty() {
        Exit::Verified
    } else {
        Exit::NotVerified
    })
}

fn text(directory: &Path, mission: &str, found: &Found) -> String {
    let mut text = format!("{}: mission {mission}\n{}", directory.display(), certificate(&found.certificate));
    if found.differences.is_empty() {
        text += "files and their numbers are those of the trajectory\n";
        text += "by their digests alone: status, counters, times, warnings, switches, prices, errors of the mesh\n";
    } else {
        text += "what differs:\n";
    }
    for difference in &found.differences {
        let _ = writeln!(text, "  {difference}");
    }
    text
}

struct Differences(Vec<String>);

impl Differences {
    /// A JSON file; its absence is named by its digest.
    fn read(&mut self, directory: &Path, name: &str) -> Option<Value> {
        let text = regular_file::read(&directory.join(name)).ok()?;
        match serde_json::from_slice(&text) {
            Ok(value) => Some(value),
            Err(e) => {
                self.0.push(format!("{name} is no JSON: {e}"));
                None
            }
        }
    }

    fn summary(
        &mut self,
        stored: &Value,
        mission: &apsides::Pipeline,
        trajectory: &Trajectory,
        results: &BTreeMap<String, f64>,
        is_whole: bool,
    ) {
        let words = [("mission", mission.name()), ("method", mission.methods().name.word())];
        for (key, word) in words {
            let stated = member(stored, key);
            if stated != word {
                self.0.push(format!("{SUMMARY}, `{key}` is {stated}, the mission has \"{word}\""));
            }
        }
        self.number(
            SUMMARY,
            "objective.value",
            member(member(stored, "objective"), "value"),
            trajectory.objective,
        );
        let none = serde_json::Map::new();
        let stored = member(stored, "results").as_object().unwrap_or(&none);
        for (key, value) in results {
            self.number(SUMMARY, &format!("results.{key}"), stored.get(key).unwrap_or(&Value::Null), *value);
        }
        // A trajectory that is rejected has no margins.
        for key in stored.keys().filter(|key| is_whole && !results.contains_key(*key)) {
            self.0.push(format!("{SUMMARY}, `results.{key}` is no result of the mission"));
        }
    }

    /// Numbers that are not finite are null in files.
    fn number(&mut self, file: &str, key: &str, stored: &Value, now: f64) {
        let differs = match stored.as_f64() {
            Some(then) => !now.is_finite() || (then - now).abs() > NOTHING.max(AGREEMENT * now.abs()),
            None => now.is_finite() || !stored.is_null(),
        };
        if differs {
            self.0.push(format!("{file}, `{key}` is {stored}, computed again {}", number(now)));
        }
    }

    /// Returns true where what is remarked differs, such as that the stated costates prove nothing.
    fn certificate(&mut self, file: &str, stored: &Value, now: &Certificate) -> bool {
        let then = match serde_json::from_value::<Certificate>(stored.clone()) {
            Ok(then) => then,
            Err(e) => {
                self.0.push(format!("{file} has no certificate: {e}"));
                return false;
            }
        };
        if then.verdict != now.verdict {
            self.0.push(format!("{file}: the verdict is {}, computed again {}", then.verdict, now.verdict));
        }
        let of = |name: &str| then.checks.iter().find(|c| c.name == name);
        for check in &now.checks {
            match of(&check.name) {
                None => self.0.push(format!("{file}: the check `{}` is missing", check.name)),
                Some(stored) if differ(stored, check) => self.0.push(format!(
                    "{file}: the check `{}` is {:e} of {:e}, computed again {:e} of {:e}",
                    check.name, stored.value, stored.limit, check.value, check.limit
                )),
                Some(_) => {}
            }
        }
        for check in then.checks.iter().filter(|c| !now.checks.iter().any(|n| n.name == c.name)) {
            self.0.push(format!("{file}: there is no check `{}`", check.name));
        }
        let (new, gone) = (now.remarks.iter(), then.remarks.iter());
        let new: Vec<_> = new.filter(|r| !then.remarks.contains(r)).collect();
        self.0.extend(new.iter().map(|r| format!("{file}: computed again, there is the remark: {r}")));
        let gone = gone.filter(|r| !now.remarks.contains(r));
        self.0.extend(gone.map(|r| format!("{file}: there is no such remark: {r}")));
        !new.is_empty()
    }

    /// Costates and multipliers by the conditions that they do not meet.
    fn costates(&mut self, as_stated: &Certificate) {
        let failed = as_stated.checks.iter().filter(|c| c.kind == CheckKind::Optimality && !c.passed);
        self.0.extend(failed.map(|c| {
            format!(
                "trajectory.csv and {MULTIPLIERS}: with the costates and multipliers there the check `{}` is {:e} of {:e} ({})",
                c.name, c.value, c.limit, c.at
            )
        }));
    }
}

/// A member of an object; null where there is none.
fn member<'a>(object: &'a Value, key: &str) -> &'a Value {
    object.get(key).unwrap_or(&Value::Null)
}

fn differ(then: &Check, now: &Check) -> bool {
    let finite = now.value.is_finite() && now.limit.is_finite();
    let close = |a: f64, b: f64| (a - b).abs() <= RESIDUAL * now.limit.abs().max(now.value.abs());
    let values = if finite {
        close(then.value, now.value) && close(then.limit, now.limit) && close(then.margin, now.margin)
    } else {
        then.value.is_finite() == now.value.is_finite() && then.limit.is_finite() == now.limit.is_finite()
    };
    !values || then.passed != now.passed || then.unit != now.unit
}
