//! Arguments of ephemerides: spacing of the rows, formats, what is exported.

use std::path::PathBuf;

use apsides::ephemeris::{Format, Sampling, Step};
use clap::Args;

/// Spacing of the rows of an ephemeris.
#[derive(Clone, Copy, Debug, Args)]
#[group(id = "rows", multiple = false)]
pub(crate) struct RowArguments {
    /// Write the flight at equal steps, such as 1s, 0.5, 2min, from its own polynomials; both sides of each phase boundary and of each jump of a control too.
    #[arg(long, value_name = "STEP", allow_hyphen_values = true)]
    step: Option<Step>,
    /// The same with so many rows from start to end.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    points: Option<u64>,
}

impl RowArguments {
    /// The spacing that is asked for.
    pub(crate) fn sampling(&self) -> Option<Sampling> {
        self.step.map(|Step(step)| Sampling::Step(step)).or(self.points.map(Sampling::Points))
    }
}

/// An ephemeris beside other files.
#[derive(Clone, Debug, Args)]
pub(crate) struct EphemerisArguments {
    #[command(flatten)]
    pub(crate) rows: RowArguments,
    /// Formats of these rows: csv, json, npz, oem, opm, aem, czml.
    #[arg(long, value_name = "A,B", value_delimiter = ',', requires = "rows")]
    pub(crate) format: Vec<Format>,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArguments {
    /// Directory that `solve --out` or `simulate --out` wrote.
    pub(crate) directory: PathBuf,
    #[command(flatten)]
    pub(crate) rows: RowArguments,
    /// Formats: csv, json, npz, oem, opm, aem, czml.
    #[arg(long, value_name = "A,B", value_delimiter = ',', default_value = "csv")]
    pub(crate) format: Vec<Format>,
    /// Replace the epoch or the axes of the mission; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Write into this directory, by default into that of the result.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Memory that the rows may take as far as that is foreseen, MiB; by default half of the machine's.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) memory: Option<u32>,
}
