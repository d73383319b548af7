//! Keys of the re-entry.

use apsides_pipeline::key::{Key, Range};
use apsides_pipeline::placing::INITIAL_STATE;

use crate::data;

pub(super) const ATMOSPHERE: &str = "atmosphere";
pub(super) const EXPONENTIAL: &str = "exponential";
pub(super) const US_1976: &str = "us-1976";
pub(super) const US_1976_PRINTED: &str = "us-1976-printed";
pub(super) const TABLE: &str = "table";
/// The keys of the start, which a message has instead.
pub(super) const START: [&str; 6] = [
    "entry_altitude_km",
    "entry_longitude_deg",
    "entry_latitude_deg",
    "entry_speed_m_s",
    "entry_path_angle_deg",
    "entry_azimuth_deg",
];
pub(super) const ATMOSPHERE_TABLE: &str = "atmosphere_table";
pub(super) const SURFACE_DENSITY: &str = "surface_density_kg_m3";
pub(super) const SCALE_HEIGHT: &str = "scale_height_m";
pub(super) const GAS_CONSTANT: &str = "gas_constant_j_kg_k";
pub(super) const HEAT_CAPACITY_RATIO: &str = "heat_capacity_ratio";
pub(super) const SUTTON_GRAVES_CONSTANT: &str = "sutton_graves_constant";

pub(super) const REFERENCE_AREA: &str = "reference_area_m2";
pub(super) const AERODYNAMICS: &str = "aerodynamics";
pub(super) const CONSTANT: &str = "constant";
pub(super) const APOLLO: &str = "apollo-trim";
pub(super) const OFFSET: &str = "apollo-offset";
pub(super) const NEWTONIAN: &str = "newtonian";
pub(super) const ATTACK: &str = "angle_of_attack_deg";
pub(super) const HALF_ANGLE: &str = "cone_half_angle_deg";
pub(super) const TRIM_OFFSET: &str = "trim_offset_m";
pub(super) const STATION: &str = "centre_of_mass_station";

pub(super) const HEATING: &str = "heating";
pub(super) const HEAT_CONSTANT: &str = "constant";
pub(super) const SUTTON_GRAVES: &str = "sutton-graves";

pub(super) const LIFT_COEFFICIENT: &str = "lift_coefficient";
pub(super) const DRAG_COEFFICIENT: &str = "drag_coefficient";

pub(super) const TARGET_LONGITUDE: &str = "target_longitude_deg";
pub(super) const TARGET_LATITUDE: &str = "target_latitude_deg";

pub(super) const NORTH: &str = "north";

const ANGLE: Range = Range::closed(-180.0, 180.0);
const LATITUDE: Range = Range::open(-85.0, 85.0);

/// Keys of the mission, in groups.
pub(super) const ALL: &[&[Key]] = &[PLANET, VEHICLE, FLIGHT, LIMITS, GOALS, CONTROL, STEERED];

const PLANET: &[Key] = &[
    data::body_key("earth"),
    data::GRAVITY,
    data::RADIUS,
    data::ROTATION_RATE,
    Key::flag("body_rotation", true, "whether the body and its atmosphere rotate"),
    data::J2,
    Key::flag("oblateness", false, "whether gravity has the term J2"),
    Key::choice(
        ATMOSPHERE,
        &[EXPONENTIAL, US_1976, US_1976_PRINTED, TABLE],
        "density over altitude: exponential, with density and scale height of the body; the US Standard Atmosphere 1976, or that with its \
         printed densities above 86 km and straight lines of their logarithms between them; a table",
    ),
    Key::named(data::BODY, SURFACE_DENSITY, Range::POSITIVE, "of the exponential atmosphere, at altitude 0"),
    Key::named(data::BODY, SCALE_HEIGHT, Range::POSITIVE, "of the exponential atmosphere"),
    Key::named(data::BODY, GAS_CONSTANT, Range::POSITIVE, "of the atmosphere"),
    Key::named(data::BODY, HEAT_CAPACITY_RATIO, Range::open(1.0, 2.0), "of the atmosphere"),
    Key::table(
        ATMOSPHERE_TABLE,
        "",
        "lines of altitude in m, density in kg/m3, temperature in K, or a path that ends with .csv",
        "the atmosphere \"table\"",
    ),
];

