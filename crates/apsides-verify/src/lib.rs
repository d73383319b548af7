//! Independent verification of optimal control solutions.

pub mod certificate;

pub use certificate::{Certificate, Check, CheckKind, Verdict};
