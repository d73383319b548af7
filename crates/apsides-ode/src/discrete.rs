//! Given steps as a function of the state they start from and of inputs, with exact first and second derivatives.
//!
//! With `v = (x_0, w)` and the stages `k_i = f(s_i, X_i, w)`, `X_i = x + h sum_j a_ij k_j` of a step,
//!
//! ```text
//! forward:  dX_i = dx + h sum_j a_ij dk_j,    dk_i = f_x dX_i + f_w,    dx+ = dx + h sum_i b_i dk_i
//! adjoint:  kappa_i = h (b_i lambda+ + sum_j a_ji f_x(X_j)^T kappa_j),  lambda = lambda+ + sum_i f_x(X_i)^T kappa_i
//! Hessian of lambda_end . x_end:   sum over steps and stages of (dX_i, dw)^T [kappa_i . f]'' (dX_i, dw)
//! ```
//!
//! These are derivatives of the numbers computed, not of the differential equation (E. Hairer, S. P. Norsett, G. Wanner, section
//! II.6 on variational equations with the same steps; W. W. Hager, Runge-Kutta methods in optimal control and the transformed adjoint
//! system, Numer. Math. 87 (2000) 247, doi:10.1007/s002110000178, for the adjoint).

use crate::error::require_dimension;
use crate::scheme::dop853::Dop853;
use crate::scheme::dopri5::Dopri5;
use crate::scheme::tableau::Tableau;
use crate::{Method, OdeError};

/// `dx/ds = f(s, x, w)` and quadratures `dq/ds = g(s, x, w)`, with first and second derivatives.
///
/// `n` states feed back, `q` quadratures do not, `m` inputs `w` are constant. Rates have `n + q` components, states first. A
/// sensitivity is a derivative with respect to `v = (x_0, w)`, row-major with `n + m` columns. Methods take `&mut self` for
/// storage of their own; what they write depends on the arguments alone. No method allocates.
pub trait SmoothSystem {
    /// Number `n` of states.
    fn states(&self) -> usize;

    /// Number `q` of quadratures.
    fn quadratures(&self) -> usize {
        0
    }

    /// Number `m` of inputs.
    fn inputs(&self) -> usize;

    /// Numbers that [`tangent`](Self::tangent) leaves for [`add_transposed`](Self::add_transposed) and
    /// [`add_hessian`](Self::add_hessian).
    fn entries(&self) -> usize;

    /// Writes the rates.
    fn rate(&mut self, s: f64, x: &[f64], w: &[f64], rate: &mut [f64]);

    /// Writes the rates, their sensitivity `f_x S + [0, f_w]` (`n + q` rows) for the sensitivity `S` of `x` (`n` rows), and the
    /// entries of this point.
    fn tangent(
        &mut self,
        s: f64,
        x: &[f64],
        w: &[f64],
        sensitivity: &[f64],
        rate: &mut [f64],
        tangent: &mut [f64],
        entries: &mut [f64],
    );

    /// Adds `[f_x; g_x]^T weights` to `out`, of length `n`.
    fn add_transposed(&mut self, w: &[f64], entries: &[f64], weights: &[f64], out: &mut [f64]);

    /// Adds the Hessian of `weights . [f; g]`, seen through `x(v)` with the sensitivity `S` and `w(v)`, to the lower triangle of
    /// the square row-major matrix `hessian` of order `n + m`; what is above the diagonal is of no use.
    fn add_hessian(
        &mut self,
        s: f64,
        x: &[f64],
        w: &[f64],
        sensitivity: &[f64],
        entries: &[f64],
        weights: &[f64],
        hessian: &mut [f64],
    );
}

/// Runge-Kutta steps between given points, with everything that their derivatives need. Owns all storage.
#[derive(Debug, Clone)]
pub struct DiscreteFlow {
    tableau: Tableau,
    states: usize,
    outputs: usize,
    columns: usize,
    entries_per_stage: usize,
    /// Ends of the steps.
    grid: Vec<f64>,
    /// States and quadratures at the ends of the steps.
    values: Vec<f64>,
    /// Their sensitivities.
    sensitivities: Vec<f64>,
    /// States and sensitivities of all stages, and the entries there.
    stage_states: Vec<f64>,
    stage_sensitivities: Vec<f64>,
    stage_entries: Vec<f64>,
    /// Rates of the stages of one step, and their sensitivities.
    rates: Vec<f64>,
    tangents: Vec<f64>,
    /// Adjoints at the ends of the steps, states and quadratures.
    adjoints: Vec<f64>,
    /// Adjoints `kappa` of the stages of one step; `pulled_back` holds `f_x^T kappa`.
    stage_adjoints: Vec<f64>,
    pulled_back: Vec<f64>,
}