const VEHICLE: &[Key] = &[
    data::vehicle_key("entry-capsule-2014"),
    Key::named(data::VEHICLE, "initial_mass_kg", Range::POSITIVE, "mass of the capsule"),
    Key::named(data::VEHICLE, REFERENCE_AREA, Range::POSITIVE, "area that the coefficients refer to"),
    Key::choice(
        AERODYNAMICS,
        &[CONSTANT, APOLLO, OFFSET, NEWTONIAN],
        "lift and drag: the next two keys, the trim table of Apollo 10 over the Mach number, Apollo's wind-tunnel coefficients in \
         the trim of a centre of mass off the axis, or the impact of the air on a sphere-cone with the radius `nose_radius_m` and a base \
         of the reference area",
    ),
    Key::named(data::VEHICLE, LIFT_COEFFICIENT, Range::from(0.0), "of constant aerodynamics"),
    Key::named(data::VEHICLE, DRAG_COEFFICIENT, Range::POSITIVE, "of constant aerodynamics"),
    Key::number(
        TRIM_OFFSET,
        0.09,
        Range::POSITIVE,
        "of \"apollo-offset\": distance of the centre of mass from the axis",
    ),
    Key::number(
        STATION,
        0.2406,
        Range::closed(0.0, 1.0),
        "of \"apollo-offset\": centre of mass ahead of the aft point of reference, in diameters",
    ),
    Key::number(
        ATTACK,
        0.0,
        Range::closed(-90.0, 90.0),
        "of \"newtonian\": angle of attack all along the flight; the lift of a blunt body is positive at negative angles",
    ),
    Key::optional(
        HALF_ANGLE,
        Range::open(0.0, 90.0),
        "of \"newtonian\": half angle of the cone behind the nose; a segment of the sphere where it is open",
    ),
    Key::choice(
        HEATING,
        &[HEAT_CONSTANT, SUTTON_GRAVES],
        "stagnation heat rate: k v^3 sqrt(density) with `heating_constant`, or by Sutton and Graves from `nose_radius_m`",
    ),
    Key::number("heating_constant", 1.294e-4, Range::POSITIVE, "k, in kg^0.5/m"),
    Key::named(data::VEHICLE, "nose_radius_m", Range::POSITIVE, "radius of the nose"),
    Key::named(
        data::BODY,
        SUTTON_GRAVES_CONSTANT,
        Range::POSITIVE,
        "of the law of Sutton and Graves in the atmosphere, kg^0.5/m",
    ),
];

const FLIGHT: &[Key] = &[
    Key::choice(
        "azimuth_from",
        &["east", NORTH],
        "azimuths count from east towards north, or from north towards east",
    ),
    INITIAL_STATE,
    Key::number("entry_altitude_km", 120.0, Range::open(20.0, 1000.0), "altitude at the start"),
    Key::number("entry_longitude_deg", 41.5, ANGLE, "longitude at the start"),
    Key::number("entry_latitude_deg", 40.5, LATITUDE, "latitude at the start"),
    Key::number(
        "entry_speed_m_s",
        7500.0,
        Range::open(500.0, 20_000.0),
        "speed at the start, relative to the planet",
    ),
    Key::number(
        "entry_path_angle_deg",
        -2.0,
        Range::open(-80.0, 10.0),
        "flight path angle at the start, positive up",
    ),
    Key::number(
        "entry_azimuth_deg",
        -45.0,
        Range::closed(-360.0, 360.0),
        "azimuth of the velocity at the start",
    ),
    Key::number("target_altitude_km", 15.0, Range::open(-5.0, 500.0), "altitude at the end"),
    Key::number(TARGET_LONGITUDE, 59.99, ANGLE, "longitude at the end"),
    Key::number(TARGET_LATITUDE, 22.98, LATITUDE, "latitude at the end"),
];

pub(super) const DYNAMIC_PRESSURE_LIMIT: &str = "dynamic_pressure_limit_kpa";
pub(super) const LOAD_LIMIT: &str = "load_limit_m_s2";
pub(super) const HEAT_RATE_LIMIT: &str = "heat_rate_limit_kw_m2";
pub(super) const NORMAL: &str = "normal";

const LIMITS: &[Key] = &[
    Key::number(
        DYNAMIC_PRESSURE_LIMIT,
        15.0,
        Range::POSITIVE_OR_UNLIMITED,
        "largest dynamic pressure; inf: not limited",
    ),
    Key::number(
        LOAD_LIMIT,
        40.0,
        Range::POSITIVE_OR_UNLIMITED,
        "largest aerodynamic acceleration; inf: not limited",
    ),
    Key::choice(
        "load",
        &["total", NORMAL],
        "what is limited: all of the aerodynamic acceleration, or its part along the lift",
    ),
    Key::number(
        HEAT_RATE_LIMIT,
        800.0,
        Range::POSITIVE_OR_UNLIMITED,
        "largest stagnation heat rate; inf: not limited",
    ),
    Key::number(
        "max_flight_time_s",
        3000.0,
        Range::from(SHORTEST_FLIGHT_S),
        "longest time from start to end",
    ),
];

