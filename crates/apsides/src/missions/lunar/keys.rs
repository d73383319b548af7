//! Keys of the lunar missions.

use crate::key::{Key, Range};

pub(super) const COMMON: &[Key] = &[
    Key::number("initial_mass_kg", 300.0, Range::POSITIVE, "mass in the parking orbit"),
    Key::number("dry_mass_kg", 60.0, Range::POSITIVE, "mass without propellant"),
    Key::number("thrust_n", 440.0, Range::POSITIVE, "full thrust"),
    Key::number("isp_s", 310.0, Range::POSITIVE, "specific impulse"),
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
        "gravitational_parameter_km3_s2",
        4904.8695,
        Range::POSITIVE,
        "of the Moon, as printed in the paper (GRAIL: 4902.8001)",
    ),
    Key::number("moon_radius_km", 1737.1, Range::POSITIVE, "radius of the Moon"),
    Key::number(
        "standard_gravity_m_s2",
        9.807,
        Range::closed(9.8, 9.81),
        "unit of the specific impulse, as in the paper",
    ),
];

pub(super) const PERILUNE: &[Key] = &[Key::number(
    "perilune_altitude_km",
    15.0,
    Range::from(0.0),
    "altitude of the perilune of the transfer",
)];

pub(super) const GATE: &[Key] = &[Key::number(
    "gate_altitude_km",
    2.0,
    Range::POSITIVE,
    "altitude where the horizontal speed is zero and the vertical descent begins",
)];

pub(super) const FLOOR: &[Key] = &[Key::number(
    "perilune_floor_km",
    15.0,
    Range::from(0.0),
    "least perilune altitude of the coast, above the surface even if the engine does not start again",
)];

pub(super) const FULL: &str = "full";
pub(super) const COAST: &str = "coast";
pub(super) const FREE: &str = "free";
pub(super) const VERTICAL: &str = "vertical";

pub(super) const THROTTLE_PATH: &str = "throttle";

/// Where a coast leads down: on an ellipse.
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

pub(super) const PITCH_RATE: &[Key] = &[Key::number(
    "max_pitch_rate_deg_s",
    f64::INFINITY,
    Range::POSITIVE_OR_UNLIMITED,
    "largest rate of the thrust angle; inf lets it jump",
)];

pub(super) const TOUCHDOWN: &[Key] = &[Key::choice(
    "touchdown_thrust",
    &[FREE, VERTICAL],
    "direction of the thrust at touchdown; vertical needs a `max_pitch_rate_deg_s`",
)];
