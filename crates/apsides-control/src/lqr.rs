//! Linear-quadratic regulators `u = -K x`, continuous and sampled.
//!
//! ```text
//! min integral x'Qx + u'Ru dt,   x' = A x + B u:      0 = A'X + X A - X B R^-1 B' X + Q,          K = R^-1 B' X
//! min sum      x'Qx + u'Ru,      x+ = A x + B u:      X = A'X A - A'X B (R + B'X B)^-1 B'X A + Q,  K = (R + B'X B)^-1 B'X A
//! ```
//!
//! The continuous equation is solved by the sign of the Hamiltonian matrix, scaled by its determinant (R. Byers, *Linear Algebra Appl.* 85
//! (1987) 267), the discrete one by doubling (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang, *Int. J. Control* 77 (2004) 767,
//! doi 10.1080/00207170410001714988). Both are refined until the residual is that of round-off, and refused where it stays large.

use nalgebra::{DMatrix, SVD, SymmetricEigen};

use crate::error::ControlError;
use crate::linear::{Plant, eigenvalues_of};
use crate::matrix::{finite, from_rows, inverse, symmetric, to_rows};

/// Most iterations of the sign function and of doubling; both converge quadratically.
const MAX_ITERATIONS: usize = 100;
/// Most iterations of a decomposition.
const MAX_DECOMPOSITION: usize = 10_000;
/// Relative change at which an iteration has converged.
const CONVERGED: f64 = 1e-14;
/// Largest residual of a Riccati equation relative to its terms.
const RESIDUAL: f64 = 1e-8;

/// A regulator: gain and cost of `NX` states and `NU` controls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regulator<const NX: usize, const NU: usize> {
    /// `K`, controls by states.
    pub gain: [[f64; NX]; NU],
    /// `X`: the least cost from `x` is `x'X x`.
    pub cost: [[f64; NX]; NX],
}

impl<const NX: usize, const NU: usize> Regulator<NX, NU> {
    /// `-K (x - target)`.
    #[must_use]
    pub fn control(&self, x: &[f64; NX], target: &[f64; NX]) -> [f64; NU] {
        feedback(&self.gain, x, target)
    }
}

/// `-K (x - target)`.
pub(crate) fn feedback<const NX: usize, const NU: usize>(
    gain: &[[f64; NX]; NU],
    x: &[f64; NX],
    target: &[f64; NX],
) -> [f64; NU] {
    std::array::from_fn(|i| -(0..NX).map(|j| gain[i][j] * (x[j] - target[j])).sum::<f64>())
}

/// The regulator of a continuous plant for the state cost `q` (positive semidefinite) and the control cost `r` (positive definite).
///
/// # Errors
/// [`ControlError::Parameter`] where a number is not finite, [`ControlError::Riccati`] where costs are not symmetric or definite as
/// needed, or where there is no stabilising solution: an unstable state that no control moves, or one on the imaginary axis that
/// costs nothing.
pub fn lqr<const NX: usize, const NU: usize>(
    plant: &Plant<NX, NU>,
    q: &[[f64; NX]; NX],
    r: &[[f64; NU]; NU],
) -> Result<Regulator<NX, NU>, ControlError> {
    let Data { a, b, q, r, weighted } = Data::checked(plant, q, r)?;
    let n = NX;
    let g = &b * &weighted;
    let mut h = DMatrix::zeros(2 * n, 2 * n);
    h.view_mut((0, 0), (n, n)).copy_from(&a);
    h.view_mut((0, n), (n, n)).copy_from(&-&g);
    h.view_mut((n, 0), (n, n)).copy_from(&-&q);
    h.view_mut((n, n), (n, n)).copy_from(&-a.transpose());
    let sign = sign_of(h)?;
    // The stable subspace is the kernel of sign + I: [S12; S22 + I] X = -[S11 + I; S21].
    let mut left = DMatrix::zeros(2 * n, n);
    let mut right = DMatrix::zeros(2 * n, n);
    left.view_mut((0, 0), (n, n)).copy_from(&sign.view((0, n), (n, n)));
    left.view_mut((n, 0), (n, n)).copy_from(&(sign.view((n, n), (n, n)) + DMatrix::identity(n, n)));
    right.view_mut((0, 0), (n, n)).copy_from(&-(sign.view((0, 0), (n, n)) + DMatrix::identity(n, n)));
    right.view_mut((n, 0), (n, n)).copy_from(&-sign.view((n, 0), (n, n)));
    const NO_GRAPH: ControlError = ControlError::Riccati { reason: "the stable subspace has no graph" };
    let svd = SVD::try_new(left, true, true, f64::EPSILON, MAX_DECOMPOSITION).ok_or(NO_GRAPH)?;
    let mut x = symmetric(&svd.solve(&right, f64::EPSILON).map_err(|_| NO_GRAPH)?);
    let residual = |x: &DMatrix<f64>| a.transpose() * x + x * &a - x * &g * x + &q;
    // One step of Newton's method (D. L. Kleinman, 1968) removes what the sign function lost.
    if let Some(step) = lyapunov(&(&a - &g * &x), &residual(&x)) {
        let better = symmetric(&(&x + step));
        if residual(&better).norm() < residual(&x).norm() {
            x = better;
        }
    }
    let size = 2.0 * (&a.transpose() * &x).norm() + (&x * &g * &x).norm() + q.norm();
    accept(residual(&x).norm(), size)?;
    let gain = inverse("control cost", r)? * b.transpose() * &x;
    let poles = eigenvalues_of("the closed loop", &(a - b * &gain))?;
    require_stable(poles.iter().all(|e| e.re < 0.0))?;
    Ok(Regulator { gain: to_rows(&gain), cost: to_rows(&x) })
}

