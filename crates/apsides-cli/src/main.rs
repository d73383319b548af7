//! The `apsides` program: missions from a file to a verified trajectory.
//!
//! ```text
//! apsides missions                                  missions, and the keys of one
//! apsides bodies, apsides vehicles, apsides sites   data that missions name
//! apsides new problem my-problem.toml               a file to begin with: equations of one's own
//! apsides solve lunar-perilune --out results        solves and verifies; writes data and a report
//! apsides sweep lunar-perilune --set perilune_altitude_km=50,25,15 --out sweep.csv
//! apsides merge shards --out flights                joins the parts of a large run
//! apsides campaign landing.toml                     the parts of one by Slurm, Dask or this machine
//! apsides verify results                            checks stored results again
//! apsides export results --step 1s --format oem     writes the flight for other programs
//! apsides certify brachistochrone_free_y other.csv  judges the trajectory of any program
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
mod montecarlo;
mod output;
mod progress;
mod reproduce;
mod sentence;
mod simulate;
mod size;
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
        // Help and version are such errors too.
        Err(e) => {
            if let Err(lost) = e.print() {
                output::unprinted(&lost);
            }
            return if e.use_stderr() { Exit::BadInput } else { Exit::Verified };
        }
    };
    let set = arguments.command.set().to_vec();
    match command(arguments.command) {
        Ok(exit) => stop::status_of(exit),
        Err(refusal) => {
            output::say(&sentence::with_set(stop::with_reason(refusal.sentence), &set));
            stop::status_of(refusal.exit)
        }
    }
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
        Command::Missions { name } => commands::missions(name.as_deref()),
        Command::New { kind, file } => commands::new(kind, file.as_deref()),
        Command::Schema => commands::schema(),
        Command::Bodies => commands::named_data(BODY),
        Command::Vehicles => commands::named_data(VEHICLE),
        Command::Sites => commands::named_data(SITE),
        Command::Check(a) => commands::check(&a),
        Command::Reproduce(a) => reproduce::reproduce(&a),
        Command::Hazard(a) => hazard::hazard(&a),
        Command::Terrain(TerrainCommand::Gen(a)) => terrain::generate(&a),
        Command::Terrain(TerrainCommand::Info { map, json }) => terrain::info(&map, json),
        Command::Problems { name } => certify::problems(name.as_deref()),
        Command::Certify(a) => certify::certify(&a),
        Command::Export(a) => export::export(&a),
        Command::Verify { directory, json } => verify::verify(&directory, json),
    }
}