impl DiscreteFlow {
    /// Steps of a method between consecutive points of `grid`, for systems of the sizes of `system`.
    ///
    /// # Errors
    /// [`OdeError::Dimension`] for fewer than two points, [`OdeError::NotFinite`].
    pub fn new<S: SmoothSystem>(method: Method, system: &S, grid: Vec<f64>) -> Result<Self, OdeError> {
        if grid.len() < 2 {
            return Err(OdeError::Dimension { argument: "grid", expected: 2, found: grid.len() });
        }
        crate::error::require_finite("grid", &grid)?;
        let tableau = match method {
            Method::Dop853 => Dop853::tableau(),
            Method::Dopri5 => Dopri5::tableau(),
        };
        let (n, q, m) = (system.states(), system.quadratures(), system.inputs());
        let (stages, points) = (tableau.stages(), grid.len());
        let all = stages * (points - 1);
        Ok(Self {
            states: n,
            outputs: n + q,
            columns: n + m,
            entries_per_stage: system.entries(),
            values: vec![0.0; points * (n + q)],
            sensitivities: vec![0.0; points * (n + q) * (n + m)],
            stage_states: vec![0.0; all * n],
            stage_sensitivities: vec![0.0; all * n * (n + m)],
            stage_entries: vec![0.0; all * system.entries()],
            rates: vec![0.0; stages * (n + q)],
            tangents: vec![0.0; stages * (n + q) * (n + m)],
            adjoints: vec![0.0; points * (n + q)],
            stage_adjoints: vec![0.0; stages * (n + q)],
            pulled_back: vec![0.0; stages * n],
            tableau,
            grid,
        })
    }

    /// Order of the method.
    pub fn order(&self) -> i32 {
        self.tableau.order
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.grid.len() - 1
    }

    /// States and quadratures at a point of the grid, after [`run`](Self::run) or [`differentiate`](Self::differentiate).
    pub fn value(&self, point: usize) -> &[f64] {
        &self.values[point * self.outputs..][..self.outputs]
    }

    /// Sensitivity of [`value`](Self::value), row-major `(n + q) x (n + m)`, after [`differentiate`](Self::differentiate).
    pub fn sensitivity(&self, point: usize) -> &[f64] {
        let size = self.outputs * self.columns;
        &self.sensitivities[point * size..][..size]
    }

    /// Adjoint of states and quadratures at a point of the grid, with the seed of that point, after
    /// [`add_hessian`](Self::add_hessian).
    pub fn adjoint(&self, point: usize) -> &[f64] {
        &self.adjoints[point * self.outputs..][..self.outputs]
    }

    /// Takes the steps from `x0` with inputs `w`; quadratures start at zero. What [`differentiate`](Self::differentiate) left is
    /// lost.
    ///
    /// # Errors
    /// [`OdeError::Dimension`]. A rate that is not finite gives values that are not finite.
    pub fn run<S: SmoothSystem>(&mut self, system: &mut S, x0: &[f64], w: &[f64]) -> Result<(), OdeError> {
        self.start(system, x0, w)?;
        let (n, o, stages) = (self.states, self.outputs, self.tableau.stages());
        for step in 0..self.steps() {
            let (s, h) = (self.grid[step], self.grid[step + 1] - self.grid[step]);
            let (before, after) = self.values.split_at_mut((step + 1) * o);
            let x = &before[step * o..];
            for i in 0..stages {
                let point = &mut self.stage_states[(step * stages + i) * n..][..n];
                let (earlier, rate) = self.rates.split_at_mut(i * o);
                combine(point, &x[..n], h, &self.tableau.a[i], earlier, o);
                system.rate(s + self.tableau.c[i] * h, point, w, &mut rate[..o]);
            }
            combine(&mut after[..o], x, h, &self.tableau.b, &self.rates, o);
        }
        Ok(())
    }

