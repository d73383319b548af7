//! The common part of CCSDS messages in keywords and values: lines of printable ASCII characters (CCSDS 502.0-B-3, section 7).

use std::fmt::Write as _;

use crate::table::Ephemeris;
use crate::{Epoch, TimeScale};

/// Name of who makes the messages.
const ORIGINATOR: &str = "APSIDES";

/// Name of an object that has none.
const UNNAMED: &str = "UNKNOWN";

/// A message that is being written: lines of keywords and values.
pub(crate) struct Message(String);

// Writing into a `String` cannot fail, hence the discarded results.

impl Message {
    /// The head of a message: its standard with its version, then what it is about, and when and by whom it was made.
    pub(crate) fn begin(standard: &str, version: &str, table: &Ephemeris, created: &Epoch) -> Self {
        let mut message = Self(format!("{standard} = {version}\n"));
        message.comment(&format!("Ephemeris of the solution of mission {}", table.name));
        message.set("CREATION_DATE", &created.in_scale(TimeScale::Utc).calendar());
        message.set("ORIGINATOR", ORIGINATOR);
        message
    }

    pub(crate) fn line(&mut self, line: std::fmt::Arguments<'_>) {
        let _ = writeln!(self.0, "{line}");
    }

    pub(crate) fn comment(&mut self, text: &str) {
        self.line(format_args!("COMMENT {}", printable(text)));
    }

    pub(crate) fn set(&mut self, key: &str, value: &str) {
        self.line(format_args!("{key} = {value}"));
    }

    /// The object: its name, which is its designator too.
    pub(crate) fn object(&mut self, table: &Ephemeris) {
        let name = printable(&table.name).to_uppercase();
        let name = if name.is_empty() { UNNAMED } else { &name };
        self.set("OBJECT_NAME", name);
        self.set("OBJECT_ID", name);
    }

    /// Begins a segment, part of a phase: the object, its centre, the axes by their keys, and the times of the first and the last row.
    pub(crate) fn begin_segment(
        &mut self,
        table: &Ephemeris,
        phase: &str,
        axes: &[(&str, &str)],
        [start, stop]: [&str; 2],
    ) {
        self.line(format_args!("\nMETA_START"));
        self.comment(&format!("phase {phase}"));
        self.object(table);
        self.set("CENTER_NAME", table.body.map_or("", |body| body.word()));
        axes.iter().for_each(|(key, value)| self.set(key, value));
        self.set("TIME_SYSTEM", table.epoch.scale().word());
        self.set("START_TIME", start);
        self.set("STOP_TIME", stop);
    }

    pub(crate) fn text(self) -> String {
        self.0
    }
}

/// A name as the standard allows it: `_` in place of what is no printable ASCII character, without blanks around it.
fn printable(name: &str) -> String {
    let allowed = |c: char| if c == ' ' || c.is_ascii_graphic() { c } else { '_' };
    name.trim().chars().map(allowed).collect()
}

/// Rows of a segment whose instants, as they are written, follow each other.
pub(crate) fn rows_of_message(table: &Ephemeris, rows: std::ops::Range<usize>) -> Vec<(usize, String)> {
    let mut kept: Vec<(usize, String)> = Vec::with_capacity(rows.len());
    for row in rows {
        let instant = table.epoch_of(row).calendar();
        if kept.last().is_none_or(|(_, last)| *last != instant) {
            kept.push((row, instant));
        }
    }
    kept
}

/// The largest degree of an interpolation between so many rows, odd for one that takes velocities too.
pub(crate) fn degree(rows: usize, most: usize) -> usize {
    (rows.saturating_sub(1)).clamp(1, most)
}
