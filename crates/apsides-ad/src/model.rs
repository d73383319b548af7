//! Traits that a user implements: models generic in the scalar. Each is a plain struct with its parameters and one method.

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

/// The flat map of equations of motion: `NX` states, `NU` controls and `NR` remaining equations follow from `NY`
/// outputs and their derivatives in time, up to number `ND - 1`.
///
/// For a flat system proper nothing remains. Where there are more outputs than controls, or where a state is taken as an output of
/// its own, the residuals keep what the outputs do not satisfy by themselves.
///
/// M. Fliess, J. Levine, P. Martin, P. Rouchon, *Int. J. Control* 61 (1995) 1327, doi 10.1080/00207179508921959.
pub trait FlatMap<
    const NY: usize,
    const ND: usize,
    const NX: usize,
    const NU: usize,
    const NR: usize,
    const NP: usize = 0,
>: Send + Sync
{
    /// States, controls and residuals, which are zero on a solution; `y[i][d]` is derivative `d` of output `i`.
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; ND]; NY], p: &[S; NP]) -> ([S; NX], [S; NU], [S; NR]);

    /// The outputs at a time, from state and control: where a solve starts.
    fn outputs(&self, t: f64, x: &[f64; NX], u: &[f64; NU], p: &[f64; NP]) -> [f64; NY];
}
