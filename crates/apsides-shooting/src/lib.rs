//! Shooting: optimal control through the integration of the equations of motion.
//!
//! ```text
//! direct:    x_{k+1} = phi(x_k, u_k, t_k, t_{k+1}),  minimise J over nodes, controls, times
//! indirect:  x' = dH/dlambda,  lambda' = -dH/dx,  u = argmin H,  boundary and transversality conditions = 0
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`direct`] | single and multiple shooting with piecewise-polynomial controls, as a nonlinear program |
//! | [`indirect`] | Pontryagin's conditions as a multi-point boundary value problem |
//!
//! References: H. G. Bock, K. J. Plitt, A multiple shooting algorithm for direct solution of optimal control problems, IFAC Proc. 17
//! (1984), doi 10.1016/S1474-6670(17)61205-9. A. E. Bryson, Y.-C. Ho, Applied Optimal Control, Taylor and Francis 1975.

pub mod direct;
pub mod error;
pub mod indirect;

pub use error::ShootingError;
