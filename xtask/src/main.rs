//! Developer tasks of the workspace, run as `cargo xtask TASK`.
//!
//! The program shells out to cargo and the `apsides` program and links none of our crates, so that it builds in seconds.
//!
//! | module | subject |
//! | --- | --- |
//! | `ci` | everything a change must pass |
//! | `layers`, `circles`, `signatures` | which crate and which module depends on which, and what an interface may name |
//! | `tidy` | rules of style that rustfmt and clippy do not know |
//! | `table` | generated documents |
//! | `book` | commands of the pages in docs, and the book of them |
//! | `bench` | benchmarks, and the same problems in other programs |
//! | `package` | every crate as a package, used by a project of its own |
//! | `release` | the order of crates and the one version of all |
//! | `supply` | licences and sources of dependencies, the bill of materials |
//! | `demand` | checks by tools that need not be there: cargo-deny, cargo-fuzz, SciPy |
//! | `python` | the wheel of the Python package, tested in a fresh environment |
//! | `cluster`, `engines` | campaigns by Slurm and Dask on this machine, held against a single run |
//! | `campaign_report`, `processor_time` | their times |
//! | `vector_levels` | results on processors of several levels of vector instructions |
//! | `readme`, `crate_readme` | the commands of README.md; README.md of each crate |
//! | `source`, `workspace`, `command` | Rust text without comments, packages, processes |

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

use std::process::ExitCode;

mod bench;
mod book;
mod book_site;
mod campaign_report;
mod ci;
mod circles;
mod cluster;
mod command;
mod crate_readme;
mod demand;
mod engines;
mod finding;
mod layers;
mod map;
mod package;
mod processor_time;
mod python;
mod readme;
mod release;
mod signatures;
mod source;
mod supply;
mod table;
mod tidy;
mod type_names;
mod vector_levels;
mod workspace;

use command::{cargo, run};
use workspace::Workspace;

const HELP: &str = "\
Developer tasks of the apsides workspace.

Usage: cargo xtask TASK [ARGS]

Tasks:
  ci                 all checks and tests in order, each with its time; stops at the first failure
  layers             dependencies between our crates, owners of heavy dependencies, import circles, public signatures
  tidy               file length, module names, documentation, leftovers, whitespace, links, machine paths
  doc                documentation of the workspace; warnings are errors
  mission NAME ...   solves a mission with the release build; further arguments go to `apsides solve`
  table [--check]    writes docs/gallery.md; --check fails if it is out of date (times and rounding aside)
  readmes [--check]  writes README.md of each crate from its documentation; --check fails if one is out of date
  examples           runs the examples of every crate
  features           each feature of each crate checked without the others
  package [CRATE ..] packages all crates, builds a project of its own and the tests of each, or of those named;
                     prints how many crates each needs and the time of the build
  python             the wheel of the Python package, its tests and its tutorial in a fresh environment
  torture            2000 alterations of each kind of file that the program reads; every key of every mission at extreme values,
                     checked and solved for two seconds each; hours
  fuzz [SECONDS]     each fuzz target for so long, 20 s without a number; needs nightly and cargo-fuzz
  exports            ephemerides and the schema read by programs of others; left out where Python has none
  fly                trajectories of missions flown again by SciPy; left out where Python has none
  cluster            a campaign by Slurm and by Dask on this machine, a worker killed on the way, held against a single run;
                     an engine that cannot be installed is left out
  campaign-report [--open-loop N] [--replanned N] [--shards N]
                     times and processor times of campaigns by processes, Slurm and Dask against single runs, and of
                     joins by their rows, as tables in target/campaign-report.md; 1000000 and 20000 flights in 20 shards
  vector-levels      results on processors of several levels of vector instructions, by QEMU; left out where it is not there
  deny               licences and sources of dependencies by deny.toml, and what cargo-deny checks besides where it is there
  sbom [FILE]        bill of materials of the program, CycloneDX 1.5 as JSON
  release [..]       the order in which crates go to the registry, and what has to stand before; --dry-run: cargo goes through
                     it and uploads nothing; --set VERSION: another version for all crates
  book               commands of the pages in docs, and the book itself where mdbook is installed
  bless              accepts the present counters of the workspace tests as the golden ones
  bench [--peers] .. criterion benches of kkt, nlp and radau, further arguments go to criterion; --peers: the same
                     works by other programs instead, in a fresh environment, with docs/benchmarks.md; a quarter of an hour;
                     --only NAME .. for some of them
  help               this text";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match perform(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the task that the arguments name.
