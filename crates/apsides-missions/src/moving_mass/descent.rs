//! A case ready to fly, and the metrics of its flights.

use apsides_ad::Dynamics;
use apsides_control::record::{Recording, Sample};
use apsides_control::simulation::{Breach, Ending, Flight, Integration, Simulation, SimulationSettings};
use apsides_dynamics::rigid_body::{FlightCondition, STATES};
use apsides_dynamics::{MovingMassVehicle, RigidBody};
use apsides_ode::Direction;

use super::case::{Case, MassModel, Masses, Run};
use super::drives::Drives;
use super::full_masses::{FullMasses, MovedDrives, StrokeLaw, positions_at, stroke_end};
use super::state::BodyState;
use super::steering::{Design, SteeringLaw, angles};
use apsides_pipeline::Error;
use apsides_pipeline::simulation::{INTERRUPTED, Watch};

/// A record of a descent: states, commands and positions of the masses. Flights that are judged are recorded at every step.
pub type Record = Recording<13, 2>;

/// Name of the stop at the lowest height of a run.
const LOWEST: &str = "stop altitude";

/// Magnitudes at which errors of position, velocity, attitude and angular velocity matter.
const SCALES: [f64; 13] = [100.0, 100.0, 100.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];

/// Largest error of a step: kinks of the tables at their knots make single steps of 10 ms err by some 1e-6, of a capsule that turns over
/// by some 1e-5.
const STEP_TOLERANCE: f64 = 2e-4;

/// A case that was checked and is ready to fly, any number of times, on several threads.
#[derive(Clone, Debug)]
pub struct Descent {
    case: Case,
    vehicle: MovingMassVehicle,
    design: Design,
    start: [f64; 13],
    settings: SimulationSettings<13>,
}

/// Angles over the window of heights, rad: of attack, then sideslip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Roots of the mean squares.
    pub rms: [f64; 2],
    /// Largest magnitudes.
    pub peak: [f64; 2],
}

/// Metrics of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// The reason for its end.
    pub ending: Ending,
    /// Time of the end, s.
    pub time: f64,
    /// Angles over the window, as far as it was flown; none if it was not reached.
    pub window: Option<Window>,
    /// Time during which a mass was at an end of its travel or at its largest speed, or the centre of mass at the limit of its reach, s.
    pub saturated_time: f64,
    /// Farthest position of each mass from neutral, m, along the rim for masses on one.
    pub largest_travel: [f64; 2],
    /// Largest speed of each mass, m/s.
    pub largest_rate: [f64; 2],
    /// Time with a total angle of attack beyond the table of coefficients, which are held at its edge there, s.
    pub beyond_table: f64,
    /// Largest error of one control step among those checked, relative to the magnitudes of the states.
    pub step_error: f64,
    /// Last state.
    pub state: [f64; 13],
}

impl Metrics {
    /// Returns true if the whole descent was flown.
    #[must_use]
    pub fn held(&self) -> bool {
        self.ending == Ending::Stop(LOWEST)
    }

    /// The larger root mean square of both angles, rad; infinite for a flight that failed, so that worst cases can be compared.
    #[must_use]
    pub fn worst_rms(&self) -> f64 {
        self.worst(|w| w.rms)
    }

    /// The larger peak of both angles, rad; infinite for a flight that failed.
    #[must_use]
    pub fn worst_peak(&self) -> f64 {
        self.worst(|w| w.peak)
    }

    fn worst(&self, of: fn(&Window) -> [f64; 2]) -> f64 {
        match &self.window {
            Some(window) if self.held() => of(window)[0].max(of(window)[1]),
            _ => f64::INFINITY,
        }
    }
}

impl Descent {
    /// Checks a case and makes it ready.
    ///
    /// # Errors
    /// The parameter that vehicle, law, actuators, sensors or simulation refuse, with its number.
    pub fn new(case: &Case) -> Result<Self, Error> {
        let vehicle = case.vehicle().map_err(Error::model)?;
        let design = Design::new(case, &vehicle)?;
        let start = vehicle.body().ground.state(&case.entry).map_err(Error::model)?;
        let settings = settings(&case.run);
        let descent = Self { case: case.clone(), vehicle, design, start, settings };
        Drives::new(&case.masses, &case.actuators, case.run.sample_time)?;
        SteeringLaw::new(case, &descent.vehicle, &descent.design)?;
        descent.simulation(&descent.vehicle, |positions| *positions)?;
        Ok(descent)
    }

