//! Problems 41 to 60.

use crate::nlp::Program;
use crate::nlp::program::{INF, program};

pub(super) fn programs() -> Vec<Program> {
    vec![program!(
        43,
        4,
        4,
        [0.0; 4],
        ([-INF; 4], [INF; 4]),
        ([-INF; 3], [8.0, 10.0, 5.0]),
        -44.0,
        1e-6,
        |x| {
            let q = x.map(|x| x * x);
            [
                q[0] + q[1] + q[2] * 2.0 + q[3] - x[0] * 5.0 - x[1] * 5.0 - x[2] * 21.0 + x[3] * 7.0,
                q[0] + q[1] + q[2] + q[3] + x[0] - x[1] + x[2] - x[3],
                q[0] + q[1] * 2.0 + q[2] + q[3] * 2.0 - x[0] - x[3],
                q[0] * 2.0 + q[1] + q[2] + x[0] * 2.0 - x[1] - x[3],
            ]
        }
    )]
}
