//! The end of a solve: Newton's method on the active set that the interior point method has found.
//!
//! The barrier keeps every bound at a distance: where slack and multiplier both vanish, both are of the size of the square root of
//! the barrier parameter, and so is the error of the solution. With the active bounds held as equations and the others left
//! out the conditions are smooth, and a few Newton steps meet them to rounding. A bound whose multiplier comes out with the wrong
//! sign is released, one that is overstepped is held, for a few rounds (P. Gill, W. Murray, M. Wright, Practical
//! Optimization, Academic Press 1981, section 5.2). A system whose inertia is not that of a strict minimum, or a set that does
//! not settle, leaves the point of the interior point method as it is.

use apsides_iteration::OptimalityError;

use crate::augmented::{AugmentedSystem, Newton};
use crate::engine::Engine;
use crate::iterate::Point;
use crate::model::{BarrierModel, Structure};
use crate::scaled::ScaledProblem;
use crate::settings::NlpSettings;
use crate::state::SolverState;
use crate::step::SINGULAR_RESIDUAL;
use crate::vector::max_abs;

/// Changes of the set.
const ROUNDS: usize = 10;
/// Residuals of the scaled functions that are rounding.
const ROUNDING: f64 = 1e-13;
/// Where a step leaves at most this part of the residual, the matrix hardly changes over the next one.
const CHORD: f64 = 1e-5;
/// A residual below which the signs of multipliers that are much larger tell what is held: the set need not be solved for to rounding first.
const TELLING: f64 = 1e-2;
/// Multipliers of the wrong sign, and excesses of bounds, that a residual does not explain, as parts of it.
const MARGIN: f64 = 1e2;
/// Diagonal entry of a variable that is held.
const HELD: f64 = 1e16;
/// Diagonal entry of a slack that is free: its row takes no part.
const FREE_SLACK: f64 = 1e-14;
/// Multipliers of the wrong sign, and excesses of bounds, that are rounding.
const LEAST: f64 = 1e-12;

/// A slack below so many roots of the barrier parameter is close: one whose multiplier vanishes too is of the size of that root.
const CLOSE_BOUND: f64 = 100.0;

/// The reach of Newton's method for one set.
#[derive(Clone, Copy)]
pub(crate) struct Reach {
    /// Most steps.
    pub(crate) steps: usize,
    /// A step that moves a variable by more, relative to its size where that is above one, leads to another solution.
    pub(crate) close: f64,
    /// Residuals of the scaled functions at which the steps end.
    pub(crate) residual: f64,
    /// True if an older factor may take the last step, where residuals need not come down to rounding, and one is kept.
    pub(crate) keeps_factor: bool,
    /// True if a factor of a point close by, for the same set, is at hand for the first step.
    pub(crate) has_factor: bool,
}

/// Part of its slack that a bound loses, as the barrier parameter goes to zero, from which on it is active: all of it, or none.
const ACTIVE: f64 = 0.5;

/// From the end of an interior point method: where a step is long, what determines a variable is the barrier alone, as along singular arcs.
const POLISH: Reach =
    Reach { steps: 4, close: 3e-2, residual: ROUNDING, keeps_factor: false, has_factor: false };

/// The reason why a set of bounds that are held leads to no solution close by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Miss {
    /// The bounds that are held and the constraints determine more than there is.
    Contradiction,
    /// There is no minimum, or none near by.
    Elsewhere,
}

/// The end of Newton's method for one set.
struct Solved {
    steps: usize,
    /// Multipliers of the wrong sign, and excesses of bounds, that are no sign of another set.
    least: f64,
}

/// The place of a variable between its bounds.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Standing {
    Free,
    Lower,
    Upper,
}

