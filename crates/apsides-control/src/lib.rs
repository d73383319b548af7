//! Feedback laws, guidance laws, actuators and closed-loop simulation.
//!
//! A vehicle `x' = f(t, x, u)` is steered by a law `u = k(t, y)` that acts at sample times on what sensors show of the state. The laws
//! know no problem of optimal control; a trajectory to follow is handed to them as a function of time.
//!
//! | module | subject |
//! | --- | --- |
//! | [`guidance`] | guidance laws of powered descent |

pub mod guidance;
