//! Solve, estimate, refine, until steps and controls are good enough.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use apsides_nlp::{Observer, SolveReport, Status};
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory, Unmet};
use apsides_ode::{FnSystem, Integrator, OdeSettings, SmoothSystem, Tolerance};
use apsides_transcription::{StartingPoint, Workers, starting_point};

use super::estimate::{SegmentEstimate, estimate};
use super::extraction::extract;
use super::plan::PhasePlan;
use super::refinement::{Wants, refine};
use super::settings::MultipleShootingSettings;
use super::shot::Shot;
use super::transcription::{Shots, Transcription, place, transcribe};
use crate::error::ShootingError;

/// Most steps of a segment before the first solve, and those where the guess cannot be integrated.
const MOST_FIRST_STEPS: usize = 100;
const BLIND_STEPS: usize = 4;

/// Difference that counts as none, as a multiple of the tolerance: both integrations have an error.
const MISS: f64 = 2.0;

/// The method: direct multiple shooting, single shooting with one segment.
#[derive(Clone, Debug, Default)]
pub struct MultipleShooting {
    /// Settings.
    pub settings: MultipleShootingSettings,
}

/// One solve: a division into segments and steps.
#[derive(Clone, Debug)]
pub struct ShootingRecord {
    /// Segments of all phases.
    pub segments: usize,
    /// Runge-Kutta steps of all segments.
    pub steps: usize,
    /// Largest error of the steps of a segment, relative to the scales of the states.
    pub integration_error: f64,
    /// Gain that the estimate expects of richer controls, relative to the objective.
    pub control_gain: f64,
    /// Largest excess of a bound on a state or of a path constraint between control points, relative to its scale; rows with
    /// controls count where they are equalities.
    pub path_excess: f64,
    /// Largest excess of a bound on a control, or of an inequality with controls, between control points, relative to its scale: no
    /// condition of accuracy.
    pub control_excess: f64,
    /// Size of the discretised problem, and the work of the interior-point method.
    pub counters: Counters,
    /// Objective in its own sense.
    pub objective: f64,
    /// Wall-clock time: transcription, solve, estimate.
    pub time: Duration,
}

/// The result of a solve.
#[derive(Clone, Debug)]
pub struct ShootingSolution {
    /// The trajectory of the last division that was solved; that of the first when none was. The errors of its intervals are those
    /// of the steps.
    pub trajectory: Trajectory,
    /// The status of the last solve: without success when a later division than that of the trajectory could not be solved.
    pub status: Status,
    /// True if steps, controls and path constraints meet their tolerances by the estimates.
    pub accurate: bool,
    /// The constraint that could not be met, when the last solve did not succeed.
    pub unmet: Option<Unmet>,
    /// Every solve.
    pub meshes: Vec<ShootingRecord>,
    /// Report of the solve that gave the trajectory.
    pub report: SolveReport,
}

impl MultipleShooting {
    /// Solves from equal segments as the settings say.
    ///
    /// # Errors
    /// When the request is ill-posed. Not converging is a status of the solution.
    pub fn solve(&self, ocp: &Ocp, guess: &Guess) -> Result<ShootingSolution, ShootingError> {
        self.solve_on(ocp, guess, self.uniform_mesh(ocp)?, &mut ())
    }

    /// Equal segments as the settings say.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn uniform_mesh(&self, ocp: &Ocp) -> Result<Mesh, ShootingError> {
        self.settings.check()?;
        Ok(Mesh::uniform(ocp, self.settings.intervals, self.settings.points)?)
    }

    /// Solves from given segments: the intervals of the mesh, whose points are the control points of each. The observer sees every
    /// iteration and can stop the solve.
    ///
    /// A guess made of an earlier trajectory with costates starts the interior-point method close to its multipliers.
    ///
    /// # Errors
    /// When the request is ill-posed.
    pub fn solve_on(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        mesh: Mesh,
        observer: &mut dyn Observer,
    ) -> Result<ShootingSolution, ShootingError> {
        let settings = &self.settings;
        settings.check()?;
        let workers = Workers::new(settings.threads);
        if settings.continuous_controls && mesh.phases.iter().any(|m| m.points().contains(&1)) {
            let allowed = "off where a segment has a single control point";
            return Err(ShootingError::Setting { name: "continuous_controls", value: 1.0, allowed });
        }
        let mut plans: Vec<PhasePlan> = mesh.phases.iter().map(|m| PhasePlan::new(m.clone(), 1)).collect();
        for plan in &mut plans {
            plan.inner_bounds.fill(settings.constraint_points.is_some());
        }
        let mut guess = guess.clone();
        count_steps(ocp, &guess, &mut plans, settings)?;
        let mut meshes: Vec<ShootingRecord> = Vec::new();
        let mut last: Option<(Trajectory, SolveReport, bool)> = None;
        loop {
            let begin = Instant::now();
            let mut nlp = transcribe(ocp, &plans, &guess, settings)?.with_workers(&workers);
            let report = nlp.solve(ocp, &guess, &settings.nlp, observer)?;
            let extracted = extract(&mut nlp, ocp, &report, settings.integration_tolerance)?;
            let estimates = estimate(&nlp, ocp, &report, &extracted)?;
            meshes.push(record(&nlp, &estimates, &report, begin.elapsed()));
            let status = report.status;
            let trajectory = extracted.trajectory;
            if !status.is_success() {
                let unmet = nlp.unmet(ocp, &report);
                let (trajectory, report, accurate) = last.unwrap_or((trajectory, report, false));
                return Ok(ShootingSolution { trajectory, status, accurate, unmet, meshes, report });
            }
            let segments: usize = estimates.iter().map(Vec::len).sum();
            let share = settings.tolerance / segments as f64;
            let order = nlp.discretisation.all.first().map_or(1, |s| s.flow.order());
            for (plan, t) in plans.iter_mut().zip(&trajectory.phases) {
                // Where the ends of segments are unknowns, from these on.
                plan.mesh.clone_from(&t.mesh);
            }
            let (mut next, mut wants) = (Vec::with_capacity(plans.len()), Wants::default());
            for ((plan, estimates), start) in plans.iter().zip(&estimates).zip(&mesh.phases) {
                let (plan, phase_wants) = refine(plan, estimates, settings, order, start, share)?;
                next.push(plan);
                wants.accuracy |= phase_wants.accuracy;
                wants.overstepped |= phase_wants.overstepped;
            }
            if next.iter().map(|p| p.mesh.intervals()).sum::<usize>() > settings.max_intervals {
                next = plans.iter().zip(&estimates).map(|(p, e)| p.with_steps(e, settings, order)).collect();
            }
            let same = next.iter().zip(&plans).all(|(a, b)| a.has_unknowns_of(b));
            let done = !wants.accuracy && (!wants.overstepped || same);
            if done || next == plans || meshes.len() > settings.max_refinements {
                let accurate = !wants.accuracy;
                return Ok(ShootingSolution { trajectory, status, accurate, unmet: None, meshes, report });
            }
            guess = Guess::earlier(&trajectory);
            last = Some((trajectory, report, !wants.accuracy));
            plans = next;
        }
    }
}

