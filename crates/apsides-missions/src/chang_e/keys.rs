//! Keys of the landings in the manner of Chang'e-3.

use apsides_pipeline::key::{Key, Range};

use crate::data;

pub(super) const INITIAL_MASS: &str = "initial_mass_kg";
pub(super) const DRY_MASS: &str = "dry_mass_kg";
pub(super) const LEAST_THRUST: &str = "min_thrust_n";
pub(super) const THRUST: &str = "thrust_n";
pub(super) const ISP: &str = "isp_s";

pub(super) const VEHICLE: &[Key] = &[
    data::vehicle_key("chang-e-3"),
    Key::named(data::VEHICLE, INITIAL_MASS, Range::POSITIVE, "mass at the perilune"),
    Key::named(data::VEHICLE, DRY_MASS, Range::POSITIVE, "mass without propellant"),
    Key::named(data::VEHICLE, LEAST_THRUST, Range::from(0.0), "least thrust of the engine, which stays on"),
    Key::named(data::VEHICLE, THRUST, Range::POSITIVE, "full thrust"),
    Key::named(data::VEHICLE, ISP, Range::POSITIVE, "specific impulse"),
];

pub(super) const MOTION: &str = "motion";
pub(super) const SPACE: &str = "space";
pub(super) const PLANE: &str = "plane";
pub(super) const ROTATION: &str = "body_rotation";
pub(super) const GRAVITY: &str = "gravity";
pub(super) const CENTRAL: &str = "central";
pub(super) const SECOND_DEGREE: &str = "degree-2";

