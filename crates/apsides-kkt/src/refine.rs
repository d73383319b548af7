//! Iterative refinement against the matrix without the static shift: classical steps while they contract, then
//! GMRES preconditioned from the right by the same factor.
//!
//! A factor with small shifts or tiny pivots is a preconditioner of low-rank error, for which GMRES converges where
//! classical refinement stalls: Arioli, Duff, Gratton and Pralet, SIAM J. Sci. Comput. 29 (2007) 2024-2044,
//! doi:10.1137/060661545.

use crate::KktSettings;
use crate::columns::{MOST_COLUMNS, columns_from, first_columns};
use crate::norms::{maxima, maximum};
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
    /// A system of rows of size `unit`.
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

    /// Writes `b - A x` and measures it.
    fn residual(&self, x: &[f64], tolerance: f64, out: &mut [f64]) -> Measure {
        out.copy_from_slice(self.rhs);
        self.structure.subtract_product(self.values, [x], [&mut *out]);
        self.measure(x, tolerance, out)
    }

    /// Measures the residual of `x`. The residuals of primal and of dual rows count relative to their own right-hand sides, too, with
    /// the weight [`OF_A_KIND`]: what is small beside the one kind of rows may be all of the other. A right-hand side counts as large enough
    /// for a residual of `tolerance` to be more than the rounding of the product `A x`.
    fn measure(&self, x: &[f64], tolerance: f64, residual: &[f64]) -> Measure {
        if self.rhs_norm == 0.0 {
            // The solution is zero.
            return Measure { whole: 0.0, weighed: 0.0, goal: tolerance };
        }
        let rounding = ROUNDING * self.unit * maximum(x);
        let least = (OF_A_KIND * rounding / tolerance.max(f64::MIN_POSITIVE)).min(self.rhs_norm);
        let [primal, dual] = maxima(residual, self.signs);
        let relative =
            |residual: f64, norm: f64| if residual == 0.0 { 0.0 } else { residual / norm.max(least) };
        let by_kind = OF_A_KIND * relative(primal, self.norms[0]).max(relative(dual, self.norms[1]));
        // A NaN of either kind stays one.
        let whole = maximum(&[primal, dual]) / self.rhs_norm;
        let weighed = if by_kind > whole { by_kind } else { whole };
        Measure { whole, weighed, goal: tolerance.max(rounding / self.rhs_norm) }
    }
}

/// The size of a residual.
#[derive(Clone, Copy)]
struct Measure {
    /// `|b - A x| / |b|`, maximum norms.
    whole: f64,
    /// The same, or that of primal or dual rows with its weight if that is larger.
    weighed: f64,
    /// Size at which refinement ends: the tolerance, or the rounding of the product `A x`, in rows of size `unit`.
    goal: f64,
}

/// A factorisation, exact or not.
pub(crate) trait Substitution {
    /// Solves in place. False, with `x` of no use, if there is no complete factor or the result is not finite.
    fn solve(&mut self, x: &mut [f64]) -> bool;

    /// The same for at most [`MOST_COLUMNS`] right-hand sides, each as if it were alone.
    fn solve_columns<const R: usize>(&mut self, x: [&mut [f64]; R]) -> [bool; R] {
        x.map(|x| self.solve(x))
    }
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

/// Refinement until the relative residual is at most a tolerance, with its work space.
pub(crate) struct Refiner {
    tolerance: f64,
    /// Most solves with a factor.
    limit: usize,
    /// One of each right-hand side: the residual of its solution; a correction, then the solution with it, and its residual.
    residuals: [Vec<f64>; MOST_COLUMNS],
    trials: [Vec<f64>; MOST_COLUMNS],
    trial_residuals: [Vec<f64>; MOST_COLUMNS],
    krylov: Krylov,
}

/// The refinement of one solution.
#[derive(Clone, Copy)]
struct Progress {
    measure: Measure,
    /// Solves with the factor.
    solves: usize,
    converged: bool,
    next: Next,
}

#[derive(Clone, Copy, PartialEq)]
enum Next {
    Classical,
    Gmres,
    /// Nothing helps any more.
    End,
}

impl Progress {
    fn goes_on(&self, limit: usize, next: Next) -> bool {
        !self.converged && self.solves < limit && self.next == next
    }

