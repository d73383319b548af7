//! The linear system of the search direction (Waechter and Biegler, eq. 13),
//!
//! ```text
//! [ H + Sigma + dw I   J^T   ] [dv]     [rp]
//! [ J                 -dc I  ] [dy] = - [rd]
//! ```
//!
//! with the unit variables eliminated: a unit variable `k` of row `i` with `s_k = Sigma_k + dw` adds `-1/s_k` to the
//! diagonal of row `i`. So slacks and elastic variables cost nothing, and the restoration phase uses the same analysis.

use std::time::{Duration, Instant};

use apsides_kkt::{Inertia, KktSettings, KktSystem, Ordering};

use crate::error::NlpError;
use crate::model::{BarrierModel, Structure};
use crate::scaled::ScaledProblem;
use crate::settings::NlpSettings;
use crate::vector::{all_finite, max_abs};

/// A residual of this size is rounding of the scaled functions, however small the right-hand side.
const ROUNDING: f64 = 1e-13;

/// The matrix, its factor and the work vectors; allocated once.
pub(crate) struct AugmentedSystem {
    system: KktSystem,
    /// Hessian, primal diagonal, Jacobian, dual diagonal.
    values: Vec<f64>,
    jacobian_at: usize,
    dual_at: usize,
    primal_at: usize,
    rhs: [Vec<f64>; 2],
    solutions: [Vec<f64>; 2],
    /// `1 / (Sigma_k + dw)` of each unit variable.
    unit_inverse: Vec<f64>,
    row_sum: Vec<f64>,
    dual_shift: f64,
    pub(crate) factorisations: usize,
    pub(crate) solves: usize,
    pub(crate) time: Duration,
}

/// The residuals `rp` and `rd`, and the step that is to take them away.
pub(crate) struct Newton<'a> {
    pub(crate) primal: &'a [f64],
    pub(crate) dual: &'a [f64],
    pub(crate) dv: &'a mut [f64],
    pub(crate) dy: &'a mut [f64],
}

impl AugmentedSystem {
    /// The system of a problem, eliminated by its stages where it has them and the settings ask for no other order.
    pub(crate) fn of(problem: &ScaledProblem<'_>, settings: &NlpSettings) -> Result<Self, NlpError> {
        let mut kkt = settings.kkt.clone();
        if kkt.ordering == Ordering::Amd
            && let Some(stages) = problem.stages()?
        {
            kkt.ordering = Ordering::Stages(stages);
        }
        Self::new(problem.structure(), kkt)
    }

    /// Begins to count and to time anew.
    pub(crate) fn forget_work(&mut self) {
        (self.factorisations, self.solves, self.time) = (0, 0, Duration::ZERO);
    }

    pub(crate) fn new(structure: &Structure, settings: KktSettings) -> Result<Self, NlpError> {
        let start = Instant::now();
        let (n, m) = (structure.variables, structure.constraints);
        let primal_at = structure.hessian.len();
        let jacobian_at = primal_at + n;
        let dual_at = jacobian_at + structure.jacobian.len();
        let entries = dual_at + m;
        let (mut rows, mut cols) = (Vec::with_capacity(entries), Vec::with_capacity(entries));
        rows.extend_from_slice(&structure.hessian.rows);
        cols.extend_from_slice(&structure.hessian.cols);
        rows.extend(0..n);
        cols.extend(0..n);
        rows.extend(structure.jacobian.rows.iter().map(|row| n + row));
        cols.extend_from_slice(&structure.jacobian.cols);
        rows.extend(n..n + m);
        cols.extend(n..n + m);
        let values = vec![0.0; rows.len()];
        let system = KktSystem::analyse(n + m, n, &rows, &cols, settings)?;
        Ok(Self {
            system,
            values,
            jacobian_at,
            dual_at,
            primal_at,
            rhs: std::array::from_fn(|_| vec![0.0; n + m]),
            solutions: std::array::from_fn(|_| vec![0.0; n + m]),
            // Room for slacks and elastic variables, so that the restoration phase does not allocate here.
            unit_inverse: vec![0.0; structure.units.len() + 2 * m],
            row_sum: vec![0.0; m],
            dual_shift: 0.0,
            factorisations: 0,
            solves: 0,
            time: start.elapsed(),
        })
    }

