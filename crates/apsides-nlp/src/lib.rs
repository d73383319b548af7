//! Sparse nonlinear programming by a primal-dual interior point method.
