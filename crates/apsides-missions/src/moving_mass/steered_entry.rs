//! A re-entry in six degrees of freedom whose lift is pointed along a profile of bank angles by two masses on a rim.
//!
//! On an axisymmetric capsule a centre of mass off the axis turns the axis to the other side, and the lift pulls to its own. In trim the
//! force of the air lies in the plane of the axis and the centre of mass: a centre of mass that is moved across that plane turns the plane, and
//! with it the lift, but gives no lasting moment about the axis. So where the masses stand on the rim is the bank angle; roll is left alone.
//!
//! Law: the axis is to be where the trim for the wanted bank has it. With the rotation `e` (rad, about y and z) that is left, the wanted
//! angular acceleration has three poles at the frequency `w`:
//!
//! ```text
//! a = 3 w^2 e + 3 w (W - (q, r)) + w^3 integral of e,    w = bandwidth * frequency of the capsule's own oscillation
//! ```
//!
//! with the angular velocity `W` of the wanted axis. Moments about the origin, `(My0, Mz0)`, and the axial force `Fx` of the table give the
//! centre of mass for it, `z = (My0 - I a_y) / Fx`, `y = (I a_z - Mz0) / Fx`; the integral is kept as a length, as which an offset
//! that the law does not know is constant while the dynamic pressure grows.
//!
//! Beyond the last Mach number of the table its coefficients are held: in hypersonic flow they hardly change.

use apsides_ad::vector::{add, cross, dot};
use apsides_ad::{Dynamics, Outside, Pchip};
use apsides_control::allocation::RadialLayout;
use apsides_control::controller::Controller;
use apsides_control::record::Sample;
use apsides_control::simulation::{Ending, Flight, Simulation};
use apsides_dynamics::aerodynamics::AxisymmetricAerodynamics;
use apsides_dynamics::attitude;
use apsides_dynamics::engine::STANDARD_GRAVITY;
use apsides_dynamics::entry::{Banked, EntryFlight, EntryState, Heading};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlightCondition, Ground, Inertia, RigidBody, Start};
use apsides_dynamics::{DynamicsError, Ellipsoid, MovingMassVehicle};

use super::case::{ActuatorLimits, Allocation, AntiWindupBy, Masses, Run};
use super::descent::{Record, settings, simulation, unit_attitude, watched};
use super::drives::Drives;
use super::state::BodyState;
use apsides_pipeline::Error;
use apsides_pipeline::simulation::Watch;

/// Dynamic pressure, Pa, from which the bank angle is judged and the integral of the law runs: below, the air moves nothing.
pub const JUDGED_PRESSURE: f64 = 100.0;
/// Total angle of attack, rad, from which the capsule tumbles.
const TUMBLING: f64 = std::f64::consts::FRAC_PI_2;
/// Axial force, N, below which the masses stand as in trim.
const LEAST_FORCE: f64 = 1e-3;
/// Time, s, over which the turn of the attitude at the start is taken.
const TURN_TIME: f64 = 0.1;

/// A re-entry whose lift is pointed by masses; SI units, rad.
#[derive(Clone, Debug)]
pub struct SteeredEntry {
    /// Planet, mass, area and heading of the planned flight.
    pub flight: EntryFlight,
    /// State at the start.
    pub start: EntryState,
    /// Altitude of the end, m.
    pub end_altitude: f64,
    /// Coefficients of the shape.
    pub shape: AxisymmetricAerodynamics,
    /// Radii of gyration about the roll axis and across it, m, with the masses on the axis.
    pub gyration: [f64; 2],
    /// Distance of the centre of mass from the axis in the trim of the planned flight, m; 0 for a capsule without lift.
    pub trim_offset: f64,
    /// Offset of the centre of mass along y and z that the law does not know, m.
    pub unknown_offset: [f64; 2],
    /// Each of the two moving masses, kg.
    pub moving_mass: f64,
    /// Radius of their rim, m.
    pub rim_radius: f64,
    /// Limits of the actuators that follow the commands.
    pub actuators: ActuatorLimits,
    /// Frequency of the law's poles by that of the capsule's own oscillation.
    pub bandwidth: f64,
    /// Time between samples of the law, s, which is the step of the integration.
    pub sample_time: f64,
    /// Longest flight, s.
    pub time_limit: f64,
}