    /// Takes the steps with their sensitivities.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn differentiate<S: SmoothSystem>(
        &mut self,
        system: &mut S,
        x0: &[f64],
        w: &[f64],
    ) -> Result<(), OdeError> {
        self.start(system, x0, w)?;
        let (n, o, c) = (self.states, self.outputs, self.columns);
        let (e, stages) = (self.entries_per_stage, self.tableau.stages());
        self.sensitivities[..o * c].fill(0.0);
        for i in 0..n {
            self.sensitivities[i * c + i] = 1.0;
        }
        for step in 0..self.steps() {
            let (s, h) = (self.grid[step], self.grid[step + 1] - self.grid[step]);
            let (before, after) = self.values.split_at_mut((step + 1) * o);
            let x = &before[step * o..];
            let (past, future) = self.sensitivities.split_at_mut((step + 1) * o * c);
            let dx = &past[step * o * c..];
            for i in 0..stages {
                let stage = step * stages + i;
                let point = &mut self.stage_states[stage * n..][..n];
                let slope = &mut self.stage_sensitivities[stage * n * c..][..n * c];
                let entries = &mut self.stage_entries[stage * e..][..e];
                let (earlier, rate) = self.rates.split_at_mut(i * o);
                let (past_tangents, tangent) = self.tangents.split_at_mut(i * o * c);
                combine(point, &x[..n], h, &self.tableau.a[i], earlier, o);
                combine(slope, &dx[..n * c], h, &self.tableau.a[i], past_tangents, o * c);
                let at = s + self.tableau.c[i] * h;
                system.tangent(at, point, w, slope, &mut rate[..o], &mut tangent[..o * c], entries);
            }
            combine(&mut after[..o], x, h, &self.tableau.b, &self.rates, o);
            combine(&mut future[..o * c], dx, h, &self.tableau.b, &self.tangents, o * c);
        }
        Ok(())
    }

    /// Adds the Hessian of `sum_k seeds_k . value_k` with respect to `(x_0, w)` to the lower triangle of the square row-major
    /// matrix `hessian` of order `n + m` (what is above the diagonal is of no use), after [`differentiate`](Self::differentiate) at the same point.
    ///
    /// # Errors
    /// [`OdeError::Dimension`].
    pub fn add_hessian<S: SmoothSystem>(
        &mut self,
        system: &mut S,
        w: &[f64],
        seeds: &[f64],
        hessian: &mut [f64],
    ) -> Result<(), OdeError> {
        require_dimension("hessian", self.columns * self.columns, hessian.len())?;
        require_dimension("seeds", self.values.len(), seeds.len())?;
        require_dimension("w", self.columns - self.states, w.len())?;
        let (n, o, c) = (self.states, self.outputs, self.columns);
        let (e, stages) = (self.entries_per_stage, self.tableau.stages());
        self.adjoints.copy_from_slice(seeds);
        for step in (0..self.steps()).rev() {
            let (s, h) = (self.grid[step], self.grid[step + 1] - self.grid[step]);
            let (before, after) = self.adjoints.split_at_mut((step + 1) * o);
            let (lambda, end) = (&mut before[step * o..], &after[..o]);
            self.stage_adjoints.fill(0.0);
            for &(i, b) in &self.tableau.b {
                for (kappa, l) in self.stage_adjoints[i * o..][..o].iter_mut().zip(end) {
                    *kappa = h * b * l;
                }
            }
            self.pulled_back.fill(0.0);
            for i in (0..stages).rev() {
                let stage = step * stages + i;
                let point = &self.stage_states[stage * n..][..n];
                let slope = &self.stage_sensitivities[stage * n * c..][..n * c];
                let entries = &self.stage_entries[stage * e..][..e];
                let (earlier, kappa) = self.stage_adjoints.split_at_mut(i * o);
                let kappa = &kappa[..o];
                let pulled = &mut self.pulled_back[i * n..][..n];
                system.add_transposed(w, entries, kappa, pulled);
                system.add_hessian(s + self.tableau.c[i] * h, point, w, slope, entries, kappa, hessian);
                for &(j, a) in &self.tableau.a[i] {
                    for (kappa, p) in earlier[j * o..][..n].iter_mut().zip(&*pulled) {
                        *kappa += h * a * p;
                    }
                }
            }
            for (l, e) in lambda.iter_mut().zip(end) {
                *l += e;
            }
            for pulled in self.pulled_back.chunks_exact(n.max(1)) {
                for (l, p) in lambda[..n].iter_mut().zip(pulled) {
                    *l += p;
                }
            }
        }
        Ok(())
    }

    fn start<S: SmoothSystem>(&mut self, system: &S, x0: &[f64], w: &[f64]) -> Result<(), OdeError> {
        require_dimension("the system's states", self.states, system.states())?;
        require_dimension("the system's rates", self.outputs, system.states() + system.quadratures())?;
        require_dimension("the system's entries", self.entries_per_stage, system.entries())?;
        require_dimension("x0", self.states, x0.len())?;
        require_dimension("w", self.columns - self.states, w.len())?;
        self.values[..self.outputs].fill(0.0);
        self.values[..self.states].copy_from_slice(x0);
        Ok(())
    }
}

/// `out = x + h sum_j a_j k_j`, with `k_j` every `stride` numbers.
#[inline]
fn combine(out: &mut [f64], x: &[f64], h: f64, a: &[(usize, f64)], k: &[f64], stride: usize) {
    let length = out.len();
    out.copy_from_slice(&x[..length]);
    for &(j, a) in a {
        let factor = h * a;
        for (o, k) in out.iter_mut().zip(&k[j * stride..][..length]) {
            *o += factor * k;
        }
    }
}
