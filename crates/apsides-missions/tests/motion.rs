//! Problems of their own files that say where the flight is: rows about a body, and statements that are refused.
#![allow(clippy::unwrap_used)]

use apsides_ephemeris::{CentralBody, Ephemeris, Format, Sampling, StateVector};
use apsides_missions::problem::STARTER;
use apsides_missions::registry;
use apsides_pipeline::{Error, Pipeline};

/// A quarter of a circular orbit about the Moon in polar coordinates, in two phases of which only the second has an engine, switched off.
const ORBIT: &str = r#"kind = "problem"
epoch = "2027-05-04T03:02:01 TAI"
frame = { reference = "icrf", node_deg = 40, inclination_deg = 51.6 }
[constants]
mu = "4902.8001 km3/s2"
radius = "1837.4 km"
[phase.first]
time.end = 1000
states.r = { unit = "km", min = 1700, max = 2000, start = "radius" }
states.angle = { unit = "deg", min = -10, max = 200, start = 0 }
states.up = { unit = "m/s", min = -100, max = 100, start = 0 }
states.along = { unit = "m/s", min = 1000, max = 2000, start = "sqrt(mu/radius)" }
dynamics = { r = "up", angle = "along/r", up = "along^2/r - mu/r^2", along = "-up*along/r" }
[phase.second]
time.end = [1500, 1501]
states.r = { unit = "km", min = 1700, max = 2000 }
states.angle = { unit = "deg", min = -10, max = 200 }
states.up = { unit = "m/s", min = -100, max = 100 }
states.along = { unit = "m/s", min = 1000, max = 2000 }
controls.throttle = [0, 1]
dynamics = { r = "up", angle = "along/r", up = "along^2/r - mu/r^2", along = "-up*along/r + throttle*1e-9 [m/s2]" }
[links]
first = "second"
[objective]
minimize = "second.end.time"
[motion]
body = "moon"
position = ["r*cos(angle)", "r*sin(angle)", 0]
velocity = ["up*cos(angle) - along*sin(angle)", "up*sin(angle) + along*cos(angle)", 0]
thrust = { first = [0, 0, 0], second = ["throttle*1 [N]", 0, 0] }
"#;

/// The table of a descent over a site, for the starter.
const AT_SITE: &str = r#"
[motion]
body = "moon"
axes = "site"
site = { longitude = -19.5, latitude = "44.1 deg", altitude = "-2.64 km" }
position = [0, 0, "h"]
velocity = [0, 0, "v"]
mass = "m"
thrust = [0, 0, "throttle*thrust"]
"#;

/// Published: the accuracy that files of an ephemeris must have, m and m/s.
const POSITION: f64 = 1.0;
const VELOCITY: f64 = 1e-3;

fn parsed(text: &str) -> Result<Pipeline, Error> {
    registry().parse(text, "own.toml", &[])
}

fn rows(mission: &Pipeline, points: u64) -> Ephemeris {
    let outcome = mission.solve(None, &mut ()).unwrap();
    assert!(outcome.status.is_success());
    let sampling = Sampling::Points(points);
    mission.ephemeris(&outcome.decisions, &outcome.ocp, &outcome.trajectory, sampling).unwrap()
}

#[test]
fn polar_coordinates_are_an_orbit_in_inertial_axes() {
    let mission = parsed(ORBIT).unwrap();
    mission.check_formats(&[Format::Oem, Format::Opm, Format::Czml]).unwrap();
    let table = rows(&mission, 51);
    assert_eq!((table.body, table.phases.len()), (Some(CentralBody::Moon), 2));
    // A circle whose plane is turned by the keys of the frame: node, then inclination.
    let (radius, mu) = (1.8374e6_f64, 4902.8001e9_f64);
    let rate = (mu / radius.powi(3)).sqrt();
    let ((sn, cn), (si, ci)) = (40_f64.to_radians().sin_cos(), 51.6_f64.to_radians().sin_cos());
    let in_space = |[x, y]: [f64; 2]| [cn * x - sn * ci * y, sn * x + cn * ci * y, si * y];
    for (time, state) in table.times.iter().zip(&table.states) {
        let (sin, cos) = (rate * time).sin_cos();
        let position = in_space([radius * cos, radius * sin]);
        let velocity = in_space([-radius * rate * sin, radius * rate * cos]);
        for k in 0..3 {
            assert!((state.position[k] - position[k]).abs() < POSITION, "{time}: {:?}", state.position);
            assert!((state.velocity[k] - velocity[k]).abs() < VELOCITY, "{time}: {:?}", state.velocity);
        }
    }
    // Nothing says a mass: no column, no keyword.
    assert!(table.column("mass_kg").is_none() && table.column("thrust_N").is_some());
    let created = mission.placing().epoch;
    let messages = Format::Opm.write(&table, &created).unwrap();
    for ((_, text), row) in messages.into_iter().zip([0, table.times.len() - 1]) {
        let text = String::from_utf8(text).unwrap();
        let read = StateVector::read_opm(&text).unwrap();
        assert_eq!((read.body, read.mass), (CentralBody::Moon, None));
        assert!(read.epoch.since(&table.epoch_of(row)).abs() < VELOCITY);
        for k in 0..3 {
            assert!((read.position[k] - table.states[row].position[k]).abs() < POSITION);
            assert!((read.velocity[k] - table.states[row].velocity[k]).abs() < VELOCITY);
        }
    }
    // The file that is written has the table, the epoch and the axes.
    assert!(parsed(&mission.to_file()).unwrap() == mission);
}

