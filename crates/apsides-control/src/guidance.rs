//! Guidance laws of powered descent: thrust from time-to-go, position and velocity.
//!
//! A law is a function: a state and a target go in, a command comes out, and nothing is kept between two calls. Whoever flies it decides
//! how often it is asked. Both laws divide by the time to go, so that the last command is held over the last moments.
//!
//! | module | subject |
//! | --- | --- |
//! | [`feed_forward`] | azimuth along the velocity to be gained, corrections of the angles by the errors of the start |
//! | [`linear_radial`] | full thrust, its angle from a radial acceleration that is linear in time |
//! | [`polynomial`] | E-guidance and the quadratic law of Apollo: position and velocity at a time that they choose |

pub mod feed_forward;
pub mod linear_radial;
pub mod polynomial;
#[cfg(test)]
mod tests;
