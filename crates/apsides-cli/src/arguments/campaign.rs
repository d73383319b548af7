//! Arguments of `campaign`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Arguments of `campaign`.
#[derive(Debug, Args)]
pub(crate) struct CampaignArguments {
    /// TOML file of the campaign.
    pub(crate) file: PathBuf,
    /// Print the number of shards.
    #[arg(long, conflicts_with_all = ["shard", "merge"])]
    pub(crate) shards: bool,
    /// Compute one shard, counted from 0: what a task of any scheduler runs. A shard that is complete is left as it is.
    #[arg(long, value_name = "K", conflicts_with = "merge")]
    pub(crate) shard: Option<u32>,
    /// With --shard: each so many shards behind it as well, one after another.
    #[arg(long, value_name = "N", requires = "shard", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) of: Option<u32>,
    /// Join the shards, which have to be complete.
    #[arg(long)]
    pub(crate) merge: bool,
    /// The fate of the work after Ctrl-C: it goes on, or ends. Without a terminal to ask at, it goes on.
    #[arg(long, value_enum, default_value = "ask")]
    pub(crate) on_interrupt: OnInterrupt,
}

/// The fate of the work after a signal to the pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OnInterrupt {
    /// Ask at the terminal.
    Ask,
    /// The work goes on without the pilot.
    Leave,
    /// The work is ended; what is done is kept.
    Cancel,
}
