//! The integrator: step control, observers, events.

use std::ops::ControlFlow;

use crate::dense::DenseSolution;
use crate::error::{require_dimension, require_finite};
use crate::event::{Event, EventTracker};
use crate::scheme::dop853::Dop853;
use crate::scheme::dopri5::Dopri5;
use crate::scheme::{ErrorWeights, Scheme, Stages};
use crate::step::{Observer, Step};
use crate::step_control::{StepControl, StiffnessTest, first_step};
use crate::{Method, OdeError, OdeSettings, OdeSystem, Statistics, Status, Summary, Tolerance};

/// Shortest step relative to the time, below which time no longer resolves it.
const RESOLUTION: f64 = 10.0 * f64::EPSILON;
/// Stands in for the time near zero, so that steps shrink no further than the range of `f64`.
const SMALLEST_TIME: f64 = 1e-280;
/// A step may be stretched by this factor to reach the end, rather than leave a tiny remainder.
const STRETCH: f64 = 1.01;

/// Integrates systems of one dimension; owns all storage, so that nothing is allocated while it runs.
///
/// Times may run forward or backward. Whatever the status, the last good state is written to the caller's slice.
#[derive(Debug, Clone)]
pub struct Integrator {
    dimension: usize,
    settings: OdeSettings,
    weights: ErrorWeights,
    stages: Stages,
    events: EventTracker,
    /// End state of a sampled integration.
    end: Vec<f64>,
}

impl Integrator {
    /// An integrator for systems of `dimension` components.
    ///
    /// # Errors
    /// [`OdeError::Setting`] or [`OdeError::Dimension`] where the settings are out of range or do not fit.
    pub fn new(dimension: usize, settings: OdeSettings) -> Result<Self, OdeError> {
        if dimension == 0 {
            return Err(OdeError::Dimension { argument: "the system", expected: 1, found: 0 });
        }
        let absolute = settings.checked(dimension)?;
        let weights = ErrorWeights { relative: settings.relative_tolerance, absolute };
        let stages = Stages::new(dimension);
        Ok(Self {
            dimension,
            settings,
            weights,
            stages,
            events: EventTracker::new(dimension),
            end: vec![0.0; dimension],
        })
    }

    /// Number of components.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The settings.
    pub fn settings(&self) -> &OdeSettings {
        &self.settings
    }

    /// Replaces both tolerances.
    ///
    /// # Errors
    /// As [`new`](Self::new); the old ones are kept then.
    pub fn set_tolerance(&mut self, relative: f64, absolute: impl Into<Tolerance>) -> Result<(), OdeError> {
        let settings = OdeSettings {
            relative_tolerance: relative,
            absolute_tolerance: absolute.into(),
            ..self.settings.clone()
        };
        self.weights = ErrorWeights { relative, absolute: settings.checked(self.dimension)? };
        self.settings = settings;
        Ok(())
    }

    /// Integrates from `x0` at `t0` to `t1`; the state reached is written to `x1`.
    ///
    /// # Errors
    /// [`OdeError::Dimension`] or [`OdeError::NotFinite`] where an argument does not fit or is NaN or infinite.
    pub fn integrate<S: OdeSystem>(
        &mut self,
        system: &S,
        t0: f64,
        x0: &[f64],
        t1: f64,
        x1: &mut [f64],
    ) -> Result<Summary, OdeError> {
        self.integrate_observed(system, t0, x0, t1, x1, &[], &mut ())
    }

