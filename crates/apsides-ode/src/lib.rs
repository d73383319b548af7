//! Runge-Kutta 8(5,3) and 5(4) with dense output, events and variational equations.
