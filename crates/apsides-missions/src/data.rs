//! Bodies, vehicles and landing sites as data: a TOML file each, by name or by path. One more is a file and a line here.
#![cfg_attr(
    not(all(
        feature = "lunar",
        feature = "geo",
        feature = "entry",
        feature = "chang-e",
        feature = "moving-mass"
    )),
    allow(dead_code, reason = "some keys belong to some kinds of mission alone")
)]

use apsides_dynamics::Body;
use apsides_ephemeris::CentralBody;
use apsides_pipeline::Error;
use apsides_pipeline::key::{Key, Range};
use apsides_pipeline::named_data::NamedData;
use apsides_pipeline::placing::Whereabouts;
use apsides_pipeline::values::Values;

/// The key that names a body.
pub const BODY: &str = "body";
/// The key that names a vehicle.
pub const VEHICLE: &str = "vehicle";
/// The key that names a landing site.
pub const SITE: &str = "site";

pub(crate) const GRAVITATIONAL_PARAMETER: &str = "gravitational_parameter_km3_s2";
pub(crate) const BODY_RADIUS: &str = "body_radius_km";

/// Allowed values of the keys, in words.
const NAME_OR_PATH: &str = "a name that `apsides bodies`, `apsides vehicles` or `apsides sites` lists, or a path that ends with .toml";

const ANY: Range = Range::open(f64::NEG_INFINITY, f64::INFINITY);
/// Longitudes (deg), latitudes (deg) and altitudes (m) of sites.
const LONGITUDE: Range = Range::closed(-360.0, 360.0);
const LATITUDE: Range = Range::open(-89.0, 89.0);
const ALTITUDE: Range = Range::closed(-10_000.0, 12_000.0);

/// Bodies: gravity, size and rotation, and the atmosphere of those that have one.
pub const BODIES: NamedData = NamedData {
    key: BODY,
    keys: &[
        Key::number(GRAVITATIONAL_PARAMETER, 0.0, Range::POSITIVE, "gravitational parameter"),
        Key::number(BODY_RADIUS, 0.0, Range::POSITIVE, "radius that altitudes count from"),
        Key::number("rotation_rate_rad_s", 0.0, ANY, "angular velocity about the axis, positive eastwards"),
        Key::number("j2", 0.0, ANY, "oblateness J2, with the radius"),
        Key::number("surface_density_kg_m3", 0.0, Range::POSITIVE, "density at altitude 0"),
        Key::number("scale_height_m", 0.0, Range::POSITIVE, "scale height of the atmosphere"),
        Key::number("gas_constant_j_kg_k", 0.0, Range::POSITIVE, "gas constant of the atmosphere"),
        Key::number("heat_capacity_ratio", 0.0, Range::open(1.0, 2.0), "ratio of the specific heats"),
        Key::number("sutton_graves_constant", 0.0, Range::POSITIVE, "of Sutton and Graves, kg^0.5/m"),
    ],
    files: &[
        ("earth", include_str!("../missions/bodies/earth.toml")),
        ("mars", include_str!("../missions/bodies/mars.toml")),
        ("moon", include_str!("../missions/bodies/moon.toml")),
        ("moon-2014", include_str!("../missions/bodies/moon-2014.toml")),
        ("moon-2017", include_str!("../missions/bodies/moon-2017.toml")),
    ],
};

/// Vehicles: upper stages, landers, capsules.
pub const VEHICLES: NamedData = NamedData {
    key: VEHICLE,
    keys: &[
        Key::number("initial_mass_kg", 0.0, Range::POSITIVE, "mass at the start of the mission"),
        Key::number("dry_mass_kg", 0.0, Range::POSITIVE, "mass without propellant"),
        Key::number("propellant_kg", 0.0, Range::POSITIVE, "propellant at the start"),
        Key::number("thrust_n", 0.0, Range::POSITIVE, "full thrust"),
        Key::number("min_thrust_n", 0.0, Range::from(0.0), "least thrust of a throttled engine"),
        Key::number("isp_s", 0.0, Range::POSITIVE, "specific impulse"),
        Key::number("reference_area_m2", 0.0, Range::POSITIVE, "area that the coefficients refer to"),
        Key::number("nose_radius_m", 0.0, Range::POSITIVE, "radius of the nose"),
        Key::number("lift_coefficient", 0.0, Range::from(0.0), "lift coefficient"),
        Key::number("drag_coefficient", 0.0, Range::POSITIVE, "drag coefficient"),
        Key::number("diameter_m", 0.0, Range::POSITIVE, "diameter"),
        Key::number("roll_gyration_radius_m", 0.0, Range::POSITIVE, "radius of gyration about the axis"),
        Key::number("pitch_gyration_radius_m", 0.0, Range::POSITIVE, "radius of gyration across the axis"),
        Key::number("centre_of_mass_station", 0.0, ANY, "centre of mass ahead of the reference, diameters"),
    ],
    files: &[
        ("block-dm", include_str!("../missions/vehicles/block-dm.toml")),
        ("breeze-m", include_str!("../missions/vehicles/breeze-m.toml")),
        ("centaur-d", include_str!("../missions/vehicles/centaur-d.toml")),
        ("chang-e-3", include_str!("../missions/vehicles/chang-e-3.toml")),
        ("entry-capsule-2014", include_str!("../missions/vehicles/entry-capsule-2014.toml")),
        ("fregat", include_str!("../missions/vehicles/fregat.toml")),
        ("fregat-sb", include_str!("../missions/vehicles/fregat-sb.toml")),
        ("lunar-lander-2017", include_str!("../missions/vehicles/lunar-lander-2017.toml")),
        ("suborbital-capsule", include_str!("../missions/vehicles/suborbital-capsule.toml")),
        ("yastreb", include_str!("../missions/vehicles/yastreb.toml")),
    ],
};

