//! Iterative refinement against the matrix without the static shift: classical steps while they contract, then
//! GMRES preconditioned from the right by the same factor.
//!
//! A factor with small shifts or tiny pivots is a preconditioner of low-rank error, for which GMRES converges where
//! classical refinement stalls: Arioli, Duff, Gratton and Pralet, SIAM J. Sci. Comput. 29 (2007) 2024-2044,
//! doi:10.1137/060661545.

use crate::structure::Structure;

/// A classical step that leaves more than this part of the residual hands over to GMRES.
const CONTRACTION: f64 = 0.1;
/// A GMRES cycle that leaves more than this part of the residual is the last.
const STAGNATION: f64 = 0.5;
/// Most steps of a GMRES cycle: bounds the memory, one vector of length `n` each.
const CYCLE: usize = 20;
/// A residual of this many units of rounding of `|x|` cannot be improved in working precision.
const ROUNDING: f64 = 10.0 * f64::EPSILON;
/// Weight of the residual of primal or dual rows relative to their own right-hand sides.
const OF_A_KIND: f64 = 1e-3;

/// A linear system as scaled and permuted: upper triangle of the matrix and right-hand side.
#[derive(Clone, Copy)]
pub(crate) struct System<'a> {
    structure: &'a Structure,
    values: &'a [f64],
    rhs: &'a [f64],
    /// Positive for primal rows, negative for dual ones; zeros have signs, too.
    signs: &'a [f64],
    /// Largest magnitude in `rhs`, and in its primal and its dual rows.
    rhs_norm: f64,
    norms: [f64; 2],
    /// Size of a row of the matrix.
    unit: f64,
}

impl<'a> System<'a> {
    /// A system of rows of size `unit`; the right-hand side is not zero.
    pub(crate) fn new(
        structure: &'a Structure,
        values: &'a [f64],
        rhs: &'a [f64],
        signs: &'a [f64],
        unit: f64,
    ) -> Self {
        let norms = maxima(rhs, signs);
        Self { structure, values, rhs, signs, rhs_norm: norms[0].max(norms[1]), norms, unit }
    }

    /// Writes `b - A x`. Returns the larger one of the residuals of primal and dual rows, relative to their right-hand
    /// sides: what is small beside the one kind of rows may be all of the other. A right-hand side counts as large enough for
    /// a residual of `tolerance` to be more than the rounding of the product `A x`.
    fn residual(&self, x: &[f64], tolerance: f64, out: &mut [f64]) -> f64 {
        out.copy_from_slice(self.rhs);
        let size = maximum(x);
        if size > 0.0 {
            self.structure.subtract_product(self.values, x, out);
        }
        let least =
            (OF_A_KIND * ROUNDING * self.unit * size / tolerance.max(f64::MIN_POSITIVE)).min(self.rhs_norm);
        let [primal, dual] = maxima(out, self.signs);
        let relative =
            |residual: f64, norm: f64| if residual == 0.0 { 0.0 } else { residual / norm.max(least) };
        let by_kind = relative(primal, self.norms[0]).max(relative(dual, self.norms[1]));
        (primal.max(dual) / self.rhs_norm).max(OF_A_KIND * by_kind)
    }

    /// `|r| / |b|`, maximum norms.
    fn relative(&self, residual: &[f64]) -> f64 {
        maximum(residual) / self.rhs_norm
    }

    /// Relative residual at which refinement ends: the tolerance, or the rounding of the product `A x`, in
    /// rows of size `unit`.
    fn goal(&self, x: &[f64], tolerance: f64) -> f64 {
        tolerance.max(ROUNDING * self.unit * maximum(x) / self.rhs_norm)
    }
}

/// A factorisation, exact or not.
pub(crate) trait Substitution {
    /// Solves in place. False, with `x` of no use, if there is no complete factor or the result is not finite.
    fn solve(&mut self, x: &mut [f64]) -> bool;
}

/// The residual that refinement reached.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outcome {
    /// `|b - A x| / |b|`, maximum norms.
    pub(crate) residual: f64,
    /// The residual is at most the tolerance, or at rounding level.
    pub(crate) converged: bool,
    /// Solves with the factor.
    pub(crate) solves: usize,
}

