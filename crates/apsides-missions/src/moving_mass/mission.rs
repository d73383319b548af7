//! Descents of a capsule that is steered by two internal masses, after Karimabadeh and Tayefi: simulated under a law.

use apsides_control::nonlinear_pid::NonlinearGains;
use apsides_control::pid::PidGains;
use apsides_dynamics::Ellipsoid;
use apsides_dynamics::aerodynamics::Interpolation;
use apsides_ephemeris::{About, Axes};
use apsides_pipeline::key::Key;
use apsides_pipeline::mission::downcast;
use apsides_pipeline::placing::Whereabouts;
use apsides_pipeline::simulation::Watch;
use apsides_pipeline::values::Values;
use apsides_pipeline::{Error, Kind, Mission, Offers, Outcome, Pipeline, Simulated};

use super::case::{
    ActuatorLimits, Allocation, AntiWindupBy, Case, DampingSet, Earth, Entry, MassModel, Masses, Run,
    SensorErrors, Vehicle,
};
use super::descent::Descent;
use super::dispersion::Descents;
use super::keys;
use super::law::{Law, RegulatorSizes, SlidingSizes};
use super::simulation::simulate;

/// The descent of a capsule whose angles are held by two masses that move across its axis.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossMasses {
    /// The closed-loop descent; its masses are [`Masses::Cross`].
    pub case: Case,
}

/// The descent of a capsule whose angles are held by two masses that move along a rim about its axis.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialMasses {
    /// The closed-loop descent; its masses are [`Masses::Radial`].
    pub case: Case,
}

/// The closed-loop case of a mission that was read, with the seed of the mission for the noise of its sensors.
///
/// # Errors
/// A mission that is optimised, and one that has no moving masses.
pub fn case(mission: &Pipeline) -> Result<Case, Error> {
    let Some(case) = case_of(mission.mission()) else {
        let kind = mission.kind();
        return Err(kind.refused(match mission.is_simulated() {
            true => "it has no moving masses",
            false => "it is optimised, not simulated: use `apsides solve`",
        }));
    };
    Ok(seeded(case, mission.seed()))
}

/// The closed-loop case of a mission with moving masses; none of another mission.
#[must_use]
pub fn case_of(mission: &dyn Mission) -> Option<&Case> {
    let cross = downcast::<CrossMasses>(mission).map(|m| &m.case);
    cross.or_else(|| downcast::<RadialMasses>(mission).map(|m| &m.case))
}

fn seeded(case: &Case, seed: u64) -> Case {
    let mut case = case.clone();
    case.sensors.seed = seed;
    case
}

const OFFERS: Offers = Offers {
    simulated_only: true,
    simulation: false,
    footprint: false,
    ephemeris: true,
    dispersed: Descents::COLUMNS,
};

impl Mission for CrossMasses {
    fn kind() -> Kind {
        const KEYS: &[&[Key]] = &[
            keys::VEHICLE,
            keys::MASSES,
            keys::CROSS,
            keys::LAW,
            keys::ACTUATORS,
            keys::SENSORS,
            keys::ENTRY,
            keys::RUN,
        ];
        let title = "Descent of a capsule whose angles are held by two masses that move across its axis";
        Kind::new::<Self>("moving-mass-cross", title, KEYS).offering(OFFERS)
    }

    fn read(values: &Values) -> Result<Self, Error> {
        Ok(Self { case: read_case(values, read_cross)? })
    }

    fn whereabouts(&self) -> Whereabouts {
        whereabouts(&self.case)
    }

    fn record_about(&self) -> Option<(About, f64)> {
        record_about(&self.case)
    }

    fn simulate(&self, seed: u64, _plan: Option<&Outcome>, watch: &Watch<'_>) -> Result<Simulated, Error> {
        simulate(&seeded(&self.case, seed), watch)
    }
}

impl Mission for RadialMasses {
    fn kind() -> Kind {
        const KEYS: &[&[Key]] = &[
            keys::VEHICLE,
            keys::MASSES,
            keys::RADIAL,
            keys::LAW,
            keys::ACTUATORS,
            keys::SENSORS,
            keys::ENTRY,
            keys::RUN,
        ];
        let title =
            "Descent of a capsule whose angles are held by two masses that move along a rim about its axis";
        Kind::new::<Self>("moving-mass-radial", title, KEYS).offering(OFFERS)
    }

    fn read(values: &Values) -> Result<Self, Error> {
        Ok(Self { case: read_case(values, read_radial)? })
    }

