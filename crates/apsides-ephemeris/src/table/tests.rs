#![allow(clippy::unwrap_used)]

use apsides_dynamics::Ellipsoid;

use super::*;
use crate::StateVector;
use crate::flight::{Instant, Site};
use crate::format::Format;
use crate::frames::Reference;

/// Round-off of positions (m) and of numbers in km that are written with a micrometre.
const POSITION: f64 = 2e-5;
/// The same of velocities, m/s.
const VELOCITY: f64 = 1e-8;
/// Round-off of angles in deg.
const DEGREES: f64 = 1e-9;

const RADIUS: f64 = 1.7374e6;
const RATE: f64 = 9e-4;

/// A circular orbit in two phases, in the mission's inertial axes, with thrust along the velocity in the first.
struct Circle {
    axes: Axes,
    attitude: Option<[f64; 4]>,
}

impl Flight for Circle {
    fn spans(&self) -> Vec<Span> {
        [("burn", [0.0, 25.0]), ("coast", [25.0, 40.0])]
            .map(|(name, times)| Span { name: name.into(), times })
            .into()
    }

    fn about(&self) -> Option<About> {
        Some(About {
            gravitational_parameter: 4.9028e12,
            surface: Ellipsoid::sphere(RADIUS, 4.9028e12, 0.0, 0.0),
            axes: self.axes,
            loads: vec![Column::new("shake", "m/s2")],
            site: Some(Site { longitude: 0.0, latitude: 0.0, altitude: 0.0 }),
        })
    }

    fn own(&self) -> Vec<Column> {
        vec![Column::new("mass", "kg"), Column::new("polar angle", "rad"), Column::new("of the burn", "-")]
    }

    fn at(&self, phase: usize, time: f64) -> Instant {
        let r = RADIUS + 1e5;
        let (sin, cos) = (RATE * time).sin_cos();
        let thrust = if phase == 0 { 50.0 } else { 0.0 };
        let point = Point {
            position: [r * cos, r * sin, 0.0],
            velocity: [-r * RATE * sin, r * RATE * cos, 0.0],
            thrust: Some([-thrust * sin, thrust * cos, 0.0]),
            mass: Some(200.0 - time),
            delta_v: Some(time),
            attitude: self.attitude,
            loads: vec![0.5],
        };
        let of_burn = if phase == 0 { 1.0 } else { f64::NAN };
        Instant { point: Some(point), own: vec![200.0 - time, RATE * time, of_burn] }
    }
}

fn table(axes: Axes, attitude: Option<[f64; 4]>) -> Ephemeris {
    let plane = Plane { reference: Reference::Body, node: 0.3, inclination: 0.5, argument: 0.0 };
    let placing = Placing { epoch: Epoch::DEFAULT.parse().unwrap(), plane };
    Ephemeris::of("circle", &Circle { axes, attitude }, &placing, Sampling::Step(10.0)).unwrap()
}

fn created() -> Epoch {
    "2026-01-02T03:04:05 UTC".parse().unwrap()
}

fn file(table: &Ephemeris, format: Format) -> Vec<u8> {
    format.write(table, &created()).unwrap().remove(0).1
}

#[test]
fn columns_have_one_meaning_in_all_phases() {
    let table = table(Axes::Inertial, None);
    assert_eq!(table.body, Some(CentralBody::Moon));
    assert_eq!(table.times, [0.0, 10.0, 20.0, 25.0, 25.0, 30.0, 40.0]);
    assert_eq!(table.phases[1].rows, 4..7);
    let column = |header: &str| table.column(header).unwrap();
    // The mass is there once, what a phase does not have is not.
    assert_eq!(table.columns.iter().filter(|(c, _)| c.header() == "mass_kg").count(), 1);
    assert!(table.column("of_the_burn").is_none() && table.column("polar_angle_rad").is_some());
    let r = RADIUS + 1e5;
    for row in 0..table.times.len() {
        assert!((column("altitude_m")[row] - 1e5).abs() < POSITION);
        assert!((column("speed_m_per_s")[row] - r * RATE).abs() < VELOCITY);
        assert!(column("flight_path_angle_deg")[row].abs() < DEGREES);
        // Over ground that turns eastwards below a prograde orbit a vehicle is slower.
        assert!(column("ground_speed_m_per_s")[row] < r * RATE - 3.0);
    }
    for (thrust, expected) in column("thrust_N").iter().zip([50.0, 50.0, 50.0, 50.0, 0.0, 0.0, 0.0]) {
        assert!((thrust - expected).abs() < DEGREES);
    }
    let (east, north) = (column("thrust_east_N")[0], column("thrust_north_N")[0]);
    // At the node the orbit climbs northwards by its inclination.
    assert!((north.atan2(east) - 0.5).abs() < DEGREES);
    assert!((column("longitude_deg")[0] - 0.3_f64.to_degrees()).abs() < DEGREES);
    assert!(column("latitude_deg")[0].abs() < DEGREES);
    let weight = 200.0 * 4.9028e12 / (r * r);
    assert!((column("thrust_to_weight")[0] - 50.0 / weight).abs() < DEGREES);
    assert!((column("shake_m_per_s2")[3] - 0.5).abs() < DEGREES);
    let above = column("above_site_m")[0];
    assert!((above - (r * 0.3_f64.cos() - RADIUS)).abs() < POSITION);
}

