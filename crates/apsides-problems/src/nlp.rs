//! Nonlinear programs of the literature with known optima, as formulas with exact derivatives.
//!
//! | module | what |
//! | --- | --- |
//! | [`hock_schittkowski`] | the collection of Hock and Schittkowski (1981) |

pub mod hock_schittkowski;
mod program;

pub use program::Program;
