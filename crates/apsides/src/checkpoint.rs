//! A search on disk: where it was, so that it goes on after the program was killed.

use std::path::{Path, PathBuf};

use apsides_metaheuristics::Run;
use serde::{Deserialize, Serialize};

use crate::{Error, Mission};

/// The file of a search, for one mission and seed.
pub(crate) struct Checkpoint<'a> {
    path: &'a Path,
    /// All values of the mission, and the seed.
    mission: String,
}

#[derive(Serialize)]
struct Written<'a> {
    mission: &'a str,
    run: &'a Run,
}

#[derive(Deserialize)]
struct Read {
    mission: String,
    run: Run,
}

impl<'a> Checkpoint<'a> {
    pub(crate) fn new(path: &'a Path, mission: &Mission) -> Self {
        Self { path, mission: format!("{}\nseed {}\n", mission.to_file(), mission.seed) }
    }

    /// The search so far, if there is one.
    pub(crate) fn read(&self) -> Result<Option<Run>, Error> {
        let text = match std::fs::read_to_string(self.path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(self.refuse(&e.to_string())),
        };
        let read: Read = serde_json::from_str(&text).map_err(|e| {
            self.refuse(&format!("is no checkpoint of a search ({e}); delete it or name another file"))
        })?;
        if read.mission != self.mission {
            return Err(self.refuse(
                "belongs to a mission with other values or another seed; delete it or name another file",
            ));
        }
        Ok(Some(read.run))
    }

    /// Writes beside the file, then takes its place: a file that is there is always whole.
    pub(crate) fn write(&self, run: &Run) -> Result<(), Error> {
        let fail = |e: &dyn std::fmt::Display| self.refuse(&e.to_string());
        let text = serde_json::to_string(&Written { mission: &self.mission, run }).map_err(|e| fail(&e))?;
        let mut name = self.path.as_os_str().to_owned();
        name.push(".partial");
        let partial = PathBuf::from(name);
        std::fs::write(&partial, text).map_err(|e| fail(&e))?;
        std::fs::rename(&partial, self.path).map_err(|e| fail(&e))
    }

    fn refuse(&self, reason: &str) -> Error {
        Error::File { path: self.path.into(), reason: reason.into() }
    }
}
