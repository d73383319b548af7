//! Arguments of `merge`.

use std::path::PathBuf;

use clap::Args;

use super::SampleFormat;

/// Arguments of `merge`.
#[derive(Debug, Args)]
pub(crate) struct MergeArguments {
    /// Directories of parts of a Monte Carlo run or a sweep, or a directory with them.
    #[arg(required = true, value_name = "PART")]
    pub(crate) parts: Vec<PathBuf>,
    /// Write what the whole run would have written into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The parts need not be the whole run, but without a gap between them: they make a larger part.
    #[arg(long)]
    pub(crate) partly: bool,
    /// Files of the samples, as of `montecarlo`.
    #[arg(long, value_enum, default_value = "csv")]
    pub(crate) format: SampleFormat,
}
