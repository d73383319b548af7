//! Independent verification of optimal control solutions.
