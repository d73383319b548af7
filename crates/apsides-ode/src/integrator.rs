//! The integrator: step control, observers, events.

use std::ops::ControlFlow;

use crate::dense::DenseSolution;
use crate::error::{require_dimension, require_finite};
use crate::event::{Event, EventTracker};
use crate::scheme::dop853::Dop853;
use crate::scheme::dopri5::Dopri5;
use crate::scheme::{CUBIC_ROWS, ErrorWeights, Scheme, Stages};
use crate::step::{Form, Observer, Step};
use crate::step_control::{StepControl, StiffnessTest, first_step};
use crate::{Method, OdeError, OdeSettings, OdeSystem, Statistics, Status, Summary, Tolerance};

/// Shortest step relative to the time, below which time no longer resolves it.
pub(crate) const RESOLUTION: f64 = 10.0 * f64::EPSILON;
/// Stands in for the time near zero, so that steps shrink no further than the range of `f64`.
pub(crate) const SMALLEST_TIME: f64 = 1e-280;
/// A step may be stretched by this factor to reach the end, rather than leave a tiny remainder.
pub(crate) const STRETCH: f64 = 1.01;

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
    ///
    /// # Examples
    /// ```
    /// use apsides_ode::{FnSystem, Integrator, OdeSettings, Status};
    ///
    /// let decay = FnSystem::new(1, |_t, x, dx| dx[0] = -x[0]);
    /// let (summary, solution) = Integrator::new(1, OdeSettings::default())?.solve_dense(&decay, 0.0, &[1.0], 5.0)?;
    /// assert_eq!(summary.status, Status::Completed);
    /// let mut x = [0.0];
    /// solution.evaluate(2.5, &mut x)?;
    /// assert!((x[0] - (-2.5_f64).exp()).abs() < 1e-9);
    /// # Ok::<(), apsides_ode::OdeError>(())
    /// ```
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
        system.rate(t0, &stages.x, &mut stages.k[0]);
        statistics.evaluations += 1;
        if !all_finite(&stages.k[0]) {
            return ended(Status::NotFinite, t0, 0.0, statistics);
        }
        let mut pace = Pace::new::<M, S>(settings, system, (t0, t1), stages, weights, &mut statistics);
        tracker.start(events, t0, &stages.x);
        let mut stiffness = StiffnessTest::new(settings.stiffness_interval);
        let mut finite = true;
        let mut t = t0;
        loop {
            if statistics.accepted + statistics.rejected >= settings.max_steps {
                return ended(Status::TooManySteps, t, pace.size, statistics);
            }
            let Some((h, last)) = pace.step(t, t1) else {
                let status = if finite { Status::StepTooSmall } else { Status::NotFinite };
                return ended(status, t, pace.size, statistics);
            };
            let tried = try_step::<M, S>(system, t, h, pace.is_fixed, stages, weights, &mut statistics);
            let error = match tried {
                Ok(error) => error,
                Err(_) if pace.is_fixed => return ended(Status::NotFinite, t, pace.size, statistics),
                Err(error) => {
                    finite = !error.is_nan();
                    pace.reject::<M>(h, error);
                    continue;
                }
            };
            finite = true;
            pace.accept::<M>(h, error, last);
            let stiff = stiffness.stiff::<M>(statistics.accepted, h, stages);
            let mut status = None;
            let mut end = if last { t1 } else { t + h };
            let n = *dimension;
            let dense = O::OBSERVES_STEPS
                || (!events.is_empty() && {
                    M::cubic(h, stages);
                    let cubic = Step::new(Form::Alternating, (t, end), h, n, &stages.rows[..CUBIC_ROWS * n]);
                    !tracker.quiet(&cubic, &stages.next, events)
                });
            if dense {
                M::dense(system, t, h, stages);
                statistics.evaluations += M::EVALUATIONS.2;
                let mut step = Step::new(Form::Alternating, (t, end), h, n, &stages.rows[..M::ROWS * n]);
                status = show(&mut step, &stages.next, tracker, events, observer);
                end = step.end;
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
                return ended(status, t, pace.size, statistics);
            }
        }
    }
}

