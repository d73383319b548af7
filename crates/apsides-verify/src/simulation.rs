//! Re-integration of the equations of motion from initial state, controls, static parameters and times alone.
//!
//! DOP853 with step control of its own, started anew at every break of the control polynomial. A linked phase starts
//! where the re-simulation of the earlier one ended. A phase of an unstable plant, which no controls as functions of time alone hold on its course,
//! is flown in pieces.

mod growth;

pub(crate) use growth::Places;
use growth::Start;

use std::cell::RefCell;

use apsides_ocp::linkage::{self, Source};
use apsides_ocp::{Guess, Ocp, PhaseTrajectory, Scaling, Trajectory};
use apsides_ode::{DenseSolution, FnSystem, Integrator, OdeSettings, Status, Tolerance};

use crate::equations::Equations;
use crate::{VerifyError, VerifySettings, shape};

/// One phase as re-simulated, sampled for figures: [`VerifySettings::scan_points`] times per interval of the control
/// polynomial, both ends of each included, so that inner ends appear twice, with the control before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedPhase {
    /// Name of the phase.
    pub name: String,
    /// Times, ascending.
    pub times: Vec<f64>,
    /// States, row-major `times x states`.
    pub states: Vec<f64>,
    /// Controls flown, row-major `times x controls`.
    pub controls: Vec<f64>,
    /// Integrals over the phase; NaN if its end was not reached.
    pub integrals: Vec<f64>,
}

/// The re-simulated path of one phase with dense output.
pub(crate) struct Flight {
    /// Solutions one after the other, at least one, of each interval of the control polynomial that was flown.
    legs: Vec<Vec<DenseSolution>>,
    pub(crate) initial_state: Vec<f64>,
    /// NaN if the end was not reached.
    pub(crate) final_state: Vec<f64>,
    /// NaN if the end was not reached.
    pub(crate) integrals: Vec<f64>,
    pub(crate) failure: Option<Failure>,
    /// Where it starts anew beside the trajectory, ascending in time.
    pub(crate) restarts: Vec<Restart>,
    /// The final state from which a linked phase starts.
    joined_end: Vec<f64>,
}

/// A time at which a flight starts anew beside the trajectory, or hands over to the next phase.
pub(crate) struct Restart {
    pub(crate) time: f64,
    /// By how much an error may have grown since the earlier start.
    pub(crate) growth: f64,
    /// The states flown until then less those from which it goes on.
    pub(crate) jump: Vec<f64>,
    /// The change of the controls since the earlier start that makes up for it: root of the mean square, relative to their scales.
    pub(crate) change: f64,
}

/// Place and reason of a re-simulation that stopped early.
pub(crate) struct Failure {
    pub(crate) time: f64,
    pub(crate) reason: &'static str,
}

impl Flight {
    /// Number of intervals flown.
    pub(crate) fn legs(&self) -> usize {
        self.legs.len()
    }

    /// Times at both ends of an interval.
    pub(crate) fn leg_times(&self, leg: usize) -> (f64, f64) {
        let pieces = &self.legs[leg];
        (pieces[0].start(), pieces[pieces.len() - 1].end())
    }

    /// State at a time of an interval; `scratch` has room for states and integrals.
    pub(crate) fn state(&self, leg: usize, t: f64, scratch: &mut [f64], out: &mut [f64]) {
        let pieces = &self.legs[leg];
        let piece = pieces.partition_point(|piece| piece.end() < t).min(pieces.len() - 1);
        let solution = &pieces[piece];
        let t = t.max(solution.start()).min(solution.end());
        match solution.evaluate(t, scratch) {
            Ok(()) => out.copy_from_slice(&scratch[..out.len()]),
            Err(_) => out.fill(f64::NAN),
        }
    }

    /// Components of the integrated system.
    pub(crate) fn dimension(&self) -> usize {
        system_dimension(self.final_state.len(), self.integrals.len())
    }
}

/// States and integrals; the integrator wants at least one component.
fn system_dimension(states: usize, integrals: usize) -> usize {
    (states + integrals).max(1)
}

