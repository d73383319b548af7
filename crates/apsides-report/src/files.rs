//! The files of a result, replaced together or not at all.
//!
//! Every file is first rendered in memory, then written and flushed to the disk in a hidden directory inside the result
//! directory (so on the same file system), and only then are they moved into place by renaming. If a rename fails, the
//! ones done are undone. A file of the earlier result that the new one does not have is removed. Readers see each file
//! old or new, never in part; a program that is killed between two renames leaves the hidden directory
//! `.apsides-*` behind with the missing files.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::ReportError;

/// Name of the file of the trajectory.
pub(crate) const TRAJECTORY: &str = "trajectory.csv";

/// A file name and its content; none for a file that must not stay.
pub type Item = (&'static str, Option<Vec<u8>>);

/// The pretty JSON text of a value, with a line break at its end; `file` names it in errors.
///
/// # Errors
/// [`ReportError::Json`] when the value has no JSON form.
pub fn json(file: &'static str, value: &impl Serialize) -> Result<Vec<u8>, ReportError> {
    let mut text = serde_json::to_vec_pretty(value).map_err(|source| ReportError::Json { file, source })?;
    text.push(b'\n');
    Ok(text)
}

/// The error of a table of a result file that its writer or reader refuses.
pub fn table_error(
    file: &'static str,
    source: impl std::error::Error + Send + Sync + 'static,
) -> ReportError {
    ReportError::Table { file, source: Box::new(source) }
}

pub(crate) fn failed(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> ReportError + use<> {
    let path = path.to_owned();
    move |source| ReportError::Io { action, path, source }
}

/// Writes files into a directory, all together or not at all, and returns the paths written. The directory and its parents are made when
/// missing.
///
/// # Errors
/// [`ReportError`] with the path and the reason. The earlier content of the directory is then as it was.
pub fn replace(dir: &Path, items: &[Item]) -> Result<Vec<PathBuf>, ReportError> {
    if dir.exists() && !dir.is_dir() {
        let problem = "exists and is not a directory: results need a directory";
        return Err(ReportError::Directory { path: dir.to_owned(), problem });
    }
    if let Some(path) = items.iter().map(|(name, _)| dir.join(name)).find(|path| path.is_dir()) {
        let problem = "is a directory: a result file of that name cannot be written";
        return Err(ReportError::Directory { path, problem });
    }
    let missing: Vec<&Path> =
        dir.ancestors().take_while(|d| !d.as_os_str().is_empty() && !d.exists()).collect();
    let written = fs::create_dir_all(dir)
        .map_err(failed("create the directory", dir))
        .and_then(|()| Staging::new(dir))
        .and_then(|staging| {
            items.iter().try_for_each(|item| staging.write(item))?;
            staging.publish(dir, items)
        });
    if written.is_err() {
        for made in missing {
            // Not empty if somebody else uses it by now: then it stays.
            let _ = fs::remove_dir(made);
        }
    }
    written
}

/// A hidden directory for files in the making, removed when dropped.
struct Staging {
    new: PathBuf,
    old: PathBuf,
    root: PathBuf,
}

impl Staging {
    fn new(dir: &Path) -> Result<Self, ReportError> {
        let process = std::process::id();
        let mut number = 0;
        loop {
            let root = dir.join(format!(".apsides-{process}-{number}"));
            match fs::create_dir(&root) {
                Ok(()) => {
                    let staging = Self { new: root.join("new"), old: root.join("old"), root };
                    for part in [&staging.new, &staging.old] {
                        fs::create_dir(part).map_err(failed("write into", dir))?;
                    }
                    return Ok(staging);
                }
                // Another thread of this process, or a killed one, has this number.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && number < 10_000 => number += 1,
                Err(e) => return Err(failed("write into", dir)(e)),
            }
        }
    }

    fn write(&self, (name, content): &Item) -> Result<(), ReportError> {
        let Some(content) = content else { return Ok(()) };
        let path = self.new.join(name);
        let write = |path: &Path| -> io::Result<()> {
            let mut file = File::create_new(path)?;
            file.write_all(content)?;
            file.sync_all()
        };
        write(&path).map_err(failed("write", &path))
    }

    /// Moves every file into place, the earlier ones aside; undoes all moves when one fails.
    fn publish(&self, dir: &Path, items: &[Item]) -> Result<Vec<PathBuf>, ReportError> {
        let mut moves: Vec<(PathBuf, PathBuf)> = Vec::new();
        let mut written = Vec::new();
        for (name, content) in items {
            let target = dir.join(name);
            let mut steps = vec![(target.clone(), self.old.join(name))];
            if content.is_some() {
                steps.push((self.new.join(name), target.clone()));
                written.push(target.clone());
            }
            for (from, to) in steps {
                match fs::rename(&from, &to) {
                    Ok(()) => moves.push((from, to)),
                    // No earlier result to move aside.
                    Err(e) if e.kind() == io::ErrorKind::NotFound && from == target => {}
                    Err(e) => {
                        for (from, to) in moves.iter().rev() {
                            let _ = fs::rename(to, from);
                        }
                        return Err(failed("replace", &target)(e));
                    }
                }
            }
        }
        Ok(written)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.root);
    }
}

#[cfg(test)]
mod tests;
