//! Damped Newton iteration with the natural monotonicity test.
//!
//! P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3.2: a step is accepted when the correction that the
//! old Jacobian gives at the new point is smaller than the step, or when the residual falls.

use apsides_nlp::{Flow as Proceed, IterationRecord, Observer, Status};
use nalgebra::{DMatrix, DVector};

use super::conditions::{Conditions, FailedSegment, Slopes};
use super::elimination::Elimination;
use super::settings::IndirectSettings;

/// Shortest damped step.
const SHORTEST: f64 = 1e-5;
/// Correction, in units of the tolerance, that counts as converged when rounding stops it from falling.
const ROUNDING: f64 = 1e3;

/// Changes of the bounds that hold end quantities before the solve is given up.
const MAX_CHANGES: usize = 20;
/// Shortest step of the continuation to a bound that is exceeded, and the iterations up to which the next one is twice as long.
const SHORTEST_TIGHTENING: f64 = 0.02;
const EASY: usize = 4;

/// Further steps with the Jacobian of the one before: each costs a third of a new one.
const CHORDS: i32 = 1;

/// The end of an iteration.
pub(super) struct Ended {
    pub(super) status: Status,
    pub(super) iterations: usize,
    pub(super) flights: usize,
    pub(super) residual: f64,
    pub(super) correction: f64,
    pub(super) failure: Option<FailedSegment>,
}