#[test]
fn fixed_states_are_carried_by_the_body() {
    let (fixed, inertial) = (table(Axes::Fixed, None), table(Axes::Inertial, None));
    let s = fixed.states[0];
    assert_eq!(s.fixed_position, [RADIUS + 1e5, 0.0, 0.0]);
    let axes = CentralBody::Moon.orientation(&fixed.epoch_of(0));
    let (position, velocity) = axes.to_icrf(s.fixed_position, s.fixed_velocity);
    assert_eq!((position, velocity), (s.position, s.velocity));
    assert_ne!(inertial.states[0].fixed_velocity, s.fixed_velocity);
}

/// The state that a message says is the one of the row, to the digits that are written.
#[test]
fn a_state_is_read_back_from_its_message() {
    let table = table(Axes::Inertial, None);
    let messages = Format::Opm.write(&table, &created()).unwrap();
    for ((name, text), row) in messages.into_iter().zip([0, 6]) {
        assert!(name.ends_with(".opm"));
        let read = StateVector::read_opm(&String::from_utf8(text).unwrap()).unwrap();
        assert_eq!(read.body, CentralBody::Moon);
        assert!(read.epoch.since(&table.epoch_of(row)).abs() < VELOCITY);
        let state = &table.states[row];
        for k in 0..3 {
            assert!((read.position[k] - state.position[k]).abs() < POSITION);
            assert!((read.velocity[k] - state.velocity[k]).abs() < VELOCITY);
        }
        assert_eq!(read.mass, state.mass);
    }
}

#[test]
fn a_segment_of_a_message_is_a_phase() {
    let text = String::from_utf8(file(&table(Axes::Inertial, None), Format::Oem)).unwrap();
    assert!(
        text.starts_with("CCSDS_OEM_VERS = 3.0\n") && text.contains("CREATION_DATE = 2026-01-02T03:04:05\n")
    );
    assert_eq!(text.matches("META_START").count(), 2);
    assert!(
        text.contains("STOP_TIME = 2030-01-01T00:00:25\n")
            && text.contains("START_TIME = 2030-01-01T00:00:25\n")
    );
    assert!(text.contains("TIME_SYSTEM = TDB\n") && text.contains("CENTER_NAME = MOON\n"));
    assert_eq!(text.lines().filter(|line| line.starts_with("2030-")).count(), 7);
}

/// A vehicle whose first axis is along the third of the mission: its quaternion there turns x to z.
#[test]
fn attitudes_are_those_from_inertial_axes_to_the_vehicle() {
    let q = [0.5_f64.sqrt(), 0.0, -0.5_f64.sqrt(), 0.0];
    let table = table(Axes::Inertial, Some(q));
    let text = String::from_utf8(file(&table, Format::Aem)).unwrap();
    let data: Vec<f64> = text
        .lines()
        .find(|line| line.starts_with("2030-"))
        .unwrap()
        .split(' ')
        .skip(1)
        .map(|v| v.parse().unwrap())
        .collect();
    let matrix = apsides_dynamics::attitude::rotation(&[data[3], data[0], data[1], data[2]]);
    let pole = apsides_dynamics::attitude::turned(&matrix, &[1.0, 0.0, 0.0]);
    let [position, velocity] = [table.states[0].position, table.states[0].velocity];
    let across = [0, 1, 2].map(|k| {
        let [i, j] = [(k + 1) % 3, (k + 2) % 3];
        (position[i] * velocity[j] - position[j] * velocity[i]) / ((RADIUS + 1e5).powi(2) * RATE)
    });
    assert!((0..3).all(|k| (pole[k] - across[k]).abs() < DEGREES), "{pole:?} {across:?}");
}

