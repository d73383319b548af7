//! Variational equations: `Phi' = (df/dx) Phi`, `Psi' = (df/dx) Psi + df/dp`.

use std::cell::RefCell;

use crate::error::{require_dimension, require_finite};
use crate::{Integrator, Linearised, OdeError, OdeSettings, OdeSystem, Summary, Tolerance};

/// A system together with its variational equations.
///
/// The augmented state is `[x (n), Phi (n x n, row-major), Psi (n x p, row-major)]`, where
/// `Phi = dx(t)/dx(t0)` starts as the identity and `Psi = dx(t)/dp` as zero.
#[derive(Debug)]
pub struct Variational<'a, S> {
    system: &'a S,
    /// The Jacobian of the current evaluation.
    jacobian: RefCell<Vec<f64>>,
}

impl<'a, S: Linearised> Variational<'a, S> {
    /// The variational equations of `system`.
    pub fn new(system: &'a S) -> Self {
        Self::with_storage(system, Vec::new())
    }

    /// Dimension of the augmented state of a system of `n` components and `p` parameters.
    pub fn augmented_dimension(n: usize, p: usize) -> usize {
        n * (1 + n + p)
    }

    fn with_storage(system: &'a S, mut jacobian: Vec<f64>) -> Self {
        jacobian.resize(system.dimension() * system.dimension(), 0.0);
        Self { system, jacobian: RefCell::new(jacobian) }
    }

    fn into_storage(self) -> Vec<f64> {
        self.jacobian.into_inner()
    }
}

impl<S: Linearised> OdeSystem for Variational<'_, S> {
    fn dimension(&self) -> usize {
        Self::augmented_dimension(self.system.dimension(), self.system.parameters())
    }

    fn rate(&self, t: f64, z: &[f64], dz: &mut [f64]) {
        let (n, p) = (self.system.dimension(), self.system.parameters());
        let (x, sensitivities) = z.split_at(n);
        let (phi, psi) = sensitivities.split_at(n * n);
        let (dx, rates) = dz.split_at_mut(n);
        let (dphi, dpsi) = rates.split_at_mut(n * n);
        self.system.rate(t, x, dx);
        let mut jacobian = self.jacobian.borrow_mut();
        self.system.jacobian(t, x, &mut jacobian);
        dphi.fill(0.0);
        add_product(&jacobian, phi, n, n, dphi);
        if p > 0 {
            self.system.parameter_jacobian(t, x, dpsi);
            add_product(&jacobian, psi, n, p, dpsi);
        }
    }
}

/// `out += a b` with `a` of `n x n`, `b` and `out` of `n x columns`, all row-major.
fn add_product(a: &[f64], b: &[f64], n: usize, columns: usize, out: &mut [f64]) {
    for (a_row, out_row) in a.chunks_exact(n).zip(out.chunks_exact_mut(columns)) {
        for (&factor, b_row) in a_row.iter().zip(b.chunks_exact(columns)) {
            // Jacobians of second-order systems are half zeros.
            if factor != 0.0 {
                for (o, v) in out_row.iter_mut().zip(b_row) {
                    *o += factor * v;
                }
            }
        }
    }
}

/// Propagates a state with its state-transition matrix and parameter sensitivities.
///
/// Only the state enters the error control (unless [`controlled_components`](OdeSettings::controlled_components) says
/// otherwise): the steps, and so the end state, are those of the state alone, and the matrices are the exact
/// derivatives of the steps taken at fixed step sizes. Owns all storage.
#[derive(Debug, Clone)]
pub struct StmPropagator {
    dimension: usize,
    parameters: usize,
    integrator: Integrator,
    start: Vec<f64>,
    end: Vec<f64>,
    jacobian: Vec<f64>,
}

impl StmPropagator {
    /// A propagator for systems of `dimension` components and `parameters` parameters. Absolute tolerances per
    /// component are those of the state, or of the whole augmented state.
    ///
    /// # Errors
    /// As [`Integrator::new`].
    pub fn new(dimension: usize, parameters: usize, mut settings: OdeSettings) -> Result<Self, OdeError> {
        let augmented = dimension * (1 + dimension + parameters);
        settings.controlled_components = settings.controlled_components.or(Some(dimension));
        if let Tolerance::PerComponent(values) = &mut settings.absolute_tolerance
            && values.len() == dimension
        {
            // Sensitivities are not controlled; any positive number will do.
            values.resize(augmented, 1.0);
        }
        let integrator = Integrator::new(augmented, settings)?;
        Ok(Self {
            dimension,
            parameters,
            integrator,
            start: vec![0.0; augmented],
            end: vec![0.0; augmented],
            jacobian: vec![0.0; dimension * dimension],
        })
    }

