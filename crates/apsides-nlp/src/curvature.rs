//! Second order at a point that meets the first-order conditions: a direction of negative curvature, and a step along it.
//!
//! The matrix of the search direction has as many negative eigenvalues as there are constraints where the Hessian is positive
//! definite on the null space of the active constraints (N. Gould, On practical conditions for the existence and uniqueness of
//! solutions to the general equality quadratic programming problem, Math. Program. 32 (1985), doi 10.1007/BF01585660). A point
//! at which it has more is a saddle or a maximum, such as the middle of the bounds where a cost is concave in it. A shift that
//! corrects the inertia lies just beyond the most negative eigenvalue, so that inverse iterations with it give its direction.

use crate::augmented::{AugmentedSystem, Newton};
use crate::engine::Engine;
use crate::model::{BarrierModel, Structure};
use crate::scaled::ScaledProblem;
use crate::state::SolverState;

/// Inverse iterations.
const ITERATIONS: usize = 8;
/// First shift, and its growth.
const FIRST_SHIFT: f64 = 1e-6;
const GROWTH: f64 = 4.0;
/// Largest shift.
const LARGEST_SHIFT: f64 = 1e8;
/// Longest step of a scaled variable, relative to its size where that is above one.
const LONGEST_STEP: f64 = 0.5;
/// Part of the distance to the bounds that the step may take.
const BOUND_PART: f64 = 0.5;
/// Least gain of the objective that the curvature promises, relative to its size: discretisations have directions
/// along which their error gains a little.
const LEAST_GAIN: f64 = 1e-4;

impl Engine {
    /// Leaves a point of negative curvature along that curvature, with multipliers and barrier parameter of a new start. False,
    /// and the point as it was, if the curvature is positive or promises no gain.
    pub(crate) fn leaves_saddle(
        &mut self,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
    ) -> bool {
        if self.has_regular_curvature() {
            return false;
        }
        let Some(shift) = self.least_shift(problem, system) else { return false };
        let curvature = self.state.most_negative_curvature(problem.structure(), system);
        let step = self.state.saddle_step();
        let size = problem.size_of_objective(self.state.current.objective);
        let gains = curvature < 0.0 && -0.5 * curvature * step * step > LEAST_GAIN * size;
        if !(gains && shift.is_finite() && step.is_finite()) {
            return false;
        }
        let Self { state, .. } = self;
        for (v, d) in state.current.v.iter_mut().zip(&state.corrected.v) {
            *v += step * d;
        }
        state.barrier = state.settings.initial_barrier.max(state.final_barrier);
        state.tau = state.settings.boundary_fraction.max(1.0 - state.barrier);
        let barrier = state.barrier;
        state.measure_current();
        for &i in &state.bounds.lower_set {
            state.current.zl[i] = barrier / state.current.lower_slack[i];
        }
        for &i in &state.bounds.upper_set {
            state.current.zu[i] = barrier / state.current.upper_slack[i];
        }
        self.forget_past();
        self.evaluate_start(problem).is_ok()
    }

    /// The least shift that gives the matrix its inertia; none where none is needed, or no shift helps.
    fn least_shift(&mut self, problem: &mut ScaledProblem<'_>, system: &mut AugmentedSystem) -> Option<f64> {
        let state = &mut self.state;
        problem.hessian(&state.current.v, &state.current.y, &mut state.hessian, &mut state.diagonal);
        for &i in &state.bounds.lower_set {
            state.diagonal[i] += state.current.zl[i] / state.current.lower_slack[i];
        }
        for &i in &state.bounds.upper_set {
            state.diagonal[i] += state.current.zu[i] / state.current.upper_slack[i];
        }
        system.load(Some(&state.hessian), &state.diagonal, &state.jacobian);
        let structure = problem.structure();
        let mut shift = 0.0;
        loop {
            let inertia = system.factor(structure, &state.diagonal, shift, 0.0)?;
            if inertia.zero > 0 {
                return None;
            }
            if inertia.negative == structure.constraints {
                return (shift > 0.0).then_some(shift);
            }
            shift = if shift == 0.0 { FIRST_SHIFT } else { GROWTH * shift };
            if shift > LARGEST_SHIFT {
                return None;
            }
        }
    }
}

impl SolverState {
    /// The curvature along the direction that inverse iterations with the present factor lead to, the largest component of which
    /// is 1, downhill; the direction stands in `corrected`.
    fn most_negative_curvature(&mut self, structure: &Structure, system: &mut AugmentedSystem) -> f64 {
        // No symmetry of the problem is one of this vector.
        for (k, w) in self.work.iter_mut().enumerate() {
            *w = ((k as f64 + 1.0) * 0.618_033_988_749_895).fract() - 0.5;
        }
        self.trial.constraints.fill(0.0);
        for _ in 0..ITERATIONS {
            let step = &mut self.corrected;
            let newton = Newton {
                primal: &self.work,
                dual: &self.trial.constraints,
                dv: &mut step.v,
                dy: &mut step.y,
            };
            let [residual] = system.solve(structure, &self.jacobian, [newton]);
            let largest = step.v.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
            if !(residual.is_finite() && largest > 0.0 && largest.is_finite()) {
                return 0.0;
            }
            step.v.iter_mut().for_each(|d| *d /= largest);
            self.work.copy_from_slice(&step.v);
        }
        let d = &mut self.corrected.v;
        let slope: f64 = self.gradient.iter().zip(d.iter()).map(|(g, d)| g * d).sum();
        if slope > 0.0 {
            d.iter_mut().for_each(|d| *d = -*d);
        }
        let diagonal: f64 = self.diagonal.iter().zip(d.iter()).map(|(h, d)| h * d * d).sum();
        let pattern = structure.hessian.rows.iter().zip(&structure.hessian.cols);
        let product = |((&r, &c), h): ((&usize, &usize), &f64)| {
            let twice = if r == c { 1.0 } else { 2.0 };
            twice * h * d[r] * d[c]
        };
        diagonal + pattern.zip(&self.hessian).map(product).sum::<f64>()
    }

    /// The step along `corrected` that is taken: no farther than half way to a bound, and no variable by more than half its size.
    fn saddle_step(&self) -> f64 {
        let d = &self.corrected.v;
        let free = d.iter().zip(&self.current.v).fold(f64::INFINITY, |longest: f64, (d, v)| {
            longest.min(LONGEST_STEP * v.abs().max(1.0) / d.abs())
        });
        free.min(self.bounds.longest_primal(&self.current, d, BOUND_PART))
    }
}