pub(super) const MOON: &[Key] = &[
    data::body_key("moon-2014"),
    data::GRAVITY,
    data::RADIUS,
    data::ROTATION_RATE,
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

pub(super) const SITE: &[Key] = &data::LANDING_SITE;

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
pub(super) const PATH_WEIGHT: &str = "adjustment_path_weight_kg_m";
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
        PATH_WEIGHT,
        0.0,
        Range::from(0.0),
        "propellant that a metre of path in the adjustment counts as; large: the shortest path, as in the contest; above 0 the thrust of the \
         adjustment only slows",
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

/// Keys of one of the two maps.
pub(super) struct MapKeys {
    /// Its name in messages and files.
    pub(super) name: &'static str,
    pub(super) map: &'static str,
    pub(super) pixel: &'static str,
    pub(super) width: &'static str,
    pub(super) criteria: &'static str,
    pub(super) hazard_worth: &'static str,
    pub(super) tilt: &'static str,
    pub(super) clearance: &'static str,
    /// The site that is decided on it.
    pub(super) site: [&'static str; 3],
}

pub(super) const COARSE: MapKeys = MapKeys {
    name: "coarse",
    map: "terrain.coarse",
    pixel: "terrain.coarse_pixel_m",
    width: "terrain.coarse_width_m",
    criteria: "terrain.coarse_criteria",
    hazard_worth: "terrain.coarse_hazard_worth_kg",
    tilt: "terrain.coarse_tilt_limit_deg",
    clearance: "terrain.coarse_clearance_m",
    site: ["decided.coarse_site_east_m", "decided.coarse_site_north_m", "decided.coarse_site_up_m"],
};

pub(super) const FINE: MapKeys = MapKeys {
    name: "fine",
    map: "terrain.fine",
    pixel: "terrain.fine_pixel_m",
    width: "terrain.fine_width_m",
    criteria: "terrain.fine_criteria",
    hazard_worth: "terrain.fine_hazard_worth_kg",
    tilt: "terrain.fine_tilt_limit_deg",
    clearance: "terrain.fine_clearance_m",
    site: ["decided.fine_site_east_m", "decided.fine_site_north_m", "decided.fine_site_up_m"],
};

pub(super) const TERRAIN_SEED: &str = "terrain.seed";
pub(super) const SITE_RULE: &str = "terrain.rule";
pub(super) const WEIGHED: &str = "weighed";
pub(super) const SPIRAL: &str = "spiral";
pub(super) const CANDIDATES: &str = "terrain.candidates";
pub(super) const CENTRE_OF_MASS: &str = "terrain.centre_of_mass_height_m";
/// No map.
pub(super) const NO_MAP: &str = "none";
/// A map from the generator.
pub(super) const GENERATED: &str = "generated";

const MAP: &str = "\"none\", \"generated\" or the path of a map file";
const CRITERIA: &str = "the name of a preset or the path of a file of criteria";

pub(super) const TERRAIN: &[Key] = &[
    Key::path(COARSE.map, NO_MAP, MAP, "map seen at the end of the adjustment, its middle below the lander"),
    Key::path(FINE.map, NO_MAP, MAP, "map seen at the hover, its middle below the lander"),
    Key::number(
        COARSE.pixel,
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "size of a pixel of the coarse map; inf: what its file states, 1 m of a generated one",
    ),
    Key::number(
        FINE.pixel,
        f64::INFINITY,
        Range::POSITIVE_OR_UNLIMITED,
        "size of a pixel of the fine map; inf: what its file states, 0.1 m of a generated one",
    ),
    Key::number(COARSE.width, 2300.0, Range::closed(50.0, 10_000.0), "width of a generated coarse map"),
    Key::number(FINE.width, 100.0, Range::closed(10.0, 1000.0), "width of a generated fine map"),
    Key::count(TERRAIN_SEED, 1, 0, u32::MAX, "seed of generated maps"),
    Key::path(COARSE.criteria, "chang-e-3-coarse", CRITERIA, "what a site of the coarse map must fulfil"),
    Key::path(FINE.criteria, "chang-e-3-fine", CRITERIA, "what a site of the fine map must fulfil"),
    Key::choice(
        SITE_RULE,
        &[WEIGHED, SPIRAL],
        "the site with the least sum of propellant and hazard, or the first safe one within reach on the clockwise spiral from below the \
         lander, as in the contest",
    ),
    Key::count(CANDIDATES, 24, 1, 200, "safe sites of a map to which diverts are planned"),
    Key::number(
        COARSE.hazard_worth,
        10.0,
        Range::POSITIVE,
        "propellant that a site of the coarse map without hazard is worth more than one that is just allowed",
    ),
    Key::number(FINE.hazard_worth, 3.0, Range::POSITIVE, "the same on the fine map"),
    Key::number(
        COARSE.tilt,
        75.0,
        Range::closed(1.0, 85.0),
        "largest tilt of the thrust from the vertical in the coarse avoidance",
    ),
    Key::number(FINE.tilt, 30.0, Range::closed(1.0, 85.0), "the same in the fine avoidance"),
    Key::optional(
        COARSE.clearance,
        Range::POSITIVE,
        "least height above the coarse map all along the coarse avoidance, below `hover_altitude_m`; not limited where it is open",
    ),
    Key::optional(
        FINE.clearance,
        Range::POSITIVE,
        "the same above the fine map in the fine avoidance, below `fine_avoidance_end_altitude_m`",
    ),
    Key::number(
        CENTRE_OF_MASS,
        2.0,
        Range::from(0.0),
        "height of the centre of mass above the footpads at touchdown",
    ),
];

pub(super) const GATE_VELOCITY: [&str; 3] =
    ["decided.gate_upward_speed_m_s", "decided.gate_eastward_speed_m_s", "decided.gate_northward_speed_m_s"];
pub(super) const GATE_MASS: &str = "decided.gate_mass_kg";
pub(super) const ADJUSTED_SPEED: &str = "decided.adjusted_upward_speed_m_s";

/// Keys of the decisions in flight; open until then.
pub(super) const DECIDED: &[Key] = &[
    decided(
        GATE_VELOCITY[0],
        "upward speed at the end of the main braking; where it is open it is free, or that of its own optimum",
    ),
    decided(GATE_VELOCITY[1], "eastward speed there"),
    decided(GATE_VELOCITY[2], "northward speed there, of a flight in the plane the forward one"),
    decided(GATE_MASS, "mass there by the main braking's own optimum"),
    decided(
        ADJUSTED_SPEED,
        "upward speed at the end of the adjustment; where it is open it is free, or that of the plan without maps",
    ),
    decided(
        COARSE.site[0],
        "way east from there to the coarse site; chosen on the coarse map where it is open",
    ),
    decided(COARSE.site[1], "way north"),
    decided(COARSE.site[2], "height of the coarse site above the ground below the lander"),
    decided(
        FINE.site[0],
        "way east from the hover to the landing site; chosen on the fine map where it is open",
    ),
    decided(FINE.site[1], "way north"),
    decided(FINE.site[2], "height of the landing site above the ground below the hover"),
];

const fn decided(path: &'static str, meaning: &'static str) -> Key {
    Key::optional(path, Range::ANY_OR_UNLIMITED, meaning)
}