/// Shortest flight, s.
pub(super) const SHORTEST_FLIGHT_S: f64 = 20.0;

pub(super) const GOAL: &str = "goal";
pub(super) const HEAT_LOAD: &str = "heat-load";
pub(super) const PEAK_DYNAMIC_PRESSURE: &str = "peak-dynamic-pressure";
pub(super) const PEAK_LOAD: &str = "peak-load";
pub(super) const PEAK_HEAT_RATE: &str = "peak-heat-rate";
pub(super) const LEAST_LIFT: &str = "least-lift";
pub(super) const MISS: &str = "miss";
pub(super) const REACH: &str = "reach";
pub(super) const REACH_BEARING: &str = "reach_bearing_deg";
pub(super) const REACH_WIDTH: &str = "reach_half_width_km";

const GOALS: &[Key] = &[
    Key::choice(
        GOAL,
        &[HEAT_LOAD, PEAK_DYNAMIC_PRESSURE, PEAK_LOAD, PEAK_HEAT_RATE, LEAST_LIFT, MISS, REACH],
        "what is least: heat load, a peak, the factor on the lift that still reaches the target, the distance from it; or how far \
         past the target along a bearing the flight can end",
    ),
    Key::number(
        REACH_BEARING,
        0.0,
        Range::closed(-360.0, 360.0),
        "of the goal \"reach\": from north towards east, at the target",
    ),
    Key::number(
        REACH_WIDTH,
        f64::INFINITY,
        Range { least: (0.0, true), most: (f64::INFINITY, true) },
        "of the goal \"reach\": how far off the line through the target the flight may end; inf: anywhere",
    ),
];

pub(super) const STEERING: &str = "steering";
pub(super) const MARGINS: &str = "margins";
pub(super) const BANK_VECTOR: &str = "bank-vector";
pub(super) const BANK: &str = "bank";

const CONTROL: &[Key] = &[
    Key::choice(
        STEERING,
        &[BANK_VECTOR, BANK],
        "what a direct method optimises: cosine and sine of the bank angle with their norm as a constraint, or the angle",
    ),
    Key::flag(MARGINS, true, "whether the least factor on the lift that reaches the target is found too"),
];

pub(super) const ROLL_GYRATION: &str = "steered.roll_gyration_radius_m";
pub(super) const PITCH_GYRATION: &str = "steered.pitch_gyration_radius_m";
pub(super) const MOVING_MASS: &str = "steered.moving_mass_kg";
pub(super) const RIM_RADIUS: &str = "steered.rim_radius_m";
pub(super) const RATE_LIMIT: &str = "steered.rate_limit_m_s";
pub(super) const ACCELERATION_LIMIT: &str = "steered.acceleration_limit_m_s2";
pub(super) const UNKNOWN_OFFSET: [&str; 2] = ["steered.offset_y_m", "steered.offset_z_m"];
pub(super) const BANDWIDTH: &str = "steered.bandwidth";
pub(super) const SAMPLE_TIME: &str = "steered.sample_time_s";

/// Keys of `apsides simulate`.
const STEERED: &[Key] = &[
    Key::number(
        ROLL_GYRATION,
        0.837_76,
        Range::POSITIVE,
        "of the flight in six degrees of freedom: radius of gyration about the axis",
    ),
    Key::number(PITCH_GYRATION, 0.770_56, Range::POSITIVE, "the same across the axis"),
    Key::number(
        MOVING_MASS,
        130.0,
        Range::POSITIVE,
        "each of two masses on a rim, which point the lift: to where they stand",
    ),
    Key::number(RIM_RADIUS, 1.2, Range::POSITIVE, "radius of the rim"),
    Key::number(RATE_LIMIT, 1.0, Range::POSITIVE_OR_UNLIMITED, "largest speed along the rim"),
    Key::number(ACCELERATION_LIMIT, 2.0, Range::POSITIVE_OR_UNLIMITED, "largest acceleration along the rim"),
    Key::number(
        UNKNOWN_OFFSET[0],
        0.0,
        Range::closed(-1.0, 1.0),
        "offset of the centre of mass along y that the law does not know",
    ),
    Key::number(UNKNOWN_OFFSET[1], 0.0, Range::closed(-1.0, 1.0), "the same along z"),
    Key::number(
        BANDWIDTH,
        0.5,
        Range::POSITIVE,
        "frequency of the law's poles by that of the capsule's own oscillation",
    ),
    Key::number(
        SAMPLE_TIME,
        0.01,
        Range::POSITIVE,
        "time between samples of the law, and step of the integration",
    ),
];
