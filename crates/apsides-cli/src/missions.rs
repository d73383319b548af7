//! `apsides missions`, `check`, `new`, `schema` and the lists of data that missions name: what can be read before anything is solved.

use std::path::Path;

use apsides::Pipeline;
use apsides::missions::data::{BODY, VEHICLE};
use apsides::pipeline::key::{Key, KeyKind};
use apsides::pipeline::whole_file::write_whole;
use apsides_ocp::{Ocp, Sense};
use serde_json::{Value, json};

use crate::arguments::{CheckArguments, NewKind};
use crate::exit::{Exit, Refusal, refusal, unwritten};
use crate::output::{print, print_json, print_words, titles};
use crate::sentence::{with_fitting_comments, wrapped};
use crate::speech::{good, is_json, title};

/// Keys that are shown of a mission without `--all`.
const KEYS_SHOWN: usize = 20;

/// Lists the missions, or the keys of one.
pub(crate) fn missions(name: Option<&str>, all: bool) -> Result<Exit, Refusal> {
    let Some(name) = name else {
        let registry = apsides::registry();
        if is_json() {
            let listed = registry.files().map(|(name, title)| json!({ "name": name, "title": title }));
            print_json(&listed.collect::<Vec<_>>())?;
        } else {
            print_words(&titles(registry.files()));
        }
        return Ok(Exit::Verified);
    };
    let mission = apsides::load(name, &[]).map_err(refusal)?;
    let shown = if all { mission.keys().collect() } else { keys_that_matter(&mission) };
    if is_json() {
        print_json(&json!({
            "name": name,
            "mission": mission.name(),
            "title": mission.title(),
            "keys": shown.iter().map(|key| object(&mission, key)).collect::<Vec<_>>(),
        }))?;
        return Ok(Exit::Verified);
    }
    print_words(&heading(name, &mission));
    for key in &shown {
        print(&format!("{} = {}\n", title(&key.path), value(&mission, key)));
        print(&wrapped("    ", &format!("{} ({})", key.meaning, key.allowed())));
    }
    let hidden = mission.keys().count() - shown.len();
    if hidden > 0 {
        print(&wrapped(
            "",
            &format!(
                "{hidden} more keys of vehicle and flight, of methods and searches, epoch and axes: apsides missions {name} --all"
            ),
        ));
    }
    Ok(Exit::Verified)
}

/// The keys that an analyst changes: those that the mission's file states, then those of its kind, then numbers that vehicle and body have;
/// none of methods, searches and axes, but which method solves it. They keep their order.
fn keys_that_matter(mission: &Pipeline) -> Vec<&Key> {
    let keys: Vec<&Key> = mission.keys().collect();
    let rank = |key: &Key| match key.path.split_once('.') {
        Some(("constants", _)) => Some(0),
        Some(_) => None,
        None if key.path == "epoch" => None,
        None if matches!(&*key.path, "method" | BODY | VEHICLE) => Some(0),
        None if matches!(key.kind, KeyKind::Named(..)) => Some(3),
        None if mission.values().place(&key.path).is_some() => Some(1),
        None => Some(2),
    };
    let mut ranked: Vec<(u8, usize)> =
        keys.iter().enumerate().filter_map(|(k, key)| Some((rank(key)?, k))).collect();
    ranked.sort_unstable();
    ranked.truncate(KEYS_SHOWN);
    let mut chosen: Vec<usize> = ranked.into_iter().map(|(_, k)| k).collect();
    chosen.sort_unstable();
    chosen.into_iter().filter_map(|k| keys.get(k).copied()).collect()
}

fn value(mission: &Pipeline, key: &Key) -> String {
    mission.values().get(&key.path).map_or_else(|| "open".into(), ToString::to_string)
}

fn object(mission: &Pipeline, key: &Key) -> Value {
    json!({
        "key": key.path,
        "value": mission.values().get(&key.path).map(ToString::to_string),
        "unit": key.unit(),
        "meaning": key.meaning,
        "allowed": key.allowed(),
    })
}

/// The name and title of a mission that comes with the program, and its kind.
fn heading(name: &str, mission: &Pipeline) -> String {
    let registry = apsides::registry();
    match registry.files().find(|(file, _)| *file == name) {
        Some((file, title)) if file == mission.name() => format!("{file}: {title}\n\n"),
        Some((file, title)) => {
            format!("{file}: {title}\nmission = \"{}\": {}\n\n", mission.name(), mission.title())
        }
        None if mission.kind().is_of_file() => format!("{name}: {}: {}\n\n", mission.name(), mission.title()),
        None => format!("{name}: mission = \"{}\": {}\n\n", mission.name(), mission.title()),
    }
}

/// Prints the JSON Schema of mission files.
pub(crate) fn schema() -> Result<Exit, Refusal> {
    print_json(&apsides::pipeline::schema::schema(&apsides::registry()))?;
    Ok(Exit::Verified)
}

/// Lists the data that the key `key` of missions may name.
pub(crate) fn named_data(key: &str) -> Result<Exit, Refusal> {
    let registry = apsides::registry();
    let Some(data) = registry.data(key) else { return Err(format!("no data are named by `{key}`").into()) };
    if is_json() {
        let listed = data.names().map(|name| {
            let [source, remarks] = data.words(name);
            json!({ "name": name, "source": source, "remarks": remarks })
        });
        print_json(&listed.collect::<Vec<_>>())?;
        return Ok(Exit::Verified);
    }
    for name in data.names() {
        print(&format!("{}\n", title(name)));
        for words in data.words(name).into_iter().flatten() {
            print(&wrapped("    ", &words));
        }
    }
    Ok(Exit::Verified)
}

