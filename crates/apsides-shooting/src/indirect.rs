//! Indirect shooting.
