//! The recipes for clusters, on this machine: a campaign by Slurm and by Dask, a worker killed on the way, held against a single run.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::command::{cargo, run, succeeds};
use crate::python::{environment, pip, program};
use crate::workspace::Workspace;

/// The campaign: flights for some seconds, so that a worker can be killed on the way.
const MISSION: &str = "chang-e-3-braking";
const ARGUMENTS: [&str; 4] = ["--position-m", "333", "--velocity-m-s", "1"];
const SAMPLES: usize = 16_000;
const SHARD_SIZE: usize = 1000;

/// Files of a run that have to be the same, byte by byte.
const FILES: [&str; 6] = [
    "montecarlo.csv",
    "montecarlo.toml",
    "montecarlo.json",
    "montecarlo.svg",
    "montecarlo.html",
    "shard.json",
];

/// Longest time of a campaign.
const LONGEST: Duration = Duration::from_secs(120);

/// Runs the recipes where their tools are there or can be installed, and says which are left out.
pub(crate) fn run_if_there(workspace: &Workspace) -> Result<(), String> {
    if !cfg!(unix) {
        println!("cluster skipped: the recipes are scripts of bash");
        return Ok(());
    }
    run(&mut cargo(&workspace.root, ["build", "--release", "--locked", "-p", "apsides-cli"]))?;
    let folder = workspace.target.join("cluster");
    let work =
        Work { root: workspace.root.clone(), program: workspace.target.join("release/apsides"), folder };
    let _ = std::fs::remove_dir_all(&work.folder);
    std::fs::create_dir_all(&work.folder).map_err(|e| format!("{}: {e}", work.folder.display()))?;
    work.whole()?;
    work.campaign("local", "", None)?;
    work.slurm()?;
    work.dask(&workspace.target)
}

struct Work {
    root: PathBuf,
    program: PathBuf,
    folder: PathBuf,
}

impl Work {
    /// The single run.
    fn whole(&self) -> Result<(), String> {
        let mut whole = Command::new(&self.program);
        whole.args(["montecarlo", MISSION]).args(ARGUMENTS).args([
            "--samples",
            &SAMPLES.to_string(),
            "--quiet",
        ]);
        run(whole.arg("--out").arg(self.folder.join("whole")).stdout(Stdio::null()))
    }

    /// A campaign by an engine, of which a process is killed on the way: that of a shard, or its parent.
    fn campaign(&self, engine: &str, keys: &str, slurm: Option<&Path>) -> Result<(), String> {
        let file = self.folder.join(format!("{engine}.toml"));
        let arguments: Vec<String> = ARGUMENTS.iter().map(|a| format!("\"{a}\"")).collect();
        let text = format!(
            "mission = \"{MISSION}\"\narguments = [{}]\nsamples = {SAMPLES}\nshard_size = {SHARD_SIZE}\n\
             engine = \"{engine}\"\nworkers = 4\n{keys}",
            arguments.join(", ")
        );
        std::fs::write(&file, text).map_err(|e| format!("{}: {e}", file.display()))?;
        let mut pilot = Command::new(&self.program);
        pilot.arg("campaign").arg(&file).arg("--quiet").stdout(Stdio::null());
        if let Some(slurm) = slurm {
            pilot.env("SLURM_CONF", slurm.join("slurm.conf"));
        }
        println!("$ apsides campaign {engine}.toml");
        let begun = Instant::now();
        let mut pilot = pilot.spawn().map_err(|e| format!("{}: {e}", self.program.display()))?;
        let killed = kill_a_worker(&self.folder.join(engine).join("shards"), engine == "dask", &mut pilot)?;
        let status = loop {
            if let Some(status) = pilot.try_wait().map_err(|e| e.to_string())? {
                break status;
            }
            if begun.elapsed() > LONGEST {
                let _ = pilot.kill();
                return Err(format!("{engine}: not at its end after {} s", LONGEST.as_secs()));
            }
            std::thread::sleep(Duration::from_millis(100));
        };
        if !status.success() {
            return Err(format!("{engine}: the campaign ended with {status}"));
        }
        for name in FILES {
            let read = |of: &Path| std::fs::read(of.join(name)).map_err(|e| format!("{engine}: {name}: {e}"));
            let (whole, merged) = (self.folder.join("whole"), self.folder.join(engine).join("merged"));
            if read(&whole)? != read(&merged)? {
                return Err(format!("{engine}: {name} differs from that of the single run"));
            }
        }
        let time = begun.elapsed().as_secs_f64();
        println!("{engine}: {killed} was killed; the joined files are those of the single run, {time:.1} s");
        Ok(())
    }