/// Work space of the refinement.
pub(crate) struct Refiner {
    residual: Vec<f64>,
    trial: Vec<f64>,
    trial_residual: Vec<f64>,
    krylov: Krylov,
}

/// Arnoldi basis and the least-squares problem of GMRES.
struct Krylov {
    /// Most basis vectors that are multiplied.
    steps: usize,
    /// `steps + 1` vectors of length `n`.
    basis: Vec<f64>,
    /// Triangular factor of the Hessenberg matrix: `steps` columns of `steps + 1`.
    triangle: Vec<f64>,
    /// Givens rotations (cosine, sine).
    rotations: Vec<(f64, f64)>,
    /// Rotated right-hand side, then the coefficients.
    coefficients: Vec<f64>,
}

impl Refiner {
    /// Work space for systems of `n` rows and `limit` refinements.
    pub(crate) fn new(n: usize, limit: usize) -> Self {
        let steps = limit.saturating_sub(1).min(n).min(CYCLE);
        Self {
            residual: vec![0.0; n],
            trial: vec![0.0; n],
            trial_residual: vec![0.0; n],
            krylov: Krylov {
                steps,
                basis: vec![0.0; n * (steps + 1)],
                triangle: vec![0.0; (steps + 1) * steps],
                rotations: vec![(1.0, 0.0); steps],
                coefficients: vec![0.0; steps + 1],
            },
        }
    }

    /// Improves `x` towards the solution until its relative residual is at most `tolerance`, or at rounding level, or
    /// `limit` solves with the factor are spent. `x` only ever becomes better, and stays finite.
    pub(crate) fn solve(
        &mut self,
        system: System<'_>,
        factor: &mut impl Substitution,
        x: &mut [f64],
        tolerance: f64,
        limit: usize,
    ) -> Outcome {
        let mut solves = 0;
        if limit > 0 && maximum(x) == 0.0 {
            // Nothing to improve yet: the solution of the factor itself.
            x.copy_from_slice(system.rhs);
            solves = 1;
            if !factor.solve(x) {
                x.fill(0.0);
            }
        }
        let residual = system.residual(x, tolerance, &mut self.residual);
        let mut goal = system.goal(x, tolerance);
        let mut outcome = Outcome { residual, converged: residual <= goal, solves };
        let relative = system.relative(&self.residual);
        if relative.is_nan() || relative > 1.0 {
            // Worse than nothing: start from zero.
            x.fill(0.0);
            outcome.residual = system.residual(x, tolerance, &mut self.residual);
            goal = system.goal(x, tolerance);
        }
        let mut classical = true;
        while !outcome.converged && outcome.solves < limit {
            let before = outcome.residual;
            // The correction goes to `trial`.
            let solved = if classical {
                self.trial.copy_from_slice(&self.residual);
                outcome.solves += 1;
                factor.solve(&mut self.trial)
            } else {
                let target = 0.5 * goal * system.rhs_norm;
                let budget = limit - outcome.solves;
                let solves =
                    self.krylov.solve(system, factor, &self.residual, &mut self.trial, target, budget);
                outcome.solves += solves.unwrap_or(budget);
                solves.is_some()
            };
            if solved {
                for (t, &x) in self.trial.iter_mut().zip(&*x) {
                    *t += x;
                }
                let measure = system.residual(&self.trial, tolerance, &mut self.trial_residual);
                if measure < outcome.residual {
                    x.copy_from_slice(&self.trial);
                    std::mem::swap(&mut self.residual, &mut self.trial_residual);
                    outcome.residual = measure;
                    goal = system.goal(x, tolerance);
                }
            } else if classical {
                break;
            }
            // A residual that still halves is more than rounding.
            let stagnates = outcome.residual > STAGNATION * before;
            outcome.converged = outcome.residual <= if stagnates { goal } else { tolerance };
            if classical {
                classical = outcome.residual <= CONTRACTION * before;
            } else if stagnates {
                break;
            }
        }
        outcome.converged = outcome.residual <= goal;
        outcome.residual = system.relative(&self.residual);
        outcome
    }
}