/// Bank angles of a planned flight over the energy that the air takes, so that a flight that is slower or higher follows them too.
#[derive(Clone, Debug)]
pub struct BankProfile {
    cosine: Pchip,
    sine: Pchip,
}

/// A flight along a profile.
#[derive(Clone, Debug, PartialEq)]
pub struct SteeredFlight {
    /// The reason for its end.
    pub ending: Ending,
    /// Time of the end, s.
    pub time: f64,
    /// Longitude and latitude of the end, rad.
    pub place: [f64; 2],
    /// Bank angle less the planned one, root mean square and peak, rad, from [`JUDGED_PRESSURE`] on.
    pub bank_error: [f64; 2],
    /// Total angle of attack less that of the trim, root mean square and peak, rad, over the same time.
    pub attack_error: [f64; 2],
    /// Largest total angle of attack over the same time, rad.
    pub largest_attack: f64,
    /// Heat load, J/m2.
    pub heat_load: f64,
    /// Largest dynamic pressure (Pa), load (m/s2) and heat rate (W/m2).
    pub peaks: [f64; 3],
    /// Time, s, during which a mass moved at its largest speed.
    pub saturated_time: f64,
    /// Largest speed of a mass along the rim, m/s.
    pub largest_rate: f64,
    /// Largest error of a step.
    pub step_error: f64,
}

/// A moment of a flight relative to its plan.
#[derive(Clone, Copy, Debug)]
pub struct SteeredCondition {
    /// Flow and loads.
    pub flow: FlightCondition,
    /// Bank angle, rad: that of the plane of the axis and the air.
    pub bank: f64,
    /// Bank angle of the plan at this energy, rad; zero without a plan.
    pub planned_bank: f64,
    /// Total angle of attack of the trim, rad.
    pub trim: f64,
    /// Heat rate, W/m2.
    pub heat_rate: f64,
}

/// A re-entry that was checked and is ready to fly.
#[derive(Clone, Debug)]
pub struct SteeredReady<'a> {
    entry: &'a SteeredEntry,
    profile: Option<&'a BankProfile>,
    vehicle: MovingMassVehicle,
    /// Trim by the Mach number.
    trim: Option<Pchip>,
    start: [f64; 13],
    rim: RadialLayout,
}

impl BankProfile {
    /// The profile of states of the planned flight with their bank angles (rad), in order of time. Moments at which the energy does not
    /// fall are left out.
    ///
    /// # Errors
    /// When fewer than two moments are left or a number is not finite.
    pub fn new(
        flight: &EntryFlight,
        moments: impl IntoIterator<Item = (EntryState, f64)>,
    ) -> Result<Self, Error> {
        let surface = flight.planet.surface();
        let (mut spent, mut cosines, mut sines) = (Vec::new(), Vec::new(), Vec::new());
        for (x, bank) in moments {
            let here = -energy(&surface, &x);
            if spent.last().is_none_or(|last| here > *last) {
                spent.push(here);
                cosines.push(bank.cos());
                sines.push(bank.sin());
            }
        }
        let column = |values: &[f64]| {
            Pchip::new(&spent, values, Outside::Constant).map_err(|_| Error::Conflict {
                place: "bank profile".into(),
                reason: "the planned flight has no two moments of falling energy with finite numbers".into(),
            })
        };
        Ok(Self { cosine: column(&cosines)?, sine: column(&sines)? })
    }

    /// The bank angle, rad, at an energy by mass (J/kg).
    #[must_use]
    pub fn at(&self, energy: f64) -> f64 {
        self.sine.at(-energy).atan2(self.cosine.at(-energy))
    }
}

