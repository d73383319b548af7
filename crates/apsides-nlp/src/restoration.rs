//! The feasibility restoration phase (Waechter and Biegler, section 3.3): from a reference point `v_R`
//!
//! ```text
//! minimise rho sum(p + n) + zeta/2 |D (v - v_R)|^2   subject to   c(v) - p + n = 0,  l <= v <= u,  p, n >= 0,
//! ```
//!
//! by the same engine. The elastic variables `p`, `n` are unit variables, so its linear systems have the size and
//! pattern of the original ones.
//!
//! A stationary point of the 1-norm at a kink need not be one of the sum of squares. So before a problem is called
//! infeasible the same is tried from `v_R` with `rho/2 |e|^2`, `c(v) - e = 0` and free `e`.

use apsides_iteration::Status;

use crate::augmented::AugmentedSystem;
use crate::engine::{Engine, Exit, Session};
use crate::model::{BarrierModel, Structure, UnitVariable};
use crate::scaled::ScaledProblem;
use crate::settings::{BarrierStrategy, NlpSettings};
use crate::state::SolverState;
use crate::step::complete_bound_multipliers;
use crate::vector::{dot, max_abs};

/// A restoration that converges with a violation below this multiple of the tolerance has found a feasible point.
const FEASIBLE: f64 = 1e2;
/// Bound multipliers above this after a restoration are reset to one.
const LARGEST_MULTIPLIER: f64 = 1e3;
/// Times that the elastic variables are set anew when the restoration phase itself finds no step.
const MAX_RESETS: usize = 3;
/// Calls with the reduction of the settings, and the factor on it for each further call.
const PATIENT_CALLS: usize = 2;
const CALL_REDUCTION: f64 = 0.5;
/// Second attempts by least squares per solve.
const MAX_SECOND_ATTEMPTS: usize = 5;

/// The outcome of a restoration phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Recovery {
    /// The outer engine stands at a point that its filter accepts.
    Recovered,
    /// As before, but a feasible point that the filter did not accept: the filter was cleared.
    RecoveredFeasible,
    /// The solve ends with this status; the outer engine stands at the least violation found.
    Ended(Status),
}

/// The measure that the restoration phase minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Measure {
    OneNorm,
    LeastSquares,
}

/// Both restoration phases of a solve, allocated when they are first needed.
#[derive(Default)]
pub(crate) struct Restoration {
    one_norm: Option<Phase>,
    least_squares: Option<Phase>,
    second_attempts: usize,
    calls: usize,
}

impl Restoration {
    /// The reduction of the violation asked for: more with each call, since a search that keeps coming back needs
    /// more than the last bit.
    fn next_reduction(&mut self, outer: &SolverState) -> f64 {
        self.calls += 1;
        let repeats = self.calls.saturating_sub(PATIENT_CALLS).min(30) as i32;
        outer.settings.restoration_reduction * CALL_REDUCTION.powi(repeats)
    }

    /// Moves the current point of `outer` to one with less violation.
    pub(crate) fn run(
        &mut self,
        outer: &mut Engine,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
        session: &mut Session<'_>,
    ) -> Recovery {
        let state = &mut outer.state;
        state.filter.add(state.current.violation, state.barrier_value(&state.current));
        let target = state.current.violation * self.next_reduction(state);
        let phase = self.one_norm.get_or_insert_with(|| Phase::new(problem, state, Measure::OneNorm));
        let mut recovery = phase.search(state, problem, system, session, target);
        if recovery == Recovery::Ended(Status::Infeasible) && self.second_attempts < MAX_SECOND_ATTEMPTS {
            self.second_attempts += 1;
            let second =
                self.least_squares.get_or_insert_with(|| Phase::new(problem, state, Measure::LeastSquares));
            recovery = match second.search(state, problem, system, session, target) {
                Recovery::Ended(status) => {
                    phase.place(state, problem);
                    let is_limit =
                        matches!(status, Status::IterationLimit | Status::TimeLimit | Status::Interrupted);
                    Recovery::Ended(if is_limit { status } else { Status::Infeasible })
                }
                recovered => recovered,
            };
        }
        if outer.adopt_restored(problem, system, recovery) {
            recovery
        } else {
            Recovery::Ended(Status::RestorationFailed)
        }
    }
}

