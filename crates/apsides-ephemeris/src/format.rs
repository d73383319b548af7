//! Formats of ephemerides by their words.

/// A format of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// All columns as text.
    Csv,
    /// All columns as one JSON object.
    Json,
    /// All columns as arrays of NumPy.
    Npz,
    /// Orbit ephemeris message of the CCSDS, 502.0-B-3, as text of keywords and values.
    Oem,
    /// Orbit parameter messages of the CCSDS, 502.0-B-3, of the start and the end of the flight.
    Opm,
    /// Attitude ephemeris message of the CCSDS, 504.0-B-2.
    Aem,
    /// Document of Cesium.
    Czml,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 7] =
        [Self::Csv, Self::Json, Self::Npz, Self::Oem, Self::Opm, Self::Aem, Self::Czml];

    /// The word of the format.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Json => "json",
            Self::Npz => "npz",
            Self::Oem => "oem",
            Self::Opm => "opm",
            Self::Aem => "aem",
            Self::Czml => "czml",
        }
    }

    /// The words of all formats.
    #[must_use]
    pub fn words() -> String {
        Self::ALL.map(Self::word).join(", ")
    }

    /// Returns true if the format has positions about a body.
    #[must_use]
    pub const fn needs_place(self) -> bool {
        matches!(self, Self::Oem | Self::Opm | Self::Aem | Self::Czml)
    }
}
