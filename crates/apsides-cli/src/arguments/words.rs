//! Words that options take.

use clap::ValueEnum;
use serde::Deserialize;

/// Kinds of files that can be begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum NewKind {
    /// Equations, bounds and objective of one's own.
    Problem,
}

/// Files of the samples of a Monte Carlo run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SampleFormat {
    /// CSV alone.
    #[default]
    Csv,
    /// CSV and Parquet.
    Parquet,
}

/// Steering of a deviating flight.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum GuidanceWord {
    /// The thrust of the plan as a function of time, along the same directions in space.
    OpenLoop,
    /// The optimum to the planned end from where the flight is, at the times of --replan-at and --replan-every.
    Replanned,
    /// Full thrust with a radial acceleration linear in time; the range is not controlled, but by --feed-forward.
    LinearRadial,
    /// An acceleration linear in time to the planned end (E-guidance), within the limits of the thrust.
    Polynomial,
}
