//! Flies a profile through the equations of motion of a phase.

use std::cell::RefCell;
use std::fmt;
use std::sync::{Mutex, PoisonError};

use apsides_ocp::{Bounds, EndpointInput, EndpointTerm, Guess, Ocp, Phase, Scaling, Sense};
use apsides_ode::{Direction, Event, Integrator, OdeSettings, Status, Tolerance};

use super::curve::Profile;
use super::flight::{Excess, Flight, FlightEnd};
use super::limits::{self, Limit, Quantity};
use super::motion::{Motion, Piece, Scratch};
use super::rules::{FlightRules, Independent};
use super::unknowns::Unknowns;
use super::watch::{Recording, Watch, WatchStorage};
use crate::error::ShootingError;

/// Tolerated error of an integral without scale or bounds, which then takes no part in the step control.
const UNCONTROLLED: f64 = 1e300;
/// Distance from a joint, in the abscissa, that rounding can make.
const AT_JOINT: f64 = 1e-9;

/// Single shooting: from a decision vector to a flight.
///
/// A decision vector has the numbers of the profile (see [`ProfileShape`](super::ProfileShape)), then, as far as the problem leaves
/// them open and in this order: the end time, unless a stop ends a flight with a profile in energy; the start time; states at the
/// start; static parameters. With a stop and a profile in time the end time is that of the profile, which keeps its last values
/// beyond.
///
/// The integration goes from joint to joint of the profile, so that jumps fall on ends of steps; those of a profile in energy are
/// events, also where the energy comes back. Integrals with a scale or bounds take part in the step control.
pub struct ProfileShooting<'a> {
    ocp: &'a Ocp,
    rules: FlightRules,
    unknowns: Unknowns,
    along: Vec<Limit>,
    at_end: Vec<Limit>,
    ode: OdeSettings,
    profile: Profile,
    pool: Mutex<Vec<FlightWorkspace>>,
}

impl fmt::Debug for ProfileShooting<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ProfileShooting")
            .field("ocp", &self.ocp.name)
            .field("rules", &self.rules)
            .finish_non_exhaustive()
    }
}

/// Storage of flights, with the last one. Nothing is allocated after the first.
pub struct FlightWorkspace {
    integrator: Integrator,
    profile: Profile,
    scratch: RefCell<Scratch>,
    watch: WatchStorage,
    /// States and integrals at the start of a piece, and at its end.
    state: Vec<f64>,
    next: Vec<f64>,
    terms: Vec<EndpointTerm>,
    /// Start time, end time, states at the start, states at the end, parameters.
    columns: Vec<f64>,
    /// Rows of the endpoint constraints.
    rows: Vec<f64>,
    flight: Flight,
}

impl FlightWorkspace {
    /// The last flight.
    #[must_use]
    pub fn flight(&self) -> &Flight {
        &self.flight
    }

    /// Its profile.
    #[must_use]
    pub fn profile(&self) -> &Profile {
        &self.profile
    }
}

/// The event that ends a piece.
#[derive(Clone, Copy)]
enum PieceEnd {
    Stop,
    Next,
    Previous,
}

impl<'a> ProfileShooting<'a> {
    /// Profiles for a problem of one phase.
    ///
    /// # Errors
    /// [`ShootingError::Setting`], [`ShootingError::Dimension`] or [`ShootingError::Profile`] naming what does not fit.
    pub fn new(ocp: &'a Ocp, rules: FlightRules) -> Result<Self, ShootingError> {
        let unknowns = Unknowns::new(ocp, &rules)?;
        let phase = &ocp.phases[0];
        let settings = &rules.settings;
        let scaling = Scaling::new(ocp, &Guess::linear(ocp));
        let states = scaling.phases[0].states.iter().map(|s| settings.tolerance * s);
        let integrals = phase.integrals.iter();
        let integrals = integrals.map(|q| q.variable.size().map_or(UNCONTROLLED, |s| settings.tolerance * s));
        let ode = OdeSettings {
            method: settings.method,
            relative_tolerance: settings.tolerance,
            absolute_tolerance: Tolerance::PerComponent(states.chain(integrals).collect()),
            max_step: settings.longest_step * unknowns.longest,
            max_steps: settings.most_steps,
            stiffness_interval: None,
            ..OdeSettings::default()
        };
        let profile = Profile::new(&rules.shape)?;
        let (along, at_end) = (limits::along(phase), limits::at_end(ocp, phase));
        let shooting = Self { ocp, rules, unknowns, along, at_end, ode, profile, pool: Mutex::default() };
        let workspace = shooting.workspace()?;
        shooting.give_back(workspace);
        Ok(shooting)
    }

