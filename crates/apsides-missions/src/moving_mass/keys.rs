//! Keys of descents with moving masses.

use apsides_pipeline::key::{Key, Range};

use crate::data;

pub(super) const SMOOTH: &str = "smooth";
pub(super) const UNSTABLE: &str = "unstable";
pub(super) const FULL: &str = "full";
pub(super) const ANGLES: &str = "angles";
pub(super) const ELLIPSOID: &str = "ellipsoid";
pub(super) const BY_ACTUATORS: &str = "actuators";
pub(super) const PID: &str = "pid";
pub(super) const NONE: &str = "none";
pub(super) const NONLINEAR_PID: &str = "nonlinear-pid";
pub(super) const LQR: &str = "lqr";
pub(super) const SLIDING: &str = "sliding";
pub(super) const TWELVE: &str =
    "twelve numbers between blanks: k1 k2 mu epsilon of the error, of its integral, of its rate";

const ANY: Range = Range::open(f64::NEG_INFINITY, f64::INFINITY);

pub(super) const VEHICLE: &[Key] = &[
    data::vehicle_key("suborbital-capsule"),
    Key::named(data::VEHICLE, "initial_mass_kg", Range::POSITIVE, "mass with the moving masses"),
    Key::named(data::VEHICLE, "diameter_m", Range::POSITIVE, "diameter of the capsule"),
    Key::named(data::VEHICLE, "roll_gyration_radius_m", Range::POSITIVE, "radius of gyration about the axis"),
    Key::named(
        data::VEHICLE,
        "pitch_gyration_radius_m",
        Range::POSITIVE,
        "radius of gyration across the axis",
    ),
    Key::named(
        data::VEHICLE,
        "centre_of_mass_station",
        ANY,
        "centre of mass ahead of the point of reference of the coefficients, in diameters",
    ),
    Key::number("offset_y_m", 0.01, ANY, "offset of the centre of mass from the axis along y"),
    Key::number("offset_z_m", 0.01, ANY, "offset of the centre of mass from the axis along z"),
    Key::choice(
        "coefficients",
        &["linear", SMOOTH],
        "between the knots of the table: straight lines, as in the reference, or two continuous derivatives",
    ),
    Key::choice(
        "damping",
        &["constant", UNSTABLE],
        "damping of the rotation: -0.25 at all Mach numbers, or an assumed set that drives it between Mach 0.6 and 2.5",
    ),
    Key::number("damping_factor", 1.0, ANY, "factor on the damping in pitch and yaw"),
];

pub(super) const MASSES: &[Key] = &[
    Key::number("moving_mass_kg", 10.0, Range::POSITIVE, "each of the two moving masses"),
    Key::choice(
        "masses",
        &["quasi-static", FULL],
        "the masses move the centre of mass alone, as in the paper, or the capsule feels their momentum and inertia, too",
    ),
    Key::number(
        "mass_station_m",
        0.0,
        Range::closed(-100.0, 100.0),
        "plane of the masses ahead of the centre of mass, with `masses = \"full\"`",
    ),
];

pub(super) const CROSS: &[Key] = &[
    Key::number("least_travel_m", -0.7, Range::closed(-100.0, 0.0), "least position of each mass"),
    Key::number("largest_travel_m", 0.7, Range::closed(0.0, 100.0), "largest position of each mass"),
];

pub(super) const RADIAL: &[Key] = &[
    Key::number("rim_radius_m", 0.75, Range::POSITIVE, "radius of the rim"),
    Key::number("neutral_1_deg", 180.0, ANY, "angle of mass 1 at the start, from z towards y"),
    Key::number("neutral_2_deg", 0.0, ANY, "angle of mass 2 at the start"),
    Key::choice(
        "allocation",
        &["inversion", ANGLES],
        "the law commands a centre of mass, from which the angles follow in closed form, or the angles themselves: \
         that of mass 1 by the angle of attack, that of mass 2 by the sideslip, both from neutral",
    ),
    Key::number(
        "least_separation_deg",
        0.0,
        Range::closed(0.0, 170.0),
        "angle between the masses at which they meet, which ends the flight; 0 lets them pass each other",
    ),
];

