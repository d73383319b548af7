//! Laws: from the angles that are seen to commands for the masses.

use std::f64::consts::PI;

use apsides_control::allocation::{CrossLayout, RadialLayout};
use apsides_control::controller::Controller;
use apsides_control::linear::Plant;
use apsides_control::lqr::lqr;
use apsides_control::nonlinear_pid::NonlinearPid;
use apsides_control::pid::{Pid, PidSettings};
use apsides_control::schedule::GainSchedule;
use apsides_control::sensor::{Sensor, SensorSettings, control_steps};
use apsides_control::sliding::SlidingMode;
use apsides_dynamics::{MovingMassVehicle, RigidBody};

use super::case::{Allocation, AntiWindupBy, Case, Masses};
use super::law::{Law, RegulatorSizes, SlidingSizes};
use super::state::BodyState;
use apsides_pipeline::Error;

/// Angle of attack and sideslip of a velocity relative to the air in body axes, rad.
#[inline]
pub(super) fn angles([u, v, w]: &[f64; 3]) -> [f64; 2] {
    [w.atan2(*u), v.atan2(u.hypot(*w))]
}

/// Angular acceleration of one axis by its angle and by the distance of a mass: `a'' = -stiffness a + effectiveness s`.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisModel {
    pub(super) stiffness: f64,
    pub(super) effectiveness: f64,
}

/// Dynamic pressures over which regulators are scheduled, Pa: less moves nothing, more is not met.
const PRESSURES: [f64; 2] = [1.0, 1e5];
/// Rows of their schedule.
const ROWS: usize = 26;
/// Mach number whose slope of the moment regulators are designed with: near the largest dynamic pressure.
const DESIGN_MACH: f64 = 2.41;

/// The vehicle as laws know it: its aerodynamics, and how far a mass moves the centre of mass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knowledge<'a> {
    pub(super) body: &'a RigidBody,
    /// Shift of the centre of mass per distance of a mass.
    pub(super) shift: f64,
}

impl Knowledge<'_> {
    /// The axis at a Mach number and a dynamic pressure (Pa).
    pub(super) fn axis(&self, mach: f64, pressure: f64) -> AxisModel {
        let aerodynamics = self.body.aerodynamics();
        let at = aerodynamics.coefficients(mach, 0.0);
        let force = pressure * aerodynamics.area() / self.body.inertia().matrix()[1][1];
        AxisModel {
            stiffness: -at.moment_by_angle * force * aerodynamics.diameter(),
            effectiveness: at.axial * force * self.shift,
        }
    }

    /// The gains of a regulator by the logarithm of the dynamic pressure.
    fn schedule(&self, sizes: &RegulatorSizes) -> Result<GainSchedule<3, 1>, Error> {
        let [least, most] = PRESSURES.map(f64::log10);
        let cost = |size: f64| 1.0 / (size * size);
        let mut q = [[0.0; 3]; 3];
        for (k, size) in [sizes.angle, sizes.rate, sizes.integral].into_iter().enumerate() {
            q[k][k] = cost(size);
        }
        let row = |k: usize| -> Result<(f64, [[f64; 3]; 1]), Error> {
            let s = least + (most - least) * k as f64 / (ROWS - 1) as f64;
            let AxisModel { stiffness, effectiveness } = self.axis(DESIGN_MACH, 10_f64.powf(s));
            let a = [[0.0, 1.0, 0.0], [-stiffness, 0.0, 0.0], [1.0, 0.0, 0.0]];
            let plant = Plant { a, b: [[0.0], [effectiveness], [0.0]] };
            Ok((s, lqr(&plant, &q, &[[cost(sizes.travel)]])?.gain))
        };
        Ok(GainSchedule::new((0..ROWS).map(row).collect::<Result<_, _>>()?)?)
    }
}

/// The part of a law that is computed once for all flights of a case.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) schedule: Option<GainSchedule<3, 1>>,
}

impl Design {
    pub(super) fn new(case: &Case, vehicle: &MovingMassVehicle) -> Result<Self, Error> {
        let know = Knowledge { body: vehicle.body(), shift: shift(vehicle) };
        Ok(Self {
            schedule: match &case.law {
                Law::Regulator(sizes) => Some(know.schedule(sizes)?),
                _ => None,
            },
        })
    }
}

/// Shift of the centre of mass per distance of a mass.
pub(super) fn shift(vehicle: &MovingMassVehicle) -> f64 {
    vehicle.masses()[0] / vehicle.body().mass()
}

