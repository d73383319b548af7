//! Direct shooting.

mod chain;
mod layout;
mod plan;
mod scales;
mod segment_system;
mod shot;
mod transcription;

pub use transcription::Transcription;
