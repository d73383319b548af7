//! Maps and references that are not part of the project.
//!
//! A test that needs them has `#[cfg_attr(not(has_shared), ignore = "needs the folder of APSIDES_SHARED")]`: without the folder it is
//! reported as ignored, not as passed. The build script of this package looks for the folder; one that is added later is seen once
//! `APSIDES_SHARED` names it.

use std::path::{Path, PathBuf};

/// A file of the folder; the name alone where there is no folder.
#[must_use]
pub fn shared(file: &str) -> PathBuf {
    Path::new(option_env!("APSIDES_SHARED_FOLDER").unwrap_or_default()).join(file)
}
