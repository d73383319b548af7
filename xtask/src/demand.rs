//! Checks by tools that need not be there: without them a sentence says how to get them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::command::{cargo, run};
use crate::supply;
use crate::workspace::Workspace;

/// Seconds of a fuzz target that nobody states.
const SHORT: u32 = 20;

/// True if cargo has a subcommand.
fn has(workspace: &Workspace, toolchain: &[&str], subcommand: &str) -> bool {
    let mut probe = Command::new("cargo");
    probe.current_dir(&workspace.root).args(toolchain).args([subcommand, "--version"]);
    probe.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// Licences and sources of all dependencies by `deny.toml`; where `cargo deny` is there, what it checks besides, and advisories where it has
/// their database.
pub(crate) fn deny(workspace: &Workspace) -> Result<(), String> {
    supply::check(workspace)?;
    if !has(workspace, &[], "deny") {
        println!("left out: bans and advisories: `cargo install --locked cargo-deny` gets the tool");
        return Ok(());
    }
    run(&mut cargo(&workspace.root, ["deny", "--offline", "check", "licenses", "bans", "sources"]))?;
    if !advisories_are_there() {
        println!("left out: advisories: `cargo deny fetch db` gets their database");
        return Ok(());
    }
    run(&mut cargo(&workspace.root, ["deny", "--offline", "check", "advisories"]))
}

/// True if `cargo deny` has fetched a database of advisories.
fn advisories_are_there() -> bool {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")));
    let databases = home.and_then(|home| std::fs::read_dir(home.join("advisory-dbs")).ok());
    databases.is_some_and(|mut found| found.any(|entry| entry.is_ok_and(|e| e.path().is_dir())))
}

/// Fuzz targets, and the folders of files from which each begins. What a run finds besides stays in `fuzz/corpus`.
const FUZZ_TARGETS: [(&str, &[&str]); 4] = [
    ("read_map", &["crates/apsides-terrain/tests/io/written_elsewhere"]),
    ("read_mission", &["fuzz/seeds/read_mission", "crates/apsides-missions/missions"]),
    ("read_problem", &["tests/problems", "crates/apsides-missions/missions/problem"]),
    ("read_results", &["fuzz/seeds/read_results"]),
];

/// Every fuzz target for so many seconds.
pub(crate) fn fuzz(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    let seconds = match arguments {
        [] => SHORT,
        [text] => text.parse().map_err(|_| format!("`fuzz` takes a number of seconds, not `{text}`"))?,
        _ => return Err(format!("`fuzz` takes a number of seconds, not `{}`", arguments.join(" "))),
    };
    if !has(workspace, &["+nightly"], "fuzz") {
        return Err("`cargo +nightly fuzz` is not there: `cargo install --locked cargo-fuzz` and a nightly toolchain get it".into());
    }
    for (target, seeds) in FUZZ_TARGETS {
        // What is found is written into the first folder.
        let corpus = workspace.root.join("fuzz/corpus").join(target);
        std::fs::create_dir_all(&corpus).map_err(|e| format!("{}: {e}", corpus.display()))?;
        let mut command = Command::new("cargo");
        command
            .current_dir(&workspace.root)
            .args(["+nightly", "fuzz", "run", target])
            .arg(corpus)
            .args(seeds);
        run(command.args([
            "--",
            &format!("-max_total_time={seconds}"),
            "-timeout=20",
            "-rss_limit_mb=2048",
        ]))?;
    }
    Ok(())
}

/// Missions whose equations `tests/references/fly.py` knows.
const FLOWN: [&str; 7] = [
    "lunar-direct",
    "lunar-perilune",
    "lunar-two-phase",
    "lunar-coast",
    "lunar-throttled",
    "lunar-vertical",
    "chang-e-3-braking",
];

/// Returns true if `python3` imports modules; says what gets them otherwise.
fn python_has(modules: &str) -> bool {
    let mut probe = Command::new("python3");
    let import = format!("import {modules}");
    let found = probe.args(["-c", &import]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    let has = found.is_ok_and(|status| status.success());
    if !has {
        println!(
            "left out: `python3` lacks one of {modules}: `pip install -r tests/references/requirements.txt` gets it"
        );
    }
    has
}

/// Missions, one of them the file of a problem, whose ephemerides are read by other programs, with the command, what follows the mission, and the formats beside those of all.
const EXPORTED: [(&str, &str, &[&str], &str); 8] = [
    ("lunar-two-phase", "solve", &[], ""),
    ("chang-e-3", "solve", &[], ""),
    ("chang-e-3-flat", "solve", &["--set", "epoch=2027-05-04T03:02:01.5 UTC"], ""),
    ("geo-2-burn", "solve", &["--set", "frame.node_deg=40", "--set", "frame.inclination_deg=51.6"], ""),
    ("geo-3-burn", "solve", &["--set", "frame.reference=icrf", "--set", "epoch=2027-05-04T03:02:01 TAI"], ""),
    ("capsule-reentry", "solve", &["--set", "epoch=1999-12-31T23:59:00 UTC"], ""),
    ("moving-mass-cross", "simulate", &["--set", "earth=ellipsoid"], ",aem"),
    ("tests/references/lunar-orbit-raise.toml", "solve", &[], ""),
];

/// Ephemerides of missions, and the schema of mission files, read by programs of others; left out with a sentence where Python does not have
/// them.
pub(crate) fn exports_if_there(workspace: &Workspace) -> Result<(), String> {
    samples_if_there(workspace)?;
    if !python_has("astropy, ccsds_ndm, jsonschema, oem, spiceypy, tomllib") {
        return Ok(());
    }
    let out = workspace.target.join("exports");
    let program = ["run", "--quiet", "--release", "-p", "apsides-cli", "--"];
    run(&mut cargo(&workspace.root, ["build", "--quiet", "--release", "-p", "apsides-cli"]))?;
    let mut read = Command::new("python3");
    read.current_dir(&workspace.root).arg("tests/references/exports.py");
    read.arg(workspace.target.join("release").join("apsides"));
    for (mission, command, values, further) in EXPORTED {
        let results = out.join(Path::new(mission).file_stem().unwrap_or_default());
        let formats = format!("csv,json,npz,oem,opm,czml{further}");
        let mut export = cargo(&workspace.root, program);
        export.args([command, mission, "--quiet", "--points", "500", "--format", &formats]).args(values);
        run(export.arg("--out").arg(&results))?;
        read.arg(results);
    }
    run(&mut read)
}

/// Samples as Parquet, of more rows than a row group has, read by pyarrow; left out with a sentence where Python does not have it.
fn samples_if_there(workspace: &Workspace) -> Result<(), String> {
    if !python_has("pyarrow.parquet") {
        return Ok(());
    }
    let out = workspace.target.join("exports").join("samples");
    let program = ["run", "--quiet", "--release", "-p", "apsides-cli", "--features", "parquet", "--"];
    let mut fly = cargo(&workspace.root, program);
    fly.args(["montecarlo", "chang-e-3-braking", "--position-m", "333", "--samples", "70000", "--quiet"]);
    run(fly.args(["--format", "parquet", "--out"]).arg(&out))?;
    let mut read = Command::new("python3");
    read.current_dir(&workspace.root).arg("tests/references/samples.py").arg(&out);
    run(&mut read)
}

/// Trajectories of missions flown again by SciPy; left out with a sentence where Python has none.
pub(crate) fn fly_if_there(workspace: &Workspace) -> Result<(), String> {
    if !python_has("scipy, tomllib") {
        return Ok(());
    }
    let out = workspace.target.join("fly");
    let mut fly = Command::new("python3");
    fly.current_dir(&workspace.root).arg("tests/references/fly.py");
    for mission in FLOWN {
        let results = out.join(mission);
        let solve = ["run", "--quiet", "--release", "-p", "apsides-cli", "--", "solve", mission, "--quiet"];
        run(cargo(&workspace.root, solve).arg("--out").arg(&results))?;
        fly.arg(results);
    }
    run(&mut fly)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fuzz_target_is_listed_with_seeds_that_are_there() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let entries = std::fs::read_dir(root.join("fuzz/fuzz_targets")).unwrap();
        let mut targets: Vec<String> =
            entries.map(|e| e.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned()).collect();
        targets.sort();
        assert_eq!(targets, FUZZ_TARGETS.map(|(target, _)| target));
        for folder in FUZZ_TARGETS.iter().flat_map(|(_, seeds)| *seeds) {
            assert!(std::fs::read_dir(root.join(folder)).unwrap().count() > 0, "{folder}");
        }
    }
}