/// The data of one restoration problem.
struct Phase {
    measure: Measure,
    engine: Engine,
    structure: Structure,
    lower: Vec<f64>,
    upper: Vec<f64>,
    reference: Vec<f64>,
    /// Diagonal of `D^2`.
    weights: Vec<f64>,
}

/// The restoration problem as the engine sees it.
struct Feasibility<'a, 'n> {
    measure: Measure,
    problem: &'a mut ScaledProblem<'n>,
    outer: &'a mut SolverState,
    structure: &'a Structure,
    lower: &'a [f64],
    upper: &'a [f64],
    reference: &'a [f64],
    weights: &'a [f64],
    penalty: f64,
    proximity: f64,
    /// A point with at most this violation may be good enough.
    target: f64,
}

impl Phase {
    fn new(problem: &ScaledProblem<'_>, outer: &SolverState, measure: Measure) -> Self {
        let (n, m) = (problem.structure().primal(), problem.structure().constraints);
        let mut structure = problem.structure().clone();
        let mut lower = problem.lower().to_vec();
        let mut upper = problem.upper().to_vec();
        structure.units.extend((0..m).map(|row| UnitVariable { row, sign: -1.0 }));
        let elastic_lower = match measure {
            Measure::OneNorm => {
                structure.units.extend((0..m).map(|row| UnitVariable { row, sign: 1.0 }));
                0.0
            }
            Measure::LeastSquares => f64::NEG_INFINITY,
        };
        lower.resize(structure.primal(), elastic_lower);
        upper.resize(structure.primal(), f64::INFINITY);
        let settings = NlpSettings { barrier: BarrierStrategy::Monotone, ..outer.settings.clone() };
        Self {
            measure,
            engine: Engine::new(&structure, &lower, &upper, &settings),
            structure,
            lower,
            upper,
            reference: vec![0.0; n],
            weights: vec![0.0; n],
        }
    }

    /// Runs the phase from the current point of `outer`; the result is left in its trial point.
    fn search(
        &mut self,
        outer: &mut SolverState,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
        session: &mut Session<'_>,
        target: f64,
    ) -> Recovery {
        let n = self.reference.len();
        self.reference.copy_from_slice(&outer.current.v);
        for (weight, v) in self.weights.iter_mut().zip(&self.reference) {
            *weight = (1.0 / v.abs().max(1.0)).powi(2);
        }
        self.lower[..n].copy_from_slice(&outer.bounds.lower);
        self.upper[..n].copy_from_slice(&outer.bounds.upper);
        let engine = &mut self.engine;
        engine.state.bounds.lower.copy_from_slice(&self.lower);
        engine.state.bounds.upper.copy_from_slice(&self.upper);
        let penalty = engine.state.settings.restoration_penalty;
        engine.state.barrier = outer.barrier.max(max_abs(&outer.current.constraints));
        engine.state.tau = engine.state.settings.boundary_fraction.max(1.0 - engine.state.barrier);
        engine.forget_past();
        engine.state.current.v[..n].copy_from_slice(&outer.current.v);
        engine.state.current.y.fill(0.0);
        for i in 0..n {
            engine.state.current.zl[i] = outer.current.zl[i].min(penalty);
            engine.state.current.zu[i] = outer.current.zu[i].min(penalty);
        }
        let feasible = FEASIBLE * engine.state.settings.tolerance;
        let mut model = Feasibility {
            measure: self.measure,
            problem,
            target,
            outer,
            structure: &self.structure,
            lower: &self.lower,
            upper: &self.upper,
            reference: &self.reference,
            weights: &self.weights,
            penalty,
            proximity: engine.state.barrier.sqrt(),
        };
        let mut resets = 0;
        let exit = loop {
            model.set_elastic(engine);
            if engine.evaluate_start(&mut model).is_err() {
                break Exit::Finished(Status::RestorationFailed);
            }
            match engine.run(&mut model, system, session) {
                Exit::NeedsRestoration | Exit::Finished(Status::StepTooSmall) if resets < MAX_RESETS => {
                    resets += 1;
                }
                exit => break exit,
            }
        };
        let violation = self.place(outer, problem);
        match exit {
            Exit::Left => Recovery::Recovered,
            Exit::Finished(Status::Optimal | Status::Acceptable) if violation <= feasible => {
                outer.filter.clear();
                Recovery::RecoveredFeasible
            }
            Exit::Finished(Status::Optimal | Status::Acceptable) => Recovery::Ended(Status::Infeasible),
            Exit::Finished(Status::StepTooSmall) | Exit::NeedsRestoration => {
                Recovery::Ended(Status::RestorationFailed)
            }
            Exit::Finished(status) => Recovery::Ended(status),
        }
    }

