//! `apsides export`.

use apsides_report::{read_outcome_trajectory, read_states, replace};

use crate::arguments::{ExportArguments, allowed_memory};
use crate::commands::{claim, probe_directory};
use crate::ephemeris::files;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, written};

const MISSION: &str = "mission.toml";

/// Keys that an export may replace: all others belong to the flight that was solved.
const REPLACEABLE: [&str; 2] = ["epoch", "frame."];

pub(crate) fn export(a: &ExportArguments) -> Result<Exit, Refusal> {
    let file = a.directory.join(MISSION);
    if !file.is_file() {
        return Err(refusal(format!(
            "{}: no result directory (it has no {MISSION}); give one that `apsides solve --out` or `apsides simulate --out` wrote",
            a.directory.display()
        )));
    }
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
    let table = match mission.is_simulated() || !a.directory.join("trajectory.csv").is_file() {
        true => {
            let (headers, rows) = read_states(&a.directory).map_err(refusal)?;
            mission.ephemeris_of_record(&headers, &rows, sampling)
        }
        false => {
            let posed = mission.pose().map_err(refusal)?;
            let trajectory = read_outcome_trajectory(&a.directory, posed.flight()).map_err(refusal)?;
            let decisions = mission.decide().map_err(refusal)?;
            mission.ephemeris(&decisions, posed.flight(), &trajectory, sampling)
        }
    };
    let files = replace(out, &files(&table.map_err(refusal)?, &a.format)?)?;
    print(written(&files).trim_start());
    Ok(Exit::Verified)
}