/// The regulator of a sampled plant, whose matrices are of one sample (see [`Plant::sampled`]); costs are per sample.
///
/// # Errors
/// As [`lqr`], with the unit circle for the imaginary axis.
///
/// # Examples
/// ```
/// use apsides_control::linear::Plant;
/// use apsides_control::lqr::lqr_discrete;
///
/// // x+ = 2 x + u at unit costs: the cost solves X = 4 X - 4 X^2 / (1 + X) + 1, and X = 2 + sqrt 5.
/// let plant = Plant { a: [[2.0]], b: [[1.0]] };
/// let regulator = lqr_discrete(&plant, &[[1.0]], &[[1.0]])?;
/// let cost = 2.0 + 5.0_f64.sqrt();
/// assert!((regulator.cost[0][0] - cost).abs() < 1e-12);
/// assert!((regulator.gain[0][0] - 2.0 * cost / (1.0 + cost)).abs() < 1e-12);
/// # Ok::<(), apsides_control::ControlError>(())
/// ```
pub fn lqr_discrete<const NX: usize, const NU: usize>(
    plant: &Plant<NX, NU>,
    q: &[[f64; NX]; NX],
    r: &[[f64; NU]; NU],
) -> Result<Regulator<NX, NU>, ControlError> {
    let Data { a, b, q, r, weighted } = Data::checked(plant, q, r)?;
    let identity = DMatrix::<f64>::identity(NX, NX);
    let (mut ak, mut gk, mut x) = (a.clone(), &b * weighted, q.clone());
    let mut converged = false;
    for _ in 0..MAX_ITERATIONS {
        let w = inverse("a matrix of the doubling iteration", &identity + &gk * &x)?;
        let step = symmetric(&(ak.transpose() * &x * &w * &ak));
        gk = symmetric(&(&gk + &ak * &w * &gk * ak.transpose()));
        ak = &ak * &w * &ak;
        x += &step;
        if step.norm() <= CONVERGED * x.norm() {
            converged = true;
            break;
        }
        if !x.iter().all(|v| v.is_finite()) {
            break;
        }
    }
    if !converged {
        return Err(ControlError::Riccati { reason: "doubling does not converge" });
    }
    let gain = inverse("R + B'X B", &r + b.transpose() * &x * &b)? * b.transpose() * &x * &a;
    let closed = &a - &b * &gain;
    let residual = closed.transpose() * &x * &closed + gain.transpose() * &r * &gain + &q - &x;
    accept(residual.norm(), x.norm() + q.norm())?;
    let poles = eigenvalues_of("the closed loop", &closed)?;
    require_stable(poles.iter().all(|e| e.frequency() < 1.0))?;
    Ok(Regulator { gain: to_rows(&gain), cost: to_rows(&x) })
}

/// Matrices of a regulator problem, checked.
struct Data {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    q: DMatrix<f64>,
    r: DMatrix<f64>,
    /// `R^-1 B'`.
    weighted: DMatrix<f64>,
}