impl Engine {
    /// Moves an optimal point to the exact solution for its active set; false, and the point as it was, if there is none close by, or it
    /// meets more than a part of its bounds.
    pub(crate) fn polish(
        &mut self,
        NlpSettings { polish: part, polish_by_course, .. }: &NlpSettings,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
    ) -> bool {
        if !self.state.meets_few_bounds(*part) {
            return false;
        }
        self.state.trial.copy_from(&self.state.current);
        let errors = self.state.errors;
        let sides = self.state.sides();
        let Err(miss) = self.settle(POLISH, &mut sides.clone(), problem, system) else { return true };
        self.restore(errors, problem);
        if miss != Miss::Contradiction && !polish_by_course {
            return false;
        }
        let Some(mut by_course) = self.state.sides_by_course(problem, system) else { return false };
        if by_course != sides && self.settle(POLISH, &mut by_course, problem, system).is_ok() {
            return true;
        }
        self.restore(errors, problem);
        false
    }

    /// Goes back to the point of the interior point method, which the trial point holds.
    fn restore(&mut self, errors: OptimalityError, problem: &mut ScaledProblem<'_>) {
        self.state.current.copy_from(&self.state.trial);
        self.state.errors = errors;
        if self.state.differentiate(problem).is_ok() {
            self.measure_errors(problem);
        }
    }

    /// Moves the point to the exact solution for the active set that begins as `sides`; the steps that it took, or why the set does not
    /// settle at an optimal point.
    pub(crate) fn settle(
        &mut self,
        mut reach: Reach,
        sides: &mut [Standing],
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
    ) -> Result<usize, Miss> {
        let (lower, upper) = problem.exact_bounds();
        let mut steps = 0;
        for _ in 0..ROUNDS {
            let solved = self.state.newton(reach, problem, system, sides, (&lower, &upper))?;
            reach.has_factor = false;
            steps += solved.steps;
            if !self.state.revise(sides, solved.least, (&lower, &upper)) {
                self.state.take_multipliers(sides);
                self.state.set_exact_slacks(&lower, &upper);
                self.state.update_dual_residual(problem);
                self.measure_errors(problem);
                return if self.is_optimal() { Ok(steps) } else { Err(Miss::Elsewhere) };
            }
        }
        Err(Miss::Elsewhere)
    }
}

impl SolverState {
    /// Returns true if the point is close to one of its bounds, or to a part of them, at most.
    fn meets_few_bounds(&self, part: f64) -> bool {
        let Point { lower_slack, upper_slack, .. } = &self.current;
        let close = CLOSE_BOUND * self.barrier.sqrt();
        let lower = self.bounds.lower_set.iter().filter(|&&i| lower_slack[i] < close).count();
        let upper = self.bounds.upper_set.iter().filter(|&&i| upper_slack[i] < close).count();
        let met = lower + upper;
        met <= 1 || met as f64 <= part * self.bounds.len() as f64
    }

    /// At a bound where the multiplier is larger than the slack.
    fn sides(&self) -> Vec<Standing> {
        let Point { zl, zu, lower_slack, upper_slack, .. } = &self.current;
        let side = |i: usize| match (zl[i] > lower_slack[i], zu[i] > upper_slack[i]) {
            (true, false) => Standing::Lower,
            (false, true) => Standing::Upper,
            _ => Standing::Free,
        };
        (0..zl.len()).map(side).collect()
    }

    /// At a bound whose slack goes to zero with the barrier parameter, and its multiplier does not; none where the system does not tell. A
    /// slack that is small by nature, as that of what has just left its bound, is smaller than its multiplier and keeps its size (A. El-Bakry,
    /// R. Tapia, Y. Zhang, SIAM Review 36 (1994) 45, doi 10.1137/1036002: the ratio of the slacks of two iterates).
    fn sides_by_course(
        &mut self,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
    ) -> Option<Vec<Standing>> {
        let structure = problem.structure().clone();
        problem.hessian(&self.current.v, &self.current.y, &mut self.hessian, &mut self.diagonal);
        for &i in &self.bounds.lower_set {
            self.diagonal[i] += self.current.zl[i] / self.current.lower_slack[i];
        }
        for &i in &self.bounds.upper_set {
            self.diagonal[i] += self.current.zu[i] / self.current.upper_slack[i];
        }
        system.load(Some(&self.hessian), &self.diagonal, &self.jacobian);
        let inertia = system.factor(&structure, &self.diagonal, 0.0, 0.0)?;
        if inertia.negative != structure.constraints || inertia.zero > 0 {
            return None;
        }
        let constraints = self.trial.constraints.clone();
        self.find_centring(&structure, system);
        self.trial.constraints.copy_from_slice(&constraints);
        let (point, course) = (&self.current, &self.corrected);
        // The part of its slack that a bound loses as the barrier goes to zero, by the product of slack and multiplier at it.
        let mut sides = vec![Standing::Free; point.v.len()];
        for &i in &self.bounds.lower_set {
            if course.v[i] * point.zl[i] > ACTIVE {
                sides[i] = Standing::Lower;
            }
        }
        for &i in &self.bounds.upper_set {
            if -course.v[i] * point.zu[i] > ACTIVE {
                sides[i] = Standing::Upper;
            }
        }
        Some(sides)
    }

