//! Whole solves: problems of the literature, behaviour on hard and malformed problems, units and warm starts.

mod behaviour;
mod chain;
mod diagnosis;
mod malformed;
mod optimal_control;
mod random_problems;
mod scaling_and_warm_start;
mod sensitivity;
mod support;
