//! Gain, phase and delay margins along a flight.
//!
//! The short-period motion at a state has the angles of attack and sideslip and the pitch and yaw rates as its states; velocity, position and
//! roll rate are held. It is differentiated exactly, sampled with the delays of actuators and sensors, and closed by the linear law that gives
//! the same at the state: gains of PID, secant gains of a nonlinear law, scheduled gains of a regulator, those of sliding mode inside its layer.
//! Each loop is opened with the other one closed.

use std::f64::consts::TAU;

use apsides_ad::vector::cross;
use apsides_ad::{Dynamics, Scalar};
use apsides_control::linear::linearise;
use apsides_control::margins::{LoopAnalysis, Margins};
use apsides_control::pid::{PidGains, PidSettings};
use apsides_control::state_space::StateSpace;
use apsides_dynamics::MovingMassVehicle;
use apsides_dynamics::attitude;
use apsides_dynamics::moving_mass::Layout;

use super::case::{Allocation, Case, DampingSet, Masses};
use super::descent::{Descent, Record};
use super::law::Law;
use super::state::BodyState;
use super::steering::{Knowledge, angles, shift};
use apsides_pipeline::Error;

/// Margins at a height of a flight, of the loops of angle of attack and sideslip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarginRow {
    /// Height, m.
    pub altitude: f64,
    /// Time, s.
    pub time: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure: f64,
    /// Frequency of the oscillation without law, Hz, where the capsule is stable there.
    pub frequency: Option<f64>,
    /// Margins of both loops.
    pub margins: [Margins; 2],
}

/// Frequencies over which responses are looked at, rad/s.
const FREQUENCIES: [f64; 2] = [1e-3, 1e4];
const POINTS: usize = 600;
/// Most samples of delay that margins are looked for with: each is a state of both loops, and the eigenvalues of twice as many take a tenth
/// of a second at each height.
const MOST_DELAY: f64 = 64.0;
/// Least amplitudes that secant gains are taken at: rad, rad s, rad/s.
const AMPLITUDE: f64 = 1e-3;

/// Rotations about y and z from a state, and the rates about them; controls as those of the vehicle.
struct ShortPeriod<'a> {
    vehicle: &'a MovingMassVehicle,
    state: [f64; 13],
}

impl Dynamics<4, 2> for ShortPeriod<'_> {
    fn rate<S: Scalar>(&self, t: S, z: &[S; 4], u: &[S; 2], _p: &[S; 0]) -> [S; 4] {
        let [attack, sideslip, pitch_rate, yaw_rate] = *z;
        let mut state = BodyState::of(&self.state.map(S::from));
        // To first order, which is what is differentiated: a turn that raises both angles.
        let turn = attitude::rate(&state.attitude, &[S::from(0.0), attack, -sideslip]);
        for (component, change) in state.attitude.iter_mut().zip(turn) {
            *component += change;
        }
        let [roll_rate, ..] = state.spin;
        state.spin = [roll_rate, pitch_rate, yaw_rate];
        let x = state.array();
        let rate = BodyState::of(&Dynamics::<13, 2>::rate(self.vehicle, t, &x, u, &[]));
        let axes = attitude::rotation(&state.attitude);
        let (_, air) = self.vehicle.body().air(&x);
        let pushed = attitude::turned_back(&axes, &rate.velocity);
        let carried = cross(&state.spin, &air);
        let d: [S; 3] = std::array::from_fn(|k| pushed[k] - carried[k]);
        let [u, v, w] = air;
        let flat = u.square() + w.square();
        let attack = (d[2] * u - w * d[0]) / flat;
        let sideslip = (d[1] * flat - v * (u * d[0] + w * d[2])) / ((flat + v.square()) * flat.sqrt());
        let [_, pitching, yawing] = rate.spin;
        [attack, sideslip, pitching, yawing]
    }
}

impl Descent {
    /// The samples of delay of a law whose loops have more of them than margins are looked for with.
    #[must_use]
    pub fn too_long_delay(&self) -> Option<f64> {
        let samples = (self.case().actuators.delay + self.case().sensors.delay) / self.case().run.sample_time;
        (self.case().law != Law::None && samples > MOST_DELAY).then_some(samples)
    }

    /// Margins at heights (m) that a recorded flight passes, in falling order. A descent without law has none, nor one with
    /// [delays of many samples](Self::too_long_delay).
    ///
    /// # Errors
    /// A linear system without response, such as one that is not finite.
    pub fn margins(&self, record: &Record, altitudes: &[f64]) -> Result<Vec<MarginRow>, Error> {
        let mut rows = Vec::new();
        if self.case().law == Law::None || self.too_long_delay().is_some() {
            return Ok(rows);
        }
        let mut wanted = altitudes.iter().copied();
        let mut next = wanted.next();
        for sample in record.samples() {
            let altitude = self.angles(&sample.state).0;
            while let Some(height) = next
                && altitude <= height
            {
                rows.push(self.margins_at(sample.time, &sample.state, &sample.control)?);
                next = wanted.next();
            }
        }
        Ok(rows)
    }