    /// Sets the matrix. `diagonal` has an entry for every primal variable: `Sigma` and diagonal parts of the Hessian.
    pub(crate) fn load(&mut self, hessian: Option<&[f64]>, diagonal: &[f64], jacobian: &[f64]) {
        let n = self.jacobian_at - self.primal_at;
        match hessian {
            Some(hessian) => self.values[..self.primal_at].copy_from_slice(hessian),
            None => self.values[..self.primal_at].fill(0.0),
        }
        self.values[self.primal_at..self.jacobian_at].copy_from_slice(&diagonal[..n]);
        self.values[self.jacobian_at..self.dual_at].copy_from_slice(jacobian);
    }

    /// Factorises the loaded matrix with the given regularisation. `None` if it is numerically unusable.
    pub(crate) fn factor(
        &mut self,
        structure: &Structure,
        diagonal: &[f64],
        primal_shift: f64,
        dual_shift: f64,
    ) -> Option<Inertia> {
        let start = Instant::now();
        self.dual_shift = dual_shift;
        let dual = &mut self.values[self.dual_at..];
        dual.fill(0.0);
        let diagonal = &diagonal[structure.variables..];
        for ((unit, sigma), inverse) in structure.units.iter().zip(diagonal).zip(&mut self.unit_inverse) {
            *inverse = 1.0 / (sigma + primal_shift);
            dual[unit.row] -= *inverse;
        }
        let inertia = self.system.factor(&self.values, primal_shift, dual_shift);
        self.factorisations += 1;
        self.time += start.elapsed();
        inertia.ok()
    }

    /// Finds at most two steps at once; returns the relative residual of each, infinite if the solve failed.
    pub(crate) fn solve<const R: usize>(
        &mut self,
        structure: &Structure,
        jacobian: &[f64],
        mut steps: [Newton<'_>; R],
    ) -> [f64; R] {
        let start = Instant::now();
        let n = structure.variables;
        for (rhs, Newton { primal, dual, .. }) in self.rhs.iter_mut().zip(&steps) {
            let (x, y) = rhs.split_at_mut(n);
            x.iter_mut().zip(*primal).for_each(|(rhs, value)| *rhs = -value);
            y.iter_mut().zip(*dual).for_each(|(rhs, value)| *rhs = -value);
            for ((unit, value), inverse) in structure.units.iter().zip(&primal[n..]).zip(&self.unit_inverse) {
                rhs[n + unit.row] += unit.sign * value * inverse;
            }
        }
        let mut residuals = [f64::INFINITY; R];
        let (Some(rhs), Some(solutions)) =
            (self.rhs.first_chunk::<R>(), self.solutions.first_chunk_mut::<R>())
        else {
            return residuals;
        };
        let qualities = self.system.solve_columns(
            rhs.each_ref().map(|rhs| &rhs[..]),
            solutions.each_mut().map(|solution| &mut solution[..]),
        );
        for (k, step) in steps.iter_mut().enumerate() {
            step.dv[..n].copy_from_slice(&self.solutions[k][..n]);
            step.dy.copy_from_slice(&self.solutions[k][n..]);
            self.recover_units(structure, jacobian, step);
            if let Ok(qualities) = &qualities
                && all_finite(step.dv)
                && all_finite(step.dy)
            {
                let relative = qualities[k].residual;
                let absolute = relative * max_abs(&self.rhs[k]);
                residuals[k] = if absolute <= ROUNDING { 0.0 } else { relative };
            }
        }
        self.solves += R;
        self.time += start.elapsed();
        residuals
    }

    /// The eliminated variables. A slack with a small `Sigma` comes from its constraint, because there its own
    /// equation would divide a cancellation by `Sigma`.
    fn recover_units(
        &mut self,
        structure: &Structure,
        jacobian: &[f64],
        Newton { primal, dual, dv, dy }: &mut Newton<'_>,
    ) {
        if structure.units.is_empty() {
            return;
        }
        let (x, units) = dv.split_at_mut(structure.variables);
        let residual = &primal[structure.variables..];
        for ((sum, dual), dy) in self.row_sum.iter_mut().zip(*dual).zip(&**dy) {
            *sum = dual - self.dual_shift * dy;
        }
        structure.add_product(jacobian, x, &mut self.row_sum);
        for k in (0..units.len()).rev() {
            let unit = structure.units[k];
            let inverse = self.unit_inverse[k];
            units[k] = if k < structure.slacks && inverse > 1.0 {
                -unit.sign * self.row_sum[unit.row]
            } else {
                -(residual[k] + unit.sign * dy[unit.row]) * inverse
            };
            self.row_sum[unit.row] += unit.sign * units[k];
        }
    }
}
