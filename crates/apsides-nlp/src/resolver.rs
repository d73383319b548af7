//! Re-solves: programs of one structure and other data, each from the solution of the last one.
//!
//! A small change of the data leaves most active sets as they are. With the active bounds held, Newton's method on the optimality conditions
//! reaches the next solution in two or three steps, without a barrier that leads it away first (J. Nocedal, S. Wright, Numerical Optimization,
//! 2nd ed., Springer 2006, section 18.1; on the loss of warm starts by a barrier E. John, E. A. Yildirim, Comput. Optim. Appl. 41 (2008)). Where
//! the set does not settle, the interior point method goes on from the last solution, and begins anew where that fails, too.

use std::time::Instant;

use apsides_iteration::{Counters, Observer, ScalingFactors, SolveReport, Status};

use crate::active_set::{Reach, Standing};
use crate::augmented::AugmentedSystem;
use crate::engine::Engine;
use crate::error::NlpError;
use crate::interior_point::{InteriorPoint, report_point};
use crate::model::{BarrierModel, Structure};
use crate::problem::Nlp;
use crate::scaled::ScaledProblem;
use crate::settings::NlpSettings;
use crate::start::check_warm_start;
use crate::warm_start::WarmStart;

/// Most Newton steps for one active set.
const STEPS: usize = 6;
/// Longest step of a variable, relative to its size where that is above one: what moves further is no small change.
const CLOSE: f64 = 0.5;
/// Residuals at which the steps end, in tolerances of the solve: the next step would square them.
const RESIDUAL: f64 = 1e-2;

/// The way on which a solution was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Newton's method on the active set of the last solution, or on one that differs in a few bounds.
    ActiveSet,
    /// The interior point method from the last solution and its multipliers.
    WarmStart,
    /// The interior point method from the start of the program.
    Cold,
}

/// A solution and the way to it.
#[derive(Debug, Clone)]
pub struct Resolved {
    /// The report, with the iterations of this solve. Where a way ended without success, its iterations are counted in the next one.
    pub report: SolveReport,
    /// The way that led to it.
    pub way: Way,
}

/// Solves programs one after the other: keeps the analysis of the linear systems and the last solution.
///
/// The programs may differ in everything but their sizes: bounds, targets, functions. Where patterns, or which variables are fixed, differ
/// the systems are analysed anew.
///
/// ```
/// use apsides_nlp::{Nlp, NlpSettings, Pattern, Resolver, Way};
///
/// /// The point of the line x0 + x1 = 1 that is next to (target, 0), with x1 >= 0.
/// struct Nearest { target: f64 }
///
/// impl Nlp for Nearest {
///     fn variables(&self) -> usize { 2 }
///     fn constraints(&self) -> usize { 1 }
///     fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
///         lower.copy_from_slice(&[f64::NEG_INFINITY, 0.0]);
///         upper.fill(f64::INFINITY);
///     }
///     fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
///         lower.fill(1.0);
///         upper.fill(1.0);
///     }
///     fn initial_point(&self, x: &mut [f64]) { x.fill(0.5) }
///     fn jacobian_pattern(&self) -> Pattern { Pattern::dense(1, 2) }
///     fn hessian_pattern(&self) -> Pattern { Pattern::from_pairs([(0, 0), (1, 1)]) }
///     fn objective(&mut self, x: &[f64]) -> f64 { (x[0] - self.target).powi(2) + x[1] * x[1] }
///     fn gradient(&mut self, x: &[f64], g: &mut [f64]) { g.copy_from_slice(&[2.0 * (x[0] - self.target), 2.0 * x[1]]) }
///     fn constraint_values(&mut self, x: &[f64], c: &mut [f64]) { c[0] = x[0] + x[1] }
///     fn jacobian(&mut self, _: &[f64], j: &mut [f64]) { j.fill(1.0) }
///     fn hessian(&mut self, _: &[f64], factor: f64, _: &[f64], h: &mut [f64]) { h.fill(2.0 * factor) }
/// }
///
/// let mut resolver = Resolver::new(NlpSettings::default());
/// assert_eq!(resolver.solve(&mut Nearest { target: 0.5 }, &mut ())?.way, Way::Cold);
/// let next = resolver.solve(&mut Nearest { target: 0.6 }, &mut ())?;
/// assert_eq!((next.way, next.report.counters.iterations), (Way::ActiveSet, 1));
/// assert!((next.report.x[0] - 0.8).abs() < 1e-12);
/// # Ok::<(), apsides_nlp::NlpError>(())
/// ```
pub struct Resolver {
    solver: InteriorPoint,
    last: Option<Last>,
    analysed: Option<Analysed>,
}

