//! Closed-loop simulation of any equations of motion under a discrete law: deterministic, without allocation in the loop.
//!
//! ```text
//! at t_k = t_0 + k T:   y = sensor(x),   c = law(t, y),   u = actuators(c);     x' = f(t, x, u) over [t_k, t_k + T]
//! ```
//!
//! A control step is made of equal steps of the classical Runge-Kutta method of order four, or of the adaptive method of `apsides-ode`. A run
//! ends at a time limit, where a stop function changes sign (located within the control step), or where something went wrong, which is
//! named with its time: see [`Ending`].

use apsides_ad::Dynamics;
use apsides_ode::{Direction, FnSystem, Integrator, OdeSettings, Status};

use crate::controller::{Actuation, Controller};
use crate::error::{ControlError, finite, positive};
use crate::record::{Recording, Sample};
use crate::sensor::Sensor;

/// Most control steps of a run.
const MAX_STEPS: f64 = 1e9;

/// The integration of a control step.
#[derive(Clone, Debug)]
pub enum Integration {
    /// Equal steps of the classical method of order four per control step.
    Fixed {
        /// Number of steps.
        substeps: usize,
    },
    /// The integrator of `apsides-ode`, started anew at each control step.
    Adaptive(OdeSettings),
}

/// Settings of a run.
#[derive(Clone, Debug)]
pub struct SimulationSettings<const NX: usize> {
    /// Control step, s; default 0.01.
    pub control_step: f64,
    /// Time of the start, s; default 0.
    pub start: f64,
    /// Longest run, s after the start; default 1000.
    pub time_limit: f64,
    /// Default one fixed step.
    pub integration: Integration,
    /// Control steps from one check of the fixed step to the next; 0 is no check. Default 100.
    pub check_interval: usize,
    /// Largest error of one control step, relative to [`scales`](Self::scales) plus the magnitude of each state; default 1e-6.
    pub check_tolerance: f64,
    /// Magnitudes at which an error of each state matters; default 1.
    pub scales: [f64; NX],
}

impl<const NX: usize> Default for SimulationSettings<NX> {
    fn default() -> Self {
        Self {
            control_step: 0.01,
            start: 0.0,
            time_limit: 1000.0,
            integration: Integration::Fixed { substeps: 1 },
            check_interval: 100,
            check_tolerance: 1e-6,
            scales: [1.0; NX],
        }
    }
}

/// The departure from orderly flight that a monitor watches for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Breach {
    /// The vehicle turns over.
    Tumbling,
    /// Moving masses touch.
    MassesMet,
    /// A moving part leaves its travel.
    TravelExceeded,
    /// A table of the model does not reach so far.
    TableLeft,
    /// Another limit, by its name.
    Limit(&'static str),
}

/// The reason why a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Ending {
    /// The time limit.
    TimeLimit,
    /// A stop function changed sign.
    Stop(&'static str),
    /// A monitor was breached.
    Breach(Breach),
    /// A state is NaN or infinite.
    State {
        /// Index of the state.
        index: usize,
    },
    /// A command of the law is NaN or infinite.
    Command {
        /// Index of the command.
        index: usize,
    },
    /// A control of the actuators is NaN or infinite.
    Control {
        /// Index of the control.
        index: usize,
    },
    /// The fixed step is too long.
    StepTooLong {
        /// Estimated error of one control step, relative to the scales.
        error: f64,
    },
    /// The adaptive integrator gave up.
    Integrator(Status),
}

/// The course of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight<const NX: usize> {
    /// The reason why it ended.
    pub ending: Ending,
    /// Time of the end, s.
    pub time: f64,
    /// Last state that is finite.
    pub state: [f64; NX],
    /// Control steps begun.
    pub steps: usize,
    /// Time during which a control was at a limit, s.
    pub saturated_time: f64,
    /// Largest error of one control step among those checked, relative to the scales.
    pub step_error: f64,
}

type Function<'a, const NX: usize> = Box<dyn Fn(f64, &[f64; NX]) -> f64 + Send + Sync + 'a>;
type ControlledFunction<'a, const NX: usize, const NU: usize> =
    Box<dyn Fn(f64, &[f64; NX], &[f64; NU]) -> f64 + Send + Sync + 'a>;
type Projection<'a, const NX: usize> = Box<dyn Fn(&mut [f64; NX]) + Send + Sync + 'a>;

struct Stop<'a, const NX: usize> {
    name: &'static str,
    function: Function<'a, NX>,
    direction: Direction,
}

