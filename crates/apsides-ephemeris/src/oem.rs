//! Orbit ephemeris messages: CCSDS 502.0-B-3, section 5, as text of keywords and values.
//!
//! Each part of a phase along which no control jumps is a segment of its own, so that nothing is interpolated across a jump of the thrust or
//! the velocity; at the end of a segment and at the start of the next stand both states. Positions in km, velocities in km/s, in axes of the
//! ICRF at the centre of the body.

use crate::Epoch;
use crate::kvn::{Message, rows_of_message};
use crate::table::Ephemeris;

/// Name of the file.
pub(crate) const FILE: &str = "ephemeris.oem";

/// Most states that an interpolation takes: a polynomial through them and their rates has seven degrees.
const MOST_STATES: usize = 4;

/// The message of an ephemeris with a place.
pub(crate) fn write(table: &Ephemeris, created: &Epoch) -> String {
    let mut message = Message::begin("CCSDS_OEM_VERS", "3.0", table, created);
    for (phase, rows) in table.arcs() {
        let rows = rows_of_message(table, rows);
        let (Some((_, start)), Some((_, stop))) = (rows.first(), rows.last()) else { continue };
        message.begin_segment(table, phase, &[("REF_FRAME", "ICRF")], [start, stop]);
        message.set("INTERPOLATION", "HERMITE");
        message.set("INTERPOLATION_DEGREE", &(2 * rows.len().clamp(1, MOST_STATES) - 1).to_string());
        message.line(format_args!("META_STOP\n"));
        for (row, instant) in &rows {
            let state = &table.states[*row];
            let [x, y, z] = state.position.map(|c| c / 1e3);
            let [u, v, w] = state.velocity.map(|c| c / 1e3);
            message.line(format_args!("{instant} {x:.9} {y:.9} {z:.9} {u:.12} {v:.12} {w:.12}"));
        }
    }
    message.text()
}
