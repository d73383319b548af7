//! Tells the tests whether the folder of maps and references is there.
//!
//! It is the folder `shared` beside the workspace, or the one that `APSIDES_SHARED` names. Tests that need it are ignored without it.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rustc-check-cfg=cfg(has_shared)");
    println!("cargo::rerun-if-env-changed=APSIDES_SHARED");
    println!("cargo::rerun-if-changed=build.rs");
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let folder = std::env::var_os("APSIDES_SHARED").map_or_else(beside, PathBuf::from);
    if folder.join("terrain").is_dir() && folder.join("reference").is_dir() {
        println!("cargo::rustc-cfg=has_shared");
        println!("cargo::rustc-env=APSIDES_SHARED_FOLDER={}", folder.display());
    }
}
