//! The data of a closed-loop descent.

use apsides_control::pid::PidGains;
use apsides_dynamics::aerodynamics::{
    AxisymmetricAerodynamics, Damping, Interpolation, MachAlphaTable, MachLaw,
};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia, RigidBody, Start, Wind};
use apsides_dynamics::{Atmosphere, DynamicsError, Ellipsoid, MovingMassVehicle};

use super::law::Law;

/// A closed-loop descent: what flies, where, and under which law. SI units, rad.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The capsule.
    pub vehicle: Vehicle,
    /// Its moving masses.
    pub masses: Masses,
    /// The part of their motion that the capsule feels.
    pub mass_model: MassModel,
    /// The law that commands them.
    pub law: Law,
    /// Limits of the actuators that follow the commands.
    pub actuators: ActuatorLimits,
    /// Errors of the sensors through which the law sees the flight.
    pub sensors: SensorErrors,
    /// State in which the flight starts.
    pub entry: Entry,
    /// Ground and gravity.
    pub earth: Earth,
    /// Wind towards north and east at 12 km, m/s; three tenths of it at the ground, none from 30 km on.
    pub wind: [f64; 2],
    /// Steps and ends.
    pub run: Run,
}

/// The capsule: a command module of Apollo to scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Mass with the moving masses, kg.
    pub mass: f64,
    /// Diameter, m.
    pub diameter: f64,
    /// Radii of gyration about the roll axis and across it, m, with the moving masses on the axis.
    pub gyration: [f64; 2],
    /// Centre of mass ahead of the table's point of reference, diameters.
    pub station: f64,
    /// Offset of the centre of mass from the axis along y and z, m, with the moving masses neutral.
    pub offset: [f64; 2],
    /// Between the knots of the table.
    pub interpolation: Interpolation,
    /// The set of damping derivatives.
    pub damping: DampingSet,
    /// Factor on the damping in pitch and yaw.
    pub damping_factor: f64,
}

/// Sets of damping derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DampingSet {
    /// Damps at all Mach numbers: [`Damping::constant`].
    Constant,
    /// Drives the oscillation between Mach 0.6 and 2.5: [`Damping::unstable`].
    Unstable,
}

/// The way in which commands of a law become positions on a rim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Allocation {
    /// The law commands a centre of mass, and the angles follow in closed form.
    Inversion,
    /// The law of each axis commands an angle: that of the attack the first, that of the sideslip the second.
    Angles,
}

/// Two moving masses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Masses {
    /// The first along y, the second along z.
    Cross {
        /// Each mass, kg.
        mass: f64,
        /// Least and greatest position, m.
        travel: [f64; 2],
    },
    /// Both on a rim.
    Radial {
        /// Each mass, kg.
        mass: f64,
        /// Radius of the rim, m.
        radius: f64,
        /// Angles at the start, and those that commands of [`Allocation::Angles`] count from, rad.
        neutral: [f64; 2],
        /// The way in which commands become angles.
        allocation: Allocation,
        /// Angle between the masses at which they touch, rad; 0 lets them pass each other.
        least_separation: f64,
    },
}

/// The part of the masses' motion that the capsule feels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MassModel {
    /// The centre of mass alone moves, as in the paper: inertia and momentum are those with both masses on the axis.
    QuasiStatic,
    /// Momentum and inertia of the masses, too: the capsule recoils when they start, stop and turn with it.
    Full {
        /// Plane of the masses ahead of the centre of mass, m. A mass that moves across in front of the centre turns the capsule by its
        /// momentum.
        station: f64,
    },
}

/// Limits of the actuators; along the rim for masses on one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorLimits {
    /// Largest speed, m/s; none where it is not limited.
    pub rate: Option<f64>,
    /// Largest acceleration, m/s2; none where it is not limited.
    pub acceleration: Option<f64>,
    /// Time from a command to its effect, s.
    pub delay: f64,
    /// Full width of the play, m.
    pub backlash: f64,
}

impl ActuatorLimits {
    /// Commands are followed at once.
    pub const IDEAL: Self = Self { rate: None, acceleration: None, delay: 0.0, backlash: 0.0 };
}

/// Errors of what the law sees: angle of attack, sideslip, pitch and yaw rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorErrors {
    /// Standard deviation of the angles, rad.
    pub angle_noise: f64,
    /// Standard deviation of the rates, rad/s.
    pub rate_noise: f64,
    /// Factor on all that is seen.
    pub gain: f64,
    /// Constant error of both angles, rad.
    pub angle_bias: f64,
    /// Age of what is seen, s.
    pub delay: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl SensorErrors {
    /// The truth.
    pub const NONE: Self =
        Self { angle_noise: 0.0, rate_noise: 0.0, gain: 1.0, angle_bias: 0.0, delay: 0.0, seed: 0 };

    pub(super) fn is_none(&self) -> bool {
        *self == Self { seed: self.seed, ..Self::NONE }
    }
}

/// The state in which a descent starts: [`Start`].
pub type Entry = Start;

/// Ground and gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Earth {
    /// A plane with the normal gravity at the latitude of the entry.
    Flat,
    /// The rotating ellipsoid.
    Ellipsoid,
}

/// The cause of saturation that the integrals of PID laws are protected against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AntiWindupBy {
    /// The ends of the travel.
    Travel,
    /// Whatever keeps the actuators from the command.
    Actuators,
}