impl SteeredEntry {
    fn body(&self) -> Result<RigidBody, DynamicsError> {
        let mass = self.flight.vehicle.mass;
        let [roll, across] = self.gyration.map(|k| mass * k * k);
        let [y, z] = self.unknown_offset;
        RigidBody::new(
            Ground::Ellipsoid(self.flight.planet.surface()),
            self.flight.planet.atmosphere.clone(),
            self.shape.clone(),
            mass,
            Inertia::principal([roll, across, across])?,
            [0.0, y, z],
        )
    }

    /// Steps and ends.
    #[must_use]
    pub fn run(&self) -> Run {
        Run {
            sample_time: self.sample_time,
            substeps: 1,
            stop_altitude: self.end_altitude,
            time_limit: self.time_limit,
            window: [self.end_altitude, self.start.altitude],
            tumbling: TUMBLING,
            anti_windup: AntiWindupBy::Actuators,
        }
    }

    fn trim(&self) -> Result<Option<Pchip>, Error> {
        if self.trim_offset == 0.0 {
            return Ok(None);
        }
        let (mach, angle): (Vec<f64>, Vec<f64>) =
            self.shape.trims(self.trim_offset).map_err(Error::model)?.into_iter().unzip();
        let table = Pchip::new(&mach, &angle, Outside::Constant);
        table.map(Some).map_err(|e| Error::in_mission(format!("trim over the Mach number: {e}")))
    }

    /// Checks a re-entry and makes it ready. Without a profile the masses stand opposite each other and nothing is steered.
    ///
    /// # Errors
    /// The parameter that vehicle, masses, actuators or simulation refuse, with its number; a trim that the masses do not reach.
    pub fn ready<'a>(&'a self, profile: Option<&'a BankProfile>) -> Result<SteeredReady<'a>, Error> {
        let mass = self.flight.vehicle.mass;
        let rim = RadialLayout::new(self.moving_mass, mass, self.rim_radius, 0.0)?;
        if rim.reach() < self.trim_offset {
            let reason = format!(
                "two masses of {} kg on a rim of {} m move the centre of mass of {mass} kg by {:.2} cm at most, the trim needs {:.2} cm",
                self.moving_mass,
                self.rim_radius,
                100.0 * rim.reach(),
                100.0 * self.trim_offset
            );
            return Err(Error::in_mission(reason));
        }
        let layout = Layout::Radial { radius: self.rim_radius };
        let body = self.body().map_err(Error::model)?;
        let vehicle =
            MovingMassVehicle::new(body, layout, [self.moving_mass; 2], 0.0).map_err(Error::model)?;
        let mut ready =
            SteeredReady { entry: self, profile, vehicle, trim: self.trim()?, start: [0.0; 13], rim };
        ready.start = ready.first_state()?;
        ready.drives()?;
        ready.simulation()?;
        Ok(ready)
    }
}

