//! Solve, estimate between the points, refine, until the curves meet the equations of motion.

use std::time::{Duration, Instant};

use apsides_nlp::{InteriorPoint, Nlp, Observer, SolveReport, Status};
use apsides_ocp::{Guess, Ocp, Scaling, Trajectory};

use crate::curve::PhaseSplines;
use crate::estimate::{PhaseEstimate, estimate, largest};
use crate::extraction;
use crate::grid::Grid;
use crate::rows::{Active, RowOrigin};
use crate::settings::BoundRows;
use crate::start::Start;
use crate::transcription::Transcription;
use crate::{FlatSystem, FlatnessError, FlatnessSettings, SplineSettings};

/// Orders added by one refinement.
const RAISE: usize = 2;

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
    /// Variables.
    pub variables: usize,
    /// Constraints.
    pub constraints: usize,
    /// Interior-point iterations.
    pub iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// How the solve ended.
    pub status: Status,
    /// Wall-clock time of the interior-point method.
    pub solve_time: Duration,
    /// Wall-clock time of all: transcription, solve, estimate.
    pub time: Duration,
}

/// The constraint that is violated most, relative to its scale, when no feasible point was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Unmet {
    /// Which constraint, where.
    pub origin: RowOrigin,
    /// By how much it is violated, in its unit; negative below a lower bound.
    pub amount: f64,
}