/// The linear systems of a structure.
struct Analysed {
    structure: Structure,
    system: AugmentedSystem,
    /// Where variables stood when the last factor was made, if it is of the last solution by its active set.
    factored: Option<Vec<Standing>>,
}

/// A solution of an earlier program.
struct Last {
    solution: WarmStart,
    /// The units in which it was solved, if it was here.
    scaling: Option<ScalingFactors>,
    /// Multipliers above are those of active bounds.
    least_multiplier: f64,
}

impl From<&SolveReport> for Last {
    fn from(report: &SolveReport) -> Self {
        Self {
            solution: WarmStart::from(report),
            scaling: Some(report.scaling.clone()),
            least_multiplier: report.barrier.sqrt(),
        }
    }
}

impl Last {
    fn fits(&self, nlp: &dyn Nlp) -> bool {
        (self.solution.x.len(), self.solution.constraint_multipliers.len())
            == (nlp.variables(), nlp.constraints())
    }
}

impl Resolver {
    /// A resolver whose first solve is cold.
    #[must_use]
    pub fn new(settings: NlpSettings) -> Self {
        Self { solver: InteriorPoint::new(settings), last: None, analysed: None }
    }

    /// A resolver that goes on from a solution with its multipliers, such as one from a file.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn from_solution(settings: NlpSettings, solution: WarmStart) -> Result<Self, NlpError> {
        check_warm_start(&solution, solution.x.len(), solution.constraint_multipliers.len())?;
        let least_multiplier = solution.barrier.unwrap_or(settings.tolerance).sqrt();
        let last = Some(Last { solution, scaling: None, least_multiplier });
        Ok(Self { last, ..Self::new(settings) })
    }

    /// Solves a program from the last solution; the observer sees the iterations of the interior point method and can end it.
    ///
    /// # Errors
    /// An ill-posed program or setting. Not converging is a status of the report, and leaves the last solution as it was.
    pub fn solve<N: Nlp + ?Sized>(
        &mut self,
        nlp: &mut N,
        observer: &mut dyn Observer,
    ) -> Result<Resolved, NlpError> {
        let resolved = self.find(&mut { nlp }, observer)?;
        if resolved.report.status.is_success() {
            self.last = Some(Last::from(&resolved.report));
        }
        Ok(resolved)
    }

    /// Solves a program by Newton's method on the active set of the last solution, or on one that differs in a few bounds; none, and the last
    /// solution as it was, where there is no such way.
    ///
    /// # Errors
    /// An ill-posed program or setting.
    pub fn follow<N: Nlp + ?Sized>(&mut self, nlp: &mut N) -> Result<Option<SolveReport>, NlpError> {
        self.solver.settings.validate()?;
        let Some(last) = self.last.as_ref().filter(|last| last.fits(&nlp)) else { return Ok(None) };
        let report =
            by_active_set(&self.solver, &mut self.analysed, &mut { nlp }, last, Instant::now())?.ok();
        if let Some(report) = &report {
            self.last = Some(Last::from(report));
        }
        Ok(report)
    }

    fn find(&mut self, nlp: &mut dyn Nlp, observer: &mut dyn Observer) -> Result<Resolved, NlpError> {
        let begin = Instant::now();
        self.solver.settings.validate()?;
        let mut steps = 0;
        if let Some(last) = self.last.as_ref().filter(|last| last.fits(nlp)) {
            match by_active_set(&self.solver, &mut self.analysed, nlp, last, begin)? {
                Ok(report) => return Ok(Resolved { report, way: Way::ActiveSet }),
                Err(taken) => steps += taken,
            }
            let warm = last.solution.clone();
            let mut report = self.interior(nlp, Some(&warm), observer, begin)?;
            report.counters.iterations += steps;
            if report.status.is_success() || report.status == Status::Interrupted {
                return Ok(Resolved { report, way: Way::WarmStart });
            }
            steps = report.counters.iterations;
        }
        let mut report = self.interior(nlp, None, observer, begin)?;
        report.counters.iterations += steps;
        Ok(Resolved { report, way: Way::Cold })
    }

    /// The interior point method with the systems at hand.
    fn interior(
        &mut self,
        nlp: &mut dyn Nlp,
        warm: Option<&WarmStart>,
        observer: &mut dyn Observer,
        begin: Instant,
    ) -> Result<SolveReport, NlpError> {
        let mut problem = ScaledProblem::new(nlp, &self.solver.settings, warm.map(|w| &w.x[..]), None)?;
        if problem.structure().variables == 0 {
            return Ok(self.solver.report_fixed(&mut problem, begin));
        }
        let analysed = analysed_for(&mut self.analysed, &problem, &self.solver.settings)?;
        analysed.factored = None;
        self.solver.run_with(&mut problem, &mut analysed.system, warm, observer, begin)
    }
}

