//! The landing zone of 356 x 91 km, and the zone of perilunes from which it is reached: (5.1) to (5.4).

use super::case::{BRAKING, SolvedCase, solve};
use super::comparison::{self, Compared, row, to};
use super::orbit::{RADIUS, SITE};
use crate::change::{Change, number};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::Stop;
use crate::workers::Workers;

/// Sizes of the landing zone eastwards and northwards, of the zone of perilunes as printed, and of the way of the braking as printed in
/// the text and as it follows from these sizes; km.
const ZONE_KM: [f64; 2] = [356.0, 91.0];
const PRINTED_ZONE_KM: [f64; 2] = [584.86, 319.86];
const PRINTED_WAY_KM: f64 = 11.443;
/// Corners of the region of perilunes as printed: "(55.30W; 16.56W), (55.30N; 40.50N)"; deg.
const PRINTED_WEST: [f64; 2] = [55.30, 16.56];
const PRINTED_NORTH: [f64; 2] = [55.30, 40.50];
/// Half a unit of the last digit of the sizes, km, and those of a way with a misplaced point.
const HALF_DIGIT_KM: f64 = 5e-3;
/// Half a unit of sizes without digits behind the point, km.
const HALF_KM: f64 = 0.5;

/// Rows of the sizes eastwards and northwards.
const LABELS: [[&str; 5]; 2] = [
    [
        "zone with ten times the printed way on all sides, eastwards, km",
        "zone with the way of the optimum on all sides, eastwards, km",
        "perilunes of four courses to the corners, eastwards, km",
        "perilunes of the course northwards to the corners, eastwards, km",
        "span of the printed corners, eastwards, km",
    ],
    [
        "zone with ten times the printed way on all sides, northwards, km",
        "zone with the way of the optimum on all sides, northwards, km",
        "perilunes of four courses to the corners, northwards, km",
        "perilunes of the course northwards to the corners, northwards, km",
        "span of the printed corners, northwards, km",
    ],
];

/// A course of the orbit at the perilune.
struct Course {
    name: &'static str,
    azimuth_deg: f64,
    way_label: &'static str,
}

/// Courses around the sky, the first that of the paper.
static COURSES: [Course; 4] = [
    Course { name: "northwards", azimuth_deg: 0.0, way_label: "way of the braking, course northwards, km" },
    Course { name: "eastwards", azimuth_deg: 90.0, way_label: "way of the braking, course eastwards, km" },
    Course { name: "southwards", azimuth_deg: 180.0, way_label: "way of the braking, course southwards, km" },
    Course { name: "westwards", azimuth_deg: 270.0, way_label: "way of the braking, course westwards, km" },
];
/// Corners of the zone, in parts of its half sizes, around it.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Kilometres of a degree of latitude, and of one of longitude at the site.
fn km_per_degree() -> [f64; 2] {
    let north = RADIUS.to_radians() / 1e3;
    [north * SITE[1].to_radians().cos(), north]
}

/// Longitude and latitude of the corners of the landing zone, deg.
fn corners() -> [[f64; 2]; 4] {
    let km = km_per_degree();
    CORNERS.map(|corner| std::array::from_fn(|k| SITE[k] + corner[k] * 0.5 * ZONE_KM[k] / km[k]))
}

/// The way of the braking on the ground (km), its propellant (kg), and the longitude and latitude of its perilune (deg).
struct Perilune {
    way: f64,
    propellant: f64,
    place: [f64; 2],
}

impl Perilune {
    fn of(solved: &SolvedCase) -> Self {
        let place = ["perilune_longitude_deg", "perilune_latitude_deg"].map(|k| solved.get(k));
        Self {
            way: solved.get("central_angle_deg").to_radians() * RADIUS / 1e3,
            propellant: solved.get("propellant_kg"),
            place,
        }
    }
}

/// The perilunes of a course for the corners of the landing zone.
struct Zone {
    course: &'static Course,
    perilunes: Vec<Perilune>,
}

impl Zone {
    fn places(&self) -> Vec<[f64; 2]> {
        self.perilunes.iter().map(|p| p.place).collect()
    }

    fn mean(&self, of: fn(&Perilune) -> f64) -> f64 {
        self.perilunes.iter().map(of).sum::<f64>() / self.perilunes.len() as f64
    }

    /// The mean way of the braking, km.
    fn way(&self) -> f64 {
        self.mean(|p| p.way)
    }
}

/// East and north extent of places, km.
fn extent(places: &[[f64; 2]]) -> [f64; 2] {
    let km = km_per_degree();
    std::array::from_fn(|k| {
        let of = |start: f64, pick: fn(f64, f64) -> f64| places.iter().map(|p| p[k]).fold(start, pick);
        (of(f64::NEG_INFINITY, f64::max) - of(f64::INFINITY, f64::min)) * km[k]
    })
}

