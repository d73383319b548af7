//! Stored counters that a change must not exceed: slow-downs show without timing.
//!
//! `tests/golden/counters.json` holds meshes and iterations by name. With `APSIDES_BLESS=1` in the environment the test
//! that compares them writes the file anew.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::Failure;

/// Work of one solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// Meshes solved.
    pub meshes: usize,
    /// Interior-point iterations over all meshes.
    pub iterations: usize,
}

/// Work by the name of the problem or mission.
pub type Counters = BTreeMap<String, Work>;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden/counters.json")
}

/// Whether the stored counters are to be written anew.
#[must_use]
pub fn blessing() -> bool {
    std::env::var_os("APSIDES_BLESS").is_some_and(|v| v == "1")
}

/// The stored counters.
///
/// # Errors
/// When the file is missing or not of the expected form.
pub fn load() -> Result<Counters, Failure> {
    let text = std::fs::read_to_string(path())?;
    let stored: BTreeMap<String, BTreeMap<String, usize>> = serde_json::from_str(&text)?;
    let work = |(name, counts): (String, BTreeMap<String, usize>)| {
        let count = |key: &str| counts.get(key).copied().ok_or(format!("`{name}` has no `{key}`"));
        let work = Work { meshes: count("meshes")?, iterations: count("iterations")? };
        Ok((name, work))
    };
    stored.into_iter().map(work).collect()
}

/// Writes the counters.
///
/// # Errors
/// When the file cannot be written.
pub fn store(counters: &Counters) -> Result<(), Failure> {
    let entry = |work: &Work| BTreeMap::from([("iterations", work.iterations), ("meshes", work.meshes)]);
    let all: BTreeMap<_, _> = counters.iter().map(|(name, work)| (name, entry(work))).collect();
    std::fs::write(path(), serde_json::to_string_pretty(&all)? + "\n")?;
    Ok(())
}