/// The size of the steps from one to the next.
struct Pace {
    size: f64,
    is_fixed: bool,
    limit: f64,
    direction: f64,
    control: StepControl,
}

impl Pace {
    /// The first step from `stages.x`, whose rates are known; an estimate of its size takes an evaluation.
    fn new<M: Scheme, S: OdeSystem>(
        settings: &OdeSettings,
        system: &S,
        (t0, t1): (f64, f64),
        stages: &mut Stages,
        weights: &ErrorWeights,
        statistics: &mut Statistics,
    ) -> Self {
        let direction = (t1 - t0).signum();
        let span = (t1 - t0).abs();
        let limit = settings.fixed_step.unwrap_or(settings.max_step);
        let size = match (settings.fixed_step, settings.initial_step) {
            (Some(step), _) => step,
            (None, Some(step)) => step.min(limit),
            (None, None) => {
                statistics.evaluations += 1;
                first_step::<M, S>(system, t0, direction, limit.min(span), stages, weights)
            }
        };
        let is_fixed = settings.fixed_step.is_some();
        Self { size, is_fixed, limit, direction, control: StepControl::new() }
    }

    /// The next step, and whether it reaches the end; none if the time does not resolve it.
    #[inline]
    fn step(&self, t: f64, t1: f64) -> Option<(f64, bool)> {
        let remaining = t1 - t;
        let stretched = STRETCH * self.size;
        let last = remaining.abs() <= if self.is_fixed { stretched } else { stretched.min(self.limit) };
        if !last && self.size <= RESOLUTION * t.abs().max(SMALLEST_TIME) {
            return None;
        }
        Some((if last { remaining } else { self.direction * self.size }, last))
    }

    /// Goes on after a step that was rejected for its error, NaN where it was not finite.
    #[inline]
    fn reject<M: Scheme>(&mut self, h: f64, error: f64) {
        self.size = h.abs() * self.control.rejected::<M>(error);
    }

    #[inline]
    fn accept<M: Scheme>(&mut self, h: f64, error: f64, last: bool) {
        let proposed = if self.is_fixed {
            self.size
        } else {
            (h.abs() * self.control.accepted::<M>(error)).min(self.limit)
        };
        // A last step cut short says little about the next.
        self.size = if last { self.size.max(proposed) } else { proposed };
    }
}

/// Tries a step: its error, as an error where it is too large, NaN where numbers are not finite.
#[inline]
fn try_step<M: Scheme, S: OdeSystem>(
    system: &S,
    t: f64,
    h: f64,
    is_fixed: bool,
    stages: &mut Stages,
    weights: &ErrorWeights,
    statistics: &mut Statistics,
) -> Result<f64, f64> {
    let error = M::attempt(system, t, h, stages, weights);
    statistics.evaluations += M::EVALUATIONS.0;
    let within = error <= 1.0 || (is_fixed && !error.is_nan());
    let mut good = within && all_finite(&stages.next);
    if good {
        M::complete(system, t, h, stages);
        statistics.evaluations += M::EVALUATIONS.1;
        good = all_finite(&stages.k[M::LAST]);
    }
    if good {
        statistics.accepted += 1;
        return Ok(error);
    }
    statistics.rejected += 1;
    Err(if !within && error.is_finite() { error } else { f64::NAN })
}

/// Shows a step and the events in it; the status if it is the last one, which a terminal event cuts short.
#[inline]
pub(crate) fn show<O: Observer>(
    step: &mut Step<'_>,
    next: &[f64],
    tracker: &mut EventTracker,
    events: &[Event<'_>],
    observer: &mut O,
) -> Option<Status> {
    let mut status = None;
    if !events.is_empty()
        && let Some(terminal) = tracker.scan(step, next, events, observer)
    {
        step.end = terminal.time;
        status = Some(Status::Event(terminal.event));
    }
    if O::OBSERVES_STEPS && observer.step(step).is_break() {
        status = status.or(Some(Status::Stopped));
    }
    status
}

/// Returns true if no value is NaN or infinite: such a one leaves zero times it NaN.
#[inline]
pub(crate) fn all_finite(values: &[f64]) -> bool {
    values.iter().map(|v| v * 0.0).sum::<f64>() == 0.0
}