pub(super) fn sheet(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let jobs: Vec<(f64, [f64; 2])> =
        COURSES.iter().flat_map(|c| corners().map(|corner| (c.azimuth_deg, corner))).collect();
    let solved = workers.all(&jobs, |(course, [longitude, latitude]), observer| {
        let changes: [Change<'_>; 3] = [
            number("orbit_azimuth_deg", *course),
            number("site_longitude_deg", *longitude),
            number("site_latitude_deg", *latitude),
        ];
        solve(BRAKING, &changes, observer)
    })?;
    let mut failures = Vec::new();
    let mut unverified = Sheet::default();
    let mut zones = COURSES.each_ref().map(|course| Zone { course, perilunes: Vec::new() });
    for (k, found) in solved.into_iter().enumerate() {
        let Some(zone) = zones.get_mut(k / CORNERS.len()) else { continue };
        match found {
            Ok(case) => {
                case.check(
                    &format!("corner {} of the zone, {}", k % CORNERS.len() + 1, zone.course.name),
                    &mut unverified,
                );
                zone.perilunes.push(Perilune::of(&case));
            }
            Err(why) => failures.push(why),
        }
    }
    let mut sheet = comparison::sheet(
        "landing-zone",
        "Landing zone of 356 x 91 km and the zone of perilunes (5.1) to (5.4), beside perilunes of the optimal braking to its corners",
        rows(&zones),
    );
    sheet.failures = failures;
    sheet.unverified = unverified.unverified;
    sheet.findings.push(
        "The printed zone of perilunes is the landing zone with the printed way of the braking, its point one place to the right, on all sides. That is \
         the zone of all courses; the orbit of the paper has one, for which the perilunes are a zone of the size of the landing zone, away from it by the way."
            .into(),
    );
    let propellants: Vec<String> =
        zones.iter().map(|z| format!("{:.2} kg {}", z.mean(|p| p.propellant), z.course.name)).collect();
    sheet.findings.push(format!(
        "Propellant by course: {}. The Moon turns eastwards with 3.3 m/s at the site; the optimum is flat, so that this moves the perilune by tens of \
         kilometres.",
        propellants.join(", ")
    ));
    sheet.graphs = vec![map(&zones)];
    Ok(sheet)
}

fn rows(zones: &[Zone]) -> Vec<Compared<'static>> {
    let places: Vec<[f64; 2]> = zones.iter().flat_map(|z| &z.perilunes).map(|p| p.place).collect();
    let whole = extent(&places);
    let northwards = zones.first();
    let one_course = extent(&northwards.map(Zone::places).unwrap_or_default());
    let way = northwards.map_or(f64::NAN, Zone::way);
    let km = km_per_degree();
    let way_of_sizes = to(0.5 * (PRINTED_ZONE_KM[0] - ZONE_KM[0]), HALF_DIGIT_KM);
    let short = "the sizes have a quarter of the way of the optimum on all sides";
    let mixed = "the corners, with their letters, do not span the printed sizes";
    let (tenfold, plain) = (10.0 * PRINTED_WAY_KM, String::new);
    let mut rows = vec![row(
        "way of the braking in the printed sizes, as ten times that of the text, km",
        way_of_sizes,
        tenfold,
        None,
        plain(),
    )];
    for zone in zones {
        rows.push(row(zone.course.way_label, way_of_sizes, zone.way(), None, short));
    }
    for (k, labels) in LABELS.iter().enumerate() {
        let printed = to(PRINTED_ZONE_KM[k], HALF_DIGIT_KM);
        let with = |way: f64| ZONE_KM[k] + 2.0 * way;
        let corners = [PRINTED_WEST, PRINTED_NORTH][k];
        rows.push(row(labels[0], printed, with(tenfold), None, plain()));
        rows.push(row(labels[1], printed, with(way), None, short));
        rows.push(row(labels[2], printed, whole[k], None, short));
        rows.push(row(labels[3], to(ZONE_KM[k], HALF_KM), one_course[k], None, plain()));
        rows.push(row(labels[4], printed, (corners[0] - corners[1]) * km[k], None, mixed));
    }
    rows
}

/// Landing zone and perilunes on a map.
fn map(zones: &[Zone]) -> Graph {
    let closed = |places: &[[f64; 2]]| {
        let mut line = places.to_vec();
        line.extend(places.first().copied());
        line
    };
    let series = |label: &str, places: &[[f64; 2]]| GraphSeries {
        label: label.into(),
        line: closed(places),
        dots: Vec::new(),
    };
    let [west, east] = PRINTED_WEST.map(|d| -d);
    let [north, south] = PRINTED_NORTH;
    let mut all = vec![
        series("landing zone", &corners()),
        series("printed region of perilunes", &[[west, south], [east, south], [east, north], [west, north]]),
    ];
    all.extend(zones.iter().map(|z| series(&format!("perilunes, course {}", z.course.name), &z.places())));
    Graph {
        file: "landing_zone.svg",
        title: "Landing zone, and perilunes for its corners".into(),
        x: ("longitude", "deg"),
        y: ("latitude", "deg"),
        series: all,
    }
}