    fn margins_at(&self, time: f64, state: &[f64; 13], control: &[f64; 2]) -> Result<MarginRow, Error> {
        let condition = self.condition(state);
        let [attack, sideslip] = self.loops(time, state, control)?;
        let margins = |open: &StateSpace| -> Result<Margins, Error> {
            Ok(LoopAnalysis::new(open, 0.0, FREQUENCIES, POINTS)?.margins()?)
        };
        Ok(MarginRow {
            altitude: condition.altitude,
            time,
            dynamic_pressure: condition.dynamic_pressure,
            frequency: self.vehicle().body().static_frequency(condition.mach, condition.dynamic_pressure),
            margins: [margins(&attack)?, margins(&sideslip)?],
        })
    }

    /// The sampled loops of angle of attack and sideslip at a state of a flight, each with the other one closed.
    pub(super) fn loops(
        &self,
        time: f64,
        state: &[f64; 13],
        control: &[f64; 2],
    ) -> Result<[StateSpace; 2], Error> {
        let sample_time = self.case().run.sample_time;
        // By inversion the law moves the centre of mass as masses on a cross would.
        let cross;
        let (vehicle, control, by_angles) = match self.case().masses {
            Masses::Radial { allocation: Allocation::Inversion, radius, .. } => {
                let layout = Layout::Cross { travel: 2.0 * radius };
                let [_, y, z] = self.vehicle().centre(control);
                let [_, y0, z0] = self.vehicle().body().centre();
                let by = shift(self.vehicle());
                cross = MovingMassVehicle::new(
                    self.vehicle().body().clone(),
                    layout,
                    self.vehicle().masses(),
                    0.0,
                )
                .map_err(Error::model)?;
                (&cross, [(y - y0) / by, (z - z0) / by], false)
            }
            Masses::Radial { .. } => (self.vehicle(), *control, true),
            Masses::Cross { .. } => (self.vehicle(), *control, false),
        };
        let short = ShortPeriod { vehicle, state: *state };
        let [_, pitch_rate, yaw_rate] = BodyState::of(state).spin;
        let plant = linearise(&short, time, &[0.0, 0.0, pitch_rate, yaw_rate], &control);
        let [attack, sideslip] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];
        let outputs = if by_angles { [attack, sideslip] } else { [sideslip, attack] };
        let delay = self.case().actuators.delay + self.case().sensors.delay;
        let plant = StateSpace::of_plant(&plant, &outputs)?.sampled(sample_time, delay)?;
        let law = |k: usize| -> Result<StateSpace, Error> {
            let (gains, filter_time) = self.linear_gains(k, state);
            let gain = self.case().sensors.gain;
            let gains =
                PidGains::new(gains.proportional * gain, gains.integral * gain, gains.derivative * gain);
            Ok(StateSpace::of_pid(&PidSettings { filter_time, ..PidSettings::new(gains, sample_time) })?)
        };
        let order = if by_angles { [0, 1] } else { [1, 0] };
        let laws = law(order[0])?.beside(&law(order[1])?)?;
        let open = plant.series(&laws)?;
        // The inputs are in the order of the laws, which is its own inverse.
        Ok([open.loop_at(order[0])?, open.loop_at(order[1])?])
    }

    /// Gains and filter time of the linear law of an angle that gives the same at a state.
    fn linear_gains(&self, k: usize, state: &[f64; 13]) -> (PidGains, f64) {
        let know = Knowledge { body: self.vehicle().body(), shift: shift(self.vehicle()) };
        let condition = self.condition(state);
        let none = PidGains::new(0.0, 0.0, 0.0);
        match &self.case().law {
            Law::None => (none, 0.0),
            Law::Pid { gains, filter_time } => (gains[k], *filter_time),
            Law::NonlinearPid { gains, filter_time } => {
                let (_, air) = know.body.air(state);
                let angle = angles(&air)[k].abs().max(AMPLITUDE);
                let [_, pitch_rate, yaw_rate] = BodyState::of(state).spin;
                let rate = [pitch_rate, yaw_rate][k].abs().max(AMPLITUDE);
                (gains[k].secant(angle, AMPLITUDE, rate), *filter_time)
            }
            Law::Regulator(_) => {
                let Some(schedule) = &self.design().schedule else { return (none, 0.0) };
                let [[angle, rate, integral]] = schedule.gain(condition.dynamic_pressure.max(1.0).log10());
                (PidGains::new(angle, integral, rate), 0.0)
            }
            Law::Sliding(sizes) => {
                let axis = know.axis(condition.mach, condition.dynamic_pressure.max(1.0));
                let law = sizes.law(&axis, know.shift);
                let steep = law.effectiveness_factor * (law.uncertainty + law.reaching) / law.boundary;
                let (by, lambda) = (axis.effectiveness, law.lambda);
                let integral = steep * lambda * sizes.integral / by;
                (PidGains::new((steep * lambda - axis.stiffness) / by, integral, (steep + lambda) / by), 0.0)
            }
        }
    }
}

