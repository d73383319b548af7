//! Arguments of `apsides certify`.

use std::path::PathBuf;

use clap::Args;

use super::TimeLimit;

/// A problem and a trajectory.
#[derive(Debug, Args)]
pub(crate) struct CertifyArguments {
    /// Problem of the gallery, mission or mission file.
    pub(crate) problem: String,
    /// Times, states and controls as CSV or JSON.
    pub(crate) trajectory: PathBuf,
    /// The course of the controls between the samples, by default whichever fits the states best.
    #[arg(long, value_enum)]
    pub(crate) interpolation: Option<InterpolationWord>,
    /// Replace a value of the mission file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Do not solve the mission for an objective to compare with.
    #[arg(long)]
    pub(crate) no_reference: bool,
    /// Memory that the solve of the mission may take as far as that is foreseen, MiB; by default half of the machine's.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) memory: Option<u32>,
    #[command(flatten)]
    pub(crate) limit: TimeLimit,
}

/// A course of the controls between samples.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum InterpolationWord {
    /// Each sample holds until the next.
    Constant,
    /// Straight lines.
    Linear,
    /// Cubics through four samples.
    Cubic,
    /// Polynomials through the nodes of intervals, which `trajectory.csv` of a result names.
    Polynomial,
}

impl From<InterpolationWord> for apsides_verify::Interpolation {
    fn from(word: InterpolationWord) -> Self {
        match word {
            InterpolationWord::Constant => Self::Constant,
            InterpolationWord::Linear => Self::Linear,
            InterpolationWord::Cubic => Self::Cubic,
            InterpolationWord::Polynomial => Self::Polynomial,
        }
    }
}
