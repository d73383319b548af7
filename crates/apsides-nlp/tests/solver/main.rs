//! Whole solves: problems of the literature, behaviour on hard and malformed problems, units and warm starts.

mod behaviour;
mod chain;
mod complementarity;
mod degenerate;
mod diagnosis;
mod malformed;
mod no_solution;
mod optimal_control;
mod resolver;
mod scaling_and_warm_start;
mod second_order;
mod sensitivity;
mod support;