fn perform(arguments: &[String]) -> Result<(), String> {
    let (task, rest) = match arguments {
        [] => ("help", &[][..]),
        [task, rest @ ..] => (task.as_str(), rest),
    };
    if matches!(task, "help" | "--help" | "-h") || rest.iter().any(|a| a == "--help" && task != "mission") {
        println!("{HELP}");
        return Ok(());
    }
    match task {
        "ci" => no_arguments(task, rest).and_then(|()| ci::run(&Workspace::load()?)),
        "layers" => no_arguments(task, rest).and_then(|()| layers::run(&Workspace::load()?)),
        "tidy" => no_arguments(task, rest).and_then(|()| tidy::run(&Workspace::load()?)),
        "doc" => no_arguments(task, rest).and_then(|()| doc(&Workspace::load()?)),
        "mission" => mission(&Workspace::load()?, rest),
        "table" => match rest {
            [] => table::write(&Workspace::load()?),
            [check] if check == "--check" => table::check(&Workspace::load()?),
            _ => Err(format!("`table` takes `--check` or nothing, not `{}`", rest.join(" "))),
        },
        "readmes" => match rest {
            [] => crate_readme::write(&Workspace::load()?),
            [check] if check == "--check" => crate_readme::check(&Workspace::load()?),
            _ => Err(format!("`readmes` takes `--check` or nothing, not `{}`", rest.join(" "))),
        },
        "examples" => no_arguments(task, rest).and_then(|()| examples(&Workspace::load()?)),
        "features" => no_arguments(task, rest).and_then(|()| package::features(&Workspace::load()?)),
        "package" => package::run(&Workspace::load()?, rest),
        "python" => no_arguments(task, rest).and_then(|()| python::build(&Workspace::load()?)),
        "torture" => no_arguments(task, rest).and_then(|()| torture(&Workspace::load()?)),
        "fuzz" => demand::fuzz(&Workspace::load()?, rest),
        "exports" => no_arguments(task, rest).and_then(|()| demand::exports_if_there(&Workspace::load()?)),
        "fly" => no_arguments(task, rest).and_then(|()| demand::fly_if_there(&Workspace::load()?)),
        "cluster" => no_arguments(task, rest).and_then(|()| cluster::run_if_there(&Workspace::load()?)),
        "campaign-report" => campaign_report::report(&Workspace::load()?, rest),
        "vector-levels" => {
            no_arguments(task, rest).and_then(|()| vector_levels::run_if_there(&Workspace::load()?))
        }
        "deny" => no_arguments(task, rest).and_then(|()| demand::deny(&Workspace::load()?)),
        "sbom" => supply::bill(&Workspace::load()?, rest),
        "book" => no_arguments(task, rest).and_then(|()| book::run_book(&Workspace::load()?)),
        "release" => release::run(&Workspace::load()?, rest),
        "bless" => no_arguments(task, rest).and_then(|()| bless(&Workspace::load()?)),
        "bench" => bench::run_benches(&Workspace::load()?, rest),
        _ => Err(format!("no task `{task}`; `cargo xtask help` lists them")),
    }
}

fn no_arguments(task: &str, rest: &[String]) -> Result<(), String> {
    if rest.is_empty() {
        return Ok(());
    }
    Err(format!("`{task}` takes no arguments, not `{}`", rest.join(" ")))
}

/// Documentation of our crates; a warning is an error.
fn doc(workspace: &Workspace) -> Result<(), String> {
    let mut doc = cargo(&workspace.root, ["doc", "--no-deps", "--workspace", "--locked"]);
    run(doc.env("RUSTDOCFLAGS", "-D warnings"))
}

/// Runs the examples of all crates, which assert what they print.
fn examples(workspace: &Workspace) -> Result<(), String> {
    run(&mut cargo(&workspace.root, ["build", "--workspace", "--examples", "--locked"]))?;
    for package in workspace.packages.iter().filter(|p| p.folder.starts_with("crates")) {
        for example in &package.examples {
            // Run as built: `cargo run -p` would build each crate's dependencies with features of its own.
            let name = format!("{example}{}", std::env::consts::EXE_SUFFIX);
            run(std::process::Command::new(workspace.target.join("debug/examples").join(name))
                .current_dir(&workspace.root))?;
        }
    }
    Ok(())
}

fn mission(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    if arguments.is_empty() {
        return Err("`mission` takes the name of a mission or a mission file".into());
    }
    let mut solve = cargo(&workspace.root, ["run", "--release", "-p", "apsides-cli", "--", "solve"]);
    run(solve.args(arguments))
}

/// Alterations of each kind of file by `torture`.
const MUTATIONS: &str = "2000";

/// All of the properties that the tests have samples of.
fn torture(workspace: &Workspace) -> Result<(), String> {
    let test =
        ["test", "--release", "-p", "apsides-cli", "--test", "mutations", "--locked", "--", "--nocapture"];
    run(cargo(&workspace.root, test).env("APSIDES_MUTATIONS", MUTATIONS))?;
    let test = ["test", "--release", "-p", "apsides-cli", "--test", "torture", "--locked"];
    run(cargo(&workspace.root, test).args(["--", "--ignored", "--nocapture"]))
}

fn bless(workspace: &Workspace) -> Result<(), String> {
    run(cargo(&workspace.root, ["test", "-p", "apsides-tests"]).env("APSIDES_BLESS", "1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn help_and_refusals() {
        assert_eq!(perform(&[]), Ok(()));
        assert_eq!(perform(&words("tidy --help")), Ok(()));
        assert!(perform(&words("tidi")).unwrap_err().contains("no task `tidi`"));
        assert!(perform(&words("tidy all")).unwrap_err().contains("takes no arguments"));
        assert!(perform(&words("mission")).unwrap_err().contains("name of a mission"));
        assert!(perform(&words("readmes --chek")).unwrap_err().contains("--check"));
        assert!(perform(&words("package apsides-warp")).unwrap_err().contains("apsides-warp"));
        assert!(perform(&words("table --chek")).unwrap_err().contains("--check"));
    }

    #[test]
    fn every_task_is_in_the_help() {
        for task in [
            "ci",
            "layers",
            "tidy",
            "doc",
            "mission",
            "table",
            "readmes",
            "examples",
            "features",
            "package",
            "bless",
            "release",
            "bench",
            "torture",
            "fuzz",
            "exports",
            "fly",
            "cluster",
            "campaign-report",
            "vector-levels",
            "deny",
            "sbom",
        ] {
            assert!(HELP.lines().any(|l| l.split_whitespace().next() == Some(task)), "{task}");
        }
    }
}
