//! The language of multi-phase optimal control problems.