impl SteeredReady<'_> {
    /// The vehicle.
    #[must_use]
    pub fn vehicle(&self) -> &MovingMassVehicle {
        &self.vehicle
    }

    fn trim_at(&self, mach: f64) -> f64 {
        self.trim.as_ref().map_or(0.0, |trim| trim.at(mach))
    }

    /// The state with the axis in trim, turning with the planned flight.
    fn first_state(&self) -> Result<[f64; 13], Error> {
        let SteeredEntry { flight, start, .. } = self.entry;
        let ground = &self.vehicle.body().ground;
        let attitude_of = |x: &EntryState| -> Result<(BodyState<f64>, f64), Error> {
            let bank = self.profile.map_or(0.0, |p| p.at(energy(&flight.planet.surface(), x)));
            let state = ground.state(&Start {
                longitude: x.longitude,
                latitude: x.latitude,
                altitude: x.altitude,
                speed: x.speed,
                path: x.path_angle,
                azimuth: flight.heading.of_course(x.azimuth),
                bank: bank * self.to_the_right(),
                // The axis below the velocity, the lift above it.
                attack: -self.trim_at(flight.mach(x.altitude, x.speed)),
                ..Start::default()
            });
            let mut state = state.map_err(Error::model)?;
            unit_attitude(&mut state);
            Ok((BodyState::of(&state), bank))
        };
        let (mut state, bank) = attitude_of(start)?;
        let first = start.array();
        let rate = Dynamics::<6, 1>::rate(&Banked(flight.clone()), 0.0, &first, &[bank], &[]);
        let next: [f64; 6] = std::array::from_fn(|k| first[k] + TURN_TIME * rate[k]);
        let (later, _) = attitude_of(&next.into())?;
        let [from, to] = [state.attitude, later.attitude];
        let turn = attitude::product(&[from[0], -from[1], -from[2], -from[3]], &to);
        let axes = attitude::rotation(&from);
        let turning = ground.rotation_rate().unwrap_or(0.0);
        for k in 0..3 {
            state.spin[k] = 2.0 * turn[1 + k] * turn[0].signum() / TURN_TIME + axes[2][k] * turning;
        }
        Ok(state.array())
    }

    /// Sign of a positive bank angle as a roll to the right.
    fn to_the_right(&self) -> f64 {
        match self.entry.flight.heading {
            Heading::FromNorth => 1.0,
            Heading::FromEast => -1.0,
        }
    }

    fn drives(&self) -> Result<Drives, Error> {
        let masses = Masses::Radial {
            mass: self.entry.moving_mass,
            radius: self.entry.rim_radius,
            neutral: self.standing(),
            allocation: Allocation::Inversion,
            least_separation: 0.0,
        };
        Drives::new(&masses, &self.entry.actuators, self.entry.sample_time)
    }

    fn simulation(&self) -> Result<Simulation<'_, MovingMassVehicle, 13, 2>, Error> {
        let run = self.entry.run();
        simulation(&self.vehicle, self.vehicle.body(), run, settings(&run))
    }

    /// Flies. The record is emptied first and holds the flight afterwards; it should keep every step.
    ///
    /// # Errors
    /// When memory has no room for the record.
    pub fn fly(&self, record: &mut Record) -> Result<SteeredFlight, Error> {
        self.fly_watched(record, &|_| true)
    }

    /// As [`fly`](Self::fly); `watch` may end the flight.
    ///
    /// # Errors
    /// As of [`fly`](Self::fly).
    pub fn fly_watched(&self, record: &mut Record, watch: &Watch<'_>) -> Result<SteeredFlight, Error> {
        let mut drives = self.drives()?;
        let standing = self.standing();
        let simulation = watched(self.simulation()?, watch);
        let flight = match self.profile {
            Some(profile) => {
                let mut law = Pointing {
                    ready: self,
                    profile,
                    before: standing,
                    integral: [0.0; 2],
                    axis_before: None,
                };
                simulation.fly(&self.start, &mut law, &mut drives, None, record)?
            }
            None => {
                let mut law = |_: f64, _: &[f64; 13]| standing;
                simulation.fly(&self.start, &mut law, &mut drives, None, record)?
            }
        };
        Ok(self.judged(&flight, record.samples()))
    }

    /// Errors, loads and rates of a flight.
    fn judged(&self, flight: &Flight<13>, samples: &[Sample<13, 2>]) -> SteeredFlight {
        let mut found = SteeredFlight {
            ending: flight.ending,
            time: flight.time,
            place: place(&flight.state),
            bank_error: [0.0; 2],
            attack_error: [0.0; 2],
            largest_attack: 0.0,
            heat_load: 0.0,
            peaks: [0.0; 3],
            saturated_time: 0.0,
            largest_rate: 0.0,
            step_error: flight.step_error,
        };
        let (mut judged, mut before) = (0_usize, None);
        for sample in samples {
            let at = self.condition(&sample.state);
            let load = at.flow.load() * STANDARD_GRAVITY;
            for (peak, value) in found.peaks.iter_mut().zip([at.flow.dynamic_pressure, load, at.heat_rate]) {
                *peak = peak.max(value);
            }
            if let Some((time, rate)) = before.replace((sample.time, at.heat_rate)) {
                found.heat_load += 0.5 * (sample.time - time) * (rate + at.heat_rate);
            }
            if at.flow.dynamic_pressure < JUDGED_PRESSURE {
                continue;
            }
            let turn = at.bank - at.planned_bank;
            let errors = [turn.sin().atan2(turn.cos()), at.flow.total_attack - at.trim];
            for ([squares, peak], error) in
                [&mut found.bank_error, &mut found.attack_error].into_iter().zip(errors)
            {
                *squares += error * error;
                *peak = peak.max(error.abs());
            }
            found.largest_attack = found.largest_attack.max(at.flow.total_attack);
            judged += 1;
        }
        for [squares, _] in [&mut found.bank_error, &mut found.attack_error] {
            *squares = (*squares / judged.max(1) as f64).sqrt();
        }
        // The last sample repeats the control of the step before.
        let steps = &samples[..samples.len().saturating_sub(1)];
        for (from, to) in steps.iter().zip(steps.iter().skip(1)) {
            let way = |k: usize| (to.control[k] - from.control[k]).abs() * self.entry.rim_radius;
            let time = to.time - from.time;
            let rate = way(0).max(way(1)) / time;
            found.largest_rate = found.largest_rate.max(rate);
            if self.entry.actuators.rate.is_some_and(|limit| rate >= limit * (1.0 - 1e-6)) {
                found.saturated_time += time;
            }
        }
        found
    }

    /// Positions of the masses at the start: in trim, or opposite each other.
    fn standing(&self) -> [f64; 2] {
        match self.profile {
            Some(_) => self.rim.invert(&[0.0, -self.entry.trim_offset], &[std::f64::consts::PI; 2]).positions,
            None => [std::f64::consts::PI, 0.0],
        }
    }

    /// The moment of a state relative to the plan.
    #[must_use]
    pub fn condition(&self, x: &[f64; 13]) -> SteeredCondition {
        let flow = self.vehicle.condition(x);
        let Directions { forward, up, right } = self.directions(x);
        let axis = attitude::rotation(&BodyState::of(x).attitude).map(|row| row[0]);
        // The lift pulls away from where the axis is turned.
        let [across, above] = [right, up].map(|d| -dot(&axis, &d));
        let lift_is_seen = cross(&axis, &forward).iter().any(|c| *c != 0.0);
        SteeredCondition {
            flow,
            bank: if lift_is_seen { (across * self.to_the_right()).atan2(above) } else { 0.0 },
            planned_bank: self.profile.map_or(0.0, |p| p.at(self.energy(x))),
            trim: self.trim_at(flow.mach),
            heat_rate: self.entry.flight.heat_rate(flow.altitude, flow.airspeed),
        }
    }

    fn energy(&self, x: &[f64; 13]) -> f64 {
        let BodyState { position, velocity, .. } = BodyState::of(x);
        self.vehicle.body().ground.energy(position, velocity)
    }

    /// Axes of the flight in those of the ground.
    fn directions(&self, x: &[f64; 13]) -> Directions {
        let BodyState { position, velocity, .. } = BodyState::of(x);
        let forward = unit(&velocity);
        let zenith = self.vehicle.body().ground.local(&position).up;
        let along = dot(&zenith, &forward);
        let up = unit(&std::array::from_fn(|k| zenith[k] - along * forward[k]));
        Directions { forward, up, right: cross(&forward, &up) }
    }
}