    /// Newton's method with the bounds of `sides` held, until the conditions are met or the set is seen to be another; an error where it does
    /// not end within its reach, or the system is not that of a strict minimum.
    fn newton(
        &mut self,
        reach: Reach,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
        sides: &[Standing],
        (lower, upper): (&[f64], &[f64]),
    ) -> Result<Solved, Miss> {
        for (i, side) in sides.iter().enumerate() {
            match side {
                Standing::Free => {}
                Standing::Lower => self.current.v[i] = lower[i],
                Standing::Upper => self.current.v[i] = upper[i],
            }
        }
        self.current.zl.fill(0.0);
        self.current.zu.fill(0.0);
        let structure = problem.structure().clone();
        let mut last = f64::INFINITY;
        for step in 0..=reach.steps {
            if !(self.current.evaluate(problem) && self.differentiate(problem).is_ok()) {
                return Err(Miss::Elsewhere);
            }
            let free = |(r, side): (&f64, &Standing)| if *side == Standing::Free { r.abs() } else { 0.0 };
            let dual = self.dual_residual.iter().zip(sides).map(free).fold(0.0, f64::max);
            let residual = dual.max(max_abs(&self.current.constraints));
            if residual <= reach.residual {
                // Whoever keeps it wants the factor of a point that needs no step, too, and whether it is a minimum.
                if reach.keeps_factor && step == 0 && !reach.has_factor {
                    self.factor_at_point(&structure, problem, system, sides)?;
                }
                return Ok(Solved { steps: step, least: LEAST });
            }
            if step == reach.steps {
                let size = max_abs(&self.current.y).max(1.0);
                let is_rounding = residual <= 1e2 * ROUNDING * size;
                return if is_rounding {
                    Ok(Solved { steps: step, least: LEAST })
                } else {
                    Err(Miss::Elsewhere)
                };
            }
            let least = MARGIN * residual;
            if step > 0 && residual <= TELLING && self.is_refuted(sides, least, (lower, upper)) {
                return Ok(Solved { steps: step, least });
            }
            // A step by the same factor leaves about as large a part of the residual as the last one.
            let is_enough = reach.keeps_factor && residual * (residual / last) <= reach.residual;
            let is_chord = if step > 0 { residual <= CHORD * last || is_enough } else { reach.has_factor };
            if !is_chord {
                self.factor_at_point(&structure, problem, system, sides)?;
            }
            self.newton_step(reach.close, &structure, system, sides)?;
            last = residual;
        }
        Err(Miss::Elsewhere)
    }

    /// Factorises the system with the bounds of `sides` held, by the derivatives at the point.
    fn factor_at_point(
        &mut self,
        structure: &Structure,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
        sides: &[Standing],
    ) -> Result<(), Miss> {
        problem.hessian(&self.current.v, &self.current.y, &mut self.hessian, &mut self.diagonal);
        for (i, side) in sides.iter().enumerate() {
            if *side != Standing::Free {
                self.diagonal[i] = HELD;
            } else if i >= structure.variables {
                self.diagonal[i] = FREE_SLACK;
            }
        }
        system.load(Some(&self.hessian), &self.diagonal, &self.jacobian);
        let inertia = system.factor(structure, &self.diagonal, 0.0, 0.0);
        if inertia.as_ref().is_some_and(|i| i.negative < structure.constraints && i.zero == 0) {
            return Err(Miss::Contradiction);
        }
        if !inertia.is_some_and(|i| i.negative == structure.constraints && i.zero == 0) {
            return Err(Miss::Elsewhere);
        }
        Ok(())
    }

