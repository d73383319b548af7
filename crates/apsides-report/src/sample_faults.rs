//! The faults of samples while a run is at work: written as they come, so that a process that is killed loses none of them.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use apsides_pipeline::fault::Fault;
use apsides_pipeline::regular_file;
use apsides_pipeline::whole_file::write_whole;

use crate::ReportError;
use crate::files::failed;

/// Faults, an object of JSON a line. The manifest of a run that has ended has them, and the file is gone.
const FAULTS: &str = "faults.jsonl";

/// The file of the faults of a run at work. There is none before the first fault.
#[derive(Debug)]
pub struct FaultFile {
    path: PathBuf,
    file: Option<File>,
}

impl FaultFile {
    /// Takes up the file of an earlier process, and returns the faults of the samples before an index; those behind are computed again. A line
    /// that was not finished is left out.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(dir: &Path, before: usize) -> Result<(Self, Vec<Fault>), ReportError> {
        let path = dir.join(FAULTS);
        let faults = Self::read(dir, before)?;
        if path.exists() {
            let kept: Vec<u8> = faults.iter().flat_map(line).collect();
            write_whole(&path, &kept).map_err(failed("write", &path))?;
        }
        Ok((Self { path, file: None }, faults))
    }

    /// The faults of the samples before an index in the file of another process; none where there is no file.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn read(dir: &Path, before: usize) -> Result<Vec<Fault>, ReportError> {
        let path = dir.join(FAULTS);
        if !path.exists() {
            return Ok(Vec::new());
        }
        let text = regular_file::read(&path).map_err(failed("read", &path))?;
        let lines = text.split(|byte| *byte == b'\n');
        let faults = lines.filter_map(|line| serde_json::from_slice(line).ok());
        Ok(faults.filter(|fault: &Fault| fault.index < before).collect())
    }

    /// Appends a fault.
    ///
    /// # Errors
    /// When the system refuses to write.
    pub fn add(&mut self, fault: &Fault) -> Result<(), ReportError> {
        let opened = match self.file.take() {
            Some(file) => Ok(file),
            None => OpenOptions::new().create(true).append(true).open(&self.path),
        };
        let written = opened.and_then(|mut file| {
            file.write_all(&line(fault))?;
            self.file = Some(file);
            Ok(())
        });
        written.map_err(failed("write", &self.path))
    }

    /// Removes the file, once the manifest has its faults.
    pub fn remove(self) {
        // One that stays is read again, and its faults are those of the manifest.
        let _ = std::fs::remove_file(&self.path);
    }
}

fn line(fault: &Fault) -> Vec<u8> {
    // Numbers and words always have a text.
    let mut line = serde_json::to_vec(fault).unwrap_or_default();
    line.push(b'\n');
    line
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn fault(index: usize) -> Fault {
        Fault { index, seed: 7, message: format!("broke off\nin line {index}") }
    }

    #[test]
    fn faults_outlive_the_process() {
        let dir = std::env::temp_dir().join(format!("apsides-faults-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let (mut file, none) = FaultFile::open(&dir, 100).unwrap();
        assert!(none.is_empty() && !dir.join(FAULTS).exists());
        for index in [2, 5, 9] {
            file.add(&fault(index)).unwrap();
        }
        // Killed: nothing is dropped, the last line is cut.
        std::mem::forget(file);
        let mut text = std::fs::read(dir.join(FAULTS)).unwrap();
        text.extend_from_slice(b"{\"index\": 11, \"se");
        std::fs::write(dir.join(FAULTS), text).unwrap();
        // The rows end before sample 9, which is computed again.
        let (mut file, earlier) = FaultFile::open(&dir, 9).unwrap();
        assert_eq!(earlier, [fault(2), fault(5)]);
        file.add(&fault(9)).unwrap();
        let (file, earlier) = FaultFile::open(&dir, 10).unwrap();
        assert_eq!(earlier, [fault(2), fault(5), fault(9)]);
        file.remove();
        assert!(!dir.join(FAULTS).exists());
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn what_cannot_be_written_is_said() {
        let gone = Path::new("no such folder");
        let (mut file, _) = FaultFile::open(gone, 1).unwrap();
        assert!(file.add(&fault(0)).unwrap_err().to_string().contains(FAULTS));
    }
}
