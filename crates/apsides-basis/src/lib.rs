//! Gauss-Radau nodes, differentiation and interpolation matrices.