impl Data {
    fn checked<const NX: usize, const NU: usize>(
        plant: &Plant<NX, NU>,
        q: &[[f64; NX]; NX],
        r: &[[f64; NU]; NU],
    ) -> Result<Self, ControlError> {
        let a = finite("state matrix of the plant", from_rows(&plant.a))?;
        let b = finite("control matrix of the plant", from_rows(&plant.b))?;
        let q = finite("state cost", from_rows(q))?;
        let r = finite("control cost", from_rows(r))?;
        if q != q.transpose() || r != r.transpose() {
            return Err(ControlError::Riccati { reason: "a cost is not symmetric" });
        }
        let spectrum = SymmetricEigen::try_new(q.clone(), f64::EPSILON, MAX_DECOMPOSITION)
            .ok_or(ControlError::Eigenvalues { what: "the state cost" })?;
        // Round-off of a semidefinite matrix.
        if spectrum.eigenvalues.min() < -1e-12 * q.norm() {
            return Err(ControlError::Riccati { reason: "the state cost is not positive semidefinite" });
        }
        let Some(factor) = r.clone().cholesky() else {
            return Err(ControlError::Riccati { reason: "the control cost is not positive definite" });
        };
        let weighted = factor.solve(&b.transpose());
        Ok(Self { a, b, q, r, weighted })
    }
}

fn accept(residual: f64, size: f64) -> Result<(), ControlError> {
    if residual <= RESIDUAL * size {
        Ok(())
    } else {
        Err(ControlError::Riccati { reason: "its residual is not small" })
    }
}

fn require_stable(stable: bool) -> Result<(), ControlError> {
    if stable { Ok(()) } else { Err(ControlError::Riccati { reason: "the closed loop is not stable" }) }
}

/// The sign of a matrix by Newton's iteration `S <- (c S + (c S)^-1) / 2`, `c = |det S|^(-1/n)`.
fn sign_of(mut s: DMatrix<f64>) -> Result<DMatrix<f64>, ControlError> {
    const AXIS: ControlError = ControlError::Riccati {
        reason: "the Hamiltonian matrix has eigenvalues on the imaginary axis (uncontrolled or without cost)",
    };
    let n = s.nrows() as f64;
    for _ in 0..MAX_ITERATIONS {
        let lu = s.clone().lu();
        let magnitude: f64 = lu.u().diagonal().iter().map(|d| d.abs().ln()).sum::<f64>() / n;
        let inverse = lu.try_inverse().filter(|_| magnitude.is_finite()).ok_or(AXIS)?;
        let c = (-magnitude).exp();
        let next = (&s * c + inverse / c) * 0.5;
        let change = (&next - &s).norm();
        s = next;
        if !change.is_finite() {
            return Err(AXIS);
        }
        if change <= CONVERGED.sqrt() * 1e-2 * s.norm() {
            return Ok(s);
        }
    }
    Err(AXIS)
}