impl Krylov {
    /// One GMRES cycle for `A d = residual`: writes the correction `d` and returns the solves spent, at most `budget`.
    /// Ends early when the Euclidean norm of the remaining residual is at most `target`. `None` if a solve failed.
    fn solve(
        &mut self,
        system: System<'_>,
        factor: &mut impl Substitution,
        residual: &[f64],
        correction: &mut [f64],
        target: f64,
        budget: usize,
    ) -> Option<usize> {
        let n = residual.len();
        let stride = self.steps + 1;
        let steps = self.steps.min(budget.saturating_sub(1));
        let norm = euclidean(residual);
        if steps == 0 || norm == 0.0 || !norm.is_finite() {
            return None;
        }
        for (v, &r) in self.basis[..n].iter_mut().zip(residual) {
            *v = r / norm;
        }
        self.coefficients.fill(0.0);
        self.coefficients[0] = norm;
        let mut used = 0;
        while used < steps {
            let k = used;
            let (known, rest) = self.basis.split_at_mut((k + 1) * n);
            let next = &mut rest[..n];
            correction.copy_from_slice(&known[k * n..]);
            if !factor.solve(correction) {
                return None;
            }
            // Minus the product: the sign is undone below.
            next.fill(0.0);
            system.structure.subtract_product(system.values, correction, next);
            next.iter_mut().for_each(|w| *w = -*w);
            let column = &mut self.triangle[k * stride..][..k + 2];
            for (h, v) in column.iter_mut().zip(known.chunks_exact(n)) {
                *h = dot(v, next);
                for (w, &v) in next.iter_mut().zip(v) {
                    *w -= *h * v;
                }
            }
            let height = euclidean(next);
            for (i, &(c, s)) in self.rotations[..k].iter().enumerate() {
                (column[i], column[i + 1]) =
                    (c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]);
            }
            let pivot = column[k].hypot(height);
            if pivot == 0.0 || !pivot.is_finite() {
                break;
            }
            let (c, s) = (column[k] / pivot, height / pivot);
            column[k] = pivot;
            self.rotations[k] = (c, s);
            self.coefficients[k + 1] = -s * self.coefficients[k];
            self.coefficients[k] *= c;
            used += 1;
            if self.coefficients[used].abs() <= target || height == 0.0 {
                break;
            }
            next.iter_mut().for_each(|w| *w /= height);
        }
        if used == 0 {
            return None;
        }
        for k in (0..used).rev() {
            let mut sum = self.coefficients[k];
            for j in k + 1..used {
                sum -= self.triangle[j * stride + k] * self.coefficients[j];
            }
            self.coefficients[k] = sum / self.triangle[k * stride + k];
        }
        correction.fill(0.0);
        for (&y, v) in self.coefficients[..used].iter().zip(self.basis.chunks_exact(n)) {
            for (d, &v) in correction.iter_mut().zip(v) {
                *d += y * v;
            }
        }
        factor.solve(correction).then_some(used + 1)
    }
}

/// Largest magnitude; NaN if any entry is.
pub(crate) fn maximum(v: &[f64]) -> f64 {
    const LANES: usize = 8;
    let larger = |m: f64, v: f64| if v.abs() <= m { m } else { v.abs() };
    let chunks = v.chunks_exact(LANES);
    let rest = chunks.remainder().iter().fold(0.0, |m, &v| larger(m, v));
    // Independent lanes, so that the comparisons need not wait for each other.
    let mut lanes = [0.0; LANES];
    for chunk in chunks {
        for (m, &v) in lanes.iter_mut().zip(chunk) {
            *m = larger(*m, v);
        }
    }
    lanes.into_iter().fold(rest, larger)
}

/// Largest magnitudes in the rows of positive and of negative sign.
fn maxima(v: &[f64], signs: &[f64]) -> [f64; 2] {
    let mut maxima = [0.0_f64; 2];
    for (v, sign) in v.iter().zip(signs) {
        let size = v.abs();
        let largest = &mut maxima[usize::from(sign.is_sign_negative())];
        // A NaN stays.
        *largest = if size <= *largest { *largest } else { size };
    }
    maxima
}

fn euclidean(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
