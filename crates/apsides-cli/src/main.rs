//! The `apsides` program: missions from a file to a verified trajectory.
//!
//! ```text
//! apsides missions                                  missions, and the keys of one
//! apsides bodies, apsides vehicles, apsides sites   data that missions name
//! apsides new problem my-problem.toml               a file to begin with: equations of one's own
//! apsides solve lunar-perilune --out results        solves and verifies; writes data and a report
//! apsides sweep lunar-perilune --set perilune_altitude_km=50,25,15 --out sweep
//! apsides merge shards --out flights                joins the parts of a large run
//! apsides campaign landing.toml                     the parts of one by Slurm, Dask or this machine
//! apsides verify results                            checks stored results again
//! apsides compare first second                      lays results beside each other
//! apsides export results --step 1s --format oem     writes the flight for other programs
//! apsides certify brachistochrone_free_y other.csv  judges the trajectory of any program
//! apsides completions bash, apsides man             for the shell and its manual
//! ```
//!
//! The exit statuses of all commands are in one table (`exit.rs`), which `apsides --help` shows. What the program does is in the libraries; it
//! computes nothing by itself.
#![cfg_attr(
    not(test),
    warn(
        clippy::expect_used,
        clippy::panic,
        clippy::unimplemented,
        clippy::unreachable,
        clippy::indexing_slicing,
        clippy::string_slice
    )
)]

mod arguments;
mod campaign;
mod certify;
mod commands;
mod compare;
mod ephemeris;
mod exit;
mod export;
mod figures;
mod footprint;
mod hazard;
mod hazard_features;
mod hazard_files;
mod hazard_watch;
mod merge;
mod missions;
mod montecarlo;
mod output;
mod progress;
mod reproduce;
mod sentence;
mod shell_files;
mod simulate;
mod size;
mod speech;
mod stop;
mod sweep;
mod sweep_file;
mod terrain;
mod tune;
mod verify;

use std::process::ExitCode;

use apsides::missions::data::{BODY, SITE, VEHICLE};
use clap::Parser;

use arguments::{Arguments, Command, TerrainCommand};
use exit::{Exit, Refusal};

/// Keeps the memory of a solve for the next one, where others give it back to the system each time.
#[cfg(feature = "mimalloc")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    stop::catch_signals();
    // A panic is a fault: what is half written is taken away as it unwinds.
    let exit = std::panic::catch_unwind(run).unwrap_or(Exit::Fault);
    let exit = match output::lost() {
        Some(why) => {
            output::say(&format!("stdout could not be written: {why}"));
            exit.or(Exit::Unwritten)
        }
        None => exit,
    };
    ExitCode::from(exit as u8)
}

fn run() -> Exit {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(e) => return unparsed(&e),
    };
    speech::speak(arguments.speech);
    let set = arguments.command.set().to_vec();
    match command(arguments.command) {
        Ok(exit) => stop::status_of(exit),
        Err(refusal) => {
            let exit = stop::status_of(refusal.exit);
            output::say_last(&sentence::with_set(stop::with_reason(refusal.sentence), &set), exit);
            exit
        }
    }
}

/// Shows help or version, which are errors of the parser too, or what is wrong with the command line.
fn unparsed(e: &clap::Error) -> Exit {
    speech::speak_as_asked(std::env::args_os());
    if e.use_stderr() && speech::is_json() {
        let text = e.render().to_string();
        output::say_last(text.trim_end().trim_start_matches("error: "), Exit::BadInput);
    } else if let Err(lost) = e.print() {
        output::unprinted(&lost);
    }
    if e.use_stderr() { Exit::BadInput } else { Exit::Verified }
}

fn command(command: Command) -> Result<Exit, Refusal> {
    match command {
        Command::Solve(a) => commands::solve(&a),
        Command::Simulate(a) => simulate::simulate(&a),
        Command::Tune(a) => tune::tune(&a),
        Command::Size(a) => size::size(&a),
        Command::Sweep(a) => sweep::run_sweep(&a),
        Command::Footprint(a) => footprint::footprint(&a),
        Command::Montecarlo(a) => montecarlo::montecarlo(&a),
        Command::Merge(a) => merge::merge(&a),
        Command::Campaign(a) => campaign::campaign(&a),
        Command::Missions { name, all } => missions::missions(name.as_deref(), all),
        Command::New { kind, file } => missions::new(kind, file.as_deref()),
        Command::Schema => missions::schema(),
        Command::Bodies => missions::named_data(BODY),
        Command::Vehicles => missions::named_data(VEHICLE),
        Command::Sites => missions::named_data(SITE),
        Command::Check(a) => missions::check(&a),
        Command::Reproduce(a) => reproduce::reproduce(&a),
        Command::Hazard(a) => hazard::hazard(&a),
        Command::Terrain(TerrainCommand::Gen(a)) => terrain::generate(&a),
        Command::Terrain(TerrainCommand::Info(map)) => terrain::info(&map),
        Command::Problems { name } => certify::problems(name.as_deref()),
        Command::Certify(a) => certify::certify(&a),
        Command::Compare(a) => compare::compare(&a),
        Command::Export(a) => export::export(&a),
        Command::Verify { directory } => verify::verify(&directory),
        Command::Completions { shell } => shell_files::completions(shell),
        Command::Man { out } => shell_files::man(out.as_deref()),
    }
}
