//! Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (Springer, 1981, doi
//! 10.1007/978-3-642-48320-2), by their number there.
//!
//! Optima are those of the book unless a comment at the problem says why not.

mod colville;
mod heat;
mod up_to_020;
mod up_to_040;
mod up_to_060;
mod up_to_070;
mod up_to_080;
mod up_to_090;
mod up_to_100;
mod up_to_110;
mod up_to_119;

use apsides_ad::Scalar;

use super::Program;

/// Sum of scalars.
fn sum<S: Scalar>(terms: impl Iterator<Item = S>) -> S {
    terms.fold(S::from(0.0), |sum, term| sum + term)
}

/// All problems, by their number.
#[must_use]
pub fn collection() -> Vec<Program> {
    [
        up_to_020::programs(),
        up_to_040::programs(),
        up_to_060::programs(),
        up_to_070::programs(),
        up_to_080::programs(),
        up_to_090::programs(),
        heat::programs(),
        up_to_100::programs(),
        up_to_110::programs(),
        up_to_119::programs(),
    ]
    .into_iter()
    .flatten()
    .collect()
}
