//! The Python package: built as a wheel, installed into a fresh environment, tested there.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::{run, succeeds};
use crate::workspace::Workspace;

/// The largest wheel, in bytes.
const LARGEST: u64 = 15_000_000;

/// As [`build`], unless there is no Python on the machine.
pub(crate) fn run_if_there(workspace: &Workspace) -> Result<(), String> {
    if !succeeds(Command::new("python3").arg("--version")) {
        println!("python skipped: there is no python3 on this machine");
        return Ok(());
    }
    build(workspace)
}

/// Builds the release wheel, installs it into a fresh environment, and runs its tests and its tutorial there.
pub(crate) fn build(workspace: &Workspace) -> Result<(), String> {
    let package = workspace.root.join("python");
    let folder = workspace.target.join("python");
    let (tools, fresh, wheels) = (folder.join("tools"), folder.join("fresh"), folder.join("wheels"));
    if !program(&tools, "maturin").exists() {
        environment(&tools)?;
        pip(&tools, &["maturin>=1.7,<2".into()])?;
    }
    empty(&wheels)?;
    let mut maturin = Command::new(program(&tools, "maturin"));
    // Not locked: the lock file follows when a crate of ours changes what it depends on.
    maturin.current_dir(&package).args(["build", "--release", "--out"]).arg(&wheels);
    // Those that do not depend on Python are compiled once for all.
    run(maturin.env("CARGO_TARGET_DIR", &workspace.target))?;
    let wheel = only_wheel(&wheels)?;
    let size = std::fs::metadata(&wheel).map_err(|e| format!("{}: {e}", wheel.display()))?.len();
    println!("{}: {:.1} MB", wheel.display(), size as f64 / 1e6);
    if size > LARGEST {
        return Err(format!("the wheel has {size} bytes, at most {LARGEST} are allowed"));
    }
    empty(&fresh)?;
    environment(&fresh)?;
    pip(&fresh, &[format!("{}[test]", wheel.display())])?;
    // Away from the sources, so that it is the wheel that is imported.
    let mut tests = Command::new(program(&fresh, "python"));
    tests.current_dir(&folder).args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir"]);
    run(tests.arg(&package).arg(package.join("tests")))
}

/// A program of an environment.
pub(crate) fn program(environment: &Path, name: &str) -> PathBuf {
    match cfg!(windows) {
        true => environment.join("Scripts").join(format!("{name}.exe")),
        false => environment.join("bin").join(name),
    }
}

/// Makes an environment.
pub(crate) fn environment(folder: &Path) -> Result<(), String> {
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(folder))
}

/// Installs packages into an environment.
pub(crate) fn pip(environment: &Path, packages: &[String]) -> Result<(), String> {
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    run(Command::new(program(environment, "python")).args(install).args(packages))
}

/// Makes a folder that is empty.
pub(crate) fn empty(folder: &Path) -> Result<(), String> {
    let fail = |e: std::io::Error| format!("{}: {e}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(fail)?;
    }
    std::fs::create_dir_all(folder).map_err(fail)
}

fn only_wheel(folder: &Path) -> Result<PathBuf, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let wheels: Vec<PathBuf> =
        entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "whl")).collect();
    match wheels.as_slice() {
        [wheel] => Ok(wheel.clone()),
        found => Err(format!("{} wheels in {} instead of one", found.len(), folder.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_wheel_is_wanted() {
        let folder = std::env::temp_dir().join(format!("wheels-{}", std::process::id()));
        assert!(empty(&folder).is_ok());
        assert!(only_wheel(&folder).is_err_and(|e| e.starts_with("0 wheels")));
        assert!(std::fs::write(folder.join("a-1-cp310-abi3.whl"), "").is_ok());
        assert!(only_wheel(&folder).is_ok_and(|w| w.ends_with("a-1-cp310-abi3.whl")));
        assert!(std::fs::remove_dir_all(&folder).is_ok());
    }
}