fn largest(v: &DVector<f64>) -> f64 {
    v.iter().fold(0.0_f64, |m, x| if x.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

/// The knowledge that a solve begins with.
pub(super) struct Begin {
    /// True when nodes follow from the flight from the first one of each phase.
    pub(super) chained: bool,
    /// True when the multipliers of the endpoint constraints are known.
    pub(super) multipliers: bool,
}

/// Solves from `z`, which is replaced by the best point: Newton iterations with given active bounds, until these are the right ones.
pub(super) fn solve(
    equations: &mut Conditions,
    z: &mut Vec<f64>,
    begin: Begin,
    settings: &IndirectSettings,
    observer: &mut dyn Observer,
) -> Ended {
    let mut ended = Ended {
        status: Status::IterationLimit,
        iterations: 0,
        flights: 1,
        residual: f64::INFINITY,
        correction: f64::INFINITY,
        failure: None,
    };
    equations.set_tolerance(settings.early());
    let chained = begin.chained && equations.fly_through(z).is_ok();
    if !chained && let Err(failure) = equations.fly(z, Slopes::New) {
        ended.failure = Some(failure);
        ended.status = Status::EvaluationFailed(apsides_nlp::Evaluation::Constraints);
        return ended;
    }
    if !begin.multipliers {
        equations.estimate_multipliers(z);
    }
    equations.choose_at_start(z);
    iterate(equations, z, settings, &mut ended, observer);
    for _ in 0..MAX_CHANGES {
        if !ended.status.is_success() || !equations.choose_at_solution(z) {
            return ended;
        }
        tighten(equations, z, settings, &mut ended, observer);
    }
    ended.status = Status::IterationLimit;
    ended
}

/// From a solution that exceeds a bound to one that keeps it: at once, else by continuation in how far it may be exceeded.
fn tighten(
    equations: &mut Conditions,
    z: &mut Vec<f64>,
    settings: &IndirectSettings,
    ended: &mut Ended,
    observer: &mut dyn Observer,
) {
    let (mut done, mut step) = (0.0, 1.0_f64);
    while done < 1.0 {
        let next = (done + step).min(1.0);
        let (from, before) = (z.clone(), ended.iterations);
        equations.allowance = 1.0 - next;
        ended.status = Status::IterationLimit;
        if equations.fly(z, Slopes::New).is_ok() {
            iterate(equations, z, settings, ended, observer);
        }
        if ended.status.is_success() {
            done = next;
            step *= if ended.iterations - before <= EASY { 2.0 } else { 1.0 };
        } else {
            *z = from;
            step *= 0.5;
            if step < SHORTEST_TIGHTENING || ended.status == Status::Interrupted {
                return;
            }
        }
    }
}

/// Newton iterations from a point that has been flown with sensitivities.
fn iterate(
    equations: &mut Conditions,
    z: &mut Vec<f64>,
    settings: &IndirectSettings,
    ended: &mut Ended,
    observer: &mut dyn Observer,
) {
    let n = equations.layout.unknowns;
    let mut residual = DVector::zeros(n);
    let mut matrix = DMatrix::zeros(n, n);
    equations.residual(z, &mut residual);
    let last = ended.iterations + settings.max_iterations;
    let mut record = Record { step: 0.0, length: 0.0, trials: 0 };
    // Corrections left after a full step relative to the square of that step.
    let mut bend = f64::INFINITY;
    // Whether the integration is still the rough one; it is not changed back.
    let mut early = true;
    loop {
        ended.residual = largest(&residual);
        if record.emit(equations, z, ended, observer) == Proceed::Stop {
            ended.status = Status::Interrupted;
            return;
        }
        if ended.iterations >= last {
            ended.status = Status::IterationLimit;
            return;
        }
        equations.jacobian(&mut matrix);
        let lu = Elimination::new(&matrix);
        let Some(step) = lu.solve(&-&residual) else {
            ended.status = Status::StepTooSmall;
            return;
        };
        let size = largest(&step);
        ended.iterations += 1;
        // Where this Jacobian is good enough for what is left after the step, none is needed at the new point.
        let enough = (bend * size).powi(1 + CHORDS) * size <= settings.tolerance;
        let mut length = longest(equations, z, &step, settings);
        record.trials = 0;
        let mut accepted = false;
        let mut has_slopes = false;
        while length >= SHORTEST {
            record.trials += 1;
            let trial = moved(equations, z, &step, length);
            let expected = if length == 1.0 { size.min(bend * size * size) } else { size };
            early &= expected > IndirectSettings::EARLY;
            equations.set_tolerance(if early { settings.early() } else { settings.integration_tolerance });
            // Slopes by the accurate integration cost some three times those by the rough one, which are as good for a step.
            let slopes = if enough || !early { Slopes::Unwanted } else { Slopes::New };
            let Some(mut found) = look(equations, &lu, &trial, slopes, ended) else {
                length *= 0.5;
                continue;
            };
            has_slopes = slopes == Slopes::New;
            if length == 1.0 {
                bend = found.left / (size * size);
                if early && found.left <= IndirectSettings::EARLY {
                    // Nearer than expected: worth a look at what the accurate integration says. The slopes of the rough one are off by far
                    // less than a step with them leaves.
                    early = false;
                    equations.set_tolerance(settings.integration_tolerance);
                    let slopes = if has_slopes { Slopes::Kept } else { Slopes::Unwanted };
                    let Some(accurate) = look(equations, &lu, &trial, slopes, ended) else {
                        length *= 0.5;
                        continue;
                    };
                    found = accurate;
                }
            }
            if length == 1.0 && !early {
                let flights = ended.flights;
                let polished = polish(equations, &lu, trial.clone(), found.clone(), size, settings, ended);
                has_slopes &= ended.flights == flights;
                if let Some(solution) = polished {
                    *z = solution;
                    record = Record { step: size, length, ..record };
                    record.emit(equations, z, ended, observer);
                    return;
                }
            }
            let falls = found.left <= (1.0 - 0.5 * length) * size
                || largest(&found.residual) <= (1.0 - 0.25 * length) * ended.residual;
            if falls {
                *z = trial;
                residual = found.residual;
                accepted = true;
                ended.failure = None;
                break;
            }
            length *= 0.5;
        }
        record = Record { step: size, length, ..record };
        if !(accepted && has_slopes) {
            equations.set_tolerance(settings.early());
            if equations.fly(z, Slopes::New).is_err() {
                accepted = false;
            }
        }
        if !accepted {
            let converged = size <= ROUNDING * settings.tolerance;
            ended.status = if converged { Status::Acceptable } else { Status::StepTooSmall };
            return;
        }
    }
}

/// The quality of a point: its residual, and the correction that a given Jacobian asks for.
#[derive(Clone)]
struct Look {
    residual: DVector<f64>,
    step: DVector<f64>,
    left: f64,
}

fn look(
    equations: &mut Conditions,
    lu: &Elimination,
    z: &[f64],
    slopes: Slopes,
    ended: &mut Ended,
) -> Option<Look> {
    ended.flights += 1;
    if let Err(failure) = equations.fly(z, slopes) {
        ended.failure = Some(failure);
        return None;
    }
    let mut residual = DVector::zeros(z.len());
    equations.residual(z, &mut residual);
    let step = lu.solve(&-&residual)?;
    let left = largest(&step);
    ended.correction = left;
    left.is_finite().then_some(Look { residual, step, left })
}

/// Takes the corrections of the same Jacobian while they are about to converge; the solution if they do.
fn polish(
    equations: &mut Conditions,
    lu: &Elimination,
    mut z: Vec<f64>,
    mut found: Look,
    mut before: f64,
    settings: &IndirectSettings,
    ended: &mut Ended,
) -> Option<Vec<f64>> {
    for remaining in (0..CHORDS).rev() {
        if found.left <= settings.tolerance {
            break;
        }
        if found.left * (found.left / before).powi(remaining + 1) > settings.tolerance {
            return None;
        }
        z = moved(equations, &z, &found.step, 1.0);
        before = found.left;
        ended.iterations += 1;
        found = look(equations, lu, &z, Slopes::Unwanted, ended)?;
    }
    if found.left > settings.tolerance {
        return None;
    }
    ended.residual = largest(&found.residual);
    ended.status = Status::Optimal;
    ended.failure = None;
    Some(moved(equations, &z, &found.step, 1.0))
}

/// `z + length step`, the step being in units of the unknowns.
fn moved(equations: &Conditions, z: &[f64], step: &DVector<f64>, length: f64) -> Vec<f64> {
    z.iter().zip(step.iter()).zip(&equations.layout.scales).map(|((z, d), s)| z + length * d * s).collect()
}

/// The longest part of a step, at most one, within the limits: of each unknown in units of its size, and of durations.
fn longest(equations: &Conditions, z: &[f64], step: &DVector<f64>, settings: &IndirectSettings) -> f64 {
    let mut length = (settings.step_limit / largest(step)).min(1.0);
    for p in &equations.layout.phases {
        let (a, b) = (p.initial_time, p.final_time);
        let scales = &equations.layout.scales;
        let change = step[b] * scales[b] - step[a] * scales[a];
        let duration = z[b] - z[a];
        if change < 0.0 {
            length = length.min(settings.duration_limit * duration / -change);
        }
    }
    length
}

struct Record {
    step: f64,
    length: f64,
    trials: usize,
}

impl Record {
    fn emit(
        &self,
        equations: &mut Conditions,
        z: &[f64],
        ended: &Ended,
        observer: &mut dyn Observer,
    ) -> Proceed {
        observer.iteration(&IterationRecord {
            iteration: ended.iterations,
            restoration: false,
            objective: equations.ends.cost(z),
            primal_infeasibility: ended.residual,
            dual_infeasibility: if ended.correction.is_finite() { ended.correction } else { 0.0 },
            barrier: 0.0,
            step_norm: self.step,
            regularisation: 0.0,
            dual_step: self.length,
            primal_step: self.length,
            line_search_trials: self.trials,
            step_kind: '-',
        })
    }
}
