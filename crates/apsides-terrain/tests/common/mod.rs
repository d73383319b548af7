//! Where maps and references are that are not part of the project.

use std::path::PathBuf;

/// A file of the folder `shared` beside the workspace, or of the one that `APSIDES_SHARED` names; none, with a printed line, where it is
/// absent.
#[allow(clippy::print_stdout)]
pub(crate) fn shared(file: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let path = std::env::var_os("APSIDES_SHARED").map_or_else(beside, PathBuf::from).join(file);
    if path.is_file() {
        return Some(path);
    }
    println!("skipped: {} is absent", path.display());
    None
}
