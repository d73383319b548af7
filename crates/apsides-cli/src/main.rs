//! The `apsides` program: missions from a file to a verified trajectory.
//!
//! ```text
//! apsides missions                                  missions, and the keys of one
//! apsides bodies, apsides vehicles, apsides sites   data that missions name
//! apsides new problem my-problem.toml               a file to begin with: equations of one's own
//! apsides solve lunar-perilune --out results        solves and verifies; writes data and a report
//! apsides sweep lunar-perilune --set perilune_altitude_km=50,25,15 --out sweep.csv
//! apsides verify results                            checks stored results again
//! apsides certify brachistochrone_free_y other.csv  judges the trajectory of any program
//! ```
//!
//! The exit status is 0 for a verified result, 2 for bad input, 3 where nothing was solved, 4 where the result is not verified. What the
//! program does is in the libraries; it computes nothing by itself.

mod arguments;
mod certify;
mod commands;
mod figures;
mod footprint;
mod hazard;
mod hazard_features;
mod hazard_files;
mod montecarlo;
mod output;
mod progress;
mod reproduce;
mod simulate;
mod size;
mod sweep;
mod terrain;
mod tune;

use std::process::ExitCode;

use apsides::missions::data::{BODY, SITE, VEHICLE};
use clap::Parser;

use arguments::{Arguments, Command, TerrainCommand};
use output::Exit;

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Solve(a) => commands::solve(&a),
        Command::Simulate(a) => simulate::simulate(&a),
        Command::Tune(a) => tune::tune(&a),
        Command::Size(a) => size::size(&a),
        Command::Sweep(a) => sweep::run_sweep(&a),
        Command::Footprint(a) => footprint::footprint(&a),
        Command::Montecarlo(a) => montecarlo::montecarlo(&a),
        Command::Missions { name } => commands::missions(name.as_deref()),
        Command::New { kind, file } => commands::new(kind, file.as_deref()),
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
        Command::Verify { directory, json } => commands::verify(&directory, json),
    };
    let exit = result.unwrap_or_else(|sentence| {
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr().lock(), "apsides: {sentence}");
        Exit::BadInput
    });
    ExitCode::from(exit as u8)
}
