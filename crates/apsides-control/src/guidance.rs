//! Guidance laws of powered descent: thrust from time-to-go, position and velocity.
