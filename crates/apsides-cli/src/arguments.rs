//! Command line of the program.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Spaceflight trajectory optimisation: solve missions, verify the answers.
#[derive(Debug, Parser)]
#[command(
    name = "apsides",
    version,
    about,
    after_help = "Examples:\n  \
        apsides missions\n  \
        apsides solve lunar-perilune --out results\n  \
        apsides solve lunar-direct --set thrust_n=500 --json\n  \
        apsides sweep lunar-perilune --set perilune_altitude_km=50,25,15 --out sweep.csv\n  \
        apsides footprint capsule-reentry --out footprint\n  \
        apsides verify results\n  \
        apsides reproduce lunar-landing --out reproduction\n\n\
        Exit status: 0 optimal and verified, 2 bad input, 3 not converged or infeasible, 4 solved but not verified."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Solve a mission and verify the answer.
    #[command(after_help = "Examples:\n  \
        apsides solve lunar-perilune --out results\n  \
        apsides solve my-mission.toml --set perilune_altitude_km=20 --set radau.points=6\n  \
        apsides solve lunar-perilune --sensitivity\n  \
        apsides solve lunar-two-phase --json --quiet")]
    Solve(SolveArguments),
    /// Solve a mission for every combination of values, each case started from its neighbour.
    #[command(after_help = "Examples:\n  \
        apsides sweep lunar-perilune --set perilune_altitude_km=50,25,20,15,10,5\n  \
        apsides sweep lunar-direct --set thrust_n=400,440,480 --set isp_s=310,320 --out sweep.csv\n  \
        apsides sweep capsule-reentry --set heat_rate_limit_kw_m2=inf,850,800,760 --sensitivity --figure prices.svg")]
    Sweep(SweepArguments),
    /// Find the ends that a mission can reach at the altitude of its target, under its limits.
    #[command(after_help = "Examples:\n  \
        apsides footprint capsule-reentry --out footprint\n  \
        apsides footprint capsule-reentry --set load_limit_m_s2=inf --bearings 72 --json")]
    Footprint(FootprintArguments),
    /// List the missions, or the keys of one.
    #[command(after_help = "Examples:\n  apsides missions\n  apsides missions lunar-perilune")]
    Missions {
        /// Show the keys of this mission with default, allowed values and meaning.
        name: Option<String>,
    },
    /// Read a mission and say whether it is well-posed, without solving it.
    #[command(
        after_help = "Examples:\n  apsides check my-mission.toml\n  apsides check lunar-direct --set thrust_n=500"
    )]
    Check(MissionArguments),
    /// Compute the tables of a publication again, or list the publications.
    #[command(
        after_help = "Examples:\n  apsides reproduce\n  apsides reproduce lunar-landing --out reproduction\n  \
                      apsides reproduce geo-injection --out reproduction"
    )]
    Reproduce(ReproduceArguments),
    /// Verify the results in a directory again: trajectory.csv against the equations of mission.toml.
    #[command(after_help = "Example:\n  apsides verify results")]
    Verify {
        /// Directory written by `solve --out`.
        directory: PathBuf,
        /// Print one JSON object on stdout.
        #[arg(long)]
        json: bool,
    },
}

/// A mission and its values.
#[derive(Debug, Args)]
pub(crate) struct MissionArguments {
    /// Mission file, or the name of a mission (see `apsides missions`).
    pub(crate) mission: String,
    /// Replace a value of the mission file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Method, short for `--set method=M`.
    #[arg(long, value_name = "M")]
    pub(crate) method: Option<String>,
}

/// Arguments that solves share.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// No progress on stderr.
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Threads to use; the results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: u32,
    /// Seed of everything random: searches.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
}

/// Arguments of `solve`.
#[derive(Debug, Args)]
pub(crate) struct SolveArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Write summary.json, trajectory.csv, certificate.json, mission.toml and report.html into this directory.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Keep the search of `--method two-layer` in this file; it goes on from there if the file exists.
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Print one JSON object on stdout and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    /// Say what one more unit of each number of vehicle and flight is worth; with --out also as sensitivity.json.
    #[arg(long)]
    pub(crate) sensitivity: bool,
    /// Say on stderr, before the first iteration, which constraints the guess violates most.
    #[arg(long)]
    pub(crate) explain: bool,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

/// Arguments of `sweep`.
#[derive(Debug, Args)]
pub(crate) struct SweepArguments {
    /// Mission file, or the name of a mission (see `apsides missions`).
    pub(crate) mission: String,
    /// Values of a key; may be repeated, all combinations are solved.
    #[arg(long = "set", value_name = "KEY=A,B,C")]
    pub(crate) set: Vec<String>,
    /// Method, short for `--set method=M`.
    #[arg(long, value_name = "M")]
    pub(crate) method: Option<String>,
    /// Write the rows with all results as CSV.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Say of each case what one more unit of the swept numbers is worth, in the objective's unit.
    #[arg(long)]
    pub(crate) sensitivity: bool,
    /// Draw the objective over the first swept number, with strokes as steep as its prices, and the prices below.
    #[arg(long, value_name = "FILE.svg", requires = "sensitivity")]
    pub(crate) figure: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

/// Arguments of `footprint`.
#[derive(Debug, Args)]
pub(crate) struct FootprintArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Bearings along which ends are sought; twice as many boundary points.
    #[arg(long, value_name = "N", default_value_t = 36, value_parser = clap::value_parser!(u32).range(3..=3600))]
    pub(crate) bearings: u32,
    /// Write footprint.csv, footprint.json and footprint.svg into this directory.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print one JSON object on stdout and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

/// Arguments of `reproduce`.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArguments {
    /// Name of the publication; all names are listed without one.
    pub(crate) name: Option<String>,
    /// Write reproduction.md, reproduction.csv and the figures into this directory.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}