/// Energy by mass, J/kg, of a state: that of [`Ground::energy`].
fn energy(surface: &Ellipsoid, x: &EntryState) -> f64 {
    let position = surface.position(x.longitude, x.latitude, x.altitude);
    Ground::Ellipsoid(*surface).energy(position, [x.speed, 0.0, 0.0])
}

/// Unit vectors along the velocity, upwards across it, and to the right.
struct Directions {
    forward: [f64; 3],
    up: [f64; 3],
    right: [f64; 3],
}

fn unit(v: &[f64; 3]) -> [f64; 3] {
    let size = dot(v, v).sqrt();
    if size > 0.0 { v.map(|c| c / size) } else { [1.0, 0.0, 0.0] }
}

/// Longitude and geocentric latitude of a state, rad.
fn place(x: &[f64; 13]) -> [f64; 2] {
    let [x, y, z] = BodyState::of(x).position;
    [y.atan2(x), z.atan2(x.hypot(y))]
}

/// The law with its memory.
struct Pointing<'a> {
    ready: &'a SteeredReady<'a>,
    profile: &'a BankProfile,
    before: [f64; 2],
    /// Centre of mass along y and z that stands against what the law does not know, m.
    integral: [f64; 2],
    /// Wanted axis of the sample before, in axes of the ground.
    axis_before: Option<[f64; 3]>,
}