/// The state at the end of the last phase of a flight that starts elsewhere than the trajectory, with the controls of the trajectory as functions
/// of time (open loop), its times and parameters; none where the flight breaks off. Phases that no linkage joins start as in the trajectory.
///
/// # Errors
/// A trajectory that does not fit the problem, a start of another size.
pub fn open_loop_end(
    ocp: &Ocp,
    trajectory: &Trajectory,
    start: &[f64],
    settings: &VerifySettings,
) -> Result<Option<Vec<f64>>, VerifyError> {
    let guess = Guess::earlier(trajectory);
    shape::check(ocp, trajectory, &guess)?;
    let expected = ocp.phases.first().map_or(0, |phase| phase.states.len());
    if start.len() != expected {
        let place = "the start of an open loop".into();
        return Err(VerifyError::Dimension { place, what: "states", expected, found: start.len() });
    }
    let scaling = Scaling::new(ocp, &guess);
    let flights = fly_from(ocp, trajectory, Some(start), &scaling, settings, WHOLE);
    let broken = flights.iter().any(|flight| flight.failure.is_some());
    Ok(flights.into_iter().next_back().map(|flight| flight.final_state).filter(|_| !broken))
}

/// Every flight goes on as it is.
const WHOLE: (Places, fn(usize, &Flight) -> bool) = (Places::Breaks, |_, _| true);

/// Simulates every phase; one whose flight does not stay with the trajectory is flown in pieces where errors grow a hundredfold on the way.
pub(crate) fn fly_in_pieces(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
    places: Places,
    stays: impl Fn(usize, &Flight) -> bool,
) -> Vec<Flight> {
    let flights = fly_from(ocp, trajectory, None, scaling, settings, (places, stays));
    // What the flight of a phase misses at its end grows in the next one.
    let is_linked = linkage::sources(ocp).iter().flatten().any(Option::is_some);
    if is_linked && flights.iter().any(|flight| !flight.restarts.is_empty()) {
        return fly_from(ocp, trajectory, None, scaling, settings, (places, |_, _| false));
    }
    flights
}

/// As [`fly_in_pieces`], the first phase from another start.
fn fly_from(
    ocp: &Ocp,
    trajectory: &Trajectory,
    start: Option<&[f64]>,
    scaling: &Scaling,
    settings: &VerifySettings,
    (places, stays): (Places, impl Fn(usize, &Flight) -> bool),
) -> Vec<Flight> {
    let mut flights: Vec<Flight> = Vec::with_capacity(ocp.phases.len());
    for (k, sources) in linkage::sources(ocp).iter().enumerate() {
        let found = &trajectory.phases[k];
        let mut initial_state = match start {
            Some(start) if k == 0 => start.to_vec(),
            _ => found.state_at(found.initial_time),
        };
        for (x, source) in initial_state.iter_mut().zip(sources) {
            if let Some(Source { phase, state, offset }) = *source {
                *x = flights[phase].joined_end[state] + offset;
            }
        }
        let equations = || Equations::new(ocp, k, &trajectory.parameters);
        let scales = &scaling.phases[k].states;
        let mut flight = fly_phase(equations(), found, initial_state.clone(), scales, settings, &[]);
        if !stays(k, &flight) {
            let starts = growth::starts(equations(), found, &scaling.phases[k], places);
            if !starts.is_empty() {
                flight = fly_phase(equations(), found, initial_state, scales, settings, &starts);
            }
        }
        flights.push(flight);
    }
    flights
}

