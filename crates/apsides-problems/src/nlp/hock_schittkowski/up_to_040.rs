//! Problems 21 to 40.

use crate::nlp::Program;
use crate::nlp::program::{INF, program};

pub(super) fn programs() -> Vec<Program> {
    vec![program!(35, 3, 2, [0.5; 3], ([0.0; 3], [INF; 3]), ([-INF], [3.0]), 1.0 / 9.0, 1e-6, |x| [
        x[0] * x[0] * 2.0 + x[1] * x[1] * 2.0 + x[2] * x[2] + x[0] * x[1] * 2.0 + x[0] * x[2] * 2.0
            - x[0] * 8.0
            - x[1] * 6.0
            - x[2] * 4.0
            + 9.0,
        x[0] + x[1] + x[2] * 2.0,
    ])]
}