    /// Decides how to go on after a step from a residual of the size `before`.
    fn conclude(&mut self, before: f64, tolerance: f64) {
        // A residual that still halves is more than rounding.
        let stagnates = self.measure.weighed > STAGNATION * before;
        self.converged = self.measure.weighed <= if stagnates { self.measure.goal } else { tolerance };
        self.next = match self.next {
            Next::Classical if self.measure.weighed > CONTRACTION * before => Next::Gmres,
            Next::Gmres if stagnates => Next::End,
            next => next,
        };
    }
}

/// Arnoldi basis and the least-squares problem of GMRES.
struct Krylov {
    /// Most basis vectors that are multiplied.
    steps: usize,
    /// At most `steps + 1` vectors of length `n`, for which there is room; filled when they are needed.
    basis: Vec<f64>,
    /// Triangular factor of the Hessenberg matrix: `steps` columns of `steps + 1`.
    triangle: Vec<f64>,
    /// Givens rotations (cosine, sine).
    rotations: Vec<(f64, f64)>,
    /// Rotated right-hand side, then the coefficients.
    coefficients: Vec<f64>,
}

impl Refiner {
    /// Refinement of solutions of systems of `n` rows.
    pub(crate) fn new(n: usize, settings: &KktSettings) -> Self {
        let steps = settings.max_refinements.min(n).min(CYCLE);
        let vectors = || std::array::from_fn(|_| vec![0.0; n]);
        Self {
            tolerance: settings.residual_tolerance,
            limit: settings.max_refinements.saturating_add(1),
            residuals: vectors(),
            trials: vectors(),
            trial_residuals: vectors(),
            krylov: Krylov {
                steps,
                basis: Vec::with_capacity(n * (steps + 1)),
                triangle: vec![0.0; (steps + 1) * steps],
                rotations: vec![(1.0, 0.0); steps],
                coefficients: vec![0.0; steps + 1],
            },
        }
    }