#[test]
fn heights_over_a_site_are_places_on_the_body() {
    let mission = parsed(&format!("{STARTER}{AT_SITE}")).unwrap();
    let table = rows(&mission, 20);
    let column = |name: &str| table.column(name).unwrap();
    let [first, last] = [0, table.times.len() - 1];
    assert!((column("above_site_m")[first] - 2000.0).abs() < POSITION);
    assert!((column("altitude_m")[last] + 2640.0).abs() < POSITION);
    assert!((column("mass_kg")[first] - 15_000.0).abs() < POSITION);
    assert!((column("ground_speed_m_per_s")[first] - 60.0).abs() < VELOCITY);
    assert!((column("ground_path_angle_deg")[first] + 90.0).abs() < VELOCITY);
    for (longitude, latitude) in column("longitude_deg").iter().zip(column("latitude_deg")) {
        assert!((longitude + 19.5).abs() < VELOCITY && (latitude - 44.1).abs() < VELOCITY);
    }
    let thrust = column("thrust_up_N");
    assert!(thrust.iter().all(|f| (-VELOCITY..=45_000.0 + VELOCITY).contains(f)) && thrust[last] > 1000.0);
}

#[test]
fn statements_of_motion_that_are_none_are_refused_at_their_place() {
    for (from, to, words) in [
        ("\"moon\"", "\"mun\"", "line 27, column 8: `body` is \"mun\", allowed is one of"),
        ("body = \"moon\"\n", "", "motion is without `body`"),
        ("\"r*sin(angle)\", 0", "\"r*sin(angle)\"", "motion.position is a list of 2"),
        ("\"r*cos(angle)\"", "\"r*cos(angel)\"", "the nearest is `angle`"),
        (
            "\"r*cos(angle)\"",
            "\"up*cos(angle)\"",
            "the first component of the position has the unit m, this is m/s",
        ),
        ("first = [0, 0, 0], ", "", "`motion.thrust` has nothing of phase `first`"),
        (
            "{ first = [0, 0, 0], second = [\"throttle*1 [N]\", 0, 0] }",
            "[\"throttle*1 [N]\", 0, 0]",
            "`throttle` is no quantity of phase `first`",
        ),
        ("{ first = [", "{ frist = [", "no phase is named `frist`"),
        ("body = \"moon\"", "body = \"moon\"\naxes = \"polar\"", "\"inertial\", \"fixed\""),
        ("body = \"moon\"", "body = \"moon\"\naxes = \"site\"", "motion is without `site`"),
        (
            "body = \"moon\"",
            "body = \"moon\"\nsite = { longitude = 0, latitude = 0 }",
            "goes with axes = \"site\"",
        ),
        ("body = \"moon\"", "body = \"moon\"\nspeed = \"up\"", "motion has no key `speed`"),
    ] {
        assert!(ORBIT.contains(from), "{from}");
        let refused = parsed(&ORBIT.replace(from, to)).unwrap_err().to_string();
        assert!(refused.contains(words), "{to}: {refused}");
        assert!(refused.contains("own.toml, line "), "{refused}");
    }
    let at = AT_SITE.replace("44.1 deg", "144.1 deg");
    let refused = parsed(&format!("{STARTER}{at}")).unwrap_err().to_string();
    assert!(refused.contains("allowed are -90 to 90"), "{refused}");
    // Keys of epoch and axes belong to a problem that says where it is.
    let nowhere = format!("epoch = \"2027-05-04T03:02:01 TAI\"\n{STARTER}");
    let refused = parsed(&nowhere).unwrap_err().to_string();
    assert!(refused.contains("`epoch` is of ephemerides") && refused.contains("[motion]"), "{refused}");
    let refused = parsed(STARTER).unwrap().check_formats(&[Format::Oem]).unwrap_err().to_string();
    assert!(refused.contains("a table [motion] with body, position and velocity"), "{refused}");
}
