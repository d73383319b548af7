//! Documents of Cesium: the flight as a point and a path that move with the clock.
//!
//! Positions are in axes fixed to the body, so that they stand over its ground. The clock of Cesium is UTC; its instants are those of the
//! flight, whatever scale the mission states.
//!
//! The CZML guide, <https://github.com/AnalyticalGraphicsInc/czml-writer/wiki/CZML-Guide>.

use serde_json::{Value, json};

use crate::kvn::degree;
use crate::orientation::turned_quaternion;
use crate::table::Ephemeris;
use crate::{EphemerisError, TimeScale};

/// Name of the file.
pub(crate) const FILE: &str = "ephemeris.czml";

/// Largest degree of interpolation.
const MOST_DEGREE: usize = 5;

/// Least time between samples, s: polynomials through nearer ones lose digits.
const APART: f64 = 1e-6;

/// Rows, once where both sides of a boundary have the same time but for rounding.
fn rows(table: &Ephemeris) -> Vec<usize> {
    let mut rows: Vec<usize> = Vec::with_capacity(table.times.len());
    for row in 0..table.times.len() {
        if rows.last().is_none_or(|last| table.times[row] - table.times[*last] > APART) {
            rows.push(row);
        }
    }
    rows
}

/// The document of an ephemeris with a place.
pub(crate) fn write(table: &Ephemeris) -> Result<Vec<u8>, EphemerisError> {
    let rows = rows(table);
    let utc = |row: usize| {
        let instant = table.epoch_of(row).in_scale(TimeScale::Utc);
        match instant.is_in(TimeScale::Utc) {
            true => Ok(format!("{}Z", instant.calendar())),
            false => Err(EphemerisError::Epoch {
                text: table.epoch.to_string(),
                reason: "`czml` needs dates in UTC, which begins with 1972".into(),
            }),
        }
    };
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(b"[]\n".to_vec()) };
    let (start, stop) = (utc(*first)?, utc(*last)?);
    let interval = format!("{start}/{stop}");
    let begin = table.times[*first];
    let mut position = Vec::with_capacity(4 * rows.len());
    let mut attitude = Vec::new();
    for row in &rows {
        let time = table.times[*row] - begin;
        position.push(time);
        position.extend(table.states[*row].fixed_position);
        if let Some([w, x, y, z]) = table.states[*row].attitude {
            let orientation = table.body.map(|body| body.orientation(&table.epoch_of(*row)));
            let to_fixed = |v| orientation.map_or(v, |o| o.vector_to_fixed(v));
            let [w, x, y, z] = turned_quaternion([w, x, y, z], &to_fixed);
            attitude.extend([time, x, y, z, w]);
        }
    }
    let sampled = |degree: usize| json!({"epoch": start, "interpolationAlgorithm": "LAGRANGE", "interpolationDegree": degree});
    let with = |mut sampled: Value, key: &str, value: Value| {
        sampled[key] = value;
        sampled
    };
    let place = with(sampled(degree(rows.len(), MOST_DEGREE)), "referenceFrame", json!("FIXED"));
    let mut vehicle = json!({
        "id": table.name,
        "name": table.name,
        "availability": interval,
        "description": format!("Flight of mission {} about the {}", table.name, table.body.map_or("", |b| b.word())),
        "position": with(place, "cartesian", json!(position)),
        "point": {"pixelSize": 8, "color": {"rgba": [230, 159, 0, 255]}},
        "path": {
            "material": {"solidColor": {"color": {"rgba": [0, 114, 178, 255]}}},
            "width": 2,
            "leadTime": 0,
            "resolution": 60,
        },
    });
    if !attitude.is_empty() {
        vehicle["orientation"] = with(sampled(1), "unitQuaternion", json!(attitude));
    }
    let document = json!([
        {
            "id": "document",
            "name": table.name,
            "version": "1.0",
            "clock": {"interval": interval, "currentTime": start, "multiplier": 10, "range": "LOOP_STOP"},
        },
        vehicle,
    ]);
    let failed = |source| EphemerisError::Table { file: FILE, source: Box::new(source) };
    let mut text = serde_json::to_vec(&document).map_err(failed)?;
    text.push(b'\n');
    Ok(text)
}
