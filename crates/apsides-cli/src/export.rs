//! `apsides export`.

use std::path::{Path, PathBuf};

use apsides::Pipeline;
use apsides::ephemeris::{Ephemeris, Sampling};
use apsides_report::{read_outcome_trajectory, read_states, replace};

use crate::arguments::{ExportArguments, allowed_memory};
use crate::commands::{claim, probe_directory};
use crate::ephemeris::files;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, print_json, written};
use crate::speech::is_json;

const MISSION: &str = "mission.toml";

/// Keys that an export may replace: all others belong to the flight that was solved.
const REPLACEABLE: [&str; 2] = ["epoch", "frame."];

pub(crate) fn export(a: &ExportArguments) -> Result<Exit, Refusal> {
    let file = mission_file(&a.directory)?;
    let Some(sampling) = a.rows.sampling() else {
        return Err("say how far apart the rows are: --step 10s, or --points 500".into());
    };
    let foreign = |set: &&String| !REPLACEABLE.iter().any(|key| set.trim_start().starts_with(key));
    if let Some(set) = a.set.iter().find(foreign) {
        return Err(format!(
            "--set {set}: the flight is solved; only `epoch` and the keys of `frame` can be replaced, others by solving again"
        )
        .into());
    }
    let mission = apsides::load(&file.to_string_lossy(), &a.set).map_err(refusal)?;
    let mission = mission.with_memory(allowed_memory(a.memory));
    mission.check_formats(&a.format).map_err(refusal)?;
    let out = a.out.as_deref().unwrap_or(&a.directory);
    probe_directory(out)?;
    let _lock = claim(out)?;
    let files = replace(out, &files(&rows_of(&a.directory, &mission, sampling)?, &a.format)?)?;
    if is_json() {
        print_json(&serde_json::json!({ "files": files }))?;
    } else {
        print(written(&files).trim_start());
    }
    Ok(Exit::Verified)
}

/// The mission file of a result directory.
pub(crate) fn mission_file(directory: &Path) -> Result<PathBuf, Refusal> {
    let file = directory.join(MISSION);
    if file.is_file() {
        return Ok(file);
    }
    Err(refusal(format!(
        "{}: no result directory (it has no {MISSION}); give one that `apsides solve --out` or `apsides simulate --out` wrote",
        directory.display()
    )))
}

/// The rows of the flight in a result directory of a mission.
pub(crate) fn rows_of(
    directory: &Path,
    mission: &Pipeline,
    sampling: Sampling,
) -> Result<Ephemeris, Refusal> {
    // A mission that is solved may have been flown too.
    let has = |file: &str| directory.join(file).is_file();
    if mission.is_simulated() || has("states.csv") && !has("trajectory.csv") {
        let (headers, rows) = read_states(directory).map_err(refusal)?;
        return mission.ephemeris_of_record(&headers, &rows, sampling).map_err(refusal);
    }
    let posed = mission.pose().map_err(refusal)?;
    let trajectory = read_outcome_trajectory(directory, posed.flight()).map_err(refusal)?;
    let decisions = mission.decide().map_err(refusal)?;
    mission.ephemeris(&decisions, posed.flight(), &trajectory, sampling).map_err(refusal)
}
