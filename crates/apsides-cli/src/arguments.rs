//! Command line of the program.

mod campaign;
mod certify;
mod compare;
mod ephemeris;
mod merge;
mod run;
mod speech;
mod terrain;
mod words;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

use crate::exit::statuses;

pub(crate) use campaign::{CampaignArguments, OnInterrupt};
pub(crate) use certify::CertifyArguments;
pub(crate) use compare::CompareArguments;
pub(crate) use ephemeris::{EphemerisArguments, ExportArguments};
pub(crate) use merge::MergeArguments;
pub(crate) use run::{RunArguments, Threads, TimeLimit, allowed_memory};
pub(crate) use speech::Speech;
pub(crate) use terrain::{GenArguments, Ground, HazardArguments, MapArguments, Rule, TerrainCommand};
pub(crate) use words::{GuidanceWord, NewKind, SampleFormat};

/// Spaceflight trajectory optimisation: solve missions, verify the answers.
#[derive(Debug, Parser)]
#[command(
    name = "apsides",
    version,
    about,
    after_help = format!("Examples:\n  \
        apsides missions\n  \
        apsides new problem my-problem.toml\n  \
        apsides solve lunar-perilune --out results\n  \
        apsides solve lunar-direct --set thrust_n=500 --json\n  \
        apsides simulate moving-mass-cross --out descent\n  \
        apsides sweep lunar-perilune --set perilune_altitude_km=50,25,15 --out sweep\n  \
        apsides footprint capsule-reentry --out footprint\n  \
        apsides verify results\n  \
        apsides reproduce lunar-landing --out reproduction\n  \
        apsides hazard map.tif --criteria chang-e-3-fine --out hazards\n\n{}", statuses())
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) speech: Speech,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The command.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Solve a mission and verify the answer.
    #[command(after_help = "Examples:\n  \
        apsides solve lunar-perilune --out results\n  \
        apsides solve my-mission.toml --set perilune_altitude_km=20 --set radau.points=6\n  \
        apsides solve lunar-perilune --sensitivity\n  \
        apsides solve lunar-perilune --out results --step 1s --format csv,oem\n  \
        apsides solve lunar-two-phase --json --quiet")]
    Solve(SolveArguments),
    /// Simulate a mission under its law: a descent with moving masses, or a re-entry along its optimal bank angle.
    #[command(after_help = "Examples:\n  \
        apsides simulate moving-mass-cross --out descent\n  \
        apsides simulate moving-mass-cross --set moving_mass_kg=5 --set rate_limit_m_s=0.2\n  \
        apsides simulate moving-mass-radial --set allocation=angles --json\n  \
        apsides simulate capsule-reentry-steered --set steered.offset_z_m=0.01")]
    Simulate(SimulateArguments),
    /// Search PID gains of a mission with moving masses: the worst of a set of descents counts.
    #[command(after_help = "Examples:\n  \
        apsides tune moving-mass-cross --set rate_limit_m_s=0.1 --out tuned\n  \
        apsides tune moving-mass-cross --set rate_limit_m_s=0.05 --all-damping --evaluations 200")]
    Tune(TuneArguments),
    /// Find the least moving masses and rates that hold an offset: by statics and by simulation, cross against rim.
    #[command(after_help = "Examples:\n  \
        apsides size moving-mass-cross --out sizes\n  \
        apsides size moving-mass-radial --offsets-cm 0.5,1 --margin 1.3 --json")]
    Size(SizeArguments),
    /// Solve a mission for every combination of values, each case started from its neighbour.
    #[command(after_help = "Examples:\n  \
        apsides sweep lunar-perilune --set perilune_altitude_km=50,25,20,15,10,5\n  \
        apsides sweep lunar-direct --set thrust_n=400,440,480 --set isp_s=310,320 --out sweep\n  \
        apsides sweep lunar-direct --set thrust_n=400,440,480,520 --chain 2 --first 2 --out parts/2\n  \
        apsides sweep capsule-reentry --set heat_rate_limit_kw_m2=inf,850,800,760 --sensitivity --figure prices.svg")]
    Sweep(SweepArguments),
    /// Find the ends that a mission can reach at the altitude of its target, under its limits.
    #[command(after_help = "Examples:\n  \
        apsides footprint capsule-reentry --out footprint\n  \
        apsides footprint capsule-reentry --set load_limit_m_s2=inf --bearings 72 --json")]
    Footprint(FootprintArguments),
    /// Fly a mission many times with deviations, and say where the flights end, or how well a law holds.
    #[command(after_help = "Examples:\n  \
        apsides montecarlo chang-e-3-braking --position-m 333 --velocity-m-s 1 --out flights\n  \
        apsides montecarlo chang-e-3-braking --position-m 333 --guidance replanned --replan-at 0,200\n  \
        apsides montecarlo chang-e-3-braking --position-m 333 --samples 1000000 --first 250000 --count 1000 --out shards/250\n  \
        apsides montecarlo lunar-perilune --state altitude=100 --vary thrust_n=2 --samples 200\n  \
        apsides montecarlo lander.toml --sigma constants.thrust=0.5 --sigma constants.isp=2 --samples 200\n  \
        apsides montecarlo chang-e-3-braking --set thrust_n=7000 --full-thrust-n 7500 --thrust-percent 0.5 \\\n    \
        --engine-unknown --guidance polynomial")]
    Montecarlo(MonteCarloArguments),
    /// Join the parts (shards) of a Monte Carlo run or a sweep, made anywhere, to what a single run would have written.
    #[command(after_help = "Examples:\n  \
        apsides montecarlo chang-e-3-braking --position-m 333 --samples 4000 --first 0 --count 2000 --out shards/0\n  \
        apsides montecarlo chang-e-3-braking --position-m 333 --samples 4000 --first 2000 --count 2000 --out shards/1\n  \
        apsides merge shards --out flights\n\n\
        Parts of other missions, settings or versions, parts that overlap, leave a gap, are not complete or were\n\
        altered are refused by name (status 2); nothing is written then.")]
    Merge(MergeArguments),
    /// Compute a large run as shards: on this machine, by Slurm or by Dask; follow them and join them.
    #[command(after_help = "Examples:\n  \
        apsides campaign landing.toml\n  \
        apsides campaign landing.toml --on-interrupt cancel\n  \
        hq submit --array 0-99 apsides campaign landing.toml --shard '$HQ_TASK_ID'\n\n\
        The file:\n  \
        mission = \"chang-e-3-braking\"\n  \
        arguments = [\"--position-m\", \"333\"]\n  \
        samples = 100000\n  \
        shard_size = 1000\n  \
        engine = \"local\"        # or slurm, dask\n\n\
        All keys: docs/campaigns.md. The same command goes on where it was; shards that are complete stay.")]
    Campaign(CampaignArguments),
    /// List the missions, or the keys of one.
    #[command(
        after_help = "Examples:\n  apsides missions\n  apsides missions lunar-perilune\n  apsides missions lunar-perilune --all"
    )]
    Missions {
        /// Show the keys of this mission that matter, with value, meaning and allowed values.
        name: Option<String>,
        /// Show all keys, those of methods, searches and frames too.
        #[arg(long, requires = "name")]
        all: bool,
    },
    /// Write a file to begin with: a problem with equations of its own, with comments.
    #[command(after_help = "Examples:\n  apsides new problem\n  apsides new problem my-lander.toml")]
    New {
        /// Kind of the file.
        #[arg(value_enum)]
        kind: NewKind,
        /// File to write, by default named like its kind; an existing one stays as it is.
        file: Option<PathBuf>,
    },
    /// Print the JSON Schema of mission files, by which editors complete and check them.
    #[command(after_help = "Example:\n  apsides schema > apsides.schema.json\n\n\
        Editors find it by a first line `#:schema apsides.schema.json` in the mission file (taplo).")]
    Schema,
    /// List the bodies that missions may name, with the source of their numbers.
    Bodies,
    /// List the vehicles that missions may name, with the source of their numbers.
    Vehicles,
    /// List the landing sites that missions may name, with the source of their numbers.
    Sites,
    /// Read a mission and say whether it is well-posed, without solving it.
    #[command(
        after_help = "Examples:\n  apsides check my-mission.toml\n  apsides check lunar-direct --set thrust_n=500\n  apsides check lunar-direct --all"
    )]
    Check(CheckArguments),
    /// Compute the tables of a publication again, or list the publications.
    #[command(
        after_help = "Examples:\n  apsides reproduce\n  apsides reproduce lunar-landing --out reproduction\n  \
                      apsides reproduce geo-injection --out reproduction\n  apsides reproduce chang-e-3 --out reproduction"
    )]
    Reproduce(ReproduceArguments),
    /// Find what is unsafe on an elevation map, and the landing sites on it.
    #[command(after_help = "Examples:\n  \
        apsides hazard map.tif --criteria chang-e-3-coarse --out hazards\n  \
        apsides hazard scene.npy --pixel 0.1 --criteria my-lander.toml --start 500,500 --sites 3 --json\n  \
        apsides hazard scene.npy --pixel 0.1 --craters 2,20 --boulders 0.3 --noise 0.05 --out hazards\n\n\
        A file of criteria is TOML: thresholds by name, `preset = \"NAME\"` for what it does not state.")]
    Hazard(HazardArguments),
    /// Make or describe elevation maps.
    #[command(subcommand)]
    Terrain(TerrainCommand),
    /// List the problems of the gallery, or the optimum of one with its evidence and the columns of its trajectories.
    #[command(after_help = "Examples:\n  apsides problems\n  apsides problems brachistochrone_free_y")]
    Problems {
        /// Show this problem.
        name: Option<String>,
    },
    /// Judge a trajectory of any program: feasible to what, optimal to what, how far from the optimum.
    #[command(after_help = "Examples:\n  \
        apsides certify di_min_energy other-program.csv\n  \
        apsides certify lunar-perilune samples.json --json\n\n\
        The file has columns (CSV) or arrays (JSON) named `time` and as the states and controls of the problem:\n\
        see `apsides problems NAME`.")]
    Certify(CertifyArguments),
    /// Write the flight of a result densely, in formats of other programs, without solving again.
    #[command(after_help = "Examples:\n  \
        apsides export results --step 10s --format oem\n  \
        apsides export results --points 500 --format csv,npz,czml --out for-others\n  \
        apsides export results --step 1min --format opm --set 'epoch=2027-03-01T06:00:00 UTC'\n\n\
        Formats:\n  \
        csv, json, npz  all columns: Cartesian states, place, speeds, thrust, loads\n  \
        oem, opm, aem   messages of the CCSDS: orbit ephemeris, first and last state, attitude\n  \
        czml            document of Cesium")]
    Export(ExportArguments),
    /// Lay results beside each other: keys and numbers that differ, flights drawn over each other.
    #[command(after_help = "Examples:\n  \
        apsides compare first second\n  \
        apsides compare first second third --out comparison")]
    Compare(CompareArguments),
    /// Verify the results in a directory again: trajectory.csv against the equations of mission.toml.
    #[command(after_help = "Example:\n  apsides verify results")]
    Verify {
        /// Directory written by `solve --out`.
        directory: PathBuf,
    },
    /// Print the script by which a shell completes commands and options.
    #[command(after_help = "Examples:\n  \
        apsides completions bash > ~/.local/share/bash-completion/completions/apsides\n  \
        apsides completions zsh > ~/.zfunc/_apsides\n  \
        apsides completions fish > ~/.config/fish/completions/apsides.fish")]
    Completions {
        /// Shell that the script is for.
        #[arg(value_enum)]
        shell: Shell,
    },
    /// Print the manual page, or write one for each command into a directory.
    #[command(after_help = "Examples:\n  \
        apsides man | man -l -\n  \
        apsides man --out ~/.local/share/man/man1")]
    Man {
        /// Write apsides.1 and a page for each command into this directory.
        #[arg(short, long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

impl Command {
    /// Values that replace those of the mission.
    pub(crate) fn set(&self) -> &[String] {
        match self {
            Self::Solve(a) => &a.mission.set,
            Self::Simulate(a) => &a.mission.set,
            Self::Tune(a) => &a.mission.set,
            Self::Size(a) => &a.mission.set,
            Self::Sweep(a) => &a.set,
            Self::Footprint(a) => &a.mission.set,
            Self::Montecarlo(a) => &a.mission.set,
            Self::Check(a) => &a.mission.set,
            Self::Certify(a) => &a.set,
            Self::Export(a) => &a.set,
            _ => &[],
        }
    }
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Print the mission file with every value written out as well.
    #[arg(long)]
    pub(crate) all: bool,
    #[command(flatten)]
    pub(crate) limit: TimeLimit,
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

/// Arguments of `solve`.
#[derive(Debug, Args)]
pub(crate) struct SolveArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Write summary.json, trajectory.csv, certificate.json, mission.toml and report.html into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) ephemeris: EphemerisArguments,
    /// Start from the flight of a result directory, such as that of the same mission with other numbers, not from a guess.
    #[arg(long, value_name = "DIR")]
    pub(crate) from: Option<PathBuf>,
    /// Keep the search of `--method two-layer` in this file; it goes on from there if the file exists.
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Say what one more unit of each number of vehicle and flight is worth; with --out also as sensitivity.json.
    #[arg(long)]
    pub(crate) sensitivity: bool,
    /// Say on stderr, before the first iteration, which constraints the guess violates most.
    #[arg(long)]
    pub(crate) explain: bool,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct SimulateArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Write summary.json, states.csv, mission.toml and report.html into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) ephemeris: EphemerisArguments,
    /// Seed of the noise of sensors.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) limit: TimeLimit,
}