#[test]
fn documents_have_the_positions_over_the_ground() {
    let table = table(Axes::Inertial, Some([1.0, 0.0, 0.0, 0.0]));
    let document: serde_json::Value = serde_json::from_slice(&file(&table, Format::Czml)).unwrap();
    let place = &document[1]["position"];
    assert_eq!(place["referenceFrame"], "FIXED");
    // Both sides of the boundary are one sample.
    assert_eq!(place["cartesian"].as_array().unwrap().len(), 4 * 6);
    assert_eq!(place["cartesian"][1], table.states[0].fixed_position[0]);
    // TDB is 69.184 s ahead of UTC but for 74 microseconds (`tests/references/ephemeris_axes.txt`).
    assert!(place["epoch"].as_str().unwrap().starts_with("2029-12-31T23:58:50.81607"));
    assert_eq!(document[1]["orientation"]["unitQuaternion"].as_array().unwrap().len(), 5 * 6);
}

#[test]
fn tables_have_all_columns() {
    let table = table(Axes::Inertial, None);
    let text = String::from_utf8(file(&table, Format::Csv)).unwrap();
    let head = text.lines().next().unwrap();
    assert!(head.starts_with("phase,epoch_tdb,time_s,position_icrf_x_m,"));
    assert_eq!(head.split(',').count(), table.columns.len() + 3);
    assert!(text.lines().nth(5).unwrap().starts_with("coast,2030-01-01T00:00:25,25.0,"));
    assert!(text.lines().all(|line| !line.contains(",,")));
    let object: serde_json::Value = serde_json::from_slice(&file(&table, Format::Json)).unwrap();
    assert_eq!(object["columns"].as_array().unwrap().len(), table.columns.len() + 1);
    assert_eq!(object["phases"][1]["first_row"], 4);
    let archive = file(&table, Format::Npz);
    assert!(archive.starts_with(b"PK\x03\x04"));
    // Contents of arrays begin at multiples of 64 from the start of their file.
    let at = archive.windows(6).position(|w| w == b"\x93NUMPY").unwrap();
    assert_eq!(u16::from_le_bytes([archive[at + 8], archive[at + 9]]) % 64, 54);
}

struct Nowhere;

impl Flight for Nowhere {
    fn spans(&self) -> Vec<Span> {
        vec![Span { name: "only".into(), times: [0.0, 1.0] }]
    }

    fn about(&self) -> Option<About> {
        None
    }

    fn own(&self) -> Vec<Column> {
        vec![Column::new("x", "km")]
    }

    fn at(&self, _phase: usize, time: f64) -> Instant {
        Instant { point: None, own: vec![time] }
    }
}

#[test]
fn a_flight_without_a_place_has_its_own_columns_alone() {
    let plane = Plane { reference: Reference::Icrf, node: 0.0, inclination: 0.0, argument: 0.0 };
    let placing = Placing { epoch: Epoch::DEFAULT.parse().unwrap(), plane };
    let table = Ephemeris::of("own", &Nowhere, &placing, Sampling::Points(3)).unwrap();
    assert_eq!(table.column("x_km").unwrap(), [0.0, 0.5, 1.0]);
    for format in Format::ALL {
        match format.write(&table, &created()) {
            Ok(files) => assert!(!format.needs_place() && !files.is_empty()),
            Err(e) => {
                assert!(
                    format.needs_place() && e.to_string().contains("three of velocity (m/s) would be needed"),
                    "{e}"
                )
            }
        }
    }
    let point = super::tests::table(Axes::Inertial, None);
    let message = Format::Aem.write(&point, &created()).unwrap_err().to_string();
    assert!(message.contains("needs an attitude"), "{message}");
    assert_eq!("OEM".parse::<Format>().unwrap(), Format::Oem);
    assert!("xlsx".parse::<Format>().unwrap_err().to_string().contains("formats: csv, json, npz, oem"));
}