/// Steps and ends of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Time between samples of the law, s.
    pub sample_time: f64,
    /// Steps of the integration per sample.
    pub substeps: usize,
    /// Height at which a run ends, m.
    pub stop_altitude: f64,
    /// Longest run, s.
    pub time_limit: f64,
    /// Heights over which angles are judged, lower first, m.
    pub window: [f64; 2],
    /// Total angle of attack from which the capsule tumbles, rad.
    pub tumbling: f64,
    /// The saturation that integrals are protected against.
    pub anti_windup: AntiWindupBy,
}

impl Case {
    /// The cross of the reference with two masses of a size (kg): 500 kg, centre of mass 1 cm off along y and z, PID (10 m/rad,
    /// 5 m/(rad s), 5 m s/rad), ideal actuators.
    #[must_use]
    pub fn cross(mass: f64) -> Self {
        Self::reference(Masses::Cross { mass, travel: [-0.7, 0.7] })
    }

    /// The rim of the reference with two masses of a size (kg), by inversion.
    #[must_use]
    pub fn radial(mass: f64) -> Self {
        Self::reference(Masses::Radial {
            mass,
            radius: 0.75,
            neutral: [std::f64::consts::PI, 0.0],
            allocation: Allocation::Inversion,
            least_separation: 0.0,
        })
    }

    fn reference(masses: Masses) -> Self {
        let latitude = 35_f64.to_radians();
        let angle = 2_f64.to_radians();
        Self {
            vehicle: Vehicle {
                mass: 500.0,
                diameter: 1.5,
                gyration: [0.4488, 0.4128],
                station: 0.2406,
                offset: [0.01; 2],
                interpolation: Interpolation::Linear,
                damping: DampingSet::Constant,
                damping_factor: 1.0,
            },
            masses,
            mass_model: MassModel::QuasiStatic,
            law: Law::pid(PidGains::new(10.0, 5.0, 5.0)),
            actuators: ActuatorLimits::IDEAL,
            sensors: SensorErrors::NONE,
            entry: Start {
                latitude,
                altitude: 100e3,
                speed: 700.0,
                path: -85_f64.to_radians(),
                attack: angle,
                sideslip: angle,
                ..Start::default()
            },
            earth: Earth::Flat,
            wind: [0.0; 2],
            run: Run {
                sample_time: 0.01,
                substeps: 1,
                stop_altitude: 3e3,
                time_limit: 600.0,
                window: [3e3, 20e3],
                tumbling: std::f64::consts::FRAC_PI_2,
                anti_windup: AntiWindupBy::Travel,
            },
        }
    }

    /// Farthest distance of the centre of mass from where it is with neutral masses, m: along one axis of a cross, in any direction on a rim.
    #[must_use]
    pub fn authority(&self) -> f64 {
        match self.masses {
            Masses::Cross { mass, travel } => mass * travel[1].min(-travel[0]) / self.vehicle.mass,
            Masses::Radial { mass, radius, least_separation, .. } => {
                2.0 * mass * radius * (0.5 * least_separation).cos() / self.vehicle.mass
            }
        }
    }

    /// The capsule without its moving masses' freedom.
    pub(super) fn body(&self) -> Result<RigidBody, DynamicsError> {
        let v = &self.vehicle;
        let mut damping = match v.damping {
            DampingSet::Constant => Damping::constant(),
            DampingSet::Unstable => Damping::unstable(),
        };
        match &mut damping.pitch {
            MachLaw::Constant(value) => *value *= v.damping_factor,
            MachLaw::Steps { values, .. } => values.iter_mut().for_each(|c| *c *= v.damping_factor),
            MachLaw::Table(_) => {}
        }
        let table = MachAlphaTable::apollo(v.interpolation);
        let aerodynamics = AxisymmetricAerodynamics::new(table, v.diameter, v.station, damping)?;
        let ground = match self.earth {
            Earth::Flat => Ground::Flat(FlatEarth::wgs84(self.entry.latitude)?),
            Earth::Ellipsoid => Ground::Ellipsoid(Ellipsoid::WGS84),
        };
        let [roll, across] = v.gyration.map(|k| v.mass * k * k);
        let inertia = Inertia::principal([roll, across, across])?;
        let centre = [0.0, v.offset[0], v.offset[1]];
        let atmosphere = Atmosphere::UsStandard1976;
        let body = RigidBody::new(ground, atmosphere, aerodynamics, v.mass, inertia, centre)?;
        let [north, east] = self.wind;
        if north == 0.0 && east == 0.0 {
            return Ok(body);
        }
        let profile = |at: f64| [0.3 * at, at, 0.0];
        Ok(body.in_wind(Wind::new(&[0.0, 12e3, 30e3], &profile(north), &profile(east))?))
    }

    /// The capsule with its moving masses. The quasi-static model does not depend on their station.
    pub(super) fn vehicle(&self) -> Result<MovingMassVehicle, DynamicsError> {
        let (layout, mass) = match self.masses {
            Masses::Cross { mass, travel } => {
                (Layout::Cross { travel: travel[0].abs().max(travel[1].abs()) }, mass)
            }
            Masses::Radial { mass, radius, .. } => (Layout::Radial { radius }, mass),
        };
        let station = match self.mass_model {
            MassModel::QuasiStatic => 0.0,
            MassModel::Full { station } => station,
        };
        MovingMassVehicle::new(self.body()?, layout, [mass; 2], station)
    }
}
