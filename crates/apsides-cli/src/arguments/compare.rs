//! Arguments of `compare`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArguments {
    /// Directories that `solve --out` or `simulate --out` wrote; differences are to the first.
    #[arg(required = true, num_args = 2.., value_name = "DIR")]
    pub(crate) directories: Vec<PathBuf>,
    /// Write compare.html with all flights over each other into this directory.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}