/// The law of one angle with its memory.
enum Axis<'a> {
    None,
    Pid(Pid),
    Nonlinear(NonlinearPid),
    Regulator { schedule: &'a GainSchedule<3, 1>, integral: f64, before: f64, wanted: f64, limit: f64 },
    Sliding { sizes: SlidingSizes, integral: f64, limit: f64 },
}

/// Angle, its rate, dynamic pressure and Mach number as an axis sees them.
#[derive(Clone, Copy)]
struct Seen {
    angle: f64,
    rate: f64,
    pressure: f64,
    mach: f64,
}

impl Axis<'_> {
    fn output(&mut self, know: &Knowledge<'_>, sample_time: f64, seen: Seen) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Pid(pid) => pid.update(-seen.angle),
            Self::Nonlinear(pid) => pid.update(-seen.angle),
            Self::Regulator { schedule, integral, before, wanted, limit } => {
                *before = *integral;
                *integral += sample_time * seen.angle;
                let s = seen.pressure.max(PRESSURES[0]).log10();
                let [u] = schedule.control(s, &[seen.angle, seen.rate, *integral], &[0.0; 3]);
                *wanted = u;
                let limited = u.clamp(-*limit, *limit);
                self.track(limited);
                limited
            }
            Self::Sliding { sizes, integral, limit } => {
                let axis = know.axis(seen.mach, seen.pressure.max(PRESSURES[0]));
                let law = sizes.law(&axis, know.shift);
                let free = -axis.stiffness * seen.angle;
                let grown = *integral + sample_time * seen.angle;
                let wanted = law.control(seen.angle + sizes.integral * grown, seen.rate, free);
                let limited = wanted.clamp(-*limit, *limit);
                // The integral stops where the command is beyond its limit, and where the layer is left.
                let surface = law.surface(seen.angle + sizes.integral * grown, seen.rate);
                if wanted == limited && surface.abs() < law.boundary {
                    *integral = grown;
                }
                limited
            }
        }
    }

    /// Says how much of the last output was reached.
    fn track(&mut self, reached: f64) {
        match self {
            Self::None | Self::Sliding { .. } => {}
            Self::Pid(pid) => pid.track(reached),
            Self::Nonlinear(pid) => pid.track(reached),
            Self::Regulator { integral, before, wanted, .. } => {
                // The integral acts with a negative sign: no integration that drives further beyond the limit.
                if (*integral - *before) * (reached - *wanted) > 0.0 {
                    *integral = *before;
                }
            }
        }
    }
}

impl SlidingSizes {
    /// The law at a state of the axis.
    pub(super) fn law(&self, axis: &AxisModel, shift: f64) -> SlidingMode {
        SlidingMode {
            lambda: self.bandwidth,
            reaching: self.reaching,
            uncertainty: axis.effectiveness / shift * self.offset,
            effectiveness: axis.effectiveness,
            effectiveness_factor: self.factor,
            boundary: self.boundary,
        }
    }
}

enum Place {
    Neutral([f64; 2]),
    Cross,
    Inversion { rim: RadialLayout, before: [f64; 2], shift: f64 },
    Angles { rim: RadialLayout, neutral: [f64; 2] },
}

/// The law of a descent with its memory: from the state to commands for the masses.
pub(super) struct SteeringLaw<'a> {
    know: Knowledge<'a>,
    axes: [Axis<'a>; 2],
    place: Place,
    sensor: Option<Sensor<4>>,
    gain: f64,
    sample_time: f64,
    tracks: bool,
    needs_flow: bool,
}

