//! Attitude ephemeris messages: CCSDS 504.0-B-2, section 4, as text of keywords and values.
//!
//! The quaternion takes vectors from the axes of the ICRF to those of the vehicle; its scalar component is the last.

use crate::Epoch;
use crate::kvn::{Message, degree, rows_of_message};
use crate::table::Ephemeris;

/// Name of the file.
pub(crate) const FILE: &str = "ephemeris.aem";

/// Largest degree of interpolation between the attitudes of a segment.
const MOST_DEGREE: usize = 3;

/// The message of an ephemeris with attitudes.
pub(crate) fn write(table: &Ephemeris, created: &Epoch) -> String {
    let mut message = Message::begin("CCSDS_AEM_VERS", "2.0", table, created);
    for (phase, rows) in table.arcs() {
        let rows = rows_of_message(table, rows);
        let (Some((_, start)), Some((_, stop))) = (rows.first(), rows.last()) else { continue };
        let axes = [("REF_FRAME_A", "ICRF"), ("REF_FRAME_B", "SC_BODY_1")];
        message.begin_segment(table, phase, &axes, [start, stop]);
        message.set("ATTITUDE_TYPE", "QUATERNION");
        message.set("INTERPOLATION_METHOD", "LAGRANGE");
        message.set("INTERPOLATION_DEGREE", &degree(rows.len(), MOST_DEGREE).to_string());
        message.line(format_args!("META_STOP\n\nDATA_START"));
        // Of the two quaternions of an attitude the one that is nearer to the last, so that they can be interpolated.
        let mut last = [0.0; 4];
        for (row, instant) in &rows {
            let Some(q) = table.states[*row].attitude else { continue };
            let turned_over = q.iter().zip(last).map(|(a, b)| a * b).sum::<f64>() < 0.0;
            let q = if turned_over { q.map(|c| -c) } else { q };
            last = q;
            let [w, x, y, z] = q;
            message.line(format_args!("{instant} {x:.15} {y:.15} {z:.15} {w:.15}"));
        }
        message.line(format_args!("DATA_STOP"));
    }
    message.text()
}