pub(super) const LAW: &[Key] = &[
    Key::choice("law", &[PID, NONLINEAR_PID, LQR, SLIDING, NONE], "what commands the masses"),
    Key::number("pid.attack_p", 10.0, ANY, "metres (or rad of an angle) per rad of the angle of attack"),
    Key::number("pid.attack_i", 5.0, ANY, "per rad s of its integral"),
    Key::number("pid.attack_d", 5.0, ANY, "per rad/s of its rate"),
    Key::number("pid.sideslip_p", 10.0, ANY, "metres (or rad of an angle) per rad of the sideslip"),
    Key::number("pid.sideslip_i", 5.0, ANY, "per rad s of its integral"),
    Key::number("pid.sideslip_d", 5.0, ANY, "per rad/s of its rate"),
    Key::text(
        "nonlinear_pid.attack",
        "10 0 0 1 5 0 0 1 5 0 0 1",
        TWELVE,
        "coefficients of the angle of attack: k1 k2 mu epsilon of the error, of its integral, of its rate, u = (k1 + k2 / (1 + exp(mu b^2))) |b|^epsilon \
         sign(b) of each term b; all positive in the paper, which prints none. `apsides tune` with `law=nonlinear-pid` finds some",
    ),
    Key::text(
        "nonlinear_pid.sideslip",
        "10 0 0 1 5 0 0 1 5 0 0 1",
        TWELVE,
        "coefficients of the sideslip, in the same order; on the angles of a rim those that hold an offset may have to be negative",
    ),
    Key::number(
        "derivative_filter_s",
        0.0,
        Range::from(0.0),
        "time constant of the filter of PID derivatives",
    ),
    Key::choice(
        "anti_windup",
        &["travel", BY_ACTUATORS],
        "integrals stop at the ends of the travel, or whenever the actuators do not follow the command",
    ),
    Key::number("lqr.angle_deg", 0.3, Range::POSITIVE, "angle that costs one"),
    Key::number("lqr.rate_deg_s", 3.0, Range::POSITIVE, "rate that costs one"),
    Key::number("lqr.integral_deg_s", 0.3, Range::POSITIVE, "integral of the angle, deg s, that costs one"),
    Key::number("lqr.travel_m", 0.2, Range::POSITIVE, "distance of a mass that costs one"),
    Key::number("sliding.bandwidth", 3.0, Range::POSITIVE, "bandwidth of the sliding surface, 1/s"),
    Key::number(
        "sliding.integral",
        0.7,
        Range::from(0.0),
        "gain of the integral that is added to the angle, 1/s",
    ),
    Key::number("sliding.reaching_deg_s2", 0.2, Range::POSITIVE, "acceleration towards the surface, deg/s2"),
    Key::number(
        "sliding.offset_m",
        0.015,
        Range::from(0.0),
        "offset of the centre of mass that the law stands",
    ),
    Key::number(
        "sliding.effectiveness_factor",
        1.2,
        Range::from(1.0),
        "largest factor between the true and the assumed effect of a mass",
    ),
    Key::number("sliding.boundary_deg_s", 8.0, Range::POSITIVE, "half the boundary layer"),
];

pub(super) const ACTUATORS: &[Key] = &[
    Key::number("rate_limit_m_s", f64::INFINITY, Range::POSITIVE_OR_UNLIMITED, "largest speed of a mass"),
    Key::number(
        "acceleration_limit_m_s2",
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "largest acceleration of a mass",
    ),
    Key::number("actuator_delay_s", 0.0, Range::closed(0.0, 10.0), "time from a command to its effect"),
    Key::number("backlash_m", 0.0, Range::from(0.0), "full width of the play between drive and mass"),
];

pub(super) const SENSORS: &[Key] = &[
    Key::number(
        "angle_noise_deg",
        0.0,
        Range::from(0.0),
        "standard deviation of the angles that the law sees",
    ),
    Key::number(
        "rate_noise_deg_s",
        0.0,
        Range::from(0.0),
        "standard deviation of the rates that the law sees",
    ),
    Key::number("angle_bias_deg", 0.0, ANY, "constant error of both angles"),
    Key::number("sensor_gain", 1.0, Range::POSITIVE, "factor on all that the law sees"),
    Key::number("sensor_delay_s", 0.0, Range::closed(0.0, 10.0), "age of what the law sees"),
];

pub(super) const ENTRY: &[Key] = &[
    Key::number("entry_altitude_km", 100.0, Range::closed(0.1, 1000.0), "height at the start"),
    Key::number("entry_speed_m_s", 700.0, Range::POSITIVE, "speed relative to the ground"),
    Key::number(
        "entry_path_angle_deg",
        -85.0,
        Range::closed(-90.0, 90.0),
        "angle of the velocity above the horizontal",
    ),
    Key::number("entry_azimuth_deg", 0.0, Range::closed(-360.0, 360.0), "course from north, clockwise"),
    Key::number("entry_longitude_deg", 0.0, Range::closed(-360.0, 360.0), "longitude at the start"),
    Key::number("entry_latitude_deg", 35.0, Range::closed(-90.0, 90.0), "geodetic latitude at the start"),
    Key::number("entry_attack_deg", 2.0, Range::closed(-180.0, 180.0), "angle of attack at the start"),
    Key::number("entry_sideslip_deg", 2.0, Range::closed(-89.0, 89.0), "sideslip at the start"),
    Key::number("entry_roll_rate_deg_s", 0.0, ANY, "roll rate at the start"),
    Key::choice(
        "earth",
        &["flat", ELLIPSOID],
        "a plane with the normal gravity of the latitude, or the rotating ellipsoid",
    ),
    Key::number(
        "wind_north_m_s",
        0.0,
        ANY,
        "wind towards north at 12 km; three tenths of it at the ground, none from 30 km on",
    ),
    Key::number(
        "wind_east_m_s",
        0.0,
        ANY,
        "wind towards east at 12 km; three tenths of it at the ground, none from 30 km on",
    ),
];

pub(super) const RUN: &[Key] = &[
    Key::number("sample_time_s", 0.01, Range::closed(1e-4, 10.0), "time between samples of the law"),
    Key::count("steps_per_sample", 1, 1, 1000, "steps of the integration per sample"),
    Key::number(
        "stop_altitude_km",
        3.0,
        Range::from(0.0),
        "height at which the flight ends, and lower end of the window",
    ),
    Key::number("window_top_km", 20.0, Range::POSITIVE, "height from which angles are judged"),
    Key::number("max_flight_time_s", 600.0, Range::closed(1.0, 1e5), "longest flight"),
    Key::number(
        "tumbling_angle_deg",
        90.0,
        Range::closed(1.0, 179.0),
        "total angle of attack from which the capsule tumbles, which ends the flight",
    ),
];
