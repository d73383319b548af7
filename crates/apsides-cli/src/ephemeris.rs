//! Ephemerides beside the files of a solve or a simulation.

use std::path::Path;

use apsides::Pipeline;
use apsides::ephemeris::{Ephemeris, Epoch, Format, Sampling};
use apsides_report::{Item, ephemeris_files};

use crate::arguments::EphemerisArguments;
use crate::exit::{Refusal, refusal};

impl EphemerisArguments {
    /// The spacing and the formats that are asked for; refused before any work where the mission does not have what they need.
    pub(crate) fn asked(
        &self,
        mission: &Pipeline,
        out: Option<&Path>,
    ) -> Result<Option<(Sampling, Vec<Format>)>, Refusal> {
        let Some(sampling) = self.rows.sampling() else { return Ok(None) };
        if out.is_none() {
            return Err("--step and --points write files: say where, with --out DIR".into());
        }
        let formats = if self.format.is_empty() { vec![Format::Csv] } else { self.format.clone() };
        mission.check_formats(&formats).map_err(refusal)?;
        Ok(Some((sampling, formats)))
    }
}

/// The files of an ephemeris.
pub(crate) fn files(table: &Ephemeris, formats: &[Format]) -> Result<Vec<Item>, Refusal> {
    ephemeris_files(table, formats, &Epoch::now()).map_err(refusal)
}