    fn slurm(&self) -> Result<(), String> {
        let there = |tool: &str| {
            let path = format!("{}:/usr/sbin", std::env::var("PATH").unwrap_or_default());
            let mut probe = Command::new("sh");
            succeeds(probe.args(["-c", &format!("command -v {tool}")]).env("PATH", path))
        };
        let missing: Vec<&str> =
            ["munged", "slurmctld", "slurmd", "sbatch"].into_iter().filter(|tool| !there(tool)).collect();
        if !missing.is_empty() {
            println!("slurm skipped: no {}: `apt-get install slurm-wlm munge`", missing.join(", "));
            return Ok(());
        }
        let script = self.root.join("cluster/slurm/local.sh");
        let cluster = self.folder.join("slurm-cluster");
        run(Command::new(&script).arg("start").arg(&cluster))?;
        let found = self.campaign("slurm", "", Some(&cluster));
        run(Command::new(&script).arg("stop").arg(&cluster))?;
        found
    }

    fn dask(&self, target: &Path) -> Result<(), String> {
        let home = target.join("cluster-python");
        let python = program(&home, "python");
        let has = |python: &Path| succeeds(Command::new(python).args(["-c", "import dask.distributed"]));
        let python = if has(Path::new("python3")) {
            PathBuf::from("python3")
        } else {
            if !has(&python) {
                let made = environment(&home).and_then(|()| pip(&home, &["distributed".into()]));
                if let Err(why) = made {
                    println!("dask skipped: {why}");
                    return Ok(());
                }
            }
            python
        };
        self.campaign("dask", &format!("[dask]\npython = \"{}\"\n", python.display()), None)
    }
}

/// Kills the process that computes a shard, or its parent, as soon as it has some samples; returns which.
fn kill_a_worker(shards: &Path, parent: bool, pilot: &mut Child) -> Result<String, String> {
    let begun = Instant::now();
    while begun.elapsed() < LONGEST {
        if let Some((process, shard)) = worker(shards) {
            let victim = if parent { parent_of(process) } else { Some(process) };
            if let Some(victim) = victim
                && succeeds(Command::new("kill").args(["-KILL", &victim.to_string()]))
            {
                let what = if parent { "the worker" } else { "the process" };
                return Ok(format!("{what} of shard {shard}"));
            }
        }
        if pilot.try_wait().is_ok_and(|ended| ended.is_some()) {
            return Err("the campaign ended before a worker could be killed".into());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let _ = pilot.kill();
    Err("no shard was begun".into())
}

/// A process that computes a shard of which rows are there, by the shard's lock.
fn worker(shards: &Path) -> Option<(u32, String)> {
    for entry in std::fs::read_dir(shards).ok()?.flatten() {
        let shard = entry.path();
        let Ok(words) = std::fs::read_to_string(shard.join(".apsides-lock")) else { continue };
        let has_rows = shard.join("montecarlo.csv").metadata().is_ok_and(|m| m.len() > 20_000);
        let process = words.strip_prefix("process ").and_then(|w| w.split_whitespace().next()?.parse().ok());
        if let Some(process) = process.filter(|_| has_rows) {
            return Some((process, entry.file_name().to_string_lossy().into_owned()));
        }
    }
    None
}

fn parent_of(process: u32) -> Option<u32> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    status
        .lines()
        .find_map(|line| line.strip_prefix("PPid:")?.trim().parse().ok())
        .filter(|parent| *parent > 1)
}