impl<'a> SteeringLaw<'a> {
    pub(super) fn new(
        case: &Case,
        vehicle: &'a MovingMassVehicle,
        design: &'a Design,
    ) -> Result<Self, Error> {
        let know = Knowledge { body: vehicle.body(), shift: shift(vehicle) };
        let sample_time = case.run.sample_time;
        // Of the angle of attack, then of the sideslip: it moves the mass on z, then that on y.
        let (limits, limit) = match case.masses {
            Masses::Cross { travel, .. } => (travel, travel[1].max(-travel[0])),
            Masses::Radial { radius, allocation: Allocation::Inversion, .. } => {
                ([-2.0 * radius, 2.0 * radius], 2.0 * radius)
            }
            // Half a turn from neutral: all places of the rim.
            Masses::Radial { .. } => ([-PI, PI], PI),
        };
        let axis = |k: usize| -> Result<Axis<'a>, Error> {
            Ok(match &case.law {
                Law::None => Axis::None,
                Law::Pid { gains, filter_time } => Axis::Pid(Pid::new(PidSettings {
                    limits,
                    filter_time: *filter_time,
                    ..PidSettings::new(gains[k], sample_time)
                })?),
                Law::NonlinearPid { gains, filter_time } => {
                    Axis::Nonlinear(NonlinearPid::new(gains[k], sample_time, *filter_time, limits)?)
                }
                Law::Regulator(_) => match &design.schedule {
                    Some(schedule) => {
                        Axis::Regulator { schedule, integral: 0.0, before: 0.0, wanted: 0.0, limit }
                    }
                    None => Axis::None,
                },
                Law::Sliding(sizes) => {
                    sizes.law(&know.axis(DESIGN_MACH, PRESSURES[0]), know.shift).checked()?;
                    Axis::Sliding { sizes: *sizes, integral: 0.0, limit }
                }
            })
        };
        let place = match case.masses {
            Masses::Radial { neutral, .. } if case.law == Law::None => Place::Neutral(neutral),
            Masses::Cross { mass, travel } => {
                CrossLayout::new(mass, case.vehicle.mass, [travel; 2])?;
                Place::Cross
            }
            Masses::Radial { mass, radius, neutral, allocation, least_separation } => {
                let rim = RadialLayout::new(mass, case.vehicle.mass, radius, least_separation)?;
                match allocation {
                    Allocation::Inversion => Place::Inversion { rim, before: neutral, shift: know.shift },
                    Allocation::Angles => Place::Angles { rim, neutral },
                }
            }
        };
        let errors = &case.sensors;
        let sensor = (!errors.is_none())
            .then(|| -> Result<_, Error> {
                let (angle, rate) = (errors.angle_noise, errors.rate_noise);
                Ok(Sensor::new(SensorSettings {
                    noise: [angle, angle, rate, rate],
                    bias: [errors.angle_bias, errors.angle_bias, 0.0, 0.0],
                    interval: 1,
                    delay: control_steps(errors.delay, sample_time)?,
                    seed: errors.seed,
                })?)
            })
            .transpose()?;
        Ok(Self {
            know,
            axes: [axis(0)?, axis(1)?],
            place,
            sensor,
            gain: errors.gain,
            sample_time,
            tracks: case.run.anti_windup == AntiWindupBy::Actuators,
            needs_flow: matches!(case.law, Law::Regulator(_) | Law::Sliding(_)),
        })
    }
}

impl Controller<13, 2> for SteeringLaw<'_> {
    fn command(&mut self, _t: f64, x: &[f64; 13]) -> [f64; 2] {
        let (altitude, air) = self.know.body.air(x);
        let [attack, sideslip] = angles(&air);
        // The angle of attack grows with the pitch rate, the sideslip with the negative yaw rate.
        let [_, pitch_rate, yaw_rate] = BodyState::of(x).spin;
        let mut seen = [attack, sideslip, pitch_rate, -yaw_rate];
        if let Some(sensor) = &mut self.sensor {
            seen = sensor.measure(&seen).map(|s| s * self.gain);
        }
        let (mut pressure, mut mach) = (0.0, 0.0);
        if self.needs_flow {
            let speed = air.iter().map(|c| c * c).sum::<f64>().sqrt();
            pressure = 0.5 * self.know.body.atmosphere.density(altitude) * speed * speed;
            mach = speed / self.know.body.atmosphere.speed_of_sound(altitude);
        }
        let outputs: [f64; 2] = std::array::from_fn(|k| {
            let seen = Seen { angle: seen[k], rate: seen[2 + k], pressure, mach };
            self.axes[k].output(&self.know, self.sample_time, seen)
        });
        let [by_attack, by_sideslip] = outputs;
        match &mut self.place {
            Place::Neutral(neutral) => *neutral,
            Place::Cross => [by_sideslip, by_attack],
            Place::Inversion { rim, before, shift } => {
                let found = rim.invert(&[by_sideslip * *shift, by_attack * *shift], before);
                if found.positions.iter().all(|p| p.is_finite()) {
                    *before = found.positions;
                }
                if found.saturated {
                    self.axes[0].track(found.centre[1] / *shift);
                    self.axes[1].track(found.centre[0] / *shift);
                }
                found.positions
            }
            Place::Angles { rim, neutral } => rim.direct(neutral, &outputs).positions,
        }
    }

    fn reached(&mut self, control: &[f64; 2]) {
        if !self.tracks {
            return;
        }
        let [by_attack, by_sideslip] = match &self.place {
            Place::Neutral(_) => return,
            Place::Cross => [control[1], control[0]],
            Place::Inversion { rim, shift, .. } => {
                let [y, z] = rim.centre(control);
                [z / shift, y / shift]
            }
            Place::Angles { neutral, .. } => [control[0] - neutral[0], control[1] - neutral[1]],
        };
        self.axes[0].track(by_attack);
        self.axes[1].track(by_sideslip);
    }
}
