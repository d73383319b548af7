//! Solve, estimate between the points, refine, until the curves meet the equations of motion.

use std::time::{Duration, Instant};

use apsides_nlp::{InteriorPoint, Nlp, Observer, SolveReport, Status};
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Ocp, RowOrigin, Scaling, Trajectory, Unmet};

use crate::curve::PhaseSplines;
use crate::estimate::{PhaseEstimate, estimate, largest};
use crate::extraction;
use crate::rows::Active;
use crate::settings::{BoundRows, Breaks, Placement};
use crate::spline_mesh::SplineMesh;
use crate::start::Start;
use crate::transcription::Transcription;
use crate::{FlatSystem, FlatnessError, FlatnessSettings, SplineSettings};

/// Orders added by one refinement.
const RAISE: usize = 2;

/// Barrier parameter of a solve that starts from a solution.
const WARM_BARRIER: f64 = 1e-8;
/// Distance to bounds at its start, as [`apsides_nlp::NlpSettings::bound_push`].
const WARM_PUSH: f64 = 1e-6;
/// Solves in a row whose error does not fall by half that end the refinement.
const STAGNATION: usize = 4;
/// Error below which slow progress may come from few segments that are left.
const STAGNATION_ERROR: f64 = 1e-4;

/// The method: flat outputs on B-splines.
#[derive(Clone, Debug, Default)]
pub struct Flatness {
    /// Settings.
    pub settings: FlatnessSettings,
}

/// One discretised problem of a solve.
#[derive(Clone, Debug)]
pub struct SolveRecord {
    /// Highest order of the splines.
    pub order: usize,
    /// Segments of all phases.
    pub segments: usize,
    /// Collocation points of all phases.
    pub points: usize,
    /// Largest estimated relative error.
    pub error: f64,
    /// Objective in its own sense and unit.
    pub objective: f64,
    /// Size of the discretised problem, and the work of the interior-point method.
    pub counters: Counters,
    /// The end of the solve.
    pub status: Status,
    /// Wall-clock time of the interior-point method.
    pub solve_time: Duration,
    /// Wall-clock time of all: transcription, solve, estimate.
    pub time: Duration,
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct FlatnessSolution {
    /// The trajectory, without costates.
    pub trajectory: Trajectory,
    /// The end of the solve of this trajectory: the last one, or the last that succeeded before a refinement failed. A solve can
    /// succeed on points that are too few: see [`accurate`](Self::accurate).
    pub status: Status,
    /// True if the error estimate meets the tolerance and, after a refinement, the objective has settled.
    pub accurate: bool,
    /// Largest estimated relative error of a state over one segment.
    pub error: f64,
    /// The change of the objective that is expected of further refinement, relative to its size; infinite before the first one.
    pub objective_change: f64,
    /// The coarse problem that the first one started from, if there was one.
    pub presolve: Option<SolveRecord>,
    /// Every discretised problem on the stated splines and their refinements.
    pub solves: Vec<SolveRecord>,
    /// The constraint that could not be met, when the last solve did not succeed.
    pub unmet: Option<Unmet>,
    /// The splines, per phase.
    pub splines: Vec<PhaseSplines>,
    /// Report of that solve.
    pub report: SolveReport,
}

impl Flatness {
    /// Solves with the splines of the settings in every phase; one flat system per phase.
    ///
    /// # Errors
    /// When the request is ill-posed. Not converging is a status of the solution.
    pub fn solve(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        guess: &Guess,
    ) -> Result<FlatnessSolution, FlatnessError> {
        let splines = vec![self.settings.spline.clone(); ocp.phases.len()];
        self.solve_on(ocp, systems, guess, &splines, &mut ())
    }

