//! Descents of a capsule that is steered by two internal masses, after Karimabadeh and Tayefi: simulated under a law.

use apsides_control::nonlinear_pid::NonlinearGains;
use apsides_control::pid::PidGains;
use apsides_dynamics::aerodynamics::Interpolation;

use super::{Flown, Kind, Simulated};
use crate::Error;
use crate::key::Values;
use crate::moving_mass::{
    ActuatorLimits, Allocation, AntiWindupBy, Case, DampingSet, Descent, Earth, Entry, Law, Masses,
    RegulatorSizes, Run, SensorErrors, SlidingSizes, Vehicle,
};

mod keys;

pub(super) const CROSS: Kind = Kind {
    name: "moving-mass-cross",
    title: "Descent of a capsule whose angles are held by two masses that move across its axis",
    flight_keys: &[
        keys::VEHICLE,
        keys::MASSES,
        keys::CROSS,
        keys::LAW,
        keys::ACTUATORS,
        keys::SENSORS,
        keys::ENTRY,
        keys::RUN,
    ],
    check: |v| check(v, cross),
    flown: Flown::Simulated(Simulated { case: |v, seed| case(v, cross(v), seed).map_err(Error::in_mission) }),
};

pub(super) const RADIAL: Kind = Kind {
    name: "moving-mass-radial",
    title: "Descent of a capsule whose angles are held by two masses that move along a rim about its axis",
    flight_keys: &[
        keys::VEHICLE,
        keys::MASSES,
        keys::RADIAL,
        keys::LAW,
        keys::ACTUATORS,
        keys::SENSORS,
        keys::ENTRY,
        keys::RUN,
    ],
    check: |v| check(v, radial),
    flown: Flown::Simulated(Simulated {
        case: |v, seed| case(v, radial(v), seed).map_err(Error::in_mission),
    }),
};

fn check(v: &Values, masses: fn(&Values) -> Masses) -> Result<(), String> {
    Descent::new(&case(v, masses(v), 0)?).map(|_| ()).map_err(|e| e.to_string())
}

fn radians(v: &Values, path: &str) -> f64 {
    v.number(path).to_radians()
}

fn cross(v: &Values) -> Masses {
    Masses::Cross {
        mass: v.number("moving_mass_kg"),
        travel: [v.number("least_travel_m"), v.number("largest_travel_m")],
    }
}

fn radial(v: &Values) -> Masses {
    Masses::Radial {
        mass: v.number("moving_mass_kg"),
        radius: v.number("rim_radius_m"),
        neutral: [radians(v, "neutral_1_deg"), radians(v, "neutral_2_deg")],
        allocation: match v.word("allocation") {
            keys::ANGLES => Allocation::Angles,
            _ => Allocation::Inversion,
        },
        least_separation: radians(v, "least_separation_deg"),
    }
}

