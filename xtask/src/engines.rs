//! Campaigns on this machine: their files, a cluster of Slurm, a Python with Dask, and whether joined files are those of a single run.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::command::{run, succeeds};
use crate::python::{environment, pip, program};

/// Workers of an engine: the nodes of `cluster/slurm/local.sh`.
pub(crate) const WORKERS: usize = 4;

/// Files of a run that have to be the same, byte by byte.
const FILES: [&str; 6] = [
    "montecarlo.csv",
    "montecarlo.toml",
    "montecarlo.json",
    "montecarlo.svg",
    "montecarlo.html",
    "shard.json",
];

/// A run that an engine divides.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    /// Name of the folder.
    pub(crate) name: &'static str,
    pub(crate) mission: &'static str,
    pub(crate) arguments: &'static [&'static str],
    pub(crate) samples: usize,
    pub(crate) shard_size: usize,
}

impl Case {
    /// The text of the campaign's file.
    pub(crate) fn file(&self, engine: &str, keys: &str) -> String {
        let arguments: Vec<String> = self.arguments.iter().map(|a| format!("\"{a}\"")).collect();
        format!(
            "mission = \"{}\"\narguments = [{}]\nsamples = {}\nshard_size = {}\nengine = \"{engine}\"\nworkers = {WORKERS}\n{keys}",
            self.mission,
            arguments.join(", "),
            self.samples,
            self.shard_size
        )
    }

    /// Writes the file of an engine below a folder; without its ending, its path is that of the campaign.
    pub(crate) fn write(
        &self,
        folder: &Path,
        name: &str,
        engine: &str,
        keys: &str,
    ) -> Result<PathBuf, String> {
        let file = folder.join(format!("{name}.toml"));
        std::fs::write(&file, self.file(engine, keys)).map_err(|e| format!("{}: {e}", file.display()))?;
        Ok(file)
    }

    /// The single run, in as many threads as an engine has workers.
    pub(crate) fn whole(&self, program: &Path, out: &Path) -> Command {
        let mut whole = Command::new(program);
        whole.args(["montecarlo", self.mission]).args(self.arguments);
        whole.args(["--samples", &self.samples.to_string(), "--threads", &WORKERS.to_string(), "--quiet"]);
        whole.arg("--out").arg(out).stdout(Stdio::null());
        whole
    }

    /// The pilot of a campaign.
    pub(crate) fn pilot(program: &Path, file: &Path, slurm: Option<&Slurm>) -> Command {
        let mut pilot = Command::new(program);
        pilot.arg("campaign").arg(file).arg("--quiet").stdout(Stdio::null());
        if let Some(slurm) = slurm {
            pilot.env("SLURM_CONF", slurm.folder.join("slurm.conf"));
        }
        pilot
    }
}

/// Says which file of a joined run is not that of the single run.
pub(crate) fn compare(whole: &Path, merged: &Path) -> Result<(), String> {
    for name in FILES {
        let read = |of: &Path| std::fs::read(of.join(name)).map_err(|e| format!("{name}: {e}"));
        if read(whole)? != read(merged)? {
            return Err(format!("{name} differs from that of the single run"));
        }
    }
    Ok(())
}

/// A cluster of Slurm on this machine, ended with the value.
#[derive(Debug)]
pub(crate) struct Slurm {
    script: PathBuf,
    pub(crate) folder: PathBuf,
}

impl Slurm {
    /// Starts it, or says why there is none.
    pub(crate) fn start(root: &Path, folder: PathBuf) -> Result<Result<Self, String>, String> {
        let there = |tool: &str| {
            let path = format!("{}:/usr/sbin", std::env::var("PATH").unwrap_or_default());
            let mut probe = Command::new("sh");
            succeeds(probe.args(["-c", &format!("command -v {tool}")]).env("PATH", path))
        };
        let missing: Vec<&str> =
            ["munged", "slurmctld", "slurmd", "sbatch"].into_iter().filter(|tool| !there(tool)).collect();
        if !missing.is_empty() {
            return Ok(Err(format!("no {}: `apt-get install slurm-wlm munge`", missing.join(", "))));
        }
        let script = root.join("cluster/slurm/local.sh");
        // Before the start: what has begun of a cluster is ended as well.
        let cluster = Self { script, folder };
        run(Command::new(&cluster.script).arg("start").arg(&cluster.folder))?;
        Ok(Ok(cluster))
    }
}

impl Slurm {
    /// The process of the daemon of a node, counted from 1.
    pub(crate) fn daemon(&self, node: usize) -> Result<u32, String> {
        let file = self.folder.join(format!("slurmd-node{node}.pid"));
        let words = std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        words.trim().parse().map_err(|e| format!("{}: {e}", file.display()))
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        if let Err(why) = run(Command::new(&self.script).arg("stop").arg(&self.folder)) {
            println!("{why}");
        }
    }
}

/// A Python with Dask, installed below the build folder where that of the path has none, or why there is none.
pub(crate) fn python_with_dask(target: &Path) -> Result<PathBuf, String> {
    let home = target.join("cluster-python");
    let python = program(&home, "python");
    let has = |python: &Path| succeeds(Command::new(python).args(["-c", "import dask.distributed"]));
    if has(Path::new("python3")) {
        return Ok("python3".into());
    }
    if !has(&python) {
        environment(&home).and_then(|()| pip(&home, &["distributed".into()]))?;
    }
    Ok(python)
}

/// The keys of a campaign by Dask.
pub(crate) fn dask_keys(python: &Path) -> String {
    format!("[dask]\npython = \"{}\"\n", python.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_all_keys() {
        let case = Case {
            name: "a",
            mission: "lunar",
            arguments: &["--position-m", "333"],
            samples: 10,
            shard_size: 5,
        };
        let text = case.file("dask", &dask_keys(Path::new("py")));
        assert!(
            text.starts_with("mission = \"lunar\"\narguments = [\"--position-m\", \"333\"]\nsamples = 10\n")
        );
        assert!(text.ends_with("shard_size = 5\nengine = \"dask\"\nworkers = 4\n[dask]\npython = \"py\"\n"));
    }

    #[test]
    fn files_that_are_not_there_are_named() {
        let nowhere = Path::new("no such folder");
        assert!(compare(nowhere, nowhere).unwrap_err().starts_with("montecarlo.csv: "));
    }
}