    /// The case.
    #[must_use]
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// The vehicle.
    #[must_use]
    pub fn vehicle(&self) -> &MovingMassVehicle {
        &self.vehicle
    }

    pub(super) fn design(&self) -> &Design {
        &self.design
    }

    /// The state in which flights start.
    #[must_use]
    pub fn start(&self) -> &[f64; 13] {
        &self.start
    }

    /// The simulation of a model of the vehicle, whose controls tell positions of the masses.
    fn simulation<'a, M: Dynamics<13, NU>, const NU: usize>(
        &'a self,
        model: &'a M,
        positions: fn(&[f64; NU]) -> [f64; 2],
    ) -> Result<Simulation<'a, M, 13, NU>, Error> {
        let vehicle = &self.vehicle;
        let body = vehicle.body();
        let [_, fastest] = body.aerodynamics().table().mach_range();
        let mut simulation = simulation(model, body, self.case.run, self.settings.clone())?
            .monitor(Breach::TableLeft, move |_, x, _| {
                let (altitude, air) = body.air(x);
                let speed = air.iter().map(|c| c * c).sum::<f64>().sqrt();
                fastest * body.atmosphere.speed_of_sound(altitude) - speed
            })
            .monitor(Breach::TravelExceeded, move |_, _, u| {
                vehicle.layout().range_left(positions(u)).map_or(-1.0, |()| 1.0)
            });
        if let Masses::Radial { least_separation, .. } = self.case.masses
            && least_separation > 0.0
        {
            simulation = simulation.end_when_masses_meet();
        }
        Ok(simulation)
    }

    /// Flies once. The record is emptied first and holds the flight afterwards; its interval decides what the metrics see, so it should keep
    /// every step.
    ///
    /// # Errors
    /// When memory has no room for the record.
    pub fn fly(&self, record: &mut Record) -> Result<Metrics, Error> {
        self.fly_watched(record, &|_| true)
    }

    /// As [`fly`](Self::fly); `watch` may end the flight.
    ///
    /// # Errors
    /// As of [`fly`](Self::fly).
    pub fn fly_watched(&self, record: &mut Record, watch: &Watch<'_>) -> Result<Metrics, Error> {
        let mut law = SteeringLaw::new(&self.case, &self.vehicle, &self.design)?;
        let sample_time = self.case.run.sample_time;
        let mut drives = Drives::new(&self.case.masses, &self.case.actuators, sample_time)?;
        let flight = match self.case.mass_model {
            MassModel::QuasiStatic => {
                let simulation = watched(self.simulation(&self.vehicle, |positions| *positions)?, watch);
                simulation.fly(&self.start, &mut law, &mut drives, None, record)?
            }
            MassModel::Full { .. } => {
                let model = FullMasses::new(&self.vehicle, sample_time);
                let simulation = watched(self.simulation(&model, stroke_end)?, watch);
                let mut strokes = Recording::every(record.interval());
                let mut law = StrokeLaw::new(law);
                let mut drives = MovedDrives::new(drives, sample_time);
                let flight = simulation.fly(&self.start, &mut law, &mut drives, None, &mut strokes)?;
                record.refill(strokes.samples().iter().map(|s| positions_at(s, sample_time)))?;
                flight
            }
        };
        Ok(self.metrics(&flight, record.samples()))
    }

    /// Height, m, and angles of attack and sideslip, rad, of a state.
    #[must_use]
    pub fn angles(&self, x: &[f64; 13]) -> (f64, [f64; 2]) {
        let (altitude, air) = self.vehicle.body().air(x);
        (altitude, angles(&air))
    }

    /// Flight condition at a state.
    #[must_use]
    pub fn condition(&self, x: &[f64; 13]) -> FlightCondition {
        self.vehicle.condition(x)
    }

    /// Lengths, m, of one unit of the positions of the masses, and positions from which travel counts.
    fn scale(&self) -> (f64, [f64; 2]) {
        match self.case.masses {
            Masses::Cross { .. } => (1.0, [0.0; 2]),
            Masses::Radial { radius, neutral, .. } => (radius, neutral),
        }
    }

    fn at_limit(&self, control: &[f64; 2], rates: &[f64; 2]) -> bool {
        const NEAR: f64 = 1e-9;
        let limit = self.case.actuators.rate;
        if limit.is_some_and(|limit| rates.iter().any(|rate| rate.abs() >= limit * (1.0 - 1e-6))) {
            return true;
        }
        match self.case.masses {
            Masses::Cross { travel, .. } => {
                control.iter().any(|s| *s <= travel[0] + NEAR || *s >= travel[1] - NEAR)
            }
            Masses::Radial { least_separation, .. } => {
                // Both at the same place, or as near as they may be: the centre of mass is at the limit of its reach.
                let apart = (control[0] - control[1]).rem_euclid(std::f64::consts::TAU);
                apart.min(std::f64::consts::TAU - apart) <= least_separation + 1e-6
            }
        }
    }

    fn metrics(&self, flight: &Flight<13>, samples: &[Sample<13, 2>]) -> Metrics {
        let [lower, upper] = self.case.run.window;
        let [_, most] = self.vehicle.body().aerodynamics().table().attack_range();
        let edge = most.cos();
        let (scale, neutral) = self.scale();
        let (mut squares, mut peak, mut count) = ([0.0; 2], [0.0_f64; 2], 0_usize);
        let (mut travel, mut rate) = ([0.0_f64; 2], [0.0_f64; 2]);
        let (mut saturated, mut beyond) = (0.0, 0.0);
        let ground = &self.vehicle.body().ground;
        for (n, sample) in samples.iter().enumerate() {
            let x = &sample.state;
            let altitude = ground.altitude(&BodyState::of(x).position);
            let (_, air) = self.vehicle.body().air(x);
            if (lower..=upper).contains(&altitude) {
                let found = angles(&air);
                for k in 0..2 {
                    squares[k] += found[k] * found[k];
                    peak[k] = peak[k].max(found[k].abs());
                }
                count += 1;
            }
            let step = samples.get(n + 1).map_or(0.0, |next| next.time - sample.time);
            let [u, v, w] = air;
            if u < edge * v.hypot(w).hypot(u) {
                beyond += step;
            }
            let before = n.checked_sub(1).map(|n| &samples[n]);
            let mut rates = [0.0; 2];
            for k in 0..2 {
                travel[k] = travel[k].max((sample.control[k] - neutral[k]).abs() * scale);
                if let Some(before) = before
                    && sample.time > before.time
                {
                    let moved = (sample.control[k] - before.control[k]).abs() * scale;
                    // The end of a run repeats the control of its last step.
                    rates[k] = if step > 0.0 { moved / (sample.time - before.time) } else { 0.0 };
                    rate[k] = rate[k].max(rates[k]);
                }
            }
            if self.at_limit(&sample.control, &rates) {
                saturated += step;
            }
        }
        let n = count as f64;
        Metrics {
            ending: flight.ending,
            time: flight.time,
            window: (count > 0).then(|| Window { rms: squares.map(|s| (s / n).sqrt()), peak }),
            saturated_time: saturated,
            largest_travel: travel,
            largest_rate: rate,
            beyond_table: beyond,
            step_error: flight.step_error,
            state: flight.state,
        }
    }
}