/// The systems that were analysed for the structure of a problem.
fn analysed_for<'a>(
    analysed: &'a mut Option<Analysed>,
    problem: &ScaledProblem<'_>,
    settings: &NlpSettings,
) -> Result<&'a mut Analysed, NlpError> {
    let kept = match analysed.take_if(|kept| kept.structure == *problem.structure()) {
        Some(kept) => kept,
        None => {
            let system = AugmentedSystem::of(problem, settings)?;
            Analysed { structure: problem.structure().clone(), system, factored: None }
        }
    };
    let kept = analysed.insert(kept);
    kept.system.forget_work();
    Ok(kept)
}

/// Newton's method on the active set of the last solution; the steps that were taken where it does not settle.
fn by_active_set(
    solver: &InteriorPoint,
    analysed: &mut Option<Analysed>,
    nlp: &mut dyn Nlp,
    last: &Last,
    begin: Instant,
) -> Result<Result<SolveReport, usize>, NlpError> {
    let Last { solution, scaling, least_multiplier } = last;
    let problem = &mut ScaledProblem::new(nlp, &solver.settings, Some(&solution.x), scaling.as_ref())?;
    if problem.structure().variables == 0 {
        return Ok(Err(0));
    }
    let Analysed { system, factored, .. } = analysed_for(analysed, problem, &solver.settings)?;
    let mut engine = Engine::for_model(problem, &solver.settings);
    engine.take_warm(problem, solution);
    engine.state.set_slacks(problem);
    engine.state.barrier = engine.state.final_barrier;
    let mut sides = engine.state.sides_of_multipliers(*least_multiplier);
    let residual = RESIDUAL * solver.settings.tolerance;
    // Gone where this way fails: what follows makes other factors.
    let has_factor = factored.take().is_some_and(|factored| factored == sides);
    let reach = Reach { steps: STEPS, close: CLOSE, residual, keeps_factor: true, has_factor };
    let Ok(iterations) = engine.settle(reach, &mut sides, problem, system) else {
        return Ok(Err(system.factorisations));
    };
    *factored = Some(sides);
    let (factorisations, solves) = (system.factorisations, system.solves);
    let counters = Counters { iterations, factorisations, solves, ..Counters::default() };
    let mut report = report_point(&engine, problem, Status::Optimal, counters, true);
    report.timing.linear_systems = system.time;
    report.timing.total = begin.elapsed();
    Ok(Ok(report))
}

impl crate::state::SolverState {
    /// Held at a bound whose multiplier is larger than what a barrier leaves where slack and multiplier are alike.
    fn sides_of_multipliers(&self, least: f64) -> Vec<Standing> {
        let (zl, zu, bounds) = (&self.current.zl, &self.current.zu, &self.bounds);
        let side = |i: usize| match (zl[i] - zu[i], bounds.lower[i].is_finite(), bounds.upper[i].is_finite())
        {
            (push, true, _) if push > least => Standing::Lower,
            (push, _, true) if push < -least => Standing::Upper,
            _ => Standing::Free,
        };
        (0..zl.len()).map(side).collect()
    }
}