    /// Propagates from `x0` at `t0` to `t1`, with `Phi` the identity and `Psi` zero at `t0`. The result is read by
    /// [`state`](Self::state), [`stm`](Self::stm) and [`sensitivity`](Self::sensitivity).
    ///
    /// # Errors
    /// As [`Integrator::integrate`].
    pub fn propagate<S: Linearised>(
        &mut self,
        system: &S,
        t0: f64,
        x0: &[f64],
        t1: f64,
    ) -> Result<Summary, OdeError> {
        let n = self.dimension;
        require_dimension("the system", n, system.dimension())?;
        require_dimension("the parameters", self.parameters, system.parameters())?;
        require_dimension("x0", n, x0.len())?;
        require_finite("x0", x0)?;
        self.start.fill(0.0);
        self.start[..n].copy_from_slice(x0);
        for i in 0..n {
            self.start[n + i * n + i] = 1.0;
        }
        let variational = Variational::with_storage(system, std::mem::take(&mut self.jacobian));
        let summary = self.integrator.integrate(&variational, t0, &self.start, t1, &mut self.end);
        self.jacobian = variational.into_storage();
        summary
    }

    /// State at the end of the last propagation.
    pub fn state(&self) -> &[f64] {
        &self.end[..self.dimension]
    }

    /// State-transition matrix `dx(t1)/dx(t0)`, row-major `n x n`.
    pub fn stm(&self) -> &[f64] {
        &self.end[self.dimension..self.dimension * (1 + self.dimension)]
    }

    /// Parameter sensitivities `dx(t1)/dp`, row-major `n x p`.
    pub fn sensitivity(&self) -> &[f64] {
        &self.end[self.dimension * (1 + self.dimension)..]
    }
}

/// Result of [`propagate_with_stm`].
#[derive(Debug, Clone, PartialEq)]
pub struct Stm {
    /// Status and work of the integration.
    pub summary: Summary,
    /// State at the time reached.
    pub state: Vec<f64>,
    /// State-transition matrix, row-major `n x n`.
    pub phi: Vec<f64>,
    /// Parameter sensitivities, row-major `n x p`.
    pub psi: Vec<f64>,
}

/// Propagates once with the state-transition matrix; for repeated use keep a [`StmPropagator`].
///
/// # Errors
/// As [`StmPropagator::new`] and [`StmPropagator::propagate`].
///
/// # Examples
/// ```
/// use apsides_ode::{Linearised, OdeSettings, OdeSystem, propagate_with_stm};
///
/// /// `x'' = -x`, which turns position and speed by the time.
/// struct Oscillator;
///
/// impl OdeSystem for Oscillator {
///     fn dimension(&self) -> usize { 2 }
///     fn rate(&self, _t: f64, x: &[f64], dx: &mut [f64]) { (dx[0], dx[1]) = (x[1], -x[0]) }
/// }
///
/// impl Linearised for Oscillator {
///     fn jacobian(&self, _t: f64, _x: &[f64], jac: &mut [f64]) { jac.copy_from_slice(&[0.0, 1.0, -1.0, 0.0]) }
/// }
///
/// let end = propagate_with_stm(&Oscillator, 0.0, &[1.0, 0.0], 2.0, OdeSettings::default())?;
/// let (sin, cos) = 2_f64.sin_cos();
/// assert!(end.phi.iter().zip([cos, sin, -sin, cos]).all(|(found, expected)| (found - expected).abs() < 1e-8));
/// # Ok::<(), apsides_ode::OdeError>(())
/// ```
pub fn propagate_with_stm<S: Linearised>(
    system: &S,
    t0: f64,
    x0: &[f64],
    t1: f64,
    settings: OdeSettings,
) -> Result<Stm, OdeError> {
    let mut propagator = StmPropagator::new(system.dimension(), system.parameters(), settings)?;
    let summary = propagator.propagate(system, t0, x0, t1)?;
    Ok(Stm {
        summary,
        state: propagator.state().to_vec(),
        phi: propagator.stm().to_vec(),
        psi: propagator.sensitivity().to_vec(),
    })
}
