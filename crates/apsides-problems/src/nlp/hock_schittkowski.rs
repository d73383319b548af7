//! Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (Springer, 1981, doi
//! 10.1007/978-3-642-48320-2), by their number there.
//!
//! Optima are those of the book unless a comment at the problem says why not.

mod up_to_020;
mod up_to_040;
mod up_to_060;
mod up_to_080;
mod up_to_100;
mod up_to_119;

use super::Program;

/// All problems, by their number.
#[must_use]
pub fn collection() -> Vec<Program> {
    [
        up_to_020::programs(),
        up_to_040::programs(),
        up_to_060::programs(),
        up_to_080::programs(),
        up_to_100::programs(),
        up_to_119::programs(),
    ]
    .into_iter()
    .flatten()
    .collect()
}
