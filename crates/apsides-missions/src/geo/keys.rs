//! Keys of the injection into geostationary orbit.

use apsides_pipeline::key::{Key, Range};

use crate::data;

pub(super) const STAGE: &[Key] = &[
    data::vehicle_key("breeze-m"),
    Key::named(data::VEHICLE, "initial_mass_kg", Range::POSITIVE, "mass in the parking orbit"),
    Key::named(data::VEHICLE, "propellant_kg", Range::POSITIVE, "propellant in the parking orbit"),
    Key::named(data::VEHICLE, "thrust_n", Range::POSITIVE, "thrust, full on every burn"),
    Key::named(data::VEHICLE, "isp_s", Range::POSITIVE, "specific impulse"),
    data::body_key("earth"),
    data::GRAVITY,
    data::RADIUS,
    data::J2,
];

pub(super) const BURNS: &str = "burns";
pub(super) const PATTERN: &str = "pattern";
pub(super) const MAX_FLIGHT_TIME: &str = "max_flight_time_s";
pub(super) const PARKING_ECCENTRICITY: &str = "parking_eccentricity";
pub(super) const STEERING: &str = "steering";
pub(super) const OPTIMAL: &str = "optimal";
pub(super) const VELOCITY: &str = "velocity";
pub(super) const INERTIAL: &str = "inertial-fixed";

pub(super) const FLIGHT: &[Key] = &[
    Key::count(BURNS, 3, 1, 8, "burns, all free in time and joined by coasts of free length"),
    Key::text(
        PATTERN,
        "",
        "letters P and A, one per burn: P.., then A.., then P.. for retro burns; from an elliptic orbit A.. too, then P..; or empty",
        "where each burn is: at perigee or apogee; empty: all at perigee but the last",
    ),
    Key::choice(
        STEERING,
        &[OPTIMAL, VELOCITY, INERTIAL],
        "direction of the thrust: free, along the velocity, or for each burn one that is fixed in inertial space",
    ),
    Key::number(
        "inclination_deg",
        0.0,
        Range { least: (0.0, true), most: (180.0, false) },
        "of the parking orbit to the equator; 0: flight in the equatorial plane",
    ),
    Key::number(
        "parking_altitude_km",
        200.0,
        Range::POSITIVE,
        "altitude of the parking orbit, of its perigee where it is elliptic",
    ),
    Key::number(
        PARKING_ECCENTRICITY,
        0.0,
        Range { least: (0.0, true), most: (1.0, false) },
        "of the parking orbit, 0.73 for the usual transfer orbit; its perigee is at the ascending node",
    ),
    Key::number(
        "target_radius_km",
        42_164.0,
        Range::POSITIVE,
        "semi-major axis of the target orbit, equatorial",
    ),
    Key::number(
        "target_eccentricity",
        0.0,
        Range { least: (0.0, true), most: (1.0, false) },
        "of the target orbit; the direction of its perigee is free",
    ),
    Key::number(
        "max_burn_time_s",
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "longest time of each burn; inf: not limited",
    ),
    Key::count("max_restarts", 10, 0, 100, "restarts that the engine allows, one less than burns"),
    Key::number(
        MAX_FLIGHT_TIME,
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "longest time from first ignition to last cut-off; inf: not limited",
    ),
    Key::number(
        "apogee_cap_km",
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "largest apogee radius of the orbits between the burns; inf: not limited",
    ),
    Key::flag("oblateness", false, "whether gravity has the term J2"),
];
