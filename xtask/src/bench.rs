//! Benchmarks: criterion benches of the solver crates, and the same problems in other programs.

use std::process::Command;

use crate::command::{cargo, run};
use crate::python;
use crate::workspace::Workspace;

/// Crates whose speed decides a solve.
const MEASURED: &[&str] = &["apsides-kkt", "apsides-nlp", "apsides-radau"];

/// Runs all comparisons with other programs.
const PEERS: &str = "benches/peers/compare.py";

/// The other programs, by their versions.
const REQUIREMENTS: &str = "benches/peers/requirements.txt";

/// Runs the benches, with the arguments for criterion; `--peers` runs the comparisons with other programs instead, with the arguments for
/// their script.
pub(crate) fn run_benches(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    let (peers, others): (Vec<_>, Vec<_>) = arguments.iter().partition(|a| *a == "--peers");
    if !peers.is_empty() {
        return compare(workspace, &others);
    }
    let mut bench = cargo(&workspace.root, ["bench"]);
    let mut any = false;
    for name in MEASURED {
        let package = workspace.package(name)?;
        if package.benches.is_empty() {
            println!("{name} has no benches");
            continue;
        }
        any = true;
        bench.args(["-p", name]);
        // By name: the libraries' own test harness does not know criterion's arguments.
        for target in &package.benches {
            bench.args(["--bench", target]);
        }
    }
    if any { run(bench.arg("--").args(others)) } else { Ok(()) }
}

/// Runs the comparisons in an environment that has the other programs.
fn compare(workspace: &Workspace, arguments: &[&String]) -> Result<(), String> {
    let environment = workspace.target.join("peers");
    let python = python::program(&environment, "python");
    if !python.exists() {
        python::environment(&environment)?;
    }
    python::pip(
        &environment,
        &["--requirement".into(), workspace.root.join(REQUIREMENTS).display().to_string()],
    )?;
    let summary = workspace.target.join("summary.json");
    let mut scripts = Command::new(python);
    scripts.current_dir(&workspace.root).arg(PEERS).arg("--summary").arg(summary).args(arguments);
    run(scripts.env("CARGO_TARGET_DIR", &workspace.target))
}
