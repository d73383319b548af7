//! A search on disk: where it was, so that it goes on after the program was killed.

use apsides_metaheuristics::Run;
use apsides_two_layer::Checkpoint;
use serde::{Deserialize, Serialize};

use super::super::CheckpointFile;
use crate::Error;
use crate::regular_file;
use crate::sealed::{seal, unseal};
use crate::whole_file::write_whole;

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

impl CheckpointFile {
    /// The search so far, if there is one.
    fn read(&self) -> Result<Option<Run>, Error> {
        let content = match regular_file::read(&self.path) {
            Ok(content) => content,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(self.refuse(&e.to_string())),
        };
        let Some(text) = unseal(&content) else {
            return Err(self.refuse(
                "is no checkpoint of a search, or was changed since it was written; delete it or name another file",
            ));
        };
        let read: Read = serde_json::from_str(text).map_err(|e| {
            self.refuse(&format!("is no checkpoint of a search ({e}); delete it or name another file"))
        })?;
        if read.mission != self.mission {
            return Err(self.refuse(
                "belongs to a mission with other values or another seed; delete it or name another file",
            ));
        }
        Ok(Some(read.run))
    }

    /// A file that is there is always whole.
    fn write(&self, run: &Run) -> Result<(), Error> {
        let fail = |e: &dyn std::fmt::Display| self.refuse(&e.to_string());
        let text = serde_json::to_string(&Written { mission: &self.mission, run }).map_err(|e| fail(&e))?;
        write_whole(&self.path, seal(&text).as_bytes()).map_err(|e| fail(&e))
    }

    fn refuse(&self, reason: &str) -> Error {
        Error::File { path: self.path.clone(), reason: reason.into() }
    }
}

impl Checkpoint for CheckpointFile {
    fn load(&self) -> Result<Option<Run>, Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.read()?)
    }

    fn save(&self, run: &Run) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.write(run)?)
    }
}