/// Settings of a run.
pub(super) fn settings(run: &Run) -> SimulationSettings<13> {
    SimulationSettings {
        control_step: run.sample_time,
        time_limit: run.time_limit,
        integration: Integration::Fixed { substeps: run.substeps },
        scales: SCALES,
        check_interval: (1.0 / run.sample_time).clamp(1.0, 1e4) as usize,
        check_tolerance: STEP_TOLERANCE,
        ..SimulationSettings::default()
    }
}

/// A simulation of a model of a body that ends at the lowest height of a run and where the capsule tumbles.
pub(super) fn simulation<'a, M: Dynamics<13, NU>, const NU: usize>(
    model: &'a M,
    body: &'a RigidBody,
    run: Run,
    settings: SimulationSettings<13>,
) -> Result<Simulation<'a, M, 13, NU>, Error> {
    let least_cosine = run.tumbling.cos();
    Ok(Simulation::new(model, settings)?
        .projection(unit_attitude)
        .stop(LOWEST, Direction::Falling, move |_, x| {
            body.ground.altitude(&BodyState::of(x).position) - run.stop_altitude
        })
        .monitor(Breach::Tumbling, move |_, x, _| {
            let (_, [u, v, w]) = body.air(x);
            u - least_cosine * v.hypot(w).hypot(u)
        }))
}