/// Writes a file to begin with; what is there stays.
pub(crate) fn new(kind: NewKind, file: Option<&Path>) -> Result<Exit, Refusal> {
    let (text, usual) = match kind {
        NewKind::Problem => (apsides::missions::problem::STARTER, "problem.toml"),
    };
    let path = file.unwrap_or_else(|| usual.as_ref());
    if std::fs::symlink_metadata(path).is_ok() {
        return Err(format!("{}: exists and stays as it is; name another file", path.display()).into());
    }
    write_whole(path, text.as_bytes()).map_err(unwritten(path))?;
    if is_json() {
        print_json(&json!({ "files": [path] }))?;
        return Ok(Exit::Verified);
    }
    let shown = path.display();
    print(&format!("written: {shown}\n\napsides check {shown}\napsides solve {shown} --out results\n"));
    Ok(Exit::Verified)
}

/// Says that a mission can be posed, and what was understood.
pub(crate) fn check(a: &CheckArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load()?.with_cancellation(a.limit.stop().cancellation());
    // One that is simulated was checked when it was read.
    let posed = if mission.is_simulated() { None } else { Some(mission.pose().map_err(refusal)?) };
    let flight = posed.as_ref().map(|posed| posed.flight());
    if is_json() {
        let mut understood = understood(&mission, flight);
        if let (true, Value::Object(members)) = (a.all, &mut understood) {
            members.insert("file".into(), mission.to_file().into());
        }
        print_json(&understood)?;
        return Ok(Exit::Verified);
    }
    print(&format!("{}: {} is well-posed\n", good("ok"), a.mission.mission));
    print(&wrapped("  ", mission.title()));
    for (name, words) in in_words(&mission, flight) {
        let head = format!("  {name:<11}");
        let indent = " ".repeat(head.len());
        print(&wrapped(&indent, &words).replacen(&indent, &head, 1));
    }
    if a.all {
        print(&format!("\n{}", with_fitting_comments(&mission.to_file())));
    } else {
        print("every value written out: --all\n");
    }
    Ok(Exit::Verified)
}

/// The understanding of a mission as data.
fn understood(mission: &Pipeline, flight: Option<&Ocp>) -> Value {
    let named = |key: &str| mission.values().get(key).map(ToString::to_string);
    let phases = flight.map(|ocp| {
        let phase = |p: &apsides_ocp::Phase| {
            let states: Vec<&str> = p.states.iter().map(|s| s.variable.name.as_str()).collect();
            let controls: Vec<&str> = p.controls.iter().map(|c| c.name.as_str()).collect();
            json!({ "name": p.name, "states": states, "controls": controls, "limits": p.path.iter().flat_map(|limit| &limit.rows).map(|row| row.name.as_str()).collect::<Vec<_>>() })
        };
        ocp.phases.iter().map(phase).collect::<Vec<_>>()
    });
    json!({
        "ok": true,
        "mission": mission.name(),
        "title": mission.title(),
        "vehicle": named(VEHICLE),
        "body": named(BODY),
        "method": flight.map(|_| mission.methods().name.word()),
        "objective": flight.map(|ocp| json!({
            "name": ocp.objective.name,
            "unit": ocp.objective.unit,
            "sense": sense(ocp),
        })),
        "phases": phases,
        "parameters": flight.map(|ocp| ocp.parameters.len()),
    })
}

fn sense(ocp: &Ocp) -> &'static str {
    if ocp.objective.sense == Sense::Minimize { "minimize" } else { "maximize" }
}

/// The understanding of a mission in words, by what they are about.
fn in_words(mission: &Pipeline, flight: Option<&Ocp>) -> Vec<(&'static str, String)> {
    let mut words = Vec::new();
    for (what, key) in [("vehicle", VEHICLE), ("body", BODY)] {
        if let Some(name) = mission.values().get(key) {
            words.push((what, name.to_string()));
        }
    }
    let changed: Vec<String> = mission
        .keys()
        .filter(|key| mission.values().place(&key.path).is_some_and(|place| place.starts_with("--set")))
        .map(|key| format!("{} = {}", key.path, value(mission, key)))
        .collect();
    if !changed.is_empty() {
        words.push(("set", changed.join(", ")));
    }
    let Some(ocp) = flight else {
        words.push(("law", "flown under its law, nothing is optimised: apsides simulate".into()));
        return words;
    };
    let wish = if ocp.objective.sense == Sense::Minimize { "least" } else { "largest" };
    words.push((
        "objective",
        format!("{wish} {} ({})", ocp.objective.name.replace('_', " "), ocp.objective.unit),
    ));
    words.push(("method", mission.methods().name.word().into()));
    for phase in &ocp.phases {
        let names = |names: Vec<&str>| names.join(", ");
        let mut text = format!(
            "{}: states {}; controls {}",
            phase.name,
            names(phase.states.iter().map(|s| s.variable.name.as_str()).collect()),
            names(phase.controls.iter().map(|c| c.name.as_str()).collect()),
        );
        if !phase.path.is_empty() {
            let limits = phase.path.iter().flat_map(|limit| &limit.rows);
            text += &format!("; limits on {}", names(limits.map(|row| row.name.as_str()).collect()));
        }
        words.push(("phase", text));
    }
    let states: usize = ocp.phases.iter().map(|p| p.states.len()).sum();
    let controls: usize = ocp.phases.iter().map(|p| p.controls.len()).sum();
    words.push((
        "unknowns",
        format!(
            "{states} states and {controls} controls as functions of time in {} phase{}, {} parameter{}, {} conditions between ends",
            ocp.phases.len(),
            if ocp.phases.len() == 1 { "" } else { "s" },
            ocp.parameters.len(),
            if ocp.parameters.len() == 1 { "" } else { "s" },
            ocp.constraints.len(),
        ),
    ));
    words
}
