//! Problems 61 to 80.

use crate::nlp::Program;

pub(super) fn programs() -> Vec<Program> {
    vec![]
}