    fn whereabouts(&self) -> Whereabouts {
        whereabouts(&self.case)
    }

    fn record_about(&self) -> Option<(About, f64)> {
        record_about(&self.case)
    }

    fn simulate(&self, seed: u64, _plan: Option<&Outcome>, watch: &Watch<'_>) -> Result<Simulated, Error> {
        simulate(&seeded(&self.case, seed), watch)
    }
}

/// Over the ellipsoid the capsule has a place, and an attitude.
fn whereabouts(case: &Case) -> Whereabouts {
    match case.earth {
        Earth::Flat => Whereabouts::NotSo("`earth` is \"flat\", `--set earth=ellipsoid` has"),
        Earth::Ellipsoid => Whereabouts::Attitude,
    }
}

fn record_about(case: &Case) -> Option<(About, f64)> {
    let surface = Ellipsoid::WGS84;
    let about = About {
        gravitational_parameter: surface.gravitational_parameter,
        surface,
        axes: Axes::Fixed,
        loads: Vec::new(),
        site: None,
    };
    (case.earth == Earth::Ellipsoid).then_some((about, case.vehicle.mass))
}

/// The number of a key in deg, as rad.
fn radians(v: &Values, path: &str) -> Result<f64, Error> {
    v.number(path).map(f64::to_radians)
}

/// The number of a key in km, as m.
fn metres(v: &Values, path: &str) -> Result<f64, Error> {
    v.number(path).map(|km| km * 1e3)
}

fn read_cross(v: &Values) -> Result<Masses, Error> {
    let travel = [v.number("least_travel_m")?, v.number("largest_travel_m")?];
    if travel[0] >= travel[1] {
        return Err(v.conflict("`least_travel_m` must be below `largest_travel_m`"));
    }
    Ok(Masses::Cross { mass: v.number("moving_mass_kg")?, travel })
}

fn read_radial(v: &Values) -> Result<Masses, Error> {
    Ok(Masses::Radial {
        mass: v.number("moving_mass_kg")?,
        radius: v.number("rim_radius_m")?,
        neutral: [radians(v, "neutral_1_deg")?, radians(v, "neutral_2_deg")?],
        allocation: match v.word("allocation")? {
            keys::ANGLES => Allocation::Angles,
            _ => Allocation::Inversion,
        },
        least_separation: radians(v, "least_separation_deg")?,
    })
}

/// The case of values, which a descent can be made of.
fn read_case(v: &Values, masses: fn(&Values) -> Result<Masses, Error>) -> Result<Case, Error> {
    let entry = read_entry(v)?;
    let run = read_run(v, &entry)?;
    let case = Case {
        vehicle: read_vehicle(v)?,
        masses: masses(v)?,
        mass_model: match v.word("masses")? {
            keys::FULL => MassModel::Full { station: v.number("mass_station_m")? },
            _ => MassModel::QuasiStatic,
        },
        law: read_law(v)?,
        actuators: ActuatorLimits {
            rate: v.limit("rate_limit_m_s")?,
            acceleration: v.limit("acceleration_limit_m_s2")?,
            delay: v.number("actuator_delay_s")?,
            backlash: v.number("backlash_m")?,
        },
        sensors: SensorErrors {
            angle_noise: radians(v, "angle_noise_deg")?,
            rate_noise: radians(v, "rate_noise_deg_s")?,
            gain: v.number("sensor_gain")?,
            angle_bias: radians(v, "angle_bias_deg")?,
            delay: v.number("sensor_delay_s")?,
            seed: 0,
        },
        entry,
        earth: match v.word("earth")? {
            keys::ELLIPSOID => Earth::Ellipsoid,
            _ => Earth::Flat,
        },
        wind: [v.number("wind_north_m_s")?, v.number("wind_east_m_s")?],
        run,
    };
    Descent::new(&case)?;
    Ok(case)
}

fn read_vehicle(v: &Values) -> Result<Vehicle, Error> {
    Ok(Vehicle {
        mass: v.number("initial_mass_kg")?,
        diameter: v.number("diameter_m")?,
        gyration: [v.number("roll_gyration_radius_m")?, v.number("pitch_gyration_radius_m")?],
        station: v.number("centre_of_mass_station")?,
        offset: [v.number("offset_y_m")?, v.number("offset_z_m")?],
        interpolation: match v.word("coefficients")? {
            keys::SMOOTH => Interpolation::Smooth,
            _ => Interpolation::Linear,
        },
        damping: match v.word("damping")? {
            keys::UNSTABLE => DampingSet::Unstable,
            _ => DampingSet::Constant,
        },
        damping_factor: v.number("damping_factor")?,
    })
}

