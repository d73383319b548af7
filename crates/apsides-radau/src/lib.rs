//! hp Legendre-Gauss-Radau collocation for multi-phase optimal control.
