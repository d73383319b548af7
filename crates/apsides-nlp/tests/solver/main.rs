//! Whole solves: problems of the literature, behaviour on hard and malformed problems, warm starts.

mod behaviour;
mod hock_schittkowski;
mod support;