/// The simulation, ended by who watches it.
pub(super) fn watched<'a, M: Dynamics<13, NU>, const NU: usize>(
    simulation: Simulation<'a, M, 13, NU>,
    watch: &'a Watch<'_>,
) -> Simulation<'a, M, 13, NU> {
    simulation.monitor(Breach::Limit(INTERRUPTED), move |t, _, _| if watch(t) { 1.0 } else { -1.0 })
}

/// Makes the quaternion of a state one of length one again.
pub(super) fn unit_attitude(x: &mut [f64; 13]) {
    // Not by `attitude::normalised`, which makes one of any: what is not finite must stay so and end the flight.
    let mut state = BodyState::of(x);
    let length = state.attitude.iter().map(|q| q * q).sum::<f64>().sqrt();
    state.attitude.iter_mut().for_each(|q| *q /= length);
    *x = state.array();
}

/// One word for scripts on how a flight ended; `completed` if it was flown to its lowest height.
#[must_use]
pub fn ending_word(ending: &Ending) -> &'static str {
    match ending {
        Ending::Stop(LOWEST) => "completed",
        Ending::Stop(_) => "stopped",
        Ending::TimeLimit => "time-limit",
        Ending::Breach(Breach::Tumbling) => "tumbling",
        Ending::Breach(Breach::MassesMet) => "masses-met",
        Ending::Breach(Breach::TravelExceeded) => "travel-exceeded",
        Ending::Breach(Breach::TableLeft) => "table-left",
        Ending::Breach(Breach::Limit(INTERRUPTED)) => INTERRUPTED,
        Ending::Breach(_) => "limit",
        Ending::State { .. } | Ending::Command { .. } | Ending::Control { .. } => "not-finite",
        Ending::StepTooLong { .. } => "step-too-long",
        Ending::Integrator(_) => "integrator",
        _ => "ended",
    }
}

/// The end of a run of a vehicle in words.
#[must_use]
pub fn ending_text(run: &Run, vehicle: &MovingMassVehicle, ending: &Ending) -> String {
    match ending {
        Ending::Stop(LOWEST) => format!("flown down to {} km", run.stop_altitude / 1e3),
        Ending::Stop(name) => format!("stopped: {name}"),
        Ending::TimeLimit => format!("still in flight after {} s", run.time_limit),
        Ending::Breach(Breach::Tumbling) => {
            format!("tumbling: the total angle of attack exceeds {} deg", run.tumbling.to_degrees().round())
        }
        Ending::Breach(Breach::MassesMet) => "the masses meet on the rim".into(),
        Ending::Breach(Breach::TravelExceeded) => "a mass leaves its travel".into(),
        Ending::Breach(Breach::TableLeft) => {
            let [_, fastest] = vehicle.body().aerodynamics().table().mach_range();
            format!("the Mach number exceeds {fastest}, where the table of coefficients ends")
        }
        Ending::Breach(Breach::Limit(INTERRUPTED)) => "interrupted".into(),
        Ending::Breach(other) => format!("a limit is exceeded: {other:?}"),
        Ending::State { index } => {
            format!("{} is no longer finite", STATES.get(*index).map_or("a state", |s| s.name))
        }
        Ending::Command { index } => format!("command {} of the law is no longer finite", index + 1),
        Ending::Control { index } => format!("position of mass {} is no longer finite", index + 1),
        Ending::StepTooLong { error } => {
            let step = run.sample_time / run.substeps as f64;
            format!("a step of {step} s is too long: its error is {error:.1e}, take more steps per sample")
        }
        Ending::Integrator(status) => format!("the integrator gives up: {status:?}"),
        other => format!("ended: {other:?}"),
    }
}
