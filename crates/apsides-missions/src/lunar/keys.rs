//! Keys of the lunar missions.

use apsides_pipeline::key::{Key, Range};

use crate::data;

pub(super) const COMMON: &[Key] = &[
    data::vehicle_key("lunar-lander-2017"),
    Key::named(data::VEHICLE, "initial_mass_kg", Range::POSITIVE, "mass in the parking orbit"),
    Key::named(data::VEHICLE, "dry_mass_kg", Range::POSITIVE, "mass without propellant"),
    Key::named(data::VEHICLE, "thrust_n", Range::POSITIVE, "full thrust"),
    Key::named(data::VEHICLE, "isp_s", Range::POSITIVE, "specific impulse"),
    data::body_key("moon-2017"),
    data::GRAVITY,
    data::RADIUS,
    Key::number(
        "orbit_altitude_km",
        100.0,
        Range::closed(0.1, 10_000.0),
        "altitude of the circular parking orbit",
    ),
    Key::number(
        "touchdown_radial_velocity_m_s",
        -5.0,
        Range::closed(-100.0, 0.0),
        "radial speed at touchdown",
    ),
    Key::number(
        "standard_gravity_m_s2",
        9.807,
        Range::closed(9.8, 9.81),
        "unit of the specific impulse, as in the paper",
    ),
];

pub(super) const PERILUNE_ALTITUDE: &str = "perilune_altitude_km";

pub(super) const PERILUNE: &[Key] =
    &[Key::number(PERILUNE_ALTITUDE, 15.0, Range::from(0.0), "altitude of the perilune of the transfer")];

pub(super) const DEPARTURE_IMPULSE: &str = "departure_impulse_m_s";

pub(super) const FREE_DEPARTURE: &str = "free_departure_impulse";
pub(super) const LARGEST_DEPARTURE: &str = "largest_departure_impulse_m_s";

pub(super) const DEPARTURE: &[Key] = &[
    Key::number(
        DEPARTURE_IMPULSE,
        0.0,
        Range::closed(0.0, 2_000.0),
        "impulse against the motion with which the perilune is left; enough of it removes the rise at first",
    ),
    Key::flag(
        FREE_DEPARTURE,
        false,
        "whether the size of this impulse is optimised for the largest mass at touchdown, its propellant counted; the search starts at the one \
         given, and none at all is an optimum among small ones",
    ),
    Key::number(
        LARGEST_DEPARTURE,
        1_500.0,
        Range::closed(0.1, 2_000.0),
        "largest impulse where its size is optimised",
    ),
];

pub(super) const OBJECTIVE: &str = "optimum_of";
pub(super) const FLIGHT_TIME: &str = "flight-time";
pub(super) const FINAL_MASS: &str = "final-mass";

/// The objective at full thrust, where both have the same optimum.
pub(super) const OBJECTIVES: &[Key] = &[Key::choice(
    OBJECTIVE,
    &[FLIGHT_TIME, FINAL_MASS],
    "with full thrust: least flight time or largest final mass, the same flight by another program; otherwise the final mass",
)];

pub(super) const GATE_ALTITUDE: &str = "gate_altitude_km";

pub(super) const GATE: &[Key] = &[Key::number(
    GATE_ALTITUDE,
    2.0,
    Range::POSITIVE,
    "altitude where the horizontal speed is zero and the vertical descent begins",
)];

pub(super) const PERILUNE_FLOOR: &str = "perilune_floor_km";

pub(super) const FLOOR: &[Key] = &[Key::number(
    PERILUNE_FLOOR,
    15.0,
    Range::from(0.0),
    "least perilune altitude of the coast, above the surface even if the engine does not start again",
)];

pub(super) const FULL: &str = "full";
pub(super) const COAST: &str = "coast";
pub(super) const FREE: &str = "free";
pub(super) const VERTICAL: &str = "vertical";

pub(super) const THROTTLE_PATH: &str = "throttle";

/// The throttle of flights on an ellipse, along which a coast leads down.
pub(super) const THROTTLE: &[Key] = &[Key::choice(
    THROTTLE_PATH,
    &[FULL, COAST, FREE],
    "full thrust all the time in minimum time; or largest final mass, with a coast and then full thrust, or with thrust \
     free from zero to full at any time",
)];

/// On a circle, where a coast alone leads nowhere.
pub(super) const THROTTLE_IN_ORBIT: &[Key] = &[Key::choice(
    THROTTLE_PATH,
    &[FULL, FREE],
    "full thrust all the time in minimum time, or free from zero to full at any time for the largest final mass",
)];

pub(super) const MAX_PITCH_RATE: &str = "max_pitch_rate_deg_s";

pub(super) const PITCH_RATE: &[Key] = &[Key::number(
    MAX_PITCH_RATE,
    f64::INFINITY,
    Range::POSITIVE_OR_UNLIMITED,
    "largest rate of the thrust angle; inf lets it jump",
)];

pub(super) const TOUCHDOWN_THRUST: &str = "touchdown_thrust";

pub(super) const TOUCHDOWN: &[Key] = &[Key::choice(
    TOUCHDOWN_THRUST,
    &[FREE, VERTICAL],
    "direction of the thrust at touchdown; vertical needs a `max_pitch_rate_deg_s`",
)];