/// Arguments of `tune`.
#[derive(Debug, Args)]
pub(crate) struct TuneArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Directions of the offset of the centre of mass, with its larger component as the size.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(0..=360))]
    pub(crate) directions: u32,
    /// Angles of attack at the entry, deg.
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_values_t = [2.0, 10.0], allow_negative_numbers = true)]
    pub(crate) entry_attack_deg: Vec<f64>,
    /// Both sets of damping derivatives, not that of the mission alone.
    #[arg(long)]
    pub(crate) all_damping: bool,
    /// Factor by which the gain of each loop must be free to grow or fall, at 1 kPa and more; up to 1 asks for nothing.
    #[arg(long, value_name = "FACTOR", default_value_t = 2.0, allow_negative_numbers = true)]
    pub(crate) least_gain_margin: f64,
    /// Least phase margin of each loop, deg.
    #[arg(long, value_name = "DEG", default_value_t = 30.0, allow_negative_numbers = true)]
    pub(crate) least_phase_margin_deg: f64,
    /// Least delay margin of each loop, s.
    #[arg(long, value_name = "S", default_value_t = 0.02, allow_negative_numbers = true)]
    pub(crate) least_delay_margin_s: f64,
    /// Sets of descents that are flown at most.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) evaluations: u32,
    /// Write mission.toml, the mission with the gains, into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Seed of the search.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) limit: TimeLimit,
}

