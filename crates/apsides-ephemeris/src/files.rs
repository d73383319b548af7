//! The files of an ephemeris.

use std::str::FromStr;

use crate::format::Format;
use crate::table::Ephemeris;
use crate::{EphemerisError, Epoch, aem, czml, npz, oem, opm, text};

/// A file name and its content.
pub type NamedFile = (&'static str, Vec<u8>);

/// The states that a place takes.
pub const NEEDED: &str = "three coordinates of position (m) and three of velocity (m/s) would be needed, by a kind of mission that says them";

impl Format {
    /// Names of all files that the formats have.
    pub const FILES: [&'static str; 8] =
        [text::CSV, text::JSON, npz::FILE, oem::FILE, opm::FILES[0], opm::FILES[1], aem::FILE, czml::FILE];

    /// The files of an ephemeris in this format; messages say that they were made at `created`.
    ///
    /// # Errors
    /// [`EphemerisError::NoPlace`], [`EphemerisError::NoAttitude`] where the flight does not have what the format needs.
    pub fn write(self, table: &Ephemeris, created: &Epoch) -> Result<Vec<NamedFile>, EphemerisError> {
        let flight = || format!("`{}`", table.name);
        if self.needs_place() && table.body.is_none() {
            return Err(EphemerisError::NoPlace { format: self, flight: flight(), needed: NEEDED });
        }
        if self == Self::Aem && table.states.iter().any(|s| s.attitude.is_none()) {
            return Err(EphemerisError::NoAttitude { format: self, flight: flight() });
        }
        Ok(match self {
            Self::Csv => vec![(text::CSV, text::csv(table)?)],
            Self::Json => vec![(text::JSON, text::json(table)?)],
            Self::Npz => vec![(npz::FILE, npz::write(table)?)],
            Self::Oem => vec![(oem::FILE, oem::write(table, created).into_bytes())],
            Self::Opm => {
                let rows = [0, table.times.len().saturating_sub(1)];
                let message = |row| opm::write(table, row, created).into_bytes();
                opm::FILES.into_iter().zip(rows.map(message)).collect()
            }
            Self::Aem => vec![(aem::FILE, aem::write(table, created).into_bytes())],
            Self::Czml => vec![(czml::FILE, czml::write(table)?)],
        })
    }
}

impl FromStr for Format {
    type Err = EphemerisError;

    fn from_str(text: &str) -> Result<Self, EphemerisError> {
        let word = text.trim().to_ascii_lowercase();
        let found = Self::ALL.into_iter().find(|format| format.word() == word);
        found.ok_or_else(|| EphemerisError::Format { word: text.into() })
    }
}