    /// Puts the result into the trial point of the outer engine, with the multipliers of the violation; returns the
    /// largest violation.
    fn place(&self, outer: &mut SolverState, problem: &mut ScaledProblem<'_>) -> f64 {
        let penalty = outer.settings.restoration_penalty;
        for (y, restoration) in outer.trial.y.iter_mut().zip(&self.engine.state.current.y) {
            *y = restoration / penalty;
        }
        place_trial(outer, problem, &self.engine.state.current.v)
    }
}

/// Puts a point into the trial point of the outer engine; returns its largest violation.
fn place_trial(outer: &mut SolverState, problem: &mut ScaledProblem<'_>, v: &[f64]) -> f64 {
    let n = outer.trial.v.len();
    outer.trial.v.copy_from_slice(&v[..n]);
    outer.measure_trial();
    let trial = &mut outer.trial;
    if trial.evaluate(problem) { max_abs(&trial.constraints) } else { f64::INFINITY }
}

impl Feasibility<'_, '_> {
    fn len(&self) -> usize {
        self.reference.len()
    }

    /// The elastic variables that are optimal for the barrier problem at this `v` (eq. 32 and 33).
    fn set_elastic(&mut self, engine: &mut Engine) {
        let (n, m) = (self.len(), self.structure.constraints);
        let (barrier, penalty) = (engine.state.barrier, self.penalty);
        self.problem.constraints(&engine.state.current.v[..n], &mut engine.state.trial.constraints);
        for row in 0..m {
            let c = engine.state.trial.constraints[row];
            if self.measure == Measure::LeastSquares {
                engine.state.current.v[n + row] = c;
                engine.state.current.y[row] = penalty * c;
                continue;
            }
            let half = (barrier - penalty * c) / (2.0 * penalty);
            let product = barrier * c / (2.0 * penalty);
            let root = (half * half + product).max(0.0).sqrt();
            // The product of the two roots is known: no cancellation for a negative half.
            let negative = if half >= 0.0 { half + root } else { product / (root - half) };
            let negative = negative.max(f64::MIN_POSITIVE.sqrt());
            let positive = (c + negative).max(f64::MIN_POSITIVE.sqrt());
            for (i, value) in [(n + row, positive), (n + m + row, negative)] {
                engine.state.current.v[i] = value;
                engine.state.current.zl[i] = barrier / value;
            }
        }
    }
}

impl BarrierModel for Feasibility<'_, '_> {
    fn structure(&self) -> &Structure {
        self.structure
    }

    fn lower(&self) -> &[f64] {
        self.lower
    }

    fn upper(&self) -> &[f64] {
        self.upper
    }

    fn objective(&mut self, v: &[f64]) -> f64 {
        let (v, elastic) = v.split_at(self.len());
        let mut distance = 0.0;
        for ((v, reference), weight) in v.iter().zip(self.reference).zip(self.weights) {
            distance += weight * (v - reference).powi(2);
        }
        let violation = match self.measure {
            Measure::OneNorm => elastic.iter().sum::<f64>(),
            Measure::LeastSquares => 0.5 * dot(elastic, elastic),
        };
        self.penalty * violation + 0.5 * self.proximity * distance
    }