fn case(v: &Values, masses: Masses, seed: u64) -> Result<Case, String> {
    let [stop, top] = ["stop_altitude_km", "window_top_km"].map(|key| v.number(key) * 1e3);
    if stop >= v.number("entry_altitude_km") * 1e3 {
        return Err("`stop_altitude_km` must be below `entry_altitude_km`".into());
    }
    if top <= stop {
        return Err("`window_top_km` must be above `stop_altitude_km`".into());
    }
    if let Masses::Cross { travel: [least, most], .. } = masses
        && least >= most
    {
        return Err("`least_travel_m` must be below `largest_travel_m`".into());
    }
    Ok(Case {
        vehicle: Vehicle {
            mass: v.number("vehicle_mass_kg"),
            diameter: v.number("diameter_m"),
            gyration: [v.number("roll_gyration_radius_m"), v.number("pitch_gyration_radius_m")],
            station: v.number("centre_of_mass_station"),
            offset: [v.number("offset_y_m"), v.number("offset_z_m")],
            interpolation: match v.word("coefficients") {
                keys::SMOOTH => Interpolation::Smooth,
                _ => Interpolation::Linear,
            },
            damping: match v.word("damping") {
                keys::UNSTABLE => DampingSet::Unstable,
                _ => DampingSet::Constant,
            },
            damping_factor: v.number("damping_factor"),
        },
        masses,
        law: law(v)?,
        actuators: ActuatorLimits {
            rate: v.number("rate_limit_m_s"),
            acceleration: v.number("acceleration_limit_m_s2"),
            delay: v.number("actuator_delay_s"),
            backlash: v.number("backlash_m"),
        },
        sensors: SensorErrors {
            angle_noise: radians(v, "angle_noise_deg"),
            rate_noise: radians(v, "rate_noise_deg_s"),
            gain: v.number("sensor_gain"),
            angle_bias: radians(v, "angle_bias_deg"),
            delay: v.number("sensor_delay_s"),
            seed,
        },
        entry: Entry {
            longitude: radians(v, "entry_longitude_deg"),
            latitude: radians(v, "entry_latitude_deg"),
            altitude: v.number("entry_altitude_km") * 1e3,
            speed: v.number("entry_speed_m_s"),
            path: radians(v, "entry_path_angle_deg"),
            azimuth: radians(v, "entry_azimuth_deg"),
            bank: 0.0,
            attack: radians(v, "entry_attack_deg"),
            sideslip: radians(v, "entry_sideslip_deg"),
            spin: [radians(v, "entry_roll_rate_deg_s"), 0.0, 0.0],
        },
        earth: match v.word("earth") {
            keys::ELLIPSOID => Earth::Ellipsoid,
            _ => Earth::Flat,
        },
        wind: [v.number("wind_north_m_s"), v.number("wind_east_m_s")],
        run: Run {
            sample_time: v.number("sample_time_s"),
            substeps: v.count("steps_per_sample"),
            stop_altitude: stop,
            time_limit: v.number("time_limit_s"),
            window: [stop, top],
            tumbling: radians(v, "tumbling_angle_deg"),
            anti_windup: match v.word("anti_windup") {
                keys::BY_ACTUATORS => AntiWindupBy::Actuators,
                _ => AntiWindupBy::Travel,
            },
        },
    })
}

fn law(v: &Values) -> Result<Law, String> {
    let filter_time = v.number("derivative_filter_s");
    Ok(match v.word("law") {
        keys::NONE => Law::None,
        keys::NONLINEAR_PID => Law::NonlinearPid {
            gains: [coefficients(v, "nonlinear_pid.attack")?, coefficients(v, "nonlinear_pid.sideslip")?],
            filter_time,
        },
        keys::LQR => Law::Regulator(RegulatorSizes {
            angle: radians(v, "lqr.angle_deg"),
            rate: radians(v, "lqr.rate_deg_s"),
            integral: radians(v, "lqr.integral_deg_s"),
            travel: v.number("lqr.travel_m"),
        }),
        keys::SLIDING => Law::Sliding(SlidingSizes {
            bandwidth: v.number("sliding.bandwidth"),
            integral: v.number("sliding.integral"),
            reaching: radians(v, "sliding.reaching_deg_s2"),
            offset: v.number("sliding.offset_m"),
            factor: v.number("sliding.effectiveness_factor"),
            boundary: radians(v, "sliding.boundary_deg_s"),
        }),
        _ => {
            let gains = |angle: [&str; 3]| {
                let [p, i, d] = angle.map(|key| v.number(key));
                PidGains::new(p, i, d)
            };
            let attack = gains(["pid.attack_p", "pid.attack_i", "pid.attack_d"]);
            let sideslip = gains(["pid.sideslip_p", "pid.sideslip_i", "pid.sideslip_d"]);
            Law::Pid { gains: [attack, sideslip], filter_time }
        }
    })
}

/// Twelve numbers of a text.
fn coefficients(v: &Values, path: &str) -> Result<NonlinearGains, String> {
    let text = v.word(path);
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    match numbers.ok().and_then(|n| <[f64; 12]>::try_from(n).ok()) {
        Some(c) => Ok(NonlinearGains::from_coefficients(&c)),
        None => Err(format!("`{path}` is \"{text}\", allowed is {}", keys::TWELVE)),
    }
}
