//! Whole solves: problems of the literature, behaviour on hard and malformed problems, units and warm starts.

mod behaviour;
mod hock_schittkowski;
mod malformed;
mod scaling_and_warm_start;
mod support;
