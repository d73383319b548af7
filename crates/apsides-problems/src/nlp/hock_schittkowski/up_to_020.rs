//! Problems 1 to 20.

use crate::nlp::Program;

pub(super) fn programs() -> Vec<Program> {
    vec![]
}