    /// Like [`integrate`](Self::integrate), locating `events` and showing steps and events to `observer`.
    ///
    /// # Errors
    /// As [`integrate`](Self::integrate).
    pub fn integrate_observed<S: OdeSystem, O: Observer>(
        &mut self,
        system: &S,
        t0: f64,
        x0: &[f64],
        t1: f64,
        x1: &mut [f64],
        events: &[Event<'_>],
        observer: &mut O,
    ) -> Result<Summary, OdeError> {
        require_dimension("the system", self.dimension, system.dimension())?;
        require_dimension("x0", self.dimension, x0.len())?;
        require_dimension("x1", self.dimension, x1.len())?;
        require_finite("t0", &[t0])?;
        require_finite("t1", &[t1])?;
        require_finite("x0", x0)?;
        require_finite("t1 - t0", &[t1 - t0])?;
        self.stages.x.copy_from_slice(x0);
        let summary = match self.settings.method {
            Method::Dop853 => self.run::<Dop853, S, O>(system, t0, t1, events, observer),
            Method::Dopri5 => self.run::<Dopri5, S, O>(system, t0, t1, events, observer),
        };
        x1.copy_from_slice(&self.stages.x);
        Ok(summary)
    }

    /// Integrates from `x0` at `t0` through `times`, which run in one direction, and writes the state at each to a
    /// row of `states` (row-major, times by components). Rows not reached are NaN.
    ///
    /// # Errors
    /// As [`integrate`](Self::integrate), and [`OdeError::SampleOrder`] where the times turn back.
    pub fn sample<S: OdeSystem>(
        &mut self,
        system: &S,
        t0: f64,
        x0: &[f64],
        times: &[f64],
        states: &mut [f64],
    ) -> Result<Summary, OdeError> {
        require_dimension("states", times.len() * self.dimension, states.len())?;
        require_finite("times", times)?;
        let t1 = times.last().copied().unwrap_or(t0);
        let mut previous = t0;
        for (index, &time) in times.iter().enumerate() {
            if (time - previous) * (t1 - t0) < 0.0 || (t1 == t0 && time != t0) {
                return Err(OdeError::SampleOrder { index, time, previous });
            }
            previous = time;
        }
        states.fill(f64::NAN);
        let n = self.dimension;
        let mut done = 0;
        // Times equal to the start need no step.
        if x0.len() == n {
            while done < times.len() && times[done] == t0 {
                states[done * n..(done + 1) * n].copy_from_slice(x0);
                done += 1;
            }
        }
        let mut end = std::mem::take(&mut self.end);
        let summary = self.integrate_observed(system, t0, x0, t1, &mut end, &[], &mut |step: &Step<'_>| {
            while done < times.len() && step.contains(times[done]) {
                step.evaluate(times[done], &mut states[done * n..(done + 1) * n]);
                done += 1;
            }
            ControlFlow::Continue(())
        });
        self.end = end;
        summary
    }

    /// Integrates from `x0` at `t0` to `t1` and keeps the dense output of every step (this allocates).
    ///
    /// # Errors
    /// As [`integrate`](Self::integrate).
    pub fn solve_dense<S: OdeSystem>(
        &mut self,
        system: &S,
        t0: f64,
        x0: &[f64],
        t1: f64,
    ) -> Result<(Summary, DenseSolution), OdeError> {
        let mut solution = DenseSolution::new(t0, x0);
        let mut end = vec![0.0; self.dimension];
        let summary = self.integrate_observed(system, t0, x0, t1, &mut end, &[], &mut solution)?;
        Ok((summary, solution))
    }

