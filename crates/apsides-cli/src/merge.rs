//! `apsides merge`.

use std::path::{Path, PathBuf};

use apsides::pipeline::digest::sha256;
use apsides::pipeline::regular_file;
use apsides::pipeline::shard::{Joined, Part, SHARD, Shard};
use apsides_report::{merge_samples, recount};

use crate::arguments::MergeArguments;
use crate::commands::{claim, probe_directory};
use crate::exit::{Exit, Refusal, refusal};
use crate::montecarlo::{Shown, of_samples, show, table_of};
use crate::output::{print, print_json, warn};
use crate::progress::Progress;
use crate::speech::is_json;
use crate::sweep::{KEYS, PRICES};
use crate::sweep_file::{self, COMMAND, SweepFile};

pub(crate) fn merge(a: &MergeArguments) -> Result<Exit, Refusal> {
    let table = table_of(a.format)?;
    let mut parts = Vec::new();
    for place in &a.parts {
        for place in parts_of(place)? {
            let shard = Shard::read(&place.join(SHARD)).map_err(refusal)?;
            let mut part = Part { place, shard };
            if part.shard.command != COMMAND {
                recount(&mut part).map_err(|e| refusal(format!("{}: {e}", part.place.display())))?;
            }
            parts.push(part);
        }
    }
    let joined = Joined::of(parts, a.partly).map_err(refusal)?;
    if let Some(part) = joined.parts.iter().find(|part| is_same(&part.place, &a.out)) {
        return Err(format!("--out {}: is one of the parts; name another place", part.place.display()).into());
    }
    if !joined.levels.is_empty() {
        warn(&format!(
            "the parts come from machines whose arithmetic differs (vector instructions: {}): the last bits of a sample depend \
             on where it was computed (docs/campaigns.md)",
            joined.levels.join(", ")
        ));
    }
    joined.unfinished.iter().for_each(|sentence| warn(sentence));
    probe_directory(&a.out)?;
    let _lock = claim(&a.out)?;
    if joined.whole.command == COMMAND {
        return merge_sweep(a, &joined);
    }
    let progress = Progress::reading(joined.whole.count as u64, "samples");
    let merged = merge_samples(&a.out, &joined, table, &mut |more| progress.advance(more as u64));
    progress.finish();
    let (statistics, files) = merged?;
    for fault in &statistics.faults {
        warn(&fault.to_string());
    }
    let mission = &joined.whole.mission;
    show(&Shown { mission, statistics: &statistics, earlier: 0, files: &files })?;
    Ok(of_samples(&statistics).or(of_unfinished(&joined)))
}

/// The status of parts of which something is missing.
fn of_unfinished(joined: &Joined) -> Exit {
    if joined.unfinished.is_empty() { Exit::Verified } else { Exit::NotSolved }
}

/// Joins the tables of parts of a sweep.
fn merge_sweep(a: &MergeArguments, joined: &Joined) -> Result<Exit, Refusal> {
    let words = |name: &str| -> Vec<String> {
        let list = joined.whole.settings.get(name).and_then(|list| list.as_array());
        list.into_iter().flatten().filter_map(|word| word.as_str().map(str::to_owned)).collect()
    };
    let mut table = SweepFile::create(&a.out, words(KEYS).into_iter(), words(PRICES).into_iter())?;
    for part in &joined.parts {
        let of_part = |reason: String| refusal(format!("{}: {reason}", part.place.display()));
        let text =
            regular_file::read(&sweep_file::table_of(&part.place)).map_err(|e| of_part(e.to_string()))?;
        let stated = part.shard.rows_sha256.as_deref();
        if stated != Some(&sha256(&text)) {
            return Err(of_part("its rows are not those of its manifest: run its command again".into()));
        }
        let rows = table.append(&text).map_err(|e| of_part(e.sentence))?;
        if rows != part.shard.done {
            return Err(of_part(format!("it has {rows} rows, its manifest {}", part.shard.done)));
        }
    }
    let [rows, failed] = table.counts();
    let files = table.finish(&joined.whole.mission, Some(joined.whole.clone()))?;
    let exit = if failed > 0 { Exit::Failures } else { Exit::Verified };
    if is_json() {
        print_json(&serde_json::json!({ "cases": rows, "without_solution": failed }))?;
    } else {
        let failures =
            if failed > 0 { format!(", {failed} of them without a solution") } else { String::new() };
        print(&format!("{rows} cases of {}{failures}\n", joined.whole.mission));
        files.iter().for_each(|file| print(&format!("written: {file}\n")));
    }
    Ok(exit.or(of_unfinished(joined)))
}

/// A part, or the parts in a directory that is none.
fn parts_of(place: &Path) -> Result<Vec<PathBuf>, Refusal> {
    if place.join(SHARD).exists() || !place.is_dir() {
        return Ok(vec![place.into()]);
    }
    let entries = std::fs::read_dir(place).map_err(|e| refusal(format!("{}: {e}", place.display())))?;
    let paths = entries.filter_map(Result::ok).map(|entry| entry.path());
    let mut parts: Vec<PathBuf> = paths.filter(|path| path.join(SHARD).exists()).collect();
    if parts.is_empty() {
        return Ok(vec![place.into()]);
    }
    parts.sort();
    Ok(parts)
}

fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
