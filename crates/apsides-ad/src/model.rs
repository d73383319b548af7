//! What a user writes: models generic in the scalar. Each is a plain struct with its parameters and one method.

use crate::Scalar;

/// Equations of motion `dx/dt = rate(t, x, u, p)` with `NX` states, `NU` controls and `NP` static parameters.
pub trait Dynamics<const NX: usize, const NU: usize, const NP: usize = 0>: Send + Sync {
    /// The rate of change of the state.
    fn rate<S: Scalar>(&self, t: S, x: &[S; NX], u: &[S; NU], p: &[S; NP]) -> [S; NX];
}

/// `NF` quantities that follow from the state and control at one time: path constraints, integrands.
pub trait PathFunction<const NX: usize, const NU: usize, const NF: usize, const NP: usize = 0>:
    Send + Sync
{
    /// The quantities at one time.
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; NX], u: &[S; NU], p: &[S; NP]) -> [S; NF];
}

/// `M` quantities that follow from `N` numbers: boundary conditions, links between phases, end costs.
pub trait VectorFunction<const N: usize, const M: usize>: Send + Sync {
    /// The quantities.
    fn evaluate<S: Scalar>(&self, z: &[S; N]) -> [S; M];
}
