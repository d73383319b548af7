//! Footprints: boundary points as CSV, everything as JSON, a map.

use std::path::{Path, PathBuf};

use apsides_pipeline::footprint::{BoundaryPoint, Footprint};

use crate::files::{Item, json, replace, table_error};
use crate::trajectory_csv::shortest;
use crate::{Axis, Figure, ReportError, Series};

const JSON: &str = "footprint.json";
const DATA: &str = "footprint.csv";
const MAP: &str = "footprint.svg";

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

/// Writes `footprint.csv`, `footprint.json` and `footprint.svg` into a directory, and returns the paths written.
///
/// # Errors
/// [`ReportError`] with the path and the reason. The earlier content of the directory is then as it was.
pub fn write_footprint(dir: &Path, footprint: &Footprint) -> Result<Vec<PathBuf>, ReportError> {
    let items: Vec<Item> = vec![
        (DATA, Some(data(footprint)?)),
        (JSON, Some(json(JSON, footprint)?)),
        (MAP, Some(footprint_map(footprint).to_svg().into_bytes())),
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