fn read_entry(v: &Values) -> Result<Entry, Error> {
    Ok(Entry {
        longitude: radians(v, "entry_longitude_deg")?,
        latitude: radians(v, "entry_latitude_deg")?,
        altitude: metres(v, "entry_altitude_km")?,
        speed: v.number("entry_speed_m_s")?,
        path: radians(v, "entry_path_angle_deg")?,
        azimuth: radians(v, "entry_azimuth_deg")?,
        bank: 0.0,
        attack: radians(v, "entry_attack_deg")?,
        sideslip: radians(v, "entry_sideslip_deg")?,
        spin: [radians(v, "entry_roll_rate_deg_s")?, 0.0, 0.0],
    })
}

/// Most steps of a flight: those of half a minute, with a record of a gigabyte or two.
const MOST_STEPS: f64 = 2e7;

fn read_run(v: &Values, entry: &Entry) -> Result<Run, Error> {
    let [stop, top] = [metres(v, "stop_altitude_km")?, metres(v, "window_top_km")?];
    if stop >= entry.altitude {
        return Err(v.conflict("`stop_altitude_km` must be below `entry_altitude_km`"));
    }
    if top <= stop {
        return Err(v.conflict("`window_top_km` must be above `stop_altitude_km`"));
    }
    let (sample_time, time_limit) = (v.number("sample_time_s")?, v.number("max_flight_time_s")?);
    let substeps = v.count("steps_per_sample")?;
    let steps = time_limit / sample_time * substeps as f64;
    if steps > MOST_STEPS {
        return Err(v.conflict(format!(
            "`sample_time_s`, `steps_per_sample` and `max_flight_time_s` make {steps:.1e} steps, at most {MOST_STEPS:e} are flown: \
             {substeps} every {sample_time} s for up to {time_limit} s; raise the first or lower the others"
        )));
    }
    Ok(Run {
        sample_time,
        substeps,
        stop_altitude: stop,
        time_limit,
        window: [stop, top],
        tumbling: radians(v, "tumbling_angle_deg")?,
        anti_windup: match v.word("anti_windup")? {
            keys::BY_ACTUATORS => AntiWindupBy::Actuators,
            _ => AntiWindupBy::Travel,
        },
    })
}

fn read_law(v: &Values) -> Result<Law, Error> {
    let filter_time = v.number("derivative_filter_s")?;
    Ok(match v.word("law")? {
        keys::NONE => Law::None,
        keys::NONLINEAR_PID => Law::NonlinearPid {
            gains: [
                nonlinear_gains(v, "nonlinear_pid.attack")?,
                nonlinear_gains(v, "nonlinear_pid.sideslip")?,
            ],
            filter_time,
        },
        keys::LQR => Law::Regulator(RegulatorSizes {
            angle: radians(v, "lqr.angle_deg")?,
            rate: radians(v, "lqr.rate_deg_s")?,
            integral: radians(v, "lqr.integral_deg_s")?,
            travel: v.number("lqr.travel_m")?,
        }),
        keys::SLIDING => Law::Sliding(SlidingSizes {
            bandwidth: v.number("sliding.bandwidth")?,
            integral: v.number("sliding.integral")?,
            reaching: radians(v, "sliding.reaching_deg_s2")?,
            offset: v.number("sliding.offset_m")?,
            factor: v.number("sliding.effectiveness_factor")?,
            boundary: radians(v, "sliding.boundary_deg_s")?,
        }),
        _ => {
            let attack = PidGains::new(
                v.number("pid.attack_p")?,
                v.number("pid.attack_i")?,
                v.number("pid.attack_d")?,
            );
            let sideslip = PidGains::new(
                v.number("pid.sideslip_p")?,
                v.number("pid.sideslip_i")?,
                v.number("pid.sideslip_d")?,
            );
            Law::Pid { gains: [attack, sideslip], filter_time }
        }
    })
}

/// The gains of a text of twelve numbers.
fn nonlinear_gains(v: &Values, path: &str) -> Result<NonlinearGains, Error> {
    let text = v.word(path)?;
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    match numbers.ok().and_then(|n| <[f64; 12]>::try_from(n).ok()) {
        Some(c) => Ok(NonlinearGains::from_coefficients(&c)),
        None => Err(v.conflict(format!("`{path}` is \"{text}\", allowed is {}", keys::TWELVE))),
    }
}
