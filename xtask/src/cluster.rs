//! The recipes for clusters, on this machine: a campaign by Slurm and by Dask, a worker killed on the way, held against a single run.

use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::command::{cargo, run, succeeds};
use crate::engines::{Case, Slurm, compare, dask_keys, python_with_dask};
use crate::workspace::Workspace;

/// The campaign: flights for some seconds, so that a worker can be killed on the way.
const CASE: Case = Case {
    name: "cluster",
    mission: "chang-e-3-braking",
    arguments: &["--position-m", "333", "--velocity-m-s", "1"],
    samples: 16_000,
    shard_size: 1000,
};

/// Longest time of a campaign.
const LONGEST: Duration = Duration::from_secs(120);

/// Runs the recipes where their tools are there or can be installed, and says which are left out.
pub(crate) fn run_if_there(workspace: &Workspace) -> Result<(), String> {
    if !cfg!(unix) {
        println!("cluster skipped: the recipes are scripts of bash");
        return Ok(());
    }
    run(&mut cargo(&workspace.root, ["build", "--release", "--locked", "-p", "apsides-cli"]))?;
    let folder = workspace.target.join(CASE.name);
    let work = Work { program: workspace.target.join("release/apsides"), folder };
    let _ = std::fs::remove_dir_all(&work.folder);
    std::fs::create_dir_all(&work.folder).map_err(|e| format!("{}: {e}", work.folder.display()))?;
    run(&mut CASE.whole(&work.program, &work.folder.join("whole")))?;
    work.campaign("local", "", None)?;
    match Slurm::start(&workspace.root, work.folder.join("slurm-cluster"))? {
        Ok(slurm) => work.campaign("slurm", "", Some(&slurm))?,
        Err(why) => println!("slurm skipped: {why}"),
    }
    match python_with_dask(&workspace.target) {
        Ok(python) => work.campaign("dask", &dask_keys(&python), None)?,
        Err(why) => println!("dask skipped: {why}"),
    }
    Ok(())
}

struct Work {
    program: PathBuf,
    folder: PathBuf,
}

impl Work {
    /// A campaign by an engine, of which a process is killed on the way: that of a shard, or its parent.
    fn campaign(&self, engine: &str, keys: &str, slurm: Option<&Slurm>) -> Result<(), String> {
        let file = CASE.write(&self.folder, engine, keys)?;
        println!("$ apsides campaign {engine}.toml");
        let begun = Instant::now();
        let mut pilot = Case::pilot(&self.program, &file, slurm);
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
        compare(&self.folder.join("whole"), &self.folder.join(engine).join("merged"))
            .map_err(|e| format!("{engine}: {e}"))?;
        let time = begun.elapsed().as_secs_f64();
        println!("{engine}: {killed} was killed; the joined files are those of the single run, {time:.1} s");
        Ok(())
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