    fn gradient(&mut self, v: &[f64], gradient: &mut [f64]) {
        let (x, elastic) = gradient.split_at_mut(self.len());
        for (i, value) in x.iter_mut().enumerate() {
            *value = self.proximity * self.weights[i] * (v[i] - self.reference[i]);
        }
        match self.measure {
            Measure::OneNorm => elastic.fill(self.penalty),
            Measure::LeastSquares => {
                for (value, e) in elastic.iter_mut().zip(&v[self.reference.len()..]) {
                    *value = self.penalty * e;
                }
            }
        }
    }

    fn constraints(&mut self, v: &[f64], values: &mut [f64]) {
        let (v, elastic) = v.split_at(self.len());
        self.problem.constraints(v, values);
        let (positive, negative) = elastic.split_at(values.len());
        for (value, p) in values.iter_mut().zip(positive) {
            *value -= p;
        }
        for (value, n) in values.iter_mut().zip(negative) {
            *value += n;
        }
    }

    fn jacobian(&mut self, v: &[f64], values: &mut [f64]) {
        self.problem.jacobian(&v[..self.len()], values);
    }

    fn hessian(&mut self, v: &[f64], y: &[f64], values: &mut [f64], diagonal: &mut [f64]) {
        self.problem.constraint_hessian(&v[..self.reference.len()], y, values);
        let (x, elastic) = diagonal.split_at_mut(self.reference.len());
        for (value, weight) in x.iter_mut().zip(self.weights) {
            *value = self.proximity * weight;
        }
        elastic.fill(if self.measure == Measure::LeastSquares { self.penalty } else { 0.0 });
    }

    fn barrier_changed(&mut self, barrier: f64) -> bool {
        self.proximity = barrier.sqrt();
        true
    }

    fn leaves(&mut self, v: &[f64]) -> bool {
        place_trial(self.outer, self.problem, v);
        let trial = &self.outer.trial;
        if !(trial.violation <= self.target && trial.objective.is_finite()) {
            return false;
        }
        let barrier = self.outer.barrier_value(trial);
        barrier.is_finite() && self.outer.filter.accepts(trial.violation, barrier)
    }

    fn is_restoration(&self) -> bool {
        true
    }
}

impl Engine {
    /// Takes over the trial point that a restoration phase has left, with new multipliers; false if it cannot be
    /// differentiated.
    fn adopt_restored(
        &mut self,
        problem: &mut ScaledProblem<'_>,
        system: &mut AugmentedSystem,
        recovery: Recovery,
    ) -> bool {
        for (step, (trial, current)) in
            self.state.step.v.iter_mut().zip(self.state.trial.v.iter().zip(&self.state.current.v))
        {
            *step = trial - current;
        }
        complete_bound_multipliers(
            &self.state.bounds,
            &self.state.current,
            &mut self.state.step,
            self.state.barrier,
        );
        let dual = self.state.bounds.longest_dual(
            &self.state.current,
            &self.state.step.zl,
            &self.state.step.zu,
            self.state.tau,
        );
        let mut largest = 0.0_f64;
        for (i, (zl, zu)) in self.state.trial.zl.iter_mut().zip(&mut self.state.trial.zu).enumerate() {
            *zl = self.state.current.zl[i] + dual * self.state.step.zl[i];
            *zu = self.state.current.zu[i] + dual * self.state.step.zu[i];
            largest = largest.max(*zl).max(*zu);
        }
        if largest > LARGEST_MULTIPLIER || largest.is_nan() {
            self.state.bounds.lower_set.iter().for_each(|&i| self.state.trial.zl[i] = 1.0);
            self.state.bounds.upper_set.iter().for_each(|&i| self.state.trial.zu[i] = 1.0);
        }
        std::mem::swap(&mut self.state.current, &mut self.state.trial);
        self.search.restart();
        self.search.kind = 'R';
        if self.state.differentiate(problem).is_err() {
            return false;
        }
        if !matches!(recovery, Recovery::Ended(_)) {
            self.state.estimate_multipliers(problem.structure(), system);
        }
        self.state.update_dual_residual(problem);
        true
    }
}
