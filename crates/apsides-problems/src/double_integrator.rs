//! The double integrator, the equations of motion of several problems.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Phase, State, Variable};

/// `x' = v`, `v' = u`.
pub struct DoubleIntegrator;

impl Dynamics<2, 1> for DoubleIntegrator {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// `u^2 / 2`.
pub struct Effort;

impl PathFunction<2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5]
    }
}

/// A phase named `move` with the states given and a control `u` that is bounded by `-limit` and `limit`.
pub(crate) fn phase(position: State, speed: State, limit: f64) -> Phase {
    Phase::new("move", DoubleIntegrator)
        .states([position, speed])
        .controls([Variable::new("u", "-").within(-limit, limit)])
        .time_unit("-")
}
