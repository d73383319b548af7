//! The files of a result, replaced together or not at all.
//!
//! Every file is first rendered in memory, then written and flushed to the disk under a hidden name beside its place
//! ([`apsides_pipeline::whole_file`]), and only then are they moved into place by renaming. If a rename fails, the
//! ones done are undone. A file of the earlier result that the new one does not have is removed. Readers see each file
//! old or new, never in part; a program that is killed between two renames leaves hidden files `.apsides-*` behind.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use apsides_ephemeris::{Ephemeris, EphemerisError, Epoch, Format};
use apsides_pipeline::whole_file::{WholeFile, publish_together};
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
/// [`ReportError`] with the path and the reason; two files of one name. The earlier content of the directory is then as it was.
pub fn replace(dir: &Path, items: &[Item]) -> Result<Vec<PathBuf>, ReportError> {
    replace_beside(dir, Vec::new(), items)
}

/// As [`replace`], together with `files` that are written but not in their places yet.
pub(crate) fn replace_beside(
    dir: &Path,
    mut files: Vec<WholeFile>,
    items: &[Item],
) -> Result<Vec<PathBuf>, ReportError> {
    if dir.exists() && !dir.is_dir() {
        let problem = "exists and is not a directory: results need a directory";
        return Err(ReportError::Directory { path: dir.to_owned(), problem });
    }
    if let Some(path) = items.iter().map(|(name, _)| dir.join(name)).find(|path| path.is_dir()) {
        let problem = "is a directory: a result file of that name cannot be written";
        return Err(ReportError::Directory { path, problem });
    }
    let mut names: Vec<&str> = items.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    if let Some([name, _]) = names.windows(2).find(|pair| matches!(pair, [name, next] if name == next)) {
        let problem = "would be written twice by one result: its figures and tables need names of their own";
        return Err(ReportError::Directory { path: dir.join(name), problem });
    }
    let missing: Vec<&Path> =
        dir.ancestors().take_while(|d| !d.as_os_str().is_empty() && !d.exists()).collect();
    let written = fs::create_dir_all(dir)
        .map_err(failed("create the directory", dir))
        .and_then(|()| staged(dir, items))
        .and_then(|(own, stale)| {
            files.extend(own);
            publish_together(files, &stale).map_err(|(path, source)| failed("replace", &path)(source))
        });
    if let Err(e) = written {
        for made in missing {
            // Not empty if somebody else uses it by now: then it stays.
            let _ = fs::remove_dir(made);
        }
        return Err(e);
    }
    Ok(items.iter().filter(|(_, content)| content.is_some()).map(|(name, _)| dir.join(name)).collect())
}

/// The files of an ephemeris in these formats, which say that they were made at `created`.
///
/// # Errors
/// [`EphemerisError`] where the flight does not have what a format needs.
pub fn ephemeris_files(
    table: &Ephemeris,
    formats: &[Format],
    created: &Epoch,
) -> Result<Vec<Item>, EphemerisError> {
    let mut formats = formats.to_vec();
    formats.sort_unstable();
    formats.dedup();
    let mut items: Vec<Item> = Vec::new();
    for format in formats {
        let files = format.write(table, created)?;
        items.extend(files.into_iter().map(|(name, content)| (name, Some(content))));
    }
    Ok(items)
}

/// Files of an ephemeris, and those of an earlier one that must not stay beside another flight.
pub(crate) fn with_stale_ephemerides(files: Vec<Item>) -> Vec<Item> {
    let is_new = |name: &str| files.iter().any(|(new, _)| *new == name);
    let stale: Vec<Item> =
        Format::FILES.into_iter().filter(|name| !is_new(name)).map(|name| (name, None)).collect();
    files.into_iter().chain(stale).collect()
}

/// The new files, not in their places yet, and those that must not stay.
fn staged(dir: &Path, items: &[Item]) -> Result<(Vec<WholeFile>, Vec<PathBuf>), ReportError> {
    let (mut files, mut stale) = (Vec::new(), Vec::new());
    for (name, content) in items {
        let path = dir.join(name);
        let Some(content) = content else {
            stale.push(path);
            continue;
        };
        let mut file = WholeFile::create(&path).map_err(failed("write", &path))?;
        file.write_all(content).map_err(failed("write", &path))?;
        files.push(file);
    }
    Ok((files, stale))
}

#[cfg(test)]
mod tests;