    /// The integration proper: from `stages.x` at `t0`, leaving the state reached in `stages.x`.
    fn run<M: Scheme, S: OdeSystem, O: Observer>(
        &mut self,
        system: &S,
        t0: f64,
        t1: f64,
        events: &[Event<'_>],
        observer: &mut O,
    ) -> Summary {
        let Self { dimension, settings, weights, stages, events: tracker, .. } = self;
        let n = *dimension;
        let mut statistics = Statistics::default();
        let ended = |status, time, next_step: f64, statistics| Summary {
            status,
            time,
            next_step: next_step.abs(),
            statistics,
        };
        if t0 == t1 {
            return ended(Status::Completed, t0, 0.0, statistics);
        }
        let direction = (t1 - t0).signum();
        let span = (t1 - t0).abs();
        system.rate(t0, &stages.x, &mut stages.k[0]);
        statistics.evaluations += 1;
        if !all_finite(&stages.k[0]) {
            return ended(Status::NotFinite, t0, 0.0, statistics);
        }
        let limit = settings.fixed_step.unwrap_or(settings.max_step);
        let mut size = match (settings.fixed_step, settings.initial_step) {
            (Some(step), _) => step,
            (None, Some(step)) => step.min(limit),
            (None, None) => {
                statistics.evaluations += 1;
                first_step::<M, S>(system, t0, direction, limit.min(span), stages, weights)
            }
        };
        tracker.start(events, t0, &stages.x);
        let dense = O::OBSERVES_STEPS || !events.is_empty();
        let mut control = StepControl::new();
        let mut stiffness = StiffnessTest::new(settings.stiffness_interval);
        let mut finite = true;
        let mut t = t0;
        loop {
            if statistics.accepted + statistics.rejected >= settings.max_steps {
                return ended(Status::TooManySteps, t, size, statistics);
            }
            let remaining = t1 - t;
            let reach =
                if settings.fixed_step.is_some() { STRETCH * size } else { (STRETCH * size).min(limit) };
            let last = remaining.abs() <= reach;
            if !last && size <= RESOLUTION * t.abs().max(SMALLEST_TIME) {
                let status = if finite { Status::StepTooSmall } else { Status::NotFinite };
                return ended(status, t, size, statistics);
            }
            let h = if last { remaining } else { direction * size };

            let error = M::attempt(system, t, h, stages, weights);
            statistics.evaluations += M::EVALUATIONS.0;
            let within = error <= 1.0 || (settings.fixed_step.is_some() && !error.is_nan());
            let mut good = within && all_finite(&stages.next);
            if good {
                M::complete(system, t, h, stages);
                statistics.evaluations += M::EVALUATIONS.1;
                good = all_finite(&stages.k[M::LAST]);
            }
            if !good {
                statistics.rejected += 1;
                finite = !within && error.is_finite();
                if settings.fixed_step.is_some() {
                    return ended(Status::NotFinite, t, size, statistics);
                }
                size = h.abs() * control.rejected::<M>(if finite { error } else { f64::NAN });
                continue;
            }
            finite = true;
            statistics.accepted += 1;
            let proposed = if settings.fixed_step.is_some() {
                size
            } else {
                (h.abs() * control.accepted::<M>(error)).min(limit)
            };
            // A last step cut short says little about the next.
            size = if last { size.max(proposed) } else { proposed };
            let stiff = stiffness.stiff::<M>(statistics.accepted, h, stages);
            let mut status = None;
            let mut end = if last { t1 } else { t + h };
            if dense {
                M::dense(system, t, h, stages);
                statistics.evaluations += M::EVALUATIONS.2;
                let rows = &stages.rows[..M::ROWS * n];
                let mut step = Step { start: t, end, size: h, dimension: n, rows };
                if !events.is_empty()
                    && let Some(terminal) = tracker.scan(&step, &stages.next, events, observer)
                {
                    end = terminal.time;
                    step.end = end;
                    status = Some(Status::Event(terminal.event));
                }
                if O::OBSERVES_STEPS && observer.step(&step).is_break() {
                    status = status.or(Some(Status::Stopped));
                }
            }
            if let Some(Status::Event(_)) = status {
                stages.x.copy_from_slice(tracker.state());
            } else {
                std::mem::swap(&mut stages.x, &mut stages.next);
                stages.k.swap(0, M::LAST);
            }
            t = end;
            let reached = last.then_some(Status::Completed);
            if let Some(status) = status.or(reached).or(stiff.then_some(Status::Stiff)) {
                return ended(status, t, size, statistics);
            }
        }
    }
}

/// Returns true if no value is NaN or infinite: such a one leaves zero times it NaN.
#[inline]
fn all_finite(values: &[f64]) -> bool {
    values.iter().map(|v| v * 0.0).sum::<f64>() == 0.0
}