    /// Solves with given splines per phase; the observer sees every iteration and can stop the solve.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn solve_on(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        guess: &Guess,
        splines: &[SplineSettings],
        observer: &mut dyn Observer,
    ) -> Result<FlatnessSolution, FlatnessError> {
        let problem = self.checked(ocp, systems, guess, splines)?;
        let meshes = meshes(&problem, splines)?;
        let (mut stage, coarse) = self.first_stage(&problem, meshes, splines, guess, observer)?;
        let presolve = coarse.as_ref().map(|(_, record)| record.clone());
        let mut coarse = coarse.map(|(stage, _)| stage);
        let refinable = splines.iter().any(|s| s.refine);
        let mut solves: Vec<SolveRecord> = Vec::new();
        let mut best: Option<(Stage, Pass)> = None;
        loop {
            let pass = self.pass(&problem, &mut stage, observer)?;
            let error = pass.record.error;
            let success = pass.report.status.is_success();
            solves.push(pass.record.clone());
            let change = expected_change(&solves, pass.nlp.scaling.objective);
            let settled = !refinable || change <= self.settings.objective_tolerance;
            let accurate = success && error <= self.settings.tolerance && settled;
            let spent = solves.len() > self.settings.max_refinements;
            if success && !spent && self.settings.bounds == BoundRows::WhereExceeded {
                let exceeded = stage.active.iter_mut().zip(&pass.estimates);
                if exceeded.fold(false, |any, (a, e)| a.extend(&e.exceeded) || any) {
                    stage.solved = false;
                    continue;
                }
            }
            if !spent && !accurate && refinable && !stagnates(&solves) {
                // What does not converge on the stated splines may on those of the collocation.
                let finer = if success {
                    self.refined(&problem, splines, stage.clone(), &pass.estimates)?
                } else if best.is_none() {
                    coarse.take()
                } else {
                    None
                };
                if let Some(finer) = finer {
                    let solved = std::mem::replace(&mut stage, finer);
                    if success {
                        best = Some((solved, pass));
                    }
                    continue;
                }
            }
            // A refinement that fails takes nothing away from the solution before it.
            let (stage, pass) = if success { (stage, pass) } else { best.unwrap_or((stage, pass)) };
            let solution = finish(&problem, &stage, pass, solves, presolve)?;
            return Ok(FlatnessSolution { accurate, objective_change: change, ..solution });
        }
    }