/// `X` of `C'X + X C + R = 0` as a linear system of the Kronecker sum; `None` where it is singular.
fn lyapunov(c: &DMatrix<f64>, r: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = c.nrows();
    let identity = DMatrix::<f64>::identity(n, n);
    let system = identity.kronecker(&c.transpose()) + c.transpose().kronecker(&identity);
    let right = DMatrix::from_iterator(n * n, 1, r.iter().map(|v| -v));
    let x = system.lu().solve(&right)?;
    Some(DMatrix::from_iterator(n, n, x.iter().copied()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solution of the Riccati equation in double precision.
    const ROUNDING: f64 = 1e-12;

    const DOUBLE_INTEGRATOR: Plant<2, 1> = Plant { a: [[0.0, 1.0], [0.0, 0.0]], b: [[0.0], [1.0]] };
    const UNIT: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

    /// Discretisation: terms of second order in the sample time.
    const SECOND_ORDER: f64 = 0.02;

    /// Round-off of the cost of some thousand steps, and what is left of it after them, relative.
    const COST: f64 = 1e-9;

    #[test]
    fn double_integrator() {
        // Q = I, R = 1: K = [1, sqrt 3], X = [[sqrt 3, 1], [1, sqrt 3]], by hand.
        let root = 3.0_f64.sqrt();
        let found = lqr(&DOUBLE_INTEGRATOR, &UNIT, &[[1.0]]).unwrap();
        assert!((found.gain[0][0] - 1.0).abs() < ROUNDING);
        assert!((found.gain[0][1] - root).abs() < ROUNDING);
        assert!((found.cost[0][0] - root).abs() < ROUNDING && (found.cost[0][1] - 1.0).abs() < ROUNDING);
        let u = found.control(&[1.0, 1.0], &[0.0, 1.0]);
        assert!((u[0] + 1.0).abs() < ROUNDING);
    }

    #[test]
    fn scalar_plants() {
        // x' = a x + u, q, r = 1: K = a + sqrt(a^2 + q).
        for a in [-3.0_f64, 0.0, 2.0, 500.0] {
            let plant = Plant { a: [[a]], b: [[1.0]] };
            let expected = a + (a * a + 4.0).sqrt();
            let found = lqr(&plant, &[[4.0]], &[[1.0]]).unwrap().gain[0][0];
            assert!((found - expected).abs() < ROUNDING * (1.0 + a.abs()), "{found} {expected}");
        }
        // x+ = x + u, q = r = 1: X = (1 + sqrt 5) / 2, K = X / (1 + X).
        let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
        let found = lqr_discrete(&Plant { a: [[1.0]], b: [[1.0]] }, &[[1.0]], &[[1.0]]).unwrap();
        assert!((found.cost[0][0] - golden).abs() < ROUNDING);
        assert!((found.gain[0][0] - golden / (1.0 + golden)).abs() < ROUNDING);
    }

    #[test]
    fn an_unstable_state_that_costs_nothing_is_moved_to_its_mirror() {
        // q = 0: the stabilising solution of x' = x + u is K = 2 (2 a X - X^2 = 0, X = 2).
        let found = lqr(&Plant { a: [[1.0]], b: [[1.0]] }, &[[0.0]], &[[1.0]]).unwrap();
        assert!((found.gain[0][0] - 2.0).abs() < ROUNDING);
    }

    #[test]
    fn fast_samples_approach_the_continuous_regulator() {
        let found = |step: f64| {
            let plant = DOUBLE_INTEGRATOR.sampled(step).unwrap();
            let q = UNIT.map(|row| row.map(|v| v * step));
            lqr_discrete(&plant, &q, &[[step]]).unwrap().gain[0]
        };
        // First order in the step: the error halves with it.
        let error = |step: f64| (found(step)[1] - 3.0_f64.sqrt()).abs();
        let ratio = error(1e-2) / error(5e-3);
        assert!((ratio - 2.0).abs() < SECOND_ORDER, "{ratio}");
    }

    #[test]
    fn the_cost_is_that_of_the_closed_loop() {
        // Badly scaled plant of four states: X solves its equation, and a sum over the closed loop gives x'X x.
        let a =
            [[1.0, 0.1, 0.0, 0.0], [0.02, 1.01, 30.0, 0.0], [0.0, 0.0, 0.9, 0.001], [0.0, 0.0, -5.0, 0.7]];
        let plant = Plant { a, b: [[0.0], [0.0], [0.0], [2.0]] };
        let mut q = [[0.0; 4]; 4];
        q[0][0] = 100.0;
        q[2][2] = 1.0;
        let found = lqr_discrete(&plant, &q, &[[0.01]]).unwrap();
        let mut x = [1.0, 0.0, 0.0, 0.0];
        let mut cost = 0.0;
        for _ in 0..20_000 {
            let u = found.control(&x, &[0.0; 4])[0];
            cost += 100.0 * x[0] * x[0] + x[2] * x[2] + 0.01 * u * u;
            x = std::array::from_fn(|i| (0..4).map(|j| a[i][j] * x[j]).sum::<f64>() + plant.b[i][0] * u);
        }
        let relative = cost / found.cost[0][0] - 1.0;
        assert!(relative.abs() < COST, "{relative}");
    }

    #[test]
    fn refusals() {
        let none: [[f64; 2]; 2] = [[0.0; 2]; 2];
        let riccati = |r: Result<Regulator<2, 1>, ControlError>| {
            assert!(matches!(r, Err(ControlError::Riccati { .. } | ControlError::Singular { .. })), "{r:?}");
        };
        // Nothing steers an unstable state.
        let stuck = Plant { a: [[1.0, 0.0], [0.0, -1.0]], b: [[0.0], [1.0]] };
        riccati(lqr(&stuck, &UNIT, &[[1.0]]));
        riccati(lqr_discrete(&Plant { a: [[2.0, 0.0], [0.0, 0.5]], b: stuck.b }, &UNIT, &[[1.0]]));
        // Eigenvalues on the axis that cost nothing.
        riccati(lqr(&DOUBLE_INTEGRATOR, &none, &[[1.0]]));
        riccati(lqr(&DOUBLE_INTEGRATOR, &UNIT, &[[0.0]]));
        riccati(lqr(&DOUBLE_INTEGRATOR, &[[-1.0, 0.0], [0.0, 1.0]], &[[1.0]]));
        riccati(lqr(&DOUBLE_INTEGRATOR, &[[1.0, 0.5], [0.0, 1.0]], &[[1.0]]));
        assert!(matches!(
            lqr(&DOUBLE_INTEGRATOR, &[[f64::NAN, 0.0], [0.0, 1.0]], &[[1.0]]),
            Err(ControlError::Parameter { what: "state cost", .. })
        ));
    }
}
