//! Reasons why a result directory cannot be written or read.

use std::io;
use std::path::PathBuf;

use apsides_ocp::OcpError;
use apsides_pipeline::whole_file::is_refusal;
use apsides_terrain::TerrainError;

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
    /// The result directory is a file, or a result file would replace a directory of its name or another file of the same result.
    #[error("`{}` {problem}", path.display())]
    Directory {
        /// The path of the directory or of the result file.
        path: PathBuf,
        /// The defect, and what is needed.
        problem: &'static str,
    },
    /// Text that is not the JSON expected, or values without a JSON form.
    #[error("{file}: {source}")]
    Json {
        /// Name of the file.
        file: &'static str,
        /// Place and reason.
        source: serde_json::Error,
    },
    /// A table that cannot be written or read.
    #[error("{file}: {source}")]
    Table {
        /// Name of the file.
        file: &'static str,
        /// The error of the reader or writer of its format.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The directory holds the samples of another run.
    #[error("{file}: the file in the directory has {found}: choose another directory, or remove it")]
    OtherRun {
        /// Name of the file.
        file: &'static str,
        /// The contents that differ from those of this run.
        found: String,
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
    /// The controls of a phase cannot be given at the nodes of its states.
    #[error("trajectory of {phase}: {source}")]
    Nodes {
        /// Name of the phase.
        phase: String,
        /// The reason.
        source: OcpError,
    },
    /// A picture of a map cannot be drawn.
    #[error("{map} map: {source}")]
    Map {
        /// Name of the map.
        map: String,
        /// The reason.
        source: TerrainError,
    },
}

impl ReportError {
    /// True where the system did not write what was to be written: a full disk, missing rights. A request that names a device or a
    /// directory in place of a file is not.
    #[must_use]
    pub fn is_lost_output(&self) -> bool {
        matches!(self, Self::Io { action, source, .. } if *action != "read" && !is_refusal(source))
    }
}
