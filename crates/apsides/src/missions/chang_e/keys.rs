//! Keys of the landings in the manner of Chang'e-3.

use crate::key::{Key, Range};

pub(super) const INITIAL_MASS: &str = "initial_mass_kg";
pub(super) const DRY_MASS: &str = "dry_mass_kg";
pub(super) const LEAST_THRUST: &str = "least_thrust_n";
pub(super) const THRUST: &str = "thrust_n";
pub(super) const EXHAUST_VELOCITY: &str = "exhaust_velocity_m_s";

pub(super) const VEHICLE: &[Key] = &[
    Key::number(INITIAL_MASS, 2400.0, Range::POSITIVE, "mass at the perilune"),
    Key::number(DRY_MASS, 900.0, Range::POSITIVE, "mass without propellant"),
    Key::number(LEAST_THRUST, 1500.0, Range::from(0.0), "least thrust of the engine, which stays on"),
    Key::number(THRUST, 7500.0, Range::POSITIVE, "full thrust"),
    Key::number(EXHAUST_VELOCITY, 2940.0, Range::POSITIVE, "effective exhaust velocity"),
];

pub(super) const MU: &str = "gravitational_parameter_km3_s2";
pub(super) const RADIUS: &str = "moon_radius_km";
pub(super) const MOTION: &str = "motion";
pub(super) const SPACE: &str = "space";
pub(super) const PLANE: &str = "plane";
pub(super) const ROTATION: &str = "moon_rotation";
pub(super) const GRAVITY: &str = "gravity";
pub(super) const CENTRAL: &str = "central";
pub(super) const SECOND_DEGREE: &str = "degree-2";

pub(super) const MOON: &[Key] = &[
    Key::number(MU, 4_902.793_455, Range::POSITIVE, "of the Moon"),
    Key::number(RADIUS, 1737.013, Range::POSITIVE, "radius that altitudes count from"),
    Key::choice(
        MOTION,
        &[SPACE, PLANE],
        "in space over the rotating Moon, or in the plane of the orbit without rotation",
    ),
    Key::flag(
        ROTATION,
        true,
        "whether the Moon rotates, in a sidereal month of 27.321661 days; in space only",
    ),
    Key::choice(
        GRAVITY,
        &[CENTRAL, SECOND_DEGREE],
        "inverse-square, or with J2 and C22 of GRGM1200A; in space only",
    ),
];

pub(super) const PERILUNE: &str = "perilune_altitude_km";
pub(super) const APOLUNE: &str = "apolune_altitude_km";
pub(super) const SPEED: &str = "start_speed_m_s";
pub(super) const AZIMUTH: &str = "orbit_azimuth_deg";

pub(super) const ORBIT: &[Key] = &[
    Key::number(PERILUNE, 15.0, Range::POSITIVE, "altitude of the perilune, where the braking begins"),
    Key::number(APOLUNE, 100.0, Range::POSITIVE, "altitude of the apolune"),
    Key::number(
        SPEED,
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "speed at the perilune in inertial space; inf: that of the orbit (contest: 1692)",
    ),
    Key::number(
        AZIMUTH,
        0.0,
        Range::closed(-180.0, 360.0),
        "of the inertial velocity at the perilune, from north towards east; the perilune is free",
    ),
];

pub(super) const SITE_LONGITUDE: &str = "site_longitude_deg";
pub(super) const SITE_LATITUDE: &str = "site_latitude_deg";

pub(super) const SITE_ALTITUDE: &str = "site_altitude_m";

pub(super) const SITE: &[Key] = &[
    Key::number(
        SITE_ALTITUDE,
        0.0,
        Range::closed(-10_000.0, 12_000.0),
        "altitude of the site, from which all other altitudes count (contest: -2641)",
    ),
    Key::number(SITE_LONGITUDE, -19.51, Range::closed(-360.0, 360.0), "longitude of the site, eastwards"),
    Key::number(SITE_LATITUDE, 44.12, Range::open(-89.0, 89.0), "latitude of the site"),
];

pub(super) const GATE_ALTITUDE: &str = "gate_altitude_km";
pub(super) const GATE_SPEED: &str = "gate_speed_m_s";
pub(super) const GATE_DIRECTION: &str = "gate_direction";
pub(super) const FREE: &str = "free";
pub(super) const DOWN: &str = "down";
pub(super) const HORIZONTAL: &str = "horizontal";

pub(super) const GATE: &[Key] = &[
    Key::number(
        GATE_ALTITUDE,
        3.0,
        Range::POSITIVE,
        "altitude at the end of the main braking, above the site",
    ),
    Key::number(GATE_SPEED, 57.0, Range::from(0.0), "speed there, relative to the ground"),
    Key::choice(GATE_DIRECTION, &[FREE, DOWN, HORIZONTAL], "direction of the velocity there"),
];

pub(super) const ORDER: &str = "optimised";
pub(super) const JOINT: &str = "jointly";
pub(super) const STAGES: &str = "by-stages";
pub(super) const ADJUSTMENT_TILT: &str = "adjustment_tilt_limit_deg";
pub(super) const COARSE_ALTITUDE: &str = "coarse_avoidance_altitude_km";
pub(super) const HOVER_ALTITUDE: &str = "hover_altitude_m";
pub(super) const HOVER_TIME: &str = "hover_time_s";
pub(super) const FINE_ALTITUDE: &str = "fine_avoidance_end_altitude_m";
pub(super) const CUTOFF_ALTITUDE: &str = "cutoff_altitude_m";

pub(super) const STAGES_BELOW: &[Key] = &[
    Key::choice(
        ORDER,
        &[JOINT, STAGES],
        "all phases together, or the main braking for itself and then the others, as in the contest",
    ),
    Key::number(
        COARSE_ALTITUDE,
        2.4,
        Range::POSITIVE,
        "altitude at the end of the adjustment, above the site",
    ),
    Key::number(
        ADJUSTMENT_TILT,
        90.0,
        Range::closed(1.0, 180.0),
        "largest tilt of the thrust from the vertical during the adjustment",
    ),
    Key::number(
        HOVER_ALTITUDE,
        100.0,
        Range::POSITIVE,
        "altitude at rest at the end of the coarse avoidance",
    ),
    Key::number(HOVER_TIME, 0.0, Range::from(0.0), "time at rest there"),
    Key::number(FINE_ALTITUDE, 30.0, Range::POSITIVE, "altitude at the end of the fine avoidance"),
    Key::number(CUTOFF_ALTITUDE, 4.0, Range::from(0.0), "altitude at rest where the engine is cut off"),
];
