//! The program on processors of several levels of vector instructions, which QEMU shows it, held against the processor of this machine.
//!
//! All that chooses by the processor sees the same: the kernels of our crates and of faer, and the mathematical library of the system.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::command::{cargo, run, succeeds};
use crate::workspace::Workspace;

const QEMU: &str = "qemu-x86_64";

/// A processor of QEMU: its name, its level, and whether it gives the bits of any processor above it.
struct Processor {
    name: &'static str,
    level: &'static str,
    same_bits: bool,
}

/// Fused operations begin at the third level; a processor without them rounds otherwise.
const PROCESSORS: [Processor; 2] = [
    Processor { name: "Haswell", level: "x86-64-v3", same_bits: true },
    Processor { name: "Nehalem", level: "x86-64", same_bits: false },
];

/// Solves and flights that reach the kernels: collocation, a descent over stages, shooting, flights along a plan, planned anew and under a law.
const CASES: [&str; 6] = [
    "solve lunar-perilune",
    "solve mars-descent",
    "solve lunar-perilune --method multiple-shooting",
    "montecarlo chang-e-3-braking --position-m 333 --velocity-m-s 1 --samples 40",
    "montecarlo chang-e-3-braking --position-m 333 --samples 3 --guidance replanned",
    "montecarlo moving-mass-cross --offset-m 0.001 --samples 4",
];

/// Files that have numbers of a result and no times of the work.
const FILES: [&str; 5] =
    ["trajectory.csv", "multipliers.json", "certificate.json", "montecarlo.csv", "montecarlo.json"];

/// Runs all cases on all processors.
pub(crate) fn run_if_there(workspace: &Workspace) -> Result<(), String> {
    if !succeeds(Command::new(QEMU).arg("--version")) {
        println!("vector-levels skipped: no {QEMU}: `apt-get install qemu-user`");
        return Ok(());
    }
    if std::env::consts::ARCH != "x86_64" {
        println!("vector-levels skipped: QEMU has processors of x86-64 alone here");
        return Ok(());
    }
    run(&mut cargo(&workspace.root, ["build", "--release", "--locked", "-p", "apsides-cli"]))?;
    let folder = workspace.target.join("vector-levels");
    let _ = std::fs::remove_dir_all(&folder);
    let program = workspace.target.join("release/apsides");
    let mut wrong = Vec::new();
    for (k, case) in CASES.into_iter().enumerate() {
        let on = |processor: Option<&str>| -> Result<PathBuf, String> {
            let out = folder.join(format!("{k}-{}", processor.unwrap_or("native")));
            fly(&program, case, processor, &out)?;
            Ok(out)
        };
        let native = on(None)?;
        for Processor { name, level, same_bits } in PROCESSORS {
            let other = differing(&native, &on(Some(name))?)?;
            let words = match other.is_empty() {
                true => "the same bytes".to_owned(),
                false => format!("other bytes in {}", other.join(", ")),
            };
            println!("{case}: {level}: {words}");
            if same_bits && !other.is_empty() {
                wrong.push(format!("{case} on {name}"));
            }
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(format!("other bits: {}", wrong.join("; "))) }
}

/// Runs a case on a processor of QEMU, or on that of this machine.
fn fly(program: &Path, case: &str, processor: Option<&str>, out: &Path) -> Result<(), String> {
    let mut command = match processor {
        None => Command::new(program),
        Some(name) => {
            let mut qemu = Command::new(QEMU);
            qemu.args(["-cpu", name]).arg(program);
            qemu
        }
    };
    command.args(case.split(' ')).args(["--threads", "1", "--quiet", "--out"]).arg(out);
    // QEMU lists there what it lacks of a processor.
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    let status = status.map_err(|e| format!("{case}: {e}"))?;
    // All there; a few flights may have failed.
    if matches!(status.code(), Some(0 | 6)) { Ok(()) } else { Err(format!("{case}: ended with {status}")) }
}

/// Names of the files that differ.
fn differing(a: &Path, b: &Path) -> Result<Vec<&'static str>, String> {
    let there: Vec<&str> = FILES.into_iter().filter(|name| a.join(name).exists()).collect();
    if there.is_empty() {
        return Err(format!("{}: has no results", a.display()));
    }
    let read = |place: &Path, name: &str| std::fs::read(place.join(name)).unwrap_or_default();
    Ok(there.into_iter().filter(|name| read(a, name) != read(b, name)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_differ_or_are_missing_are_named() {
        let folder = std::env::temp_dir().join(format!("apsides-levels-{}", std::process::id()));
        let [a, b] = ["a", "b"].map(|name| folder.join(name));
        for place in [&a, &b] {
            std::fs::create_dir_all(place).unwrap();
        }
        assert!(differing(&a, &b).unwrap_err().contains("no results"));
        std::fs::write(a.join("trajectory.csv"), "1").unwrap();
        std::fs::write(b.join("trajectory.csv"), "1").unwrap();
        assert!(differing(&a, &b).unwrap().is_empty());
        std::fs::write(a.join("certificate.json"), "1").unwrap();
        assert_eq!(differing(&a, &b).unwrap(), ["certificate.json"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
