//! Flags that every command has: the form and the amount of what it says.

use clap::{Args, ColorChoice};

/// The voice of the program.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct Speech {
    /// Print one JSON object on stdout and nothing else; errors and warnings are one on stderr, a line each.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// No progress on stderr.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Say more: iterations on stderr, every check of a certificate, work and times.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
    /// Colours: in a terminal unless NO_COLOR is set, always, or never.
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t = ColorChoice::Auto)]
    pub(crate) color: ColorChoice,
}