/// Arguments of `size`.
#[derive(Debug, Args)]
pub(crate) struct SizeArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Offsets of the centre of mass, cm.
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_values_t = [0.25, 0.5, 1.0, 1.5, 2.0])]
    pub(crate) offsets_cm: Vec<f64>,
    /// Factor on the masses of statics with which the least rates are sought.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.2, allow_negative_numbers = true)]
    pub(crate) margin: f64,
    /// Write size.json and size.svg into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
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
    /// Cases of a chain: the first of each starts from the mission's own guess, the others from their neighbours. All are one chain without it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) chain: Option<u32>,
    /// Solve a part of the cases (a shard) alone, from this index on, counted from 0: the first of a chain. `apsides merge` joins parts.
    #[arg(long, value_name = "K", requires = "chain")]
    pub(crate) first: Option<u32>,
    /// Number of cases of the part; all behind the first without it.
    #[arg(long, value_name = "N", requires = "chain", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) count: Option<u32>,
    /// Write sweep.csv, a row a case with all results, and sweep.html into this directory; with --chain shard.json, too.
    #[arg(short, long, value_name = "DIR")]
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

/// Arguments of `montecarlo`. Deviations are normal and independent; the sizes are standard deviations.
#[derive(Debug, Args)]
pub(crate) struct MonteCarloArguments {
    #[command(flatten)]
    pub(crate) mission: MissionArguments,
    /// Number of flights of the whole run; with --out those in the file count.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(2..=1_000_000_000))]
    pub(crate) samples: u32,
    /// Fly a part of the run (a shard) alone: from this index on, counted from 0. A sample depends on seed and index alone; `apsides merge`
    /// joins parts to what the whole run would have been.
    #[arg(long, value_name = "K", default_value_t = 0)]
    pub(crate) first: u32,
    /// Number of samples of the part; all behind the first without it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) count: Option<u32>,
    /// Standard deviation of a number of the mission, in its unit; may be repeated. Each sample is an optimum: the mission solved again with
    /// drawn numbers.
    #[arg(long, value_name = "KEY=SIGMA", value_parser = sized_key)]
    pub(crate) sigma: Vec<(String, f64)>,
    /// Standard deviation of the initial value of a state of any optimised mission, by its name and in the unit of its problem; may be
    /// repeated. The flights have the controls of the plan as functions of time.
    #[arg(long, value_name = "NAME=SIGMA", value_parser = sized_key)]
    pub(crate) state: Vec<(String, f64)>,
    /// The same of a number of the mission, by its key; may be repeated, and go with --state.
    #[arg(long, value_name = "KEY=SIGMA", value_parser = sized_key)]
    pub(crate) vary: Vec<(String, f64)>,
    /// Position along each axis (up, along the course, across), m.
    #[arg(long = "position-m", value_name = "SIGMA", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) position: f64,
    /// Velocity along each axis, m/s.
    #[arg(long = "velocity-m-s", value_name = "SIGMA", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) velocity: f64,
    /// Thrust, per cent.
    #[arg(
        long = "thrust-percent",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) thrust: f64,
    /// Exhaust velocity, per cent.
    #[arg(
        long = "exhaust-velocity-percent",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) exhaust_velocity: f64,
    /// Mass, kg.
    #[arg(long = "mass-kg", value_name = "SIGMA", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) mass: f64,
    /// Error of the navigated position along each axis, constant over a flight, m.
    #[arg(
        long = "navigation-position-m",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) navigation_position: f64,
    /// Error of the navigated velocity along each axis, constant over a flight, m/s.
    #[arg(
        long = "navigation-velocity-m-s",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) navigation_velocity: f64,
    /// Offset of the centre of mass along each axis, m; of a descent under its law.
    #[arg(long = "offset-m", value_name = "SIGMA", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) offset: f64,
    /// Angle of attack and sideslip at the entry, deg; of a descent.
    #[arg(
        long = "entry-angle-deg",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) entry_angle: f64,
    /// Flight path angle at the entry, deg; of a descent.
    #[arg(
        long = "path-angle-deg",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) path_angle: f64,
    /// Gain of the sensors, per cent; of a descent.
    #[arg(
        long = "sensor-gain-percent",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) sensor_gain: f64,
    /// Damping in pitch and yaw, per cent; of a descent.
    #[arg(
        long = "damping-percent",
        value_name = "SIGMA",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) damping: f64,
    /// Wind towards north and east at 12 km, m/s; of a descent.
    #[arg(long = "wind-m-s", value_name = "SIGMA", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) wind: f64,
    /// Guidance of the deviating flights.
    #[arg(long, value_enum, default_value = "open-loop")]
    pub(crate) guidance: GuidanceWord,
    /// Times at which a re-planned flight is planned anew, s; the start without any.
    #[arg(long = "replan-at", value_name = "TIMES", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) replan_at: Vec<f64>,
    /// Plans anew every so many seconds besides.
    #[arg(long = "replan-every", value_name = "SECONDS", allow_negative_numbers = true)]
    pub(crate) replan_every: Option<f64>,
    /// Gains of angles by errors of the start, of `--guidance linear-radial`: deg/km and deg s/m along the course, the same across it.
    #[arg(long = "feed-forward", value_name = "GAINS", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) feed_forward: Vec<f64>,
    /// Plans and laws take thrust and exhaust velocity of the mission for true; they know those of the flight without this.
    #[arg(long = "engine-unknown")]
    pub(crate) engine_unknown: bool,
    /// Largest thrust in flight, N, where the mission plans with less to have a reserve.
    #[arg(long = "full-thrust-n", value_name = "THRUST", allow_negative_numbers = true)]
    pub(crate) full_thrust: Option<f64>,
    /// Write montecarlo.csv, flight by flight, then montecarlo.json, .svg, .html and shard.json; a run that was stopped goes on.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Files of the samples: parquet makes montecarlo.parquet of montecarlo.csv at the end, in builds with the feature `parquet`.
    #[arg(long, value_enum, default_value = "csv", requires = "out")]
    pub(crate) format: SampleFormat,
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
    /// Write footprint.csv, footprint.json, footprint.svg and footprint.html into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

/// Arguments of `reproduce`.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArguments {
    /// Name of the publication; all names are listed without one.
    pub(crate) name: Option<String>,
    /// Print what each publication states, with the command that shows it and the outcome, in Markdown; nothing is computed.
    #[arg(long, conflicts_with = "out")]
    pub(crate) items: bool,
    /// Write reproduction.html, reproduction.md, reproduction.csv, the figures and the mission files into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
}

fn sized_key(text: &str) -> Result<(String, f64), String> {
    match text.split_once('=').map(|(key, size)| (key.trim().to_owned(), size.trim().parse())) {
        Some((key, Ok(size))) if !key.is_empty() => Ok((key, size)),
        _ => Err("a key and a standard deviation are expected: key=sigma".into()),
    }
}