    /// The problem.
    #[must_use]
    pub fn ocp(&self) -> &'a Ocp {
        self.ocp
    }

    /// Its phase.
    #[must_use]
    pub fn phase(&self) -> &'a Phase {
        &self.ocp.phases[0]
    }

    /// The rules of the flight.
    #[must_use]
    pub fn rules(&self) -> &FlightRules {
        &self.rules
    }

    /// Lower and upper ends of the decision variables.
    #[must_use]
    pub fn space(&self) -> (&[f64], &[f64]) {
        (&self.unknowns.lower, &self.unknowns.upper)
    }

    /// Bounded path constraint rows, states and controls, in the order of [`Flight::peaks`].
    #[must_use]
    pub fn watched(&self) -> &[Limit] {
        &self.along
    }

    /// Conditions at the end besides those of states, in the order of [`Flight::end_conditions`].
    #[must_use]
    pub fn end_conditions(&self) -> &[Limit] {
        &self.at_end
    }

    /// The profile of a decision vector.
    ///
    /// # Errors
    /// [`ShootingError::Dimension`].
    pub fn profile(&self, decision: &[f64]) -> Result<Profile, ShootingError> {
        self.check(decision)?;
        let mut profile = self.profile.clone();
        profile.decode(&decision[..self.unknowns.shape])?;
        Ok(profile)
    }

    /// Storage for flights; one per thread.
    ///
    /// # Errors
    /// [`ShootingError::Ode`] where the integrator refuses its settings.
    pub fn workspace(&self) -> Result<FlightWorkspace, ShootingError> {
        let phase = self.phase();
        let (n, q, p) = (phase.states.len(), phase.integrals.len(), self.ocp.parameters.len());
        let firsts: Vec<usize> = (self.ocp.constraints.iter())
            .scan(0, |next, c| Some(std::mem::replace(next, *next + c.rows.len())))
            .collect();
        let terms = EndpointTerm::all(self.ocp, &firsts, |input| column(input, n));
        let rows = self.ocp.constraints.iter().map(|c| c.rows.len()).sum();
        let flight = Flight {
            end: FlightEnd::NoDuration,
            objective: f64::NAN,
            initial_time: f64::NAN,
            final_time: f64::NAN,
            initial_state: vec![f64::NAN; n],
            final_state: vec![f64::NAN; n],
            parameters: vec![f64::NAN; p],
            integrals: vec![0.0; q],
            state_misses: vec![f64::NAN; n],
            end_conditions: vec![Excess::NONE; self.at_end.len()],
            peaks: vec![Excess::NONE; self.along.len()],
            steps: 0,
            evaluations: 0,
        };
        Ok(FlightWorkspace {
            integrator: Integrator::new(n + q, self.ode.clone())?,
            profile: self.profile.clone(),
            scratch: RefCell::new(Scratch::new(phase, &self.rules, p)),
            watch: WatchStorage {
                state: vec![0.0; n + q],
                rows: vec![0.0; phase.path_rows()],
                times: [f64::NAN; 2],
                values: vec![[f64::NAN; 2]; self.along.len()],
            },
            state: vec![0.0; n + q],
            next: vec![0.0; n + q],
            terms,
            columns: vec![0.0; 2 + 2 * n + p],
            rows: vec![0.0; rows],
            flight,
        })
    }

    /// Flies a decision vector; numbers outside of their bounds count as the nearest inside. A flight that fails is one too.
    ///
    /// # Errors
    /// [`ShootingError::Dimension`] for a vector of another length.
    pub fn fly<'w>(
        &self,
        decision: &[f64],
        workspace: &'w mut FlightWorkspace,
    ) -> Result<&'w Flight, ShootingError> {
        self.fly_recorded(decision, workspace, None)?;
        Ok(&workspace.flight)
    }

    /// Flies a decision vector with storage that threads share, and takes from the flight what is wanted.
    ///
    /// # Errors
    /// As [`fly`](Self::fly).
    pub fn flown<T>(&self, decision: &[f64], take: impl FnOnce(&Flight) -> T) -> Result<T, ShootingError> {
        let spare = self.pool.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut workspace = spare.map_or_else(|| self.workspace(), Ok)?;
        let taken = self.fly(decision, &mut workspace).map(take);
        self.give_back(workspace);
        taken
    }

    /// End of the abscissa of a profile in time.
    pub(crate) fn horizon(&self, decision: &[f64]) -> f64 {
        self.unknowns.horizon.value(decision)
    }

    fn give_back(&self, workspace: FlightWorkspace) {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
    }

    fn check(&self, decision: &[f64]) -> Result<(), ShootingError> {
        let (expected, found) = (self.unknowns.lower.len(), decision.len());
        if expected == found {
            return Ok(());
        }
        let place = format!("phase `{}`", self.phase().name);
        Err(ShootingError::Dimension { place, what: "decision variables", expected, found })
    }

    /// Flies, and keeps the flight as a whole where a recording is given.
    pub(crate) fn fly_recorded(
        &self,
        decision: &[f64],
        workspace: &mut FlightWorkspace,
        mut recording: Option<&mut Recording>,
    ) -> Result<(), ShootingError> {
        self.check(decision)?;
        let (phase, unknowns, n) = (self.phase(), &self.unknowns, self.phase().states.len());
        let FlightWorkspace { profile, state, flight, .. } = &mut *workspace;
        profile.decode(&decision[..unknowns.shape])?;
        for (x, slot) in state.iter_mut().zip(&unknowns.initial_state) {
            *x = slot.value(decision);
        }
        state[n..].fill(0.0);
        for (p, slot) in flight.parameters.iter_mut().zip(&unknowns.parameters) {
            *p = slot.value(decision);
        }
        flight.initial_state.copy_from_slice(&state[..n]);
        flight.initial_time = unknowns.initial_time.value(decision);
        flight.final_time = flight.initial_time;
        flight.peaks.fill(Excess::NONE);
        (flight.steps, flight.evaluations) = (0, 0);
        if let Some(recording) = &mut recording {
            recording.begin(flight.initial_time, state);
        }
        let horizon = unknowns.horizon.value(decision);
        let limit = match self.rules.stop {
            Some(_) => unknowns.latest.min(flight.initial_time + phase.duration.upper),
            None => horizon,
        };
        let span = [flight.initial_time, horizon, limit];
        workspace.flight.end = if !workspace.state.iter().chain(&span).all(|v| v.is_finite()) {
            FlightEnd::NotFinite
        } else if horizon.min(limit) <= workspace.flight.initial_time {
            FlightEnd::NoDuration
        } else {
            self.integrate(workspace, horizon, limit, recording)?
        };
        self.judge(workspace);
        Ok(())
    }

    /// From joint to joint until the flight ends.
    fn integrate(
        &self,
        workspace: &mut FlightWorkspace,
        horizon: f64,
        limit: f64,
        mut recording: Option<&mut Recording>,
    ) -> Result<FlightEnd, ShootingError> {
        let FlightWorkspace { integrator, profile, scratch, watch, state, next, flight, .. } = workspace;
        let Flight { initial_time, parameters, peaks, steps, evaluations, final_time: t, .. } = flight;
        let energy = match &self.rules.independent {
            Independent::Time => None,
            Independent::Energy { energy, .. } => Some(energy(&state[..self.phase().states.len()])),
        };
        let motion = Motion {
            phase: self.phase(),
            rules: &self.rules,
            profile,
            parameters,
            times: [*initial_time, horizon],
            energy: energy.unwrap_or(f64::NAN),
        };
        let stop = |_: f64, x: &[f64]| self.rules.stop.map_or(f64::NAN, |stop| x[stop.state] - stop.value);
        let at_limit = if self.rules.stop.is_some() { FlightEnd::TimeLimit } else { FlightEnd::EndTime };
        let mut interval = 0;
        loop {
            let joints = [profile.joints()[interval], profile.joints()[interval + 1]];
            let last = interval + 1 == profile.intervals();
            let joint_time = initial_time.mul_add(1.0 - joints[1], horizon * joints[1]);
            let target = if last || energy.is_some() { limit } else { limit.min(joint_time) };
            if *t >= limit {
                return Ok(at_limit);
            }
            if target <= *t {
                // A sub-interval too short for the resolution of time.
                interval += 1;
                continue;
            }
            let before = |t: f64, x: &[f64]| motion.abscissa(t, x) - joints[0];
            let after = |t: f64, x: &[f64]| motion.abscissa(t, x) - joints[1];
            let mut events = [Event::new(&stop).terminal(); 3];
            let mut passages = [PieceEnd::Stop; 3];
            let mut count = 0;
            if let Some(stop) = self.rules.stop {
                events[0] = events[0].directed(stop.direction);
                count = 1;
            }
            if energy.is_some() && !last {
                events[count] = Event::new(&after).directed(Direction::Rising).terminal();
                passages[count] = PieceEnd::Next;
                count += 1;
            }
            if energy.is_some() && interval > 0 {
                events[count] = Event::new(&before).directed(Direction::Falling).terminal();
                passages[count] = PieceEnd::Previous;
                count += 1;
            }
            let mut observer = Watch {
                motion,
                interval,
                limits: &self.along,
                samples: self.rules.settings.samples,
                scratch,
                storage: watch,
                peaks,
                recording: recording.as_deref_mut(),
            };
            observer.storage.state.copy_from_slice(state);
            observer.begin(*t);
            let piece = Piece { motion, interval, scratch };
            let events = &events[..count];
            let summary =
                integrator.integrate_observed(&piece, *t, state, target, next, events, &mut observer)?;
            if let Some(recording) = &mut recording {
                recording.pieces.push((interval, *t, summary.time));
            }
            std::mem::swap(state, next);
            *t = summary.time;
            *steps += summary.statistics.accepted;
            *evaluations += summary.statistics.evaluations;
            let s = motion.abscissa(*t, state);
            let left = s < joints[0] - AT_JOINT && interval > 0 || s > joints[1] + AT_JOINT && !last;
            if energy.is_some() && left {
                // It left at once, which is no passage.
                return Ok(FlightEnd::Held);
            }
            match summary.status {
                Status::Completed if target < limit => interval += 1,
                Status::Completed => return Ok(at_limit),
                Status::Event(k) => match passages[k] {
                    PieceEnd::Stop => return Ok(FlightEnd::Stopped),
                    PieceEnd::Next => interval += 1,
                    PieceEnd::Previous => interval -= 1,
                },
                status => return Ok(FlightEnd::failure(status)),
            }
            if *steps >= self.rules.settings.most_steps {
                return Ok(FlightEnd::TooManySteps);
            }
        }
    }

    /// Objective and misses of the state reached.
    fn judge(&self, workspace: &mut FlightWorkspace) {
        let FlightWorkspace { state, terms, columns, rows, flight, .. } = workspace;
        let (phase, n) = (self.phase(), self.phase().states.len());
        flight.final_state.copy_from_slice(&state[..n]);
        flight.integrals.copy_from_slice(&state[n..]);
        (columns[0], columns[1]) = (flight.initial_time, flight.final_time);
        columns[2..2 + n].copy_from_slice(&flight.initial_state);
        columns[2 + n..2 + 2 * n].copy_from_slice(&flight.final_state);
        columns[2 + 2 * n..].copy_from_slice(&flight.parameters);
        let objective = &self.ocp.objective;
        let linear: f64 = objective.linear.iter().map(|&(input, w)| w * columns[column(input, n)]).sum();
        let integrals: f64 = objective.integrals.iter().map(|&(_, k, w)| w * flight.integrals[k]).sum();
        let sign = match objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        rows.fill(0.0);
        let functions: f64 = terms.iter_mut().map(|term| term.add_values(columns, rows)).sum();
        flight.objective =
            if flight.end.is_complete() { sign * (linear + integrals) + functions } else { f64::NAN };
        for ((miss, x), s) in flight.state_misses.iter_mut().zip(&flight.final_state).zip(&phase.states) {
            *miss = x - s.terminal.clamp(*x);
        }
        let latest = flight.initial_time + phase.duration.upper;
        let earliest = flight.initial_time + phase.duration.lower;
        let end_time = phase.final_time.intersect(&Bounds::new(earliest, latest));
        for (excess, limit) in flight.end_conditions.iter_mut().zip(&self.at_end) {
            let (bounds, value) = match limit.quantity {
                Quantity::Endpoint(row) => (limit.bounds, rows[row]),
                Quantity::Integral(k) => (limit.bounds, flight.integrals[k]),
                _ => (end_time, flight.final_time),
            };
            *excess = limit.excess(&bounds, value, flight.final_time);
        }
    }
}

/// Place of an end quantity of the only phase among the columns of a workspace.
fn column(input: EndpointInput, states: usize) -> usize {
    match input {
        EndpointInput::InitialTime { .. } => 0,
        EndpointInput::FinalTime { .. } => 1,
        EndpointInput::InitialState { state, .. } => 2 + state,
        EndpointInput::FinalState { state, .. } => 2 + states + state,
        EndpointInput::Parameter { index } => 2 + 2 * states + index,
    }
}
