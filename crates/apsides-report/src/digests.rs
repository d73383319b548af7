//! `digests.json`: the SHA-256 of every file of a result, so that a file that was changed later is named.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use apsides_pipeline::digest::sha256;
use apsides_pipeline::regular_file;
use serde::{Deserialize, Serialize};

use crate::ReportError;
use crate::files::{Item, failed, json};

/// Name of the file.
pub(crate) const DIGESTS: &str = "digests.json";

/// The digests of the files of a result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Digests {
    /// The program that wrote the files, with its version.
    made_by: String,
    /// Files that all others are made from.
    made_from: Vec<String>,
    /// SHA-256 of each file, in hexadecimal digits.
    sha256: BTreeMap<String, String>,
}

/// A file of a result that is not what was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileState {
    /// Its digest is another one.
    Changed,
    /// It is not there.
    Missing,
    /// It is there, and `digests.json` has no digest of it.
    Undigested,
}

impl FileState {
    /// The state in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Changed => "was changed since it was written",
            Self::Missing => "is missing",
            Self::Undigested => "has no digest",
        }
    }
}

/// The file with the digests of these.
pub(crate) fn digests(items: &[Item], made_from: &[&str]) -> Result<Item, ReportError> {
    let digest = |(name, content): &Item| Some(((*name).to_owned(), sha256(content.as_ref()?)));
    let digests = Digests {
        made_by: concat!("apsides ", env!("CARGO_PKG_VERSION")).into(),
        made_from: made_from.iter().map(|name| (*name).to_owned()).collect(),
        sha256: items.iter().filter_map(digest).collect(),
    };
    Ok((DIGESTS, Some(json(DIGESTS, &digests)?)))
}

/// The files of a result directory that are not what was written, by their digests; `needed` must be among those that have one.
///
/// # Errors
/// When a file cannot be read, or the digests are none.
pub fn changed_files(dir: &Path, needed: &[&str]) -> Result<Vec<(String, FileState)>, ReportError> {
    let read = |name: &str| match regular_file::read(&dir.join(name)) {
        Ok(content) => Ok(Some(content)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(failed("read", &dir.join(name))(e)),
    };
    let Some(text) = read(DIGESTS)? else { return Ok(vec![(DIGESTS.to_owned(), FileState::Missing)]) };
    let digests: Digests =
        serde_json::from_slice(&text).map_err(|source| ReportError::Json { file: DIGESTS, source })?;
    let mut found = Vec::new();
    for (name, digest) in &digests.sha256 {
        // A name is that of a file in the directory and nothing else.
        let state = match Path::new(name).file_name().is_some_and(|own| own == name.as_str()) {
            false => Some(FileState::Missing),
            true => match read(name)? {
                None => Some(FileState::Missing),
                Some(content) if sha256(&content) != *digest => Some(FileState::Changed),
                Some(_) => None,
            },
        };
        found.extend(state.map(|state| (name.clone(), state)));
    }
    for name in needed.iter().filter(|name| !digests.sha256.contains_key(**name)) {
        let state = if dir.join(name).exists() { FileState::Undigested } else { FileState::Missing };
        found.push(((*name).to_owned(), state));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;

    use super::*;
    use crate::files::replace;

    #[test]
    fn a_file_that_was_changed_or_taken_away_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let mut items: Vec<Item> =
            vec![("a.csv", Some(b"1,2\n".to_vec())), ("b.json", Some(b"{}\n".to_vec()))];
        items.push(("c.json", None));
        items.push(digests(&items, &["a.csv"]).unwrap());
        replace(dir.path(), &items).unwrap();
        assert_eq!(changed_files(dir.path(), &["a.csv", "b.json"]).unwrap(), []);
        let text = fs::read_to_string(dir.path().join(DIGESTS)).unwrap();
        // Of `printf '1,2\n' | sha256sum`.
        assert!(text.contains("52186c933993da4082b3cdc7c40bb4bf735b391ff54a2ef78c037dda6c38a680"), "{text}");
        fs::write(dir.path().join("a.csv"), "1,3\n").unwrap();
        fs::remove_file(dir.path().join("b.json")).unwrap();
        fs::write(dir.path().join("e.json"), "").unwrap();
        let named = |name: &str, state| (name.to_owned(), state);
        let expected = [
            named("a.csv", FileState::Changed),
            named("b.json", FileState::Missing),
            named("d.json", FileState::Missing),
            named("e.json", FileState::Undigested),
        ];
        assert_eq!(changed_files(dir.path(), &["d.json", "e.json"]).unwrap(), expected);
        fs::remove_file(dir.path().join(DIGESTS)).unwrap();
        assert_eq!(changed_files(dir.path(), &[]).unwrap(), [named(DIGESTS, FileState::Missing)]);
    }
}
