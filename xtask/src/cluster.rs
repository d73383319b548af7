//! The recipes for clusters, on this machine: campaigns by processes, Slurm and Dask, of which a process is killed on the way, held against a
//! single run.

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
const LONGEST: Duration = Duration::from_secs(300);

/// The process that is killed without a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Victim {
    /// That of a shard.
    Shard,
    /// Its parent, a worker of the engine.
    Worker,
    /// That which submits and follows; it is started again.
    Pilot,
    /// The daemon of a node of Slurm.
    Node,
}

impl Victim {
    fn word(self) -> &'static str {
        match self {
            Self::Shard => "shard",
            Self::Worker => "worker",
            Self::Pilot => "pilot",
            Self::Node => "node",
        }
    }
}

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
    work.campaign("local", "", None, Victim::Shard)?;
    work.campaign("local", "", None, Victim::Pilot)?;
    match Slurm::start(&workspace.root, work.folder.join("slurm-cluster"))? {
        Ok(slurm) => {
            // The node last: it stays away.
            for victim in [Victim::Shard, Victim::Pilot, Victim::Node] {
                work.campaign("slurm", "", Some(&slurm), victim)?;
            }
        }
        Err(why) => println!("slurm skipped: {why}"),
    }
    match python_with_dask(&workspace.target) {
        Ok(python) => work.campaign("dask", &dask_keys(&python), None, Victim::Worker)?,
        Err(why) => println!("dask skipped: {why}"),
    }
    Ok(())
}

struct Work {
    program: PathBuf,
    folder: PathBuf,
}

impl Work {
    /// A campaign by an engine, of which a process is killed on the way.
    fn campaign(
        &self,
        engine: &str,
        keys: &str,
        slurm: Option<&Slurm>,
        victim: Victim,
    ) -> Result<(), String> {
        let name = format!("{engine}-{}", victim.word());
        let of_campaign = |e: String| format!("{name}: {e}");
        let file = CASE.write(&self.folder, &name, engine, keys)?;
        println!("$ apsides campaign {name}.toml");
        let begun = Instant::now();
        let started = || Case::pilot(&self.program, &file, slurm).spawn().map_err(|e| e.to_string());
        let mut pilot = started().map_err(of_campaign)?;
        let out = self.folder.join(&name);
        let daemon = slurm.map(|slurm| slurm.daemon(1)).transpose()?;
        let strike = |process| match victim {
            Victim::Shard => kill(process),
            Victim::Worker => parent_of(process).is_some_and(kill),
            Victim::Node => daemon.is_some_and(kill),
            Victim::Pilot => true,
        };
        strike_at_work(&out.join("shards"), &mut pilot, strike).map_err(of_campaign)?;
        if victim == Victim::Pilot {
            pilot.kill().and_then(|()| pilot.wait()).map_err(|e| e.to_string())?;
            pilot = started().map_err(of_campaign)?;
        }
        let status = loop {
            if let Some(status) = pilot.try_wait().map_err(|e| e.to_string())? {
                break status;
            }
            if begun.elapsed() > LONGEST {
                let _ = pilot.kill();
                return Err(of_campaign(format!("not at its end after {} s", LONGEST.as_secs())));
            }
            std::thread::sleep(Duration::from_millis(100));
        };
        if !status.success() {
            return Err(of_campaign(format!("it ended with {status}")));
        }
        compare(&self.folder.join("whole"), &out.join("merged")).map_err(of_campaign)?;
        let time = begun.elapsed().as_secs_f64();
        println!(
            "{engine}: a {} was killed; the joined files are those of the single run, {time:.1} s",
            victim.word()
        );
        Ok(())
    }
}

/// Strikes as soon as a process computes a shard of which some rows are there; again where that one was gone.
fn strike_at_work(shards: &Path, pilot: &mut Child, strike: impl Fn(u32) -> bool) -> Result<(), String> {
    let begun = Instant::now();
    while begun.elapsed() < LONGEST {
        if worker(shards).is_some_and(&strike) {
            return Ok(());
        }
        if pilot.try_wait().is_ok_and(|ended| ended.is_some()) {
            return Err("the campaign ended before a process could be killed".into());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let _ = pilot.kill();
    Err("no shard was begun".into())
}

fn kill(process: u32) -> bool {
    succeeds(Command::new("kill").args(["-KILL", &process.to_string()]))
}

/// A process that computes a shard of which rows are there, by the shard's lock.
fn worker(shards: &Path) -> Option<u32> {
    for entry in std::fs::read_dir(shards).ok()?.flatten() {
        let shard = entry.path();
        let Ok(words) = std::fs::read_to_string(shard.join(".apsides-lock")) else { continue };
        let has_rows = shard.join("montecarlo.csv").metadata().is_ok_and(|m| m.len() > 20_000);
        let process = words.strip_prefix("process ").and_then(|w| w.split_whitespace().next()?.parse().ok());
        if let Some(process) = process.filter(|_| has_rows) {
            return Some(process);
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