/// Landing sites.
pub const SITES: NamedData = NamedData {
    key: SITE,
    keys: &[
        Key::number("site_longitude_deg", 0.0, LONGITUDE, "longitude, eastwards"),
        Key::number("site_latitude_deg", 0.0, LATITUDE, "latitude"),
        Key::number("site_altitude_m", 0.0, ALTITUDE, "altitude above the radius of the body"),
    ],
    files: &[("chang-e-3-2014", include_str!("../missions/sites/chang-e-3-2014.toml"))],
};

/// Former paths of keys, each with the one of today.
pub(crate) const RENAMED: &[(&str, &str)] = &[
    ("earth_radius_km", "body_radius_km"),
    ("exhaust_velocity_m_s", "isp_s"),
    ("least_thrust_n", "min_thrust_n"),
    ("longest_flight_s", "max_flight_time_s"),
    ("mass_flow_kg_s", "isp_s"),
    ("mass_kg", "initial_mass_kg"),
    ("max_burn_s", "max_burn_time_s"),
    ("max_flight_time_h", "max_flight_time_s"),
    ("moon_radius_km", "body_radius_km"),
    ("moon_rotation", "body_rotation"),
    ("planet", "body"),
    ("planet_rotation", "body_rotation"),
    ("steered.pitch_gyration_radius", "steered.pitch_gyration_radius_m"),
    ("steered.roll_gyration_radius", "steered.roll_gyration_radius_m"),
    ("time_limit_s", "max_flight_time_s"),
    ("vehicle_mass_kg", "initial_mass_kg"),
];

/// The key that names the body of a mission, by default this one.
pub(crate) const fn body_key(default: &'static str) -> Key {
    Key::path(BODY, default, NAME_OR_PATH, "central body; its file has the numbers of the body")
}

/// The key that names the vehicle of a mission, by default this one.
pub(crate) const fn vehicle_key(default: &'static str) -> Key {
    Key::path(VEHICLE, default, NAME_OR_PATH, "vehicle; its file has the numbers of the vehicle")
}

/// The gravity that the body has.
pub(crate) const GRAVITY: Key =
    Key::named(BODY, GRAVITATIONAL_PARAMETER, Range::POSITIVE, "gravitational parameter of the body");

/// The size that the body has.
pub(crate) const RADIUS: Key =
    Key::named(BODY, BODY_RADIUS, Range::POSITIVE, "radius of the body, from which altitudes count");

/// The rotation that the body has.
pub(crate) const ROTATION_RATE: Key = Key::named(
    BODY,
    "rotation_rate_rad_s",
    ANY,
    "angular velocity of the body, where `body_rotation` is set",
);

/// The oblateness that the body has.
pub(crate) const J2: Key = Key::named(BODY, "j2", ANY, "J2 of the body, where `oblateness` is set");

/// The key that names the landing site, and what the site has.
pub(crate) const LANDING_SITE: [Key; 4] = [
    Key::path(SITE, "chang-e-3-2014", NAME_OR_PATH, "landing site; its file has the next three keys"),
    Key::named(SITE, "site_altitude_m", ALTITUDE, "altitude of the site, from which all others count"),
    Key::named(SITE, "site_longitude_deg", LONGITUDE, "longitude of the site, eastwards"),
    Key::named(SITE, "site_latitude_deg", LATITUDE, "latitude of the site"),
];

/// Radius of a body by its name or the path of its file, m. `place` is where the name stands.
///
/// # Errors
/// A name that is not known, a file that cannot be read or states no radius.
pub fn body_radius_m(name: &str, place: &str) -> Result<f64, Error> {
    let keys = [RADIUS];
    let radius = BODIES.numbers(name, &keys, place, RENAMED)?;
    Ok(radius.iter().map(|(_, kilometres, _)| 1e3 * kilometres).sum())
}

/// The body of the values, its gravity and size.
pub(crate) fn central_body(values: &Values) -> Result<Body, Error> {
    let (parameter, radius) = (values.number(GRAVITATIONAL_PARAMETER)?, values.number(BODY_RADIUS)?);
    let refusal = values.refusal(&[GRAVITATIONAL_PARAMETER, BODY_RADIUS]);
    Body::new(parameter * 1e9, radius * 1e3).map_err(refusal)
}

/// The place of flights about a body of a gravitational parameter (m3/s2), as points.
pub(crate) fn point_about(gravitational_parameter: f64) -> Whereabouts {
    match CentralBody::of_gravity(gravitational_parameter) {
        Some(_) => Whereabouts::Point,
        None => Whereabouts::NotSo("its body is none of Earth, Moon and Mars, whose axes alone are known"),
    }
}
