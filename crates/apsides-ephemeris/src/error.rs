//! Reasons why an ephemeris is refused.

use crate::format::Format;

/// The errors of epochs and ephemerides, each with what is allowed instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EphemerisError {
    /// A text that is no instant.
    #[error("`{text}` is no epoch: {reason}")]
    Epoch {
        /// The text.
        text: String,
        /// The mistake, and what is allowed.
        reason: String,
    },
    /// A spacing of rows that is none.
    #[error("`{text}` is no step: a time above 0 is expected, such as 10s, 0.5, 2min or 1h")]
    Step {
        /// The text.
        text: String,
    },
    /// A word that is no format.
    #[error("`{word}` is no format of an ephemeris; formats: {}", Format::words())]
    Format {
        /// The word.
        word: String,
    },
    /// A format that needs places on a body, of a flight that has none.
    #[error(
        "`{}` needs positions and velocities about Earth, Moon or Mars, and {flight} has none: {needed}; csv, json and npz have its own \
         states and controls",
        format.word()
    )]
    NoPlace {
        /// The format.
        format: Format,
        /// The flight, in words.
        flight: String,
        /// The states that would be needed, in words.
        needed: &'static str,
    },
    /// A format that needs an attitude, of a flight that has none.
    #[error("`{}` needs an attitude, and the states of {flight} are those of a point: moving-mass missions have one", format.word())]
    NoAttitude {
        /// The format.
        format: Format,
        /// The flight, in words.
        flight: String,
    },
    /// A message that is not of its standard, or has what is not taken.
    #[error("line {line}: {reason}")]
    Message {
        /// The line, from 1; the last where something is missing.
        line: usize,
        /// The mistake, and what is allowed.
        reason: String,
    },
    /// A number that is not finite, which no message may have.
    #[error("`{quantity}` is not finite at {time} s of phase `{phase}`: no ephemeris is written")]
    NotFinite {
        /// The quantity.
        quantity: String,
        /// Time of the mission, s.
        time: f64,
        /// Name of the phase.
        phase: String,
    },
    /// A table whose writer fails.
    #[error("{file}: {source}")]
    Table {
        /// Name of the file.
        file: &'static str,
        /// The error of the writer.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}