    /// Solves systems with one matrix, each as if it were alone, and improves the solutions until their relative residual is at most the
    /// tolerance, or at rounding level, or the most solves with the factor are spent. Solutions stay finite.
    pub(crate) fn solve<const R: usize>(
        &mut self,
        systems: [System<'_>; R],
        factor: &mut impl Substitution,
        mut x: [&mut [f64]; R],
    ) -> [Outcome; R] {
        for (x, system) in x.iter_mut().zip(&systems) {
            x.copy_from_slice(system.rhs);
        }
        let finite = factor.solve_columns(x.each_mut().map(|x| &mut **x));
        for (x, _) in x.iter_mut().zip(finite).filter(|(_, finite)| !finite) {
            x.fill(0.0);
        }
        let mut residuals: [&mut [f64]; R] = first_columns(&mut self.residuals);
        for (residual, system) in residuals.iter_mut().zip(&systems) {
            residual.copy_from_slice(system.rhs);
        }
        subtract_products(&systems, &x, residuals);
        let mut progress: [Progress; R] = std::array::from_fn(|k| {
            let measure = systems[k].measure(x[k], self.tolerance, &self.residuals[k]);
            self.begin(k, systems[k], x[k], measure, 1)
        });
        // Steps that all want are taken at once.
        while R > 1 && progress.iter().all(|progress| progress.goes_on(self.limit, Next::Classical)) {
            self.classical_step(0, systems, factor, x.each_mut().map(|x| &mut **x), &mut progress);
        }
        std::array::from_fn(|k| self.improve(k, systems[k], factor, x[k], progress[k]))
    }

    /// Improves a solution with another factor, or finds one if there is none yet. `x` only ever becomes better, and stays finite.
    pub(crate) fn resume(
        &mut self,
        system: System<'_>,
        factor: &mut impl Substitution,
        x: &mut [f64],
    ) -> Outcome {
        let mut solves = 0;
        if maximum(x) == 0.0 {
            x.copy_from_slice(system.rhs);
            solves = 1;
            if !factor.solve(x) {
                x.fill(0.0);
            }
        }
        let measure = system.residual(x, self.tolerance, &mut self.residuals[0]);
        let progress = self.begin(0, system, x, measure, solves);
        self.improve(0, system, factor, x, progress)
    }

    /// The refinement of a solution whose residual is number `k`, after so many solves with the factor.
    fn begin(
        &mut self,
        k: usize,
        system: System<'_>,
        x: &mut [f64],
        mut measure: Measure,
        solves: usize,
    ) -> Progress {
        let converged = measure.weighed <= measure.goal;
        if measure.whole.is_nan() || measure.whole > 1.0 {
            // Worse than nothing: start from zero.
            x.fill(0.0);
            measure = system.residual(x, self.tolerance, &mut self.residuals[k]);
        }
        Progress { measure, solves, converged, next: Next::Classical }
    }

    /// Improves a solution whose residual is number `k`.
    fn improve(
        &mut self,
        k: usize,
        system: System<'_>,
        factor: &mut impl Substitution,
        x: &mut [f64],
        progress: Progress,
    ) -> Outcome {
        let mut progress = [progress];
        while progress[0].goes_on(self.limit, Next::Classical) {
            self.classical_step(k, [system], factor, [&mut *x], &mut progress);
        }
        while progress[0].goes_on(self.limit, Next::Gmres) {
            self.gmres_cycle(k, system, factor, &mut *x, &mut progress);
        }
        let [Progress { measure, solves, .. }] = progress;
        Outcome { residual: measure.whole, converged: measure.weighed <= measure.goal, solves }
    }

    /// Corrects solutions, whose residuals begin with number `first`, by a solve with the factor.
    fn classical_step<const R: usize>(
        &mut self,
        first: usize,
        systems: [System<'_>; R],
        factor: &mut impl Substitution,
        x: [&mut [f64]; R],
        progress: &mut [Progress; R],
    ) {
        let mut corrections: [&mut [f64]; R] = columns_from(&mut self.trials, first);
        for (correction, residual) in corrections.iter_mut().zip(&self.residuals[first..]) {
            correction.copy_from_slice(residual);
        }
        let solved = factor.solve_columns(corrections);
        let before = progress.map(|progress| progress.measure.weighed);
        self.take_corrections(first, systems, x, progress, solved);
        for ((progress, before), solved) in progress.iter_mut().zip(before).zip(solved) {
            progress.solves += 1;
            progress.conclude(before, self.tolerance);
            if !solved {
                progress.next = Next::End;
            }
        }
    }

    /// Corrects a solution whose residual is number `k` by a cycle of GMRES.
    fn gmres_cycle(
        &mut self,
        k: usize,
        system: System<'_>,
        factor: &mut impl Substitution,
        x: &mut [f64],
        progress: &mut [Progress; 1],
    ) {
        let [Progress { measure, solves, .. }] = progress;
        let before = measure.weighed;
        let target = 0.5 * measure.goal * system.rhs_norm;
        let budget = self.limit - *solves;
        let (residual, correction) = (&self.residuals[k], &mut self.trials[k]);
        let spent = self.krylov.solve(system, factor, residual, correction, target, budget);
        *solves += spent.unwrap_or(budget);
        self.take_corrections(k, [system], [x], progress, [spent.is_some()]);
        progress[0].conclude(before, self.tolerance);
    }

    /// Takes the corrections in `trials`, of those that are solved, that make the residual smaller.
    fn take_corrections<const R: usize>(
        &mut self,
        first: usize,
        systems: [System<'_>; R],
        x: [&mut [f64]; R],
        progress: &mut [Progress; R],
        solved: [bool; R],
    ) {
        for k in 0..R {
            for (trial, &x) in self.trials[first + k].iter_mut().zip(&*x[k]) {
                *trial += x;
            }
            self.trial_residuals[first + k].copy_from_slice(systems[k].rhs);
        }
        subtract_products(
            &systems,
            &columns_from(&mut self.trials, first),
            columns_from(&mut self.trial_residuals, first),
        );
        for ((k, x), progress) in x.into_iter().enumerate().zip(progress).filter(|((k, _), _)| solved[*k]) {
            let (trial, residual) = (&self.trials[first + k], &mut self.trial_residuals[first + k]);
            let measure = systems[k].measure(trial, self.tolerance, residual);
            if measure.weighed < progress.measure.weighed {
                x.copy_from_slice(trial);
                std::mem::swap(&mut self.residuals[first + k], residual);
                progress.measure = measure;
            }
        }
    }
}

/// Subtracts the products of the matrix that systems share with vectors from others.
fn subtract_products<const R: usize>(systems: &[System<'_>; R], x: &[&mut [f64]; R], out: [&mut [f64]; R]) {
    if let Some(system) = systems.first() {
        system.structure.subtract_product(system.values, x.each_ref().map(|x| &**x), out);
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
        self.basis.clear();
        self.basis.extend(residual.iter().map(|r| r / norm));
        self.coefficients.fill(0.0);
        self.coefficients[0] = norm;
        let mut used = 0;
        while used < steps {
            let k = used;
            self.basis.resize((k + 2) * n, 0.0);
            let (known, next) = self.basis.split_at_mut((k + 1) * n);
            correction.copy_from_slice(&known[k * n..]);
            if !factor.solve(correction) {
                return None;
            }
            // Minus the product: the sign is undone below.
            system.structure.subtract_product(system.values, [&*correction], [&mut *next]);
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

fn euclidean(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ordering;
    use crate::analysis::Analysis;

    /// Round-off of the arithmetic.
    const ROUND_OFF: f64 = 1e-15;

    /// A primal row and a dual row that are not coupled.
    fn measured(values: [f64; 2], rhs: [f64; 2], x: [f64; 2]) -> Measure {
        let order = Ordering::Custom(vec![0, 1]);
        let Analysis { structure, .. } = Analysis::new(2, &[0, 1], &[0, 1], &order).expect("small");
        System::new(&structure, &values, &rhs, &[0.0, -0.0], 1.0).residual(&x, 1e-10, &mut [0.0; 2])
    }

    #[test]
    fn a_residual_that_is_all_of_its_kind_counts() {
        // The dual row is not solved at all, and small beside the right-hand side.
        let measure = measured([1.0, 1.0], [1.0, 1e-6], [1.0, 0.0]);
        assert_eq!((measure.whole, measure.weighed), (1e-6, OF_A_KIND));
        // Rounding of the product is no residual of a kind without a right-hand side.
        let measure = measured([1.0, 1.0], [1.0, 0.0], [1.0, ROUND_OFF]);
        assert!(measure.weighed <= measure.goal, "{}", measure.weighed);
    }

    #[test]
    fn a_residual_that_is_no_number_is_never_small() {
        for values in [[f64::MAX, 1.0], [1.0, f64::MAX]] {
            let measure = measured(values.map(|v| v * 1e10 - v * 1e10), [1.0, 1.0], [1.0, 1.0]);
            assert!(measure.whole.is_nan() && measure.weighed.is_nan());
        }
    }
}