impl Pointing<'_> {
    /// Unit vectors along the air and along the lift for the planned bank, in axes of the ground.
    fn wanted(&self, x: &[f64; 13]) -> [[f64; 3]; 2] {
        let Directions { forward, up, right } = self.ready.directions(x);
        let (sin, cos) = self.profile.at(self.ready.energy(x)).sin_cos();
        let across = sin * self.ready.to_the_right();
        [forward, std::array::from_fn(|k| cos * up[k] + across * right[k])]
    }
}

impl Controller<13, 2> for Pointing<'_> {
    fn command(&mut self, _t: f64, x: &[f64; 13]) -> [f64; 2] {
        let SteeredReady { entry, vehicle, rim, .. } = self.ready;
        let body = vehicle.body();
        let (altitude, air) = body.air(x);
        let [density, sound] = body.atmosphere.density_and_sound(altitude);
        let speed = dot(&air, &air).sqrt();
        let mach = speed / sound;
        let trim = self.ready.trim_at(mach);
        let [forward, lift] = self.wanted(x);
        let (away, along) = trim.sin_cos();
        let wanted = std::array::from_fn(|k| along * forward[k] - away * lift[k]);
        let before = self.axis_before.replace(wanted).unwrap_or(wanted);
        let change: [f64; 3] = std::array::from_fn(|k| (wanted[k] - before[k]) / entry.sample_time);
        let turning = [0.0, 0.0, body.ground.rotation_rate().unwrap_or(0.0)];
        let axes = attitude::rotation(&BodyState::of(x).attitude);
        let [_, pitch_rate, yaw_rate] =
            attitude::turned_back(&axes, &add(&cross(&wanted, &change), &turning));
        let wanted = attitude::turned_back(&axes, &wanted);
        // The rotation from the axis to where it is to be, about y and z.
        let away = wanted[1].hypot(wanted[2]);
        let by_sine = if away > 0.0 { away.atan2(wanted[0]) / away } else { 1.0 };
        let left = [-wanted[2] * by_sine, wanted[1] * by_sine];
        let spin = BodyState::of(x).spin;
        let [_, pitch_spin, yaw_spin] = spin;
        let loads = body.aerodynamics().loads(density, sound, &air, &spin);
        let inertia = body.inertia().matrix()[1][1];
        let pressure = 0.5 * density * speed * speed;
        let slope = body.aerodynamics().coefficients(mach, trim * trim).moment_by_angle;
        let stiffness = -slope * pressure * body.aerodynamics().area() * body.aerodynamics().diameter();
        let w = entry.bandwidth * (stiffness.max(0.0) / inertia).sqrt();
        let lag = [pitch_rate - pitch_spin, yaw_rate - yaw_spin];
        let [by_pitch, by_yaw] = [0, 1].map(|k| inertia * 3.0 * w * (w * left[k] + lag[k]));
        let axial = loads.force[0];
        let direct = if axial < -LEAST_FORCE {
            [(by_yaw - loads.moment[2]) / axial, (loads.moment[1] - by_pitch) / axial]
        } else {
            // As in trim: on the side of the lift.
            let lift = attitude::turned_back(&axes, &lift);
            let size = entry.trim_offset / lift[1].hypot(lift[2]).max(f64::MIN_POSITIVE);
            [lift[1] * size, lift[2] * size]
        };
        let found = rim.invert(&add(&direct, &self.integral), &self.before);
        if !found.saturated && pressure >= JUDGED_PRESSURE {
            let grown = entry.sample_time * w.powi(3) * inertia / -axial;
            self.integral = add(&self.integral, &[-left[1] * grown, left[0] * grown]);
        }
        if found.positions.iter().all(|p| p.is_finite()) {
            self.before = found.positions;
        }
        found.positions
    }
}