/// Heights of a descent at which margins are looked at, m.
pub const MARGIN_HEIGHTS: [f64; 10] = [80e3, 60e3, 50e3, 40e3, 30e3, 25e3, 20e3, 15e3, 10e3, 5e3];

/// The least margins over rows and both loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastMargins {
    /// All loops are stable.
    pub stable: bool,
    /// Factor by which the gain may grow or fall; infinite where no factor reaches the limit of stability. The others alike.
    pub gain: f64,
    /// Phase, rad.
    pub phase: f64,
    /// Delay, s.
    pub delay: f64,
}

impl LeastMargins {
    /// Dynamic pressure from which margins of a case count, Pa: below it the masses do little, whatever the gains.
    pub const PRESSURE: f64 = 1e3;

    /// The least margins of some rows.
    #[must_use]
    pub fn among(rows: &[MarginRow]) -> Self {
        let least = |of: fn(&Margins) -> Option<f64>| {
            let found = rows.iter().flat_map(|row| &row.margins).filter_map(of);
            found.min_by(f64::total_cmp).unwrap_or(f64::INFINITY)
        };
        Self {
            stable: rows.iter().all(MarginRow::stable),
            gain: least(gain_either_way),
            phase: least(|m| m.phase.map(|c| c.margin)),
            delay: least(|m| m.delay.map(|c| c.margin)),
        }
    }

    /// The least margins of a case at the [heights](MARGIN_HEIGHTS) that it passes with at least [`PRESSURE`](Self::PRESSURE), with each of
    /// some sets of damping derivatives.
    ///
    /// # Errors
    /// Those of [`Descent::new`], [`Descent::fly`] and [`Descent::margins`]; delays too long for margins.
    pub fn of(case: &Case, damping: &[DampingSet], record: &mut Record) -> Result<Self, Error> {
        let mut rows = Vec::new();
        for damping in damping {
            let mut case = case.clone();
            case.vehicle.damping = *damping;
            let descent = Descent::new(&case)?;
            if let Some(samples) = descent.too_long_delay() {
                return Err(Error::in_mission(without_margins(samples)));
            }
            descent.fly(record)?;
            let found = descent.margins(record, &MARGIN_HEIGHTS)?;
            rows.extend(found.into_iter().filter(|row| row.dynamic_pressure >= Self::PRESSURE));
        }
        Ok(Self::among(&rows))
    }
}

impl MarginRow {
    /// Returns true if both loops are stable.
    #[must_use]
    pub fn stable(&self) -> bool {
        self.margins.iter().all(|m| m.stable)
    }

    /// Gain margin (least factor, either way), phase margin (deg), delay margin (s) and the frequency of the phase margin (Hz): the least of both
    /// loops.
    #[must_use]
    pub fn least(&self) -> [Option<f64>; 4] {
        let least =
            |of: fn(&Margins) -> Option<f64>| self.margins.iter().filter_map(of).min_by(f64::total_cmp);
        [
            least(gain_either_way),
            least(|m| m.phase.map(|c| c.margin.to_degrees())),
            least(|m| m.delay.map(|c| c.margin)),
            least(|m| m.phase.map(|c| c.frequency / TAU)),
        ]
    }
}

/// Says that delays of so many samples are too long for margins.
pub(super) fn without_margins(samples: f64) -> String {
    format!(
        "`actuator_delay_s` and `sensor_delay_s` together are {samples:.0} samples of the law; margins and root locus are given for at \
         most {MOST_DELAY:.0}: raise `sample_time_s` or shorten the delays for them"
    )
}

/// The factor by which the gain may grow, or fall, whichever is less.
fn gain_either_way(m: &Margins) -> Option<f64> {
    let (up, down) = (m.gain.map(|c| c.margin), m.gain_reduction.map(|c| 1.0 / c.margin));
    match (up, down) {
        (Some(up), Some(down)) => Some(up.min(down)),
        (up, down) => up.or(down),
    }
}
