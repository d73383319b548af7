//! Sparse symmetric indefinite systems: analyse once, refactor, inertia, refinement.
