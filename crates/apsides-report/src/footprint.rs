//! Footprints: boundary points as CSV, everything as JSON, a map.

use std::path::{Path, PathBuf};

use apsides_pipeline::footprint::{BoundaryPoint, FEWEST_BEARINGS, Footprint};

use crate::files::{Item, json, replace, table_error};
use crate::number::readable;
use crate::trajectory_csv::shortest;
use crate::{Axis, Figure, Page, ReportError, Series, stacked_svg};

const JSON: &str = "footprint.json";
const DATA: &str = "footprint.csv";
const MAP: &str = "footprint.svg";
const PAGE: &str = "footprint.html";

const HEADS: [&str; 11] = [
    "kind",
    "bearing_deg",
    "distance_km",
    "longitude_deg",
    "latitude_deg",
    "flight_time_s",
    "downrange_km",
    "crossrange_km",
    "status",
    "verdict",
    "verified",
];

/// Writes `footprint.csv`, `footprint.json`, `footprint.svg` and `footprint.html` into a directory, and returns the paths written.
///
/// # Errors
/// [`ReportError`] with the path and the reason. The earlier content of the directory is then as it was.
pub fn write_footprint(dir: &Path, footprint: &Footprint) -> Result<Vec<PathBuf>, ReportError> {
    let items: Vec<Item> = vec![
        (DATA, Some(data(footprint)?)),
        (JSON, Some(json(JSON, footprint)?)),
        (MAP, Some(stacked_svg(&[footprint_map(footprint)]).into_bytes())),
        (PAGE, Some(page(footprint).into_bytes())),
    ];
    replace(dir, &items)
}

/// The outline with its points, the ground track of the mission's own flight, start and target, to scale in the middle of the map.
#[must_use]
pub fn footprint_map(footprint: &Footprint) -> Figure {
    let places: Vec<[f64; 2]> = footprint.points.iter().map(BoundaryPoint::place).collect();
    let closed = places.iter().chain(places.first()).copied().collect();
    let shown =
        places.iter().chain(&footprint.track_deg).chain([&footprint.start_deg, &footprint.target_deg]);
    let (south, north) = (shown.map(|p| p[1]))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let middle = 0.5 * (south + north);
    let title = format!("{}: ends within reach at {} km", footprint.mission, footprint.altitude_km);
    Figure::new(title, Axis::new("longitude", "deg"), Axis::new("latitude", "deg"))
        .with(Series::line("boundary", closed))
        .with(Series::dots("", places).colored(0))
        .with(Series::line("ground track", footprint.track_deg.clone()).colored(1))
        .with(Series::dots("start", vec![footprint.start_deg]).colored(2))
        .with(Series::dots("target", vec![footprint.target_deg]).colored(3))
        .to_scale(1.0 / middle.to_radians().cos())
}

/// The page: what is within reach in a sentence, the map, each end.
fn page(f: &Footprint) -> String {
    let mut page = Page::new(&format!("Footprint of {}", f.mission));
    let number = |v: f64| readable(v, DIGITS);
    page.lead(&if f.points.len() < FEWEST_BEARINGS {
        format!("{} ends were found, too few for an outline.", f.points.len())
    } else {
        let side = if f.target_inside { "inside" } else { "outside" };
        format!(
            "At {} km altitude {} km\u{b2} are within reach: {} km along the entry course and {} km across it; the target is {side}, {} km from \
             the boundary.",
            number(f.altitude_km),
            number(f.area_km2),
            number(f.length_km()),
            number(f.width_km()),
            number(f.target_margin_km.abs())
        )
    });
    if !f.complete {
        page.lead("The work was ended before all bearings were sought: the outline is that of the ends that were found.");
    }
    page.facts(&[
        ("ends within reach", f.points.len().to_string()),
        ("verified as optima", f.verified.to_string()),
        ("problems solved", f.cases.to_string()),
        ("without an end", f.failures.len().to_string()),
    ]);
    page.figures(&[footprint_map(f)]);
    page.heading("Ends");
    let row = |p: &BoundaryPoint| {
        let numbers = [p.bearing_deg, p.distance_km, p.longitude_deg, p.latitude_deg, p.flight_time_s];
        let numbers = numbers.into_iter().chain([p.downrange_km, p.crossrange_km]).map(number);
        let first = std::iter::once(p.verdict.to_string()).chain(std::iter::once(p.kind.word().to_owned()));
        first.chain(numbers).collect::<Vec<_>>()
    };
    let heads = [
        "verdict",
        "kind",
        "bearing (deg)",
        "distance (km)",
        "longitude (deg)",
        "latitude (deg)",
        "flight time (s)",
        "downrange (km)",
        "crossrange (km)",
    ];
    page.table(&heads, &f.points.iter().map(row).collect::<Vec<_>>());
    if !f.failures.is_empty() {
        page.heading("Without an end");
        page.list(&f.failures);
    }
    page.finish()
}

/// Significant digits of a number on the page.
const DIGITS: usize = 6;

fn data(footprint: &Footprint) -> Result<Vec<u8>, ReportError> {
    let failed = |e: csv::Error| table_error(DATA, e);
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(HEADS).map_err(failed)?;
    for p in &footprint.points {
        let numbers = [
            p.bearing_deg,
            p.distance_km,
            p.longitude_deg,
            p.latitude_deg,
            p.flight_time_s,
            p.downrange_km,
            p.crossrange_km,
        ];
        let last = [p.status.clone(), p.verdict.to_string(), p.verified.to_string()];
        let record = std::iter::once(p.kind.word().to_owned()).chain(numbers.map(shortest)).chain(last);
        csv.write_record(record).map_err(failed)?;
    }
    csv.into_inner().map_err(|e| table_error(DATA, e.into_error()))
}
