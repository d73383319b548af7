//! Everything that a change must pass, in order of cost.

use std::time::{Duration, Instant};

use crate::command::{cargo, run as run_command, run_keeping, written};
use crate::workspace::Workspace;
use crate::{
    book, cluster, crate_readme, demand, doc, examples, layers, package, python, readme, supply, table, tidy,
};

/// A step: its name and what it does.
type Step = (&'static str, fn(&Workspace) -> Result<(), String>);

const STEPS: &[Step] = &[
    ("fmt", |w| run_command(&mut cargo(&w.root, ["fmt", "--all", "--check"]))),
    ("layers", layers::run),
    ("tidy", tidy::run),
    ("readmes", crate_readme::check),
    ("clippy", |w| {
        let lint = ["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"];
        run_command(&mut cargo(&w.root, lint))
    }),
    ("features", package::features),
    ("doc", doc),
    ("test", test),
    ("examples", examples),
    ("missions", missions),
    ("table", table::check),
    ("readme", first_command),
    ("book", book::run_book),
    ("deny", demand::deny),
    ("sbom", |w| supply::bill(w, &[])),
    ("fly", demand::fly_if_there),
    ("exports", demand::exports_if_there),
    ("cluster", cluster::run_if_there),
    ("python", python::run_if_there),
];

/// Runs all steps; stops at the first that fails.
pub(crate) fn run(workspace: &Workspace) -> Result<(), String> {
    let mut times: Vec<(&str, Duration)> = Vec::new();
    for (k, (name, step)) in STEPS.iter().enumerate() {
        println!("== {}/{} {name}", k + 1, STEPS.len());
        let clock = Instant::now();
        let result = step(workspace);
        let time = clock.elapsed();
        println!("-- {name}: {:.1} s", time.as_secs_f64());
        times.push((name, time));
        result.map_err(|e| format!("step `{name}` failed: {e}"))?;
    }
    println!("== all {} steps passed", STEPS.len());
    for (name, time) in &times {
        println!("{name:>10} {:8.1} s", time.as_secs_f64());
    }
    println!("{:>10} {:8.1} s", "total", times.iter().map(|t| t.1.as_secs_f64()).sum::<f64>());
    Ok(())
}

fn read_readme(workspace: &Workspace) -> Result<String, String> {
    std::fs::read_to_string(workspace.root.join("README.md")).map_err(|e| format!("README.md: {e}"))
}

/// The test command of the README, and what its closing lines add up to.
fn test(workspace: &Workspace) -> Result<(), String> {
    let line = readme::test_command(&read_readme(workspace)?)?;
    let closing = run_keeping(&mut written(&workspace.root, &line)?, |l| l.starts_with("test result:"))?;
    let tally = Tally::of(&closing);
    println!(
        "{} passed; {} failed; {} ignored in {} binaries",
        tally.passed,
        tally.failed,
        tally.ignored,
        closing.len()
    );
    if tally.passed == 0 { Err(format!("`{line}` ran no test")) } else { Ok(()) }
}

/// Directory of the mission files.
const MISSIONS: &str = "crates/apsides-missions/missions/";

/// Every mission file is well-formed.
fn missions(workspace: &Workspace) -> Result<(), String> {
    let files = workspace.files()?;
    let is_mission = |f: &&String| {
        f.strip_prefix(MISSIONS).is_some_and(|name| name.ends_with(".toml") && !name.contains('/'))
    };
    for file in files.iter().filter(is_mission) {
        run_command(&mut cargo(
            &workspace.root,
            ["run", "--quiet", "--release", "-p", "apsides-cli", "--", "check", file],
        ))?;
    }
    Ok(())
}

/// Runs the command that a new reader types first.
fn first_command(workspace: &Workspace) -> Result<(), String> {
    run_command(&mut written(&workspace.root, &readme::first_command(&read_readme(workspace)?)?)?)
}

/// Sums over the closing lines of test binaries.
#[derive(Debug, Default, PartialEq, Eq)]
struct Tally {
    passed: usize,
    failed: usize,
    ignored: usize,
}

impl Tally {
    /// Adds up lines like `test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out`.
    fn of(lines: &[String]) -> Self {
        let mut tally = Self::default();
        for part in lines.iter().flat_map(|l| l.split([';', '.'])) {
            let mut words = part.split_whitespace();
            let (Some(Ok(count)), Some(what)) = (words.next().map(str::parse::<usize>), words.next()) else {
                continue;
            };
            match what {
                "passed" => tally.passed += count,
                "failed" => tally.failed += count,
                "ignored" => tally.ignored += count,
                _ => {}
            }
        }
        tally
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_lines_add_up() {
        let lines = [
            "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.12s",
            "test result: FAILED. 40 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 9.00s",
        ];
        let tally = Tally::of(&lines.map(str::to_owned));
        assert_eq!(tally, Tally { passed: 43, failed: 2, ignored: 1 });
    }
}