    /// The first discretised problem of [`solve`](Self::solve) on the splines of the settings. Where a coarse solution precedes it,
    /// that one is solved here, and the problem starts from it.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn transcription(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        guess: &Guess,
    ) -> Result<Transcription, FlatnessError> {
        let splines = vec![self.settings.spline.clone(); ocp.phases.len()];
        let problem = self.checked(ocp, systems, guess, &splines)?;
        let meshes = meshes(&problem, &splines)?;
        let (stage, _) = self.first_stage(&problem, meshes, &splines, guess, &mut ())?;
        Transcription::new(ocp, systems, &stage.meshes, &stage.start, &problem.scaling, &stage.active)
    }

    /// The problem, once the request is found to be well-posed.
    fn checked<'a>(
        &self,
        ocp: &'a Ocp,
        systems: &'a [FlatSystem],
        guess: &Guess,
        splines: &[SplineSettings],
    ) -> Result<Problem<'a>, FlatnessError> {
        self.settings.check()?;
        check_sizes(ocp, systems, splines)?;
        guess.check(ocp)?;
        Ok(Problem { ocp, systems, scaling: Scaling::new(ocp, guess) })
    }

    /// The stage of the stated splines, from a coarse solution where one is wanted and found.
    fn first_stage(
        &self,
        problem: &Problem<'_>,
        meshes: Vec<SplineMesh>,
        splines: &[SplineSettings],
        guess: &Guess,
        observer: &mut dyn Observer,
    ) -> Result<(Stage, Option<(Stage, SolveRecord)>), FlatnessError> {
        let &Problem { ocp, systems, .. } = problem;
        let active = Active::first(ocp, self.settings.bounds);
        let fitted = |meshes: Vec<SplineMesh>| {
            let mut start = Start::from_guess(ocp, systems, &meshes, guess)?;
            start.fit(ocp, systems, &meshes, guess, &problem.scaling);
            Ok::<_, FlatnessError>(Stage { meshes, start, active: active.clone(), solved: false })
        };
        let collocation = |s: &SplineSettings| {
            matches!(s.breaks, Breaks::Collocation(_)) && s.placement == Placement::GaussPerSegment
        };
        if !self.settings.presolve || splines.iter().all(collocation) {
            return Ok((fitted(meshes)?, None));
        }
        let settings = vec![SplineSettings::default(); systems.len()];
        let mut coarse = fitted(self::meshes(problem, &settings)?)?;
        let pass = self.pass(problem, &mut coarse, observer)?;
        if !pass.report.status.is_success() {
            return Ok((fitted(meshes)?, None));
        }
        let start = coarse.start.on(ocp, systems, &meshes, &pass.curves)?;
        Ok((Stage { meshes, start, active, solved: true }, Some((coarse, pass.record))))
    }

    /// Solves one discretised problem; the stage then holds the solution.
    fn pass(
        &self,
        problem: &Problem<'_>,
        stage: &mut Stage,
        observer: &mut dyn Observer,
    ) -> Result<Pass, FlatnessError> {
        let begin = Instant::now();
        let Problem { ocp, systems, scaling } = problem;
        let mut nlp = Transcription::new(ocp, systems, &stage.meshes, &stage.start, scaling, &stage.active)?;
        let mut settings = self.settings.nlp.clone();
        if stage.solved {
            // A larger barrier would lead away from a point that is a solution already, if on other splines.
            settings.initial_barrier = settings.initial_barrier.min(WARM_BARRIER);
            settings.initial_bound_multiplier = settings.initial_bound_multiplier.min(WARM_BARRIER);
            settings.bound_push = settings.bound_push.min(WARM_PUSH);
            settings.bound_fraction = settings.bound_fraction.min(WARM_PUSH);
        }
        let solver = InteriorPoint { settings };
        let solve_begin = Instant::now();
        let report = solver.solve_observed(&mut nlp, observer)?;
        let solve_time = solve_begin.elapsed();
        // A point that is no trajectory can come from a solve that failed; its start takes its place.
        let found = Start::from_vector(&nlp.layout, &report.x);
        stage.solved |= report.status.is_success();
        if found.times.iter().all(|(a, b)| a < b) && report.x.iter().all(|v| v.is_finite()) {
            stage.start = found;
        }
        let curves = curves(&stage.meshes, &stage.start);
        let estimates = self.estimates(problem, &curves, &stage.start)?;
        let record = SolveRecord {
            order: stage.meshes.iter().map(SplineMesh::order).max().unwrap_or(0),
            segments: stage.meshes.iter().map(SplineMesh::segments).sum(),
            points: stage.meshes.iter().map(|g| g.points.len()).sum(),
            error: largest(estimates.iter().flat_map(|e| e.errors.iter().copied())),
            objective: nlp.sign * report.objective,
            counters: Counters::of(nlp.variables(), nlp.constraints(), &report),
            status: report.status,
            solve_time,
            time: begin.elapsed(),
        };
        Ok(Pass { nlp, report, curves, estimates, record })
    }

    fn estimates(
        &self,
        problem: &Problem<'_>,
        curves: &[PhaseSplines],
        start: &Start,
    ) -> Result<Vec<PhaseEstimate>, FlatnessError> {
        let Problem { ocp, systems, scaling } = problem;
        let of = |k: usize| {
            let (times, scales) = (start.times[k], &scaling.phases[k]);
            estimate(ocp, k, &systems[k], &curves[k], times, &start.parameters, scales, &self.settings)
        };
        (0..curves.len()).map(of).collect()
    }

    /// Finer splines with the same curves: orthogonal collocation first, then higher order, then more segments. None where nothing
    /// more is allowed.
    fn refined(
        &self,
        problem: &Problem<'_>,
        splines: &[SplineSettings],
        mut stage: Stage,
        estimates: &[PhaseEstimate],
    ) -> Result<Option<Stage>, FlatnessError> {
        let poor = |e: &f64| e.is_nan() || *e > self.settings.tolerance;
        // Where every phase meets the tolerance, the objective has not settled yet: all are refined.
        let all = !estimates.iter().flat_map(|e| &e.errors).any(poor);
        let mut changed = false;
        for (k, system) in problem.systems.iter().enumerate() {
            let (mesh, c) = (&stage.meshes[k], &stage.start.coefficients[k]);
            let errors = &estimates[k].errors;
            if !splines[k].refine || !(all || errors.iter().any(poor)) {
                continue;
            }
            let marked = |s: usize| all || poor(&errors[s]);
            let more = (0..mesh.segments()).filter(|s| marked(*s)).count();
            let finer = if mesh.per_segment.is_none() {
                mesh.orthogonal(system, c, 0)
            } else if mesh.order() + RAISE <= self.settings.max_order {
                mesh.orthogonal(system, c, RAISE)
            } else if mesh.segments() + more <= self.settings.max_intervals {
                mesh.halved(system, c, marked)
            } else {
                continue;
            };
            let named = |source| FlatnessError::Basis {
                place: format!("phase `{}`, refinement", problem.ocp.phases[k].name),
                source,
            };
            (stage.meshes[k], stage.start.coefficients[k]) = finer.map_err(named)?;
            changed = true;
        }
        Ok(changed.then_some(stage))
    }
}