impl std::fmt::Display for Unmet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: violated by {:.6} {}", self.origin, self.amount.abs(), self.origin.unit)
    }
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct FlatnessSolution {
    /// The trajectory, without costates.
    pub trajectory: Trajectory,
    /// How the last solve ended. A solve can succeed on points that are too few: see [`accurate`](Self::accurate).
    pub status: Status,
    /// Whether the error estimate meets the tolerance and, after a refinement, the objective has settled.
    pub accurate: bool,
    /// Largest estimated relative error of a state over one segment.
    pub error: f64,
    /// Every discretised problem.
    pub solves: Vec<SolveRecord>,
    /// The constraint that could not be met, when the last solve did not succeed.
    pub unmet: Option<Unmet>,
    /// The splines, per phase.
    pub splines: Vec<PhaseSplines>,
    /// Report of the last solve.
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
        self.settings.check()?;
        check_sizes(ocp, systems, splines)?;
        guess.check(ocp)?;
        let scaling = Scaling::new(ocp, guess);
        let mut grids = Vec::with_capacity(systems.len());
        for ((phase, system), s) in ocp.phases.iter().zip(systems).zip(splines) {
            grids.push(Grid::new(phase, system, s)?);
        }
        let mut start = Start::from_guess(ocp, systems, &grids, guess)?;
        start.fit_states(ocp, systems, &grids, guess, &scaling);
        let mut active = Active::first(ocp, self.settings.bounds);
        let mut solves: Vec<SolveRecord> = Vec::new();
        loop {
            let begin = Instant::now();
            let mut nlp = Transcription::new(ocp, systems, &grids, &start, &scaling, &active)?;
            let solver = InteriorPoint { settings: self.settings.nlp.clone() };
            let solve_begin = Instant::now();
            let report = solver.solve_observed(&mut nlp, observer)?;
            let solve_time = solve_begin.elapsed();
            // A point that is no trajectory can come from a solve that failed; its start takes its place.
            let found = Start::from_vector(&nlp.layout, &report.x);
            let lasts = found.times.iter().all(|(a, b)| a < b) && report.x.iter().all(|v| v.is_finite());
            if lasts {
                start = found;
            }
            let curves: Vec<PhaseSplines> = curves(&grids, &start);
            let estimates = self.estimates(ocp, systems, &curves, &start, &scaling)?;
            let error = largest(estimates.iter().flat_map(|e| e.errors.iter().copied()));
            let objective = nlp.sign * report.objective;
            let previous = solves.last().map(|s| s.objective);
            solves.push(SolveRecord {
                order: grids.iter().map(Grid::order).max().unwrap_or(0),
                segments: grids.iter().map(Grid::segments).sum(),
                points: grids.iter().map(|g| g.points.len()).sum(),
                error,
                objective,
                variables: nlp.variables(),
                constraints: nlp.constraints(),
                iterations: report.counters.iterations,
                factorisations: report.counters.factorisations,
                status: report.status,
                solve_time,
                time: begin.elapsed(),
            });
            let scale = nlp.scaling.objective.max(objective.abs());
            let change = previous.map_or(f64::INFINITY, |p| (p - objective).abs() / scale);
            let refinable = splines.iter().any(|s| s.refine);
            let settled = !refinable || change <= self.settings.objective_tolerance;
            let accurate = report.status.is_success() && error <= self.settings.defect_tolerance && settled;
            let last = !report.status.is_success() || solves.len() >= self.settings.max_solves;
            let rows_added = !last && self.settings.bounds == BoundRows::WhereExceeded && {
                let exceeded = active.iter_mut().zip(&estimates);
                exceeded.fold(false, |any, (a, e)| a.extend(&e.exceeded) || any)
            };
            if rows_added {
                continue;
            }
            let refined = if last || accurate || !refinable {
                None
            } else {
                self.refined(ocp, systems, splines, &grids, &start, &estimates)?
            };
            if let Some((finer, coefficients)) = refined {
                grids = finer;
                start.coefficients = coefficients;
                continue;
            }
            let mut phases = Vec::with_capacity(systems.len());
            for (k, phase) in ocp.phases.iter().enumerate() {
                let (times, errors) = (start.times[k], &estimates[k].errors);
                phases.push(extraction::trajectory(
                    &phase.name,
                    &systems[k],
                    &curves[k],
                    times,
                    &start.parameters,
                    errors,
                )?);
            }
            let unmet = unmet(&nlp, &report);
            let trajectory = Trajectory {
                phases,
                parameters: start.parameters,
                objective,
                constraint_multipliers: None,
            };
            let status = report.status;
            return Ok(FlatnessSolution {
                trajectory,
                status,
                accurate,
                error,
                solves,
                unmet,
                splines: curves,
                report,
            });
        }
    }

    fn estimates(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        curves: &[PhaseSplines],
        start: &Start,
        scaling: &Scaling,
    ) -> Result<Vec<PhaseEstimate>, FlatnessError> {
        let of = |k: usize| {
            let (times, scales) = (start.times[k], &scaling.phases[k]);
            estimate(ocp, k, &systems[k], &curves[k], times, &start.parameters, scales, &self.settings)
        };
        (0..curves.len()).map(of).collect()
    }

    /// Finer grids with the same curves: orthogonal collocation first, then higher order, then more segments. None where nothing
    /// more is allowed.
    #[allow(clippy::type_complexity)]
    fn refined(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        splines: &[SplineSettings],
        grids: &[Grid],
        start: &Start,
        estimates: &[PhaseEstimate],
    ) -> Result<Option<(Vec<Grid>, Vec<Vec<Vec<f64>>>)>, FlatnessError> {
        let tolerance = self.settings.defect_tolerance;
        let poor = |e: &f64| !(*e <= tolerance);
        // Where every phase meets the tolerance, the objective has not settled yet: all are refined.
        let all = !estimates.iter().flat_map(|e| &e.errors).any(poor);
        let (mut finer, mut coefficients) = (Vec::new(), Vec::new());
        let mut changed = false;
        for k in 0..grids.len() {
            let (grid, system, c) = (&grids[k], &systems[k], &start.coefficients[k]);
            let errors = &estimates[k].errors;
            let wanted = splines[k].refine && (all || errors.iter().any(poor));
            let named = |source| FlatnessError::Basis {
                place: format!("phase `{}`, refinement", ocp.phases[k].name),
                source,
            };
            let marked = |s: usize| all || poor(&errors[s]);
            let more = (0..grid.segments()).filter(|s| marked(*s)).count();
            let next = if !wanted {
                None
            } else if grid.per_segment.is_none() {
                Some(grid.orthogonal(system, c, 0))
            } else if grid.order() + RAISE <= self.settings.max_order {
                Some(grid.orthogonal(system, c, RAISE))
            } else if grid.segments() + more <= self.settings.max_segments {
                Some(grid.halved(system, c, marked))
            } else {
                None
            };
            changed |= next.is_some();
            let (g, c) = next.unwrap_or_else(|| Ok((grid.clone(), c.clone()))).map_err(named)?;
            finer.push(g);
            coefficients.push(c);
        }
        Ok(changed.then_some((finer, coefficients)))
    }
}

fn check_sizes(ocp: &Ocp, systems: &[FlatSystem], splines: &[SplineSettings]) -> Result<(), FlatnessError> {
    let counts = [
        ("flat systems (one per phase)", systems.len()),
        ("spline settings (one per phase)", splines.len()),
    ];
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

fn curves(grids: &[Grid], start: &Start) -> Vec<PhaseSplines> {
    let of = |(g, c): (&Grid, &Vec<Vec<f64>>)| PhaseSplines {
        bases: g.bases.clone(),
        coefficients: c.clone(),
        breaks: g.breaks.clone(),
    };
    grids.iter().zip(&start.coefficients).map(of).collect()
}

fn unmet(nlp: &Transcription, report: &SolveReport) -> Option<Unmet> {
    if report.status.is_success() {
        return None;
    }
    let worst = report.worst_constraint?;
    Some(Unmet { origin: nlp.rows.get(worst.constraint)?.origin.clone(), amount: worst.amount })
}