#[test]
fn messages_that_are_none_are_refused_with_the_line() {
    let good = "CCSDS_OPM_VERS = 2.0\nCENTER_NAME = EARTH\nREF_FRAME = ICRF\nTIME_SYSTEM = UTC\nEPOCH = 2026-001T00:00:00Z\n\
                X = 6503.514 [km]\nY = 1239.647\nZ = -717.49\nX_DOT = -0.87\nY_DOT = 8.74 [km/s]\nZ_DOT = -4.19\n";
    let read = StateVector::read_opm(good).unwrap();
    assert_eq!((read.position[0], read.mass), (6_503_514.0, None));
    for (from, to, words) in [
        ("CCSDS_OPM_VERS = 2.0\n", "", "begins with `CCSDS_OPM_VERS"),
        ("EARTH", "VENUS", "line 2: `CENTER_NAME` is `VENUS`, taken are EARTH, MOON, MARS"),
        ("ICRF", "TEME", "taken are ICRF, GCRF, IAU_EARTH"),
        ("UTC", "GPS", "taken are TAI, TT, TDB, UTC"),
        ("Z_DOT = -4.19\n", "", "`Z_DOT` is missing"),
        ("8.74 [km/s]", "8.74 [m/s]", "line 10: `Y_DOT` is in m/s, the standard has km/s"),
        ("1239.647", "nan", "a finite number is needed"),
        ("Y = 1239.647", "Y 1239.647", "line 7: `Y 1239.647` is no keyword"),
        ("Y = 1239.647", "X = 1239.647", "`X` stands twice"),
        ("2026-001T00:00:00Z", "2026-400T00:00:00", "of a day that there is"),
    ] {
        let message = StateVector::read_opm(&good.replace(from, to)).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
    assert!(StateVector::read_opm("").is_err());
    let fixed = StateVector::read_opm(&good.replace("ICRF", "IAU_EARTH")).unwrap();
    assert_ne!(fixed.position, read.position);
}

/// The circle in three parts: the thrust of the burn jumps at 10 s.
struct OfTwoThrusts(Circle);

impl Flight for OfTwoThrusts {
    fn spans(&self) -> Vec<Span> {
        [("burn", [0.0, 10.0]), ("burn", [10.0, 25.0]), ("coast", [25.0, 40.0])]
            .map(|(name, times)| Span { name: name.into(), times })
            .into()
    }

    fn about(&self) -> Option<About> {
        self.0.about()
    }

    fn own(&self) -> Vec<Column> {
        self.0.own()
    }

    fn at(&self, span: usize, time: f64) -> Instant {
        self.0.at(usize::from(span == 2), time)
    }
}

#[test]
fn parts_of_a_phase_are_one_phase_and_segments_of_their_own_in_messages() {
    let plane = Plane { reference: Reference::Icrf, node: 0.0, inclination: 0.0, argument: 0.0 };
    let placing = Placing { epoch: Epoch::DEFAULT.parse().unwrap(), plane };
    let flight = OfTwoThrusts(Circle { axes: Axes::Inertial, attitude: Some([1.0, 0.0, 0.0, 0.0]) });
    let table = Ephemeris::of("two", &flight, &placing, Sampling::Step(5.0)).unwrap();
    let burn = &table.phases[0];
    assert_eq!((table.phases.len(), &burn.rows, &burn.arcs[..]), (2, &(0..7), &[0..3, 3..7][..]));
    assert_eq!(table.times[2..4], [10.0, 10.0]);
    for format in [Format::Oem, Format::Aem] {
        let files = format.write(&table, &created()).unwrap();
        let text = String::from_utf8(files[0].1.clone()).unwrap();
        assert_eq!((text.matches("META_START").count(), text.matches("COMMENT phase burn").count()), (3, 2));
        assert_eq!(text.matches("T00:00:10").count(), 4, "{text}");
    }
}

#[test]
fn names_in_messages_are_of_printable_ascii_characters() {
    let mut table = table(Axes::Inertial, Some([1.0, 0.0, 0.0, 0.0]));
    for (name, written) in
        [("Mond-L\u{e4}nder\n2", "MOND-L_NDER_2"), ("", "UNKNOWN"), (" \t", "UNKNOWN"), ("a b", "A B")]
    {
        table.name = name.into();
        table.phases[0].name = "d\u{e9}part\r".into();
        for format in [Format::Oem, Format::Aem, Format::Opm] {
            let files = format.write(&table, &created()).unwrap();
            let text = String::from_utf8(files[0].1.clone()).unwrap();
            assert!(text.contains(&format!("\nOBJECT_NAME = {written}\nOBJECT_ID = {written}\n")), "{text}");
            assert!(
                text.contains("COMMENT phase d_part_") || text.contains("COMMENT phase d_part\n"),
                "{text}"
            );
            assert!(text.chars().all(|c| c == '\n' || c == ' ' || c.is_ascii_graphic()), "{text}");
        }
    }
}