/// Flies a phase, anew beside the trajectory at each of the times given, of which the last is its end.
fn fly_phase(
    equations: Equations<'_>,
    found: &PhaseTrajectory,
    initial_state: Vec<f64>,
    scales: &[f64],
    settings: &VerifySettings,
    starts: &[Start],
) -> Flight {
    let (nx, nq) = (equations.nx, equations.phase.integrals.len());
    let n = system_dimension(nx, nq);
    let tolerance = settings.integration_tolerance;
    let mut absolute: Vec<f64> = scales.iter().map(|s| tolerance * s).collect();
    absolute.extend(equations.phase.integrals.iter().map(|q| tolerance * q.variable.scale.unwrap_or(1.0)));
    absolute.resize(n, tolerance);
    let ode = OdeSettings {
        relative_tolerance: tolerance,
        absolute_tolerance: Tolerance::PerComponent(absolute),
        max_steps: settings.max_steps,
        // A stiff phase is flown with many steps rather than given up.
        stiffness_interval: None,
        ..OdeSettings::default()
    };
    let mut flight = Flight {
        legs: Vec::with_capacity(found.control.segments().len()),
        final_state: vec![f64::NAN; nx],
        integrals: vec![f64::NAN; nq],
        failure: None,
        restarts: Vec::with_capacity(starts.len()),
        joined_end: vec![f64::NAN; nx],
        initial_state,
    };
    let failed = |mut flight: Flight, time, reason| {
        flight.failure = Some(Failure { time, reason });
        flight
    };
    let breaks = found.control.breaks();
    let Ok(mut integrator) = Integrator::new(n, ode) else {
        return failed(flight, breaks[0], "the scales or tolerances are not usable");
    };
    let mut y = vec![0.0; n];
    y[..nx].copy_from_slice(&flight.initial_state);
    let mut end = y.clone();
    let scratch = RefCell::new((vec![0.0; equations.nu], equations));
    for leg in 0..found.control.segments().len() {
        let system = FnSystem::new(n, |t: f64, y: &[f64], rates: &mut [f64]| {
            let (u, equations) = &mut *scratch.borrow_mut();
            found.control.evaluate_in(leg, t, u);
            equations.set(found.control.within(leg, t), &y[..nx], u);
            rates.fill(0.0);
            equations.rates(&mut rates[..nx + nq]);
        });
        let (mut at, stop) = (breaks[leg], breaks[leg + 1]);
        let mut pieces = Vec::with_capacity(1);
        let anew = starts.iter().filter(|start| (breaks[leg]..stop).contains(&start.time));
        for (end_of_piece, start) in anew.map(|start| (start.time, Some(start))).chain([(stop, None)]) {
            if end_of_piece > at {
                let mut solution = DenseSolution::new(at, &y);
                let flown = integrator.integrate_observed(
                    &system,
                    at,
                    &y,
                    end_of_piece,
                    &mut end,
                    &[],
                    &mut solution,
                );
                match flown.map(|summary| (summary.status, summary.time)) {
                    Ok((Status::Completed, _)) => y.copy_from_slice(&end),
                    Ok((status, time)) => return failed(flight, time, reason(status)),
                    Err(_) => return failed(flight, at, "the state it starts from is not finite"),
                }
                pieces.push(solution);
                at = end_of_piece;
            }
            if let Some(start) = start {
                let restart = start.join(&mut y[..nx], &found.state_at(at), settings.end_tolerance);
                flight.restarts.push(restart);
            }
        }
        flight.legs.push(pieces);
    }
    flight.final_state.copy_from_slice(&y[..nx]);
    if let Some(start) = starts.last() {
        let restart = start.join(&mut y[..nx], &found.final_state(), settings.end_tolerance);
        flight.restarts.push(restart);
    }
    flight.joined_end.copy_from_slice(&y[..nx]);
    flight.integrals.copy_from_slice(&y[nx..nx + nq]);
    flight
}

fn reason(status: Status) -> &'static str {
    match status {
        Status::TooManySteps => "too many steps",
        Status::StepTooSmall => "the step became too small: a singularity",
        Status::NotFinite => "the rates are not finite",
        _ => "stopped early",
    }
}

/// Times at which an interval is examined, both ends included.
pub(crate) fn sample_times((start, end): (f64, f64), points: usize) -> impl Iterator<Item = f64> {
    (0..points).map(move |k| {
        let fraction = k as f64 / (points - 1) as f64;
        if k + 1 == points { end } else { start + fraction * (end - start) }
    })
}

/// Samples a flight for figures.
pub(crate) fn sample(found: &PhaseTrajectory, flight: &Flight, points: usize) -> SimulatedPhase {
    let (nx, nu) = (found.state.dimension(), found.control.dimension());
    let rows = flight.legs() * points;
    let mut simulated = SimulatedPhase {
        name: found.name.clone(),
        times: Vec::with_capacity(rows),
        states: vec![0.0; rows * nx],
        controls: vec![0.0; rows * nu],
        integrals: flight.integrals.clone(),
    };
    let mut scratch = vec![0.0; flight.dimension()];
    for leg in 0..flight.legs() {
        for t in sample_times(flight.leg_times(leg), points) {
            let row = simulated.times.len();
            flight.state(leg, t, &mut scratch, &mut simulated.states[row * nx..(row + 1) * nx]);
            found.control.evaluate_in(leg, t, &mut simulated.controls[row * nu..(row + 1) * nu]);
            simulated.times.push(t);
        }
    }
    simulated
}
