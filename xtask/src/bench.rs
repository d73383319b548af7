//! Benchmarks: criterion benches of the solver crates, and the same problems in other programs.

use std::process::Command;

use crate::command::{cargo, run, succeeds};
use crate::workspace::Workspace;

/// Crates whose speed decides a solve.
const MEASURED: &[&str] = &["apsides-kkt", "apsides-nlp", "apsides-radau"];

/// Folder of the scripts that solve our problems with other programs. Each prints its own comparison.
const PEERS: &str = "benches/peers";

/// Runs the benches; `--peers` adds the scripts, everything else goes to criterion.
pub(crate) fn run_benches(workspace: &Workspace, arguments: &[String]) -> Result<(), String> {
    let (peers, criterion): (Vec<_>, Vec<_>) = arguments.iter().partition(|a| *a == "--peers");
    let mut bench = cargo(&workspace.root, ["bench"]);
    let mut any = false;
    for name in MEASURED {
        let package = workspace.package(name)?;
        if package.benches.is_empty() {
            println!("{name} has no benches");
            continue;
        }
        any = true;
        bench.args(["-p", name]);
        // By name: the libraries' own test harness does not know criterion's arguments.
        for target in &package.benches {
            bench.args(["--bench", target]);
        }
    }
    if any {
        run(bench.arg("--").args(criterion))?;
    }
    if peers.is_empty() { Ok(()) } else { compare(workspace) }
}

/// Runs every script of the peers' folder, if their solver is there.
fn compare(workspace: &Workspace) -> Result<(), String> {
    if !succeeds(Command::new("python3").args(["-c", "import casadi"])) {
        println!("peers skipped: python3 cannot import casadi (pip install casadi)");
        return Ok(());
    }
    let files = workspace.files()?;
    let scripts: Vec<_> = files.iter().filter(|f| is_script(f)).collect();
    if scripts.is_empty() {
        println!("peers skipped: no scripts in {PEERS}");
    }
    for script in scripts {
        run(Command::new("python3").current_dir(&workspace.root).arg(script))?;
    }
    Ok(())
}

fn is_script(path: &str) -> bool {
    let name = path.strip_prefix(PEERS).and_then(|p| p.strip_prefix('/'));
    name.is_some_and(|n| n.ends_with(".py") && !n.contains('/'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_lie_in_the_folder_itself() {
        assert!(is_script("benches/peers/landing.py"));
        assert!(!is_script("benches/peers/README.md"));
        assert!(!is_script("benches/peers/data/a.py"));
        assert!(!is_script("benches/landing.py"));
    }
}
