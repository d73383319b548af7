//! Guidance laws of powered descent: thrust from time-to-go, position and velocity.
//!
//! A law is a function: a state and a target go in, a command comes out, and nothing is kept between two calls. Whoever flies it decides
//! how often it is asked. Both laws divide by the time to go, so that the last command is held over the last moments.
//!
//! | module | subject |
//! | --- | --- |
//! | [`linear_radial`] | full thrust, its angle from a radial acceleration that is linear in time |
//! | [`polynomial`] | E-guidance and the quadratic law of Apollo: position and velocity at a time that they choose |

use thiserror::Error;

pub mod linear_radial;
pub mod polynomial;
#[cfg(test)]
mod tests;

/// Why a law has no command.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum GuidanceError {
    /// A state, a target or a setting is not a number in its range.
    #[error("{what} is {value}, it must be finite{}", if *.positive { " and positive" } else { "" })]
    Input {
        /// What was given.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Whether it must be positive.
        positive: bool,
    },
    /// No time to go fulfils the law's equation.
    #[error("no time to go leads from this state to the target: {reason}")]
    NoTimeToGo {
        /// What is in the way.
        reason: &'static str,
    },
    /// The least thrust is not below the largest.
    #[error("the least thrust is {least} N, it must not be negative nor above the largest, {most} N")]
    Limits {
        /// Least thrust, N.
        least: f64,
        /// Largest thrust, N.
        most: f64,
    },
}

fn finite(what: &'static str, value: f64) -> Result<f64, GuidanceError> {
    if value.is_finite() { Ok(value) } else { Err(GuidanceError::Input { what, value, positive: false }) }
}

fn positive(what: &'static str, value: f64) -> Result<f64, GuidanceError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(GuidanceError::Input { what, value, positive: true })
    }
}