/// A vehicle ready to fly: equations of motion, settings, stops and monitors. It is shared by runs on several threads; what has a memory
/// (law, actuators, sensor, record) goes into [`fly`](Self::fly).
pub struct Simulation<'a, D, const NX: usize, const NU: usize> {
    model: &'a D,
    settings: SimulationSettings<NX>,
    stops: Vec<Stop<'a, NX>>,
    monitors: Vec<(Breach, ControlledFunction<'a, NX, NU>)>,
    projection: Option<Projection<'a, NX>>,
}

impl<'a, D: Dynamics<NX, NU>, const NX: usize, const NU: usize> Simulation<'a, D, NX, NU> {
    /// A simulation without stops and monitors.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where a time, tolerance or scale is not positive or there are no substeps, and what the adaptive
    /// integrator refuses.
    pub fn new(model: &'a D, settings: SimulationSettings<NX>) -> Result<Self, ControlError> {
        positive("control step in s", settings.control_step)?;
        positive("time limit in s", settings.time_limit)?;
        if settings.time_limit / settings.control_step > MAX_STEPS {
            let allowed = "at most a billion (1e9) control steps";
            return Err(ControlError::Parameter {
                what: "time limit in s",
                value: settings.time_limit,
                allowed,
            });
        }
        finite("start time in s", settings.start)?;
        positive("tolerance of the step check", settings.check_tolerance)?;
        for scale in settings.scales {
            positive("scale of a state", scale)?;
        }
        match &settings.integration {
            Integration::Fixed { substeps: 0 } => {
                let what = "steps per control step";
                return Err(ControlError::Parameter { what, value: 0.0, allowed: "at least 1" });
            }
            Integration::Fixed { .. } => {}
            Integration::Adaptive(ode) => drop(Integrator::new(NX, ode.clone())?),
        }
        Ok(Self { model, settings, stops: Vec::new(), monitors: Vec::new(), projection: None })
    }

    /// Ends runs where a function of time and state changes sign in this direction, such as altitude less that of a parachute.
    /// It is looked at once per control step: a change that is undone within one is not seen.
    #[must_use]
    pub fn stop(
        mut self,
        name: &'static str,
        direction: Direction,
        function: impl Fn(f64, &[f64; NX]) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.stops.push(Stop { name, function: Box::new(function), direction });
        self
    }

    /// Ends runs where a margin, a function of time, state and control, is negative or NaN at a control step.
    #[must_use]
    pub fn monitor(
        mut self,
        breach: Breach,
        margin: impl Fn(f64, &[f64; NX], &[f64; NU]) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.monitors.push((breach, Box::new(margin)));
        self
    }

    /// Ends runs where the actuators report that moving masses touch; without it the masses stop and the run goes on.
    #[must_use]
    pub fn end_when_masses_meet(self) -> Self {
        self.monitor(Breach::MassesMet, |_, _, _| 0.0)
    }