/// Equal steps along each segment of the start that come as close as the tolerance says to an integration with step control, in
/// powers of two, no more than that takes.
fn count_steps(
    ocp: &Ocp,
    guess: &Guess,
    plans: &mut [PhasePlan],
    settings: &MultipleShootingSettings,
) -> Result<(), ShootingError> {
    let (layout, Shots { mut all, .. }) = place(ocp, plans, guess, settings)?;
    let (start, scales) = starting_point(ocp, guess, &layout, StartingPoint::BetweenBounds);
    let mut shots = all.iter_mut();
    for (p, plan) in layout.phases.iter().zip(plans) {
        for ((segment, steps), shot) in p.segments.iter().zip(&mut plan.steps).zip(&mut shots) {
            shot.set_point(&start);
            let scales = &scales[segment.state_column..][..p.states];
            *steps = first_steps(shot, scales, settings)?.max(settings.least_steps);
        }
    }
    Ok(())
}

fn first_steps(
    shot: &mut Shot,
    scales: &[f64],
    settings: &MultipleShootingSettings,
) -> Result<usize, ShootingError> {
    let n = scales.len();
    let (x0, w) = shot.point.split_at(n);
    let outputs = shot.system.states() + shot.system.quadratures();
    let scratch = RefCell::new((&mut shot.system, vec![0.0; outputs]));
    let rates = FnSystem::new(n, |s: f64, x: &[f64], dx: &mut [f64]| {
        let (system, rates) = &mut *scratch.borrow_mut();
        system.rate(s, x, w, rates);
        dx.copy_from_slice(&rates[..n]);
    });
    let tolerance = settings.integration_tolerance;
    let absolute = scales.iter().map(|s| s * tolerance).collect();
    let controlled = OdeSettings {
        method: settings.method,
        relative_tolerance: tolerance,
        absolute_tolerance: Tolerance::PerComponent(absolute),
        max_steps: MOST_FIRST_STEPS,
        stiffness_interval: None,
        ..OdeSettings::default()
    };
    let reach = |settings: OdeSettings| -> Result<Option<(Vec<f64>, usize)>, ShootingError> {
        let mut end = vec![0.0; n];
        let summary = Integrator::new(n, settings)?.integrate(&rates, 0.0, x0, 1.0, &mut end);
        let completed = summary.ok().filter(|s| s.status == apsides_ode::Status::Completed);
        Ok(completed.map(|s| (end, s.statistics.accepted)))
    };
    let Some((exact, most)) = reach(controlled.clone())? else { return Ok(BLIND_STEPS) };
    let mut steps = 1;
    while steps < most {
        let fixed = OdeSettings { fixed_step: Some(1.0 / steps as f64), ..controlled.clone() };
        let end = reach(fixed)?;
        let close = |end: Vec<f64>| {
            let mut misses = end.iter().zip(&exact).zip(scales);
            misses.all(|((a, b), s)| (a - b).abs() <= MISS * tolerance * s)
        };
        if end.is_some_and(|(end, _)| close(end)) {
            break;
        }
        steps *= 2;
    }
    Ok(steps.min(most).max(1))
}

fn largest(estimates: &[Vec<SegmentEstimate>], value: impl Fn(&SegmentEstimate) -> f64) -> f64 {
    let values = estimates.iter().flatten().map(value);
    values.fold(0.0, |worst: f64, v| if v > worst || v.is_nan() { v } else { worst })
}

fn record(
    nlp: &Transcription,
    estimates: &[Vec<SegmentEstimate>],
    report: &SolveReport,
    time: Duration,
) -> ShootingRecord {
    let all = || estimates.iter().flatten();
    ShootingRecord {
        segments: all().count(),
        steps: nlp.discretisation.all.iter().map(|s| s.flow.steps()).sum(),
        integration_error: largest(estimates, |e| e.integration),
        control_gain: all().map(|e| e.gain).sum(),
        path_excess: largest(estimates, |e| e.state_excess.max(e.equality_excess)),
        control_excess: largest(estimates, |e| e.control_excess.max(e.mixed_excess)),
        counters: Counters::of(nlp.layout.variables, nlp.layout.constraints, report),
        objective: nlp.sign() * report.objective,
        time,
    }
}