/// By how much the objective may change yet, relative to its size: what it changed by last, times the rate at which its changes fall.
fn expected_change(solves: &[SolveRecord], scale: f64) -> f64 {
    let change =
        |w: &[SolveRecord]| (w[1].objective - w[0].objective).abs() / scale.max(w[1].objective.abs());
    let mut changes = solves.windows(2).rev().map(change);
    match (changes.next(), changes.next()) {
        (Some(last), Some(before)) if last < before => last * (last / before),
        (Some(last), _) => last,
        (None, _) => f64::INFINITY,
    }
}

/// True if the last refinements did not reduce the error: then it is not the splines that are too coarse.
fn stagnates(solves: &[SolveRecord]) -> bool {
    let Some(recent) = solves.last_chunk::<STAGNATION>() else { return false };
    let above = recent[0].error;
    recent.iter().all(|s| s.status.is_success() && s.error >= 0.5 * above && s.error > STAGNATION_ERROR)
}

/// The request, once it is found to be well-posed.
struct Problem<'a> {
    ocp: &'a Ocp,
    systems: &'a [FlatSystem],
    scaling: Scaling,
}

/// Splines, values and active bounds: what a discretised problem is made of.
#[derive(Clone)]
struct Stage {
    meshes: Vec<SplineMesh>,
    start: Start,
    active: Vec<Active>,
    /// True if the values are a solution, if on other splines.
    solved: bool,
}

/// One discretised problem, solved.
struct Pass {
    nlp: Transcription,
    report: SolveReport,
    curves: Vec<PhaseSplines>,
    estimates: Vec<PhaseEstimate>,
    record: SolveRecord,
}

fn meshes(problem: &Problem<'_>, splines: &[SplineSettings]) -> Result<Vec<SplineMesh>, FlatnessError> {
    let phases = problem.ocp.phases.iter().zip(problem.systems).zip(splines);
    phases.map(|((phase, system), s)| SplineMesh::new(phase, system, s)).collect()
}

fn finish(
    problem: &Problem<'_>,
    stage: &Stage,
    pass: Pass,
    solves: Vec<SolveRecord>,
    presolve: Option<SolveRecord>,
) -> Result<FlatnessSolution, FlatnessError> {
    let parameters = &stage.start.parameters;
    let mut phases = Vec::with_capacity(stage.meshes.len());
    for (k, (phase, system)) in problem.ocp.phases.iter().zip(problem.systems).enumerate() {
        let (times, errors) = (stage.start.times[k], &pass.estimates[k].errors);
        phases.push(extraction::trajectory(&phase.name, system, &pass.curves[k], times, parameters, errors)?);
    }
    Ok(FlatnessSolution {
        trajectory: Trajectory {
            phases,
            parameters: parameters.clone(),
            objective: pass.record.objective,
            constraint_multipliers: None,
        },
        status: pass.report.status,
        accurate: false,
        error: pass.record.error,
        objective_change: f64::INFINITY,
        presolve,
        solves,
        unmet: unmet(problem, stage, &pass.nlp, &pass.report),
        splines: pass.curves,
        report: pass.report,
    })
}

fn check_sizes(ocp: &Ocp, systems: &[FlatSystem], splines: &[SplineSettings]) -> Result<(), FlatnessError> {
    let counts =
        [("flat systems (one per phase)", systems.len()), ("spline settings (one per phase)", splines.len())];
    for (what, found) in counts {
        let expected = ocp.phases.len();
        if found != expected {
            let place = format!("problem `{}`", ocp.name);
            return Err(FlatnessError::Dimension { place, what, expected, found });
        }
    }
    for (phase, system) in ocp.phases.iter().zip(systems) {
        system.check(phase, ocp.parameters.len())?;
    }
    Ok(())
}

fn curves(meshes: &[SplineMesh], start: &Start) -> Vec<PhaseSplines> {
    let of = |(g, c): (&SplineMesh, &Vec<Vec<f64>>)| PhaseSplines {
        bases: g.bases.clone(),
        coefficients: c.clone(),
        breaks: g.breaks.clone(),
    };
    meshes.iter().zip(&start.coefficients).map(of).collect()
}

fn unmet(problem: &Problem<'_>, stage: &Stage, nlp: &Transcription, report: &SolveReport) -> Option<Unmet> {
    if report.status.is_success() {
        return None;
    }
    let worst = report.worst_constraint?;
    let row = nlp.rows.get(worst.constraint)?;
    let phase = row.origin.phase.as_ref().and_then(|name| problem.ocp.phase_index(name));
    let time = phase.zip(row.fraction).map(|(k, s)| {
        let (start, end) = stage.start.times[k];
        (1.0 - s) * start + s * end
    });
    Some(Unmet { origin: RowOrigin { time, ..row.origin.clone() }, amount: worst.amount })
}
