//! Reasons why a result directory cannot be written or read.

use std::io;
use std::path::PathBuf;

/// The errors of reading and writing results, each with its place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The operating system refused to read or write.
    #[error("cannot {action} `{}`: {source}", path.display())]
    Io {
        /// `write`, `create the directory`, ...
        action: &'static str,
        /// File or directory.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The result directory is something else.
    #[error("`{}` exists and is not a directory: results need a directory", path.display())]
    NotADirectory {
        /// The path that was given as the directory.
        path: PathBuf,
    },
    /// A result file cannot replace a directory of its name.
    #[error("`{}` is a directory: a result file of that name cannot be written", path.display())]
    IsADirectory {
        /// Path of the result file.
        path: PathBuf,
    },
    /// Text that is not the JSON expected, or values without a JSON form.
    #[error("{file}: {source}")]
    Json {
        /// Name of the file.
        file: &'static str,
        /// Place and reason.
        source: serde_json::Error,
    },
    /// A table that cannot be written as CSV.
    #[error("{file}: {reason}")]
    Table {
        /// Name of the file.
        file: &'static str,
        /// Reason of the writer.
        reason: String,
    },
    /// A trajectory file that is truncated, malformed or does not fit the problem.
    #[error("trajectory, line {line}: {reason}")]
    Trajectory {
        /// Line of the file; the header is line 1.
        line: u64,
        /// The defect, and what is expected instead.
        reason: String,
    },
    /// Multipliers that do not fit the problem or the trajectory.
    #[error("multipliers of {place}: {reason}")]
    Multipliers {
        /// Phase or constraint.
        place: String,
        /// The defect, and what is expected instead.
        reason: String,
    },
    /// A trajectory in memory that does not fit the problem, or has no node at the start of an interval.
    #[error("trajectory of {place}: {reason}")]
    Shape {
        /// Problem or phase.
        place: String,
        /// The defect, and what is expected instead.
        reason: String,
    },
    /// The drawing library failed.
    #[error("figure `{title}`: {reason}")]
    Figure {
        /// Title of the figure.
        title: String,
        /// Reason of the library.
        reason: String,
    },
}