    /// Puts the state back where it belongs after each step: a quaternion to length one.
    #[must_use]
    pub fn projection(mut self, project: impl Fn(&mut [f64; NX]) + Send + Sync + 'a) -> Self {
        self.projection = Some(Box::new(project));
        self
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &SimulationSettings<NX> {
        &self.settings
    }

    /// Flies from a state until the run ends. Without a sensor the law sees the state itself. Law, actuators and sensor go on from the
    /// memory they have.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where the state is not finite, [`ControlError::Dimension`] where memory has no room for the record.
    pub fn fly<C, A>(
        &self,
        state: &[f64; NX],
        law: &mut C,
        actuators: &mut A,
        mut sensor: Option<&mut Sensor<NX>>,
        record: &mut Recording<NX, NU>,
    ) -> Result<Flight<NX>, ControlError>
    where
        C: Controller<NX, NU> + ?Sized,
        A: Actuation<NU> + ?Sized,
    {
        for value in state {
            finite("initial state", *value)?;
        }
        let SimulationSettings { control_step, start, time_limit, .. } = self.settings;
        let steps = (time_limit / control_step * (1.0 - 1e-9)).ceil() as usize;
        record.prepare(steps)?;
        let mut stepper = self.stepper()?;
        let mut x = *state;
        let mut values: Vec<f64> = self.stops.iter().map(|s| (s.function)(start, &x)).collect();
        let mut flight = Flight {
            ending: Ending::TimeLimit,
            time: start,
            state: x,
            steps: 0,
            saturated_time: 0.0,
            step_error: 0.0,
        };
        let (mut command, mut control) = ([0.0; NU], [0.0; NU]);
        for step in 0..steps {
            let t = start + step as f64 * control_step;
            let end = start + ((step + 1) as f64 * control_step).min(time_limit);
            let measured = sensor.as_mut().map_or(x, |s| s.measure(&x));
            let wanted = law.command(t, &measured);
            if let Some(index) = not_finite(&wanted) {
                flight.ending = Ending::Command { index };
                break;
            }
            let reached = actuators.advance(&wanted);
            if let Some(index) = not_finite(&reached) {
                flight.ending = Ending::Control { index };
                break;
            }
            (command, control) = (wanted, reached);
            law.reached(&control);
            if record.wants(step) {
                record.push(Sample { time: t, state: x, command, control });
            }
            if let Some(breach) = self.breached(t, &x, &control, actuators.met()) {
                flight.ending = Ending::Breach(breach);
                break;
            }
            let h = end - t;
            let next = match stepper.advance(self, t, &x, &control, h) {
                Ok(next) => next,
                Err(ending) => {
                    flight.ending = ending;
                    break;
                }
            };
            flight.steps = step + 1;
            if actuators.saturated() {
                flight.saturated_time += h;
            }
            if let Some(index) = not_finite(&next) {
                flight.ending = Ending::State { index };
                break;
            }
            if self.settings.check_interval > 0 && step.is_multiple_of(self.settings.check_interval) {
                let error = self.step_error(t, &x, &control, h, &next);
                // NaN of the half steps counts as too large.
                flight.step_error = if error <= flight.step_error { flight.step_error } else { error };
                if error > self.settings.check_tolerance || error.is_nan() {
                    flight.ending = Ending::StepTooLong { error };
                    break;
                }
            }
            if let Some((name, part)) = self.first_stop(&mut stepper, &mut values, t, &x, &control, h, &next)
            {
                flight.ending = Ending::Stop(name);
                flight.time = t + part * h;
                flight.state = match stepper.advance(self, t, &x, &control, part * h) {
                    Ok(at_stop) if part < 1.0 => at_stop,
                    _ => next,
                };
                break;
            }
            x = next;
            (flight.time, flight.state) = (end, x);
        }
        // A run that ends where a control step begins has that moment already.
        if record.samples().last().is_none_or(|last| last.time != flight.time) {
            record.push(Sample { time: flight.time, state: flight.state, command, control });
        }
        Ok(flight)
    }

    fn stepper(&self) -> Result<Stepper, ControlError> {
        Ok(match &self.settings.integration {
            Integration::Fixed { substeps } => Stepper::Fixed(*substeps),
            Integration::Adaptive(ode) => Stepper::Adaptive(Box::new(Integrator::new(NX, ode.clone())?)),
        })
    }

    fn breached(&self, t: f64, x: &[f64; NX], u: &[f64; NU], met: bool) -> Option<Breach> {
        let broken = |margin: f64| margin < 0.0 || margin.is_nan();
        let found = self
            .monitors
            .iter()
            .find(|(breach, margin)| (*breach == Breach::MassesMet && met) || broken(margin(t, x, u)));
        found.map(|(breach, _)| *breach)
    }

    /// Error of a fixed control step, estimated from twice as many steps of half the length: for order four a fifteenth of the difference is
    /// the error of the latter, sixteen fifteenths that of the former. Zero of an adaptive step.
    fn step_error(&self, t: f64, x: &[f64; NX], u: &[f64; NU], h: f64, found: &[f64; NX]) -> f64 {
        let Integration::Fixed { substeps } = self.settings.integration else { return 0.0 };
        let finer = self.fixed_steps(t, x, u, h, 2 * substeps);
        let mut error = 0.0;
        for k in 0..NX {
            let scale = self.settings.scales[k] + finer[k].abs();
            let here = 16.0 / 15.0 * (finer[k] - found[k]).abs() / scale;
            error = if here <= error { error } else { here };
        }
        error
    }

    fn fixed_steps(&self, t: f64, x: &[f64; NX], u: &[f64; NU], h: f64, substeps: usize) -> [f64; NX] {
        let h = h / substeps as f64;
        let mut x = *x;
        for k in 0..substeps {
            x = self.runge_kutta(t + k as f64 * h, &x, u, h);
            if let Some(project) = &self.projection {
                project(&mut x);
            }
        }
        x
    }

    /// One step of the classical method of order four.
    #[inline]
    fn runge_kutta(&self, t: f64, x: &[f64; NX], u: &[f64; NU], h: f64) -> [f64; NX] {
        let rate = |t: f64, x: &[f64; NX]| self.model.rate(t, x, u, &[]);
        // One after the other in a loop, so that the rate is there once.
        let (mut next, mut at, mut later) = (*x, *x, t);
        for (weight, part) in [(h / 6.0, 0.5 * h), (h / 3.0, 0.5 * h), (h / 3.0, h), (h / 6.0, 0.0)] {
            let k = rate(later, &at);
            for i in 0..NX {
                next[i] += weight * k[i];
                at[i] = x[i] + part * k[i];
            }
            later = t + part;
        }
        next
    }

    /// The first stop function that changes sign in this control step and the part of the step at which it does.
    fn first_stop(
        &self,
        stepper: &mut Stepper,
        values: &mut [f64],
        t: f64,
        x: &[f64; NX],
        u: &[f64; NU],
        h: f64,
        next: &[f64; NX],
    ) -> Option<(&'static str, f64)> {
        let mut first: Option<(&'static str, f64)> = None;
        for (stop, value) in self.stops.iter().zip(values) {
            let before = std::mem::replace(value, (stop.function)(t + h, next));
            let crossed = match stop.direction {
                Direction::Rising => before < 0.0 && *value >= 0.0,
                Direction::Falling => before > 0.0 && *value <= 0.0,
                Direction::Any => before != 0.0 && before * *value <= 0.0,
            };
            if !crossed {
                continue;
            }
            let mut at = |part: f64| match stepper.advance(self, t, x, u, part * h) {
                Ok(state) => (stop.function)(t + part * h, &state),
                Err(_) => f64::NAN,
            };
            let part = locate(before, *value, &mut at);
            if first.is_none_or(|(_, earliest)| part < earliest) {
                first = Some((stop.name, part));
            }
        }
        first
    }
}

/// Takes control steps, or parts of one.
enum Stepper {
    Fixed(usize),
    Adaptive(Box<Integrator>),
}

impl Stepper {
    fn advance<D: Dynamics<NX, NU>, const NX: usize, const NU: usize>(
        &mut self,
        simulation: &Simulation<'_, D, NX, NU>,
        t: f64,
        x: &[f64; NX],
        u: &[f64; NU],
        h: f64,
    ) -> Result<[f64; NX], Ending> {
        match self {
            Self::Fixed(substeps) => Ok(simulation.fixed_steps(t, x, u, h, *substeps)),
            Self::Adaptive(integrator) => {
                let system = FnSystem::new(NX, |t, x: &[f64], dx: &mut [f64]| {
                    let state = std::array::from_fn(|k| x[k]);
                    dx.copy_from_slice(&simulation.model.rate(t, &state, u, &[]));
                });
                let mut next = *x;
                let status = match integrator.integrate(&system, t, x, t + h, &mut next) {
                    Ok(summary) => summary.status,
                    // Size and state are checked before.
                    Err(_) => Status::NotFinite,
                };
                if status != Status::Completed {
                    return Err(Ending::Integrator(status));
                }
                if let Some(project) = &simulation.projection {
                    project(&mut next);
                }
                Ok(next)
            }
        }
    }
}

/// Part of a step, from 0 to 1, at which a function that has these values at the ends crosses zero; on its far side.
fn locate(start: f64, end: f64, f: &mut impl FnMut(f64) -> f64) -> f64 {
    let (mut a, mut b) = ((0.0, start), (1.0, end));
    // False position with halved weights (the Illinois method), every third round bisection.
    let (mut weight_a, mut weight_b) = (1.0, 1.0);
    for round in 0..100 {
        if b.1 == 0.0 || b.0 - a.0 <= 4.0 * f64::EPSILON {
            break;
        }
        let (fa, fb): (f64, f64) = (weight_a * a.1, weight_b * b.1);
        let straight = (a.0 * fb - b.0 * fa) / (fb - fa);
        let inside = straight > a.0 && straight < b.0;
        let part = if inside && round % 3 != 2 { straight } else { 0.5 * (a.0 + b.0) };
        let value = f(part);
        if value.is_nan() {
            break;
        }
        if value * start > 0.0 {
            a = (part, value);
            (weight_a, weight_b) = (1.0, 0.5 * weight_b);
        } else {
            b = (part, value);
            (weight_a, weight_b) = (0.5 * weight_a, 1.0);
        }
    }
    b.0
}

fn not_finite<const N: usize>(values: &[f64; N]) -> Option<usize> {
    values.iter().position(|v| !v.is_finite())
}

#[cfg(test)]
mod tests;