    /// A step by the system that was factorised last.
    fn newton_step(
        &mut self,
        close: f64,
        structure: &Structure,
        system: &mut AugmentedSystem,
        sides: &[Standing],
    ) -> Result<(), Miss> {
        for ((rhs, residual), side) in self.work.iter_mut().zip(&self.dual_residual).zip(sides) {
            *rhs = if *side == Standing::Free { *residual } else { 0.0 };
        }
        let step = &mut self.step;
        let newton =
            Newton { primal: &self.work, dual: &self.current.constraints, dv: &mut step.v, dy: &mut step.y };
        let [residual] = system.solve(structure, &self.jacobian, [newton]);
        if residual > SINGULAR_RESIDUAL {
            return Err(Miss::Elsewhere);
        }
        let far = |((v, d), side): ((&f64, &f64), &Standing)| {
            *side == Standing::Free && d.abs() > close * v.abs().max(1.0)
        };
        if self.current.v.iter().zip(&step.v).zip(sides).any(far) {
            return Err(Miss::Elsewhere);
        }
        for ((v, d), side) in self.current.v.iter_mut().zip(&step.v).zip(sides) {
            if *side == Standing::Free {
                *v += d;
            }
        }
        for (y, d) in self.current.y.iter_mut().zip(&step.y) {
            *y += d;
        }
        Ok(())
    }

    /// Releases bounds with multipliers of the wrong sign and holds those that are overstepped; false if there is none.
    fn revise(&self, sides: &mut [Standing], excess: f64, bounds: (&[f64], &[f64])) -> bool {
        let least = self.least_multiplier(excess);
        let mut changed = false;
        for (i, side) in sides.iter_mut().enumerate() {
            let next = self.next_standing(i, *side, [excess, least], bounds);
            changed |= next != *side;
            *side = next;
        }
        changed
    }

    /// Returns true if there are bounds with multipliers of the wrong sign, or some that are overstepped.
    fn is_refuted(&self, sides: &[Standing], excess: f64, bounds: (&[f64], &[f64])) -> bool {
        let least = self.least_multiplier(excess);
        sides
            .iter()
            .enumerate()
            .any(|(i, &side)| self.next_standing(i, side, [excess, least], bounds) != side)
    }

    /// The multiplier that counts where a bound is overstepped by `excess`: relative to the largest.
    fn least_multiplier(&self, excess: f64) -> f64 {
        excess * max_abs(&self.current.y).max(1.0)
    }

    /// Released where the multiplier has the wrong sign by more than `least`, held where the bound is overstepped by more than `excess`.
    fn next_standing(
        &self,
        i: usize,
        side: Standing,
        [excess, least]: [f64; 2],
        (lower, upper): (&[f64], &[f64]),
    ) -> Standing {
        let (v, z) = (self.current.v[i], self.dual_residual[i]);
        match side {
            Standing::Lower if z < -least => Standing::Free,
            Standing::Upper if z > least => Standing::Free,
            Standing::Free if v < lower[i] - excess => Standing::Lower,
            Standing::Free if v > upper[i] + excess => Standing::Upper,
            _ => side,
        }
    }

    /// The multipliers of the bounds that are held, from the gradient of the Lagrangian.
    fn take_multipliers(&mut self, sides: &[Standing]) {
        for (i, side) in sides.iter().enumerate() {
            let z = self.dual_residual[i];
            match side {
                Standing::Free => {}
                Standing::Lower => self.current.zl[i] = z.max(0.0),
                Standing::Upper => self.current.zu[i] = (-z).max(0.0),
            }
        }
    }

    fn set_exact_slacks(&mut self, lower: &[f64], upper: &[f64]) {
        for &i in &self.bounds.lower_set {
            self.current.lower_slack[i] = (self.current.v[i] - lower[i]).max(0.0);
        }
        for &i in &self.bounds.upper_set {
            self.current.upper_slack[i] = (upper[i] - self.current.v[i]).max(0.0);
        }
    }
}
