//! Direct shooting.
