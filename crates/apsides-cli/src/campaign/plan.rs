//! The file of a campaign, and the shards that it makes.

use std::ops::Range;
use std::path::{Path, PathBuf};

use apsides::pipeline::digest::sha256;
use apsides::pipeline::regular_file;
use apsides::pipeline::shard::{SHARD, Shard};
use clap::Parser as _;
use serde::Deserialize;

use super::keys;
use crate::arguments::{Arguments, Command, SampleFormat};
use crate::exit::{Refusal, refusal};

/// Command of the shards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum CommandWord {
    /// Samples of a Monte Carlo run.
    #[default]
    Montecarlo,
    /// Cases of a sweep.
    Sweep,
}

impl CommandWord {
    fn word(self) -> &'static str {
        match self {
            Self::Montecarlo => "montecarlo",
            Self::Sweep => "sweep",
        }
    }

    /// The name of that which is counted.
    pub(crate) fn counted(self) -> &'static str {
        match self {
            Self::Montecarlo => "samples",
            Self::Sweep => "cases",
        }
    }
}

/// Engine of the shards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EngineWord {
    /// Processes of this machine.
    #[default]
    Local,
    /// An array job of Slurm.
    Slurm,
    /// Tasks of Dask.
    Dask,
}

/// The file, as it is written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plan {
    /// Command of the shards.
    #[serde(default)]
    pub(crate) command: CommandWord,
    /// Mission file, or the name of a mission.
    mission: String,
    /// Options of the command.
    #[serde(default)]
    arguments: Vec<String>,
    /// Samples of the whole run; the cases of a sweep are counted by its `--set`.
    samples: Option<u32>,
    /// Seed of the run.
    #[serde(default)]
    seed: u64,
    /// Samples or cases of a shard.
    shard_size: u32,
    /// Engine of the shards.
    #[serde(default)]
    pub(crate) engine: EngineWord,
    /// Directory of the shards and of the result; the name of the file without its ending by default.
    out: Option<PathBuf>,
    /// Shards at a time, for `local` and Dask's own cluster; one for each core by default.
    workers: Option<u32>,
    /// Threads of a shard.
    #[serde(default = "one")]
    pub(crate) threads: u32,
    /// Times that a shard is tried that ends before its end.
    #[serde(default = "three")]
    pub(crate) attempts: u32,
    /// Longest time of a shard, s.
    time_limit_s: Option<f64>,
    /// Memory of a shard, MiB.
    pub(crate) memory_mib: Option<u32>,
    /// Files of the joined samples.
    #[serde(default)]
    pub(crate) format: SampleFormat,
    /// Keys of Slurm.
    #[serde(default)]
    pub(crate) slurm: SlurmKeys,
    /// Keys of Dask.
    #[serde(default)]
    pub(crate) dask: DaskKeys,
    /// The file.
    #[serde(skip)]
    pub(crate) file: PathBuf,
    /// Samples or cases of the whole run.
    #[serde(skip)]
    total: u32,
}

/// Keys of Slurm.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SlurmKeys {
    /// Options of `sbatch`.
    #[serde(default)]
    pub(crate) options: Vec<String>,
}

/// Keys of Dask.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct DaskKeys {
    /// Python with `dask.distributed`.
    pub(crate) python: String,
    /// Address of a scheduler; a cluster on this machine without it.
    pub(crate) scheduler: Option<String>,
}

impl Default for DaskKeys {
    fn default() -> Self {
        Self { python: "python3".into(), scheduler: None }
    }
}

fn one() -> u32 {
    1
}

fn three() -> u32 {
    3
}

/// Options of commands that the file has keys for, or that shards set.
const OWN: [&str; 12] = [
    "--samples",
    "--seed",
    "--first",
    "--count",
    "--out",
    "--threads",
    "--time-limit",
    "--memory",
    "--quiet",
    "--json",
    "--format",
    "--figure",
];

impl Plan {
    /// Reads a file and goes to its directory, to which its paths are relative.
    pub(crate) fn read(file: &Path) -> Result<Self, Refusal> {
        let shown = file.display();
        let text = regular_file::read_text(file).map_err(|e| refusal(format!("{shown}: {e}")))?;
        let refused = |reason: String| Err(refusal(format!("{shown}: {reason}")));
        if let Some(mistake) = keys::mistake(&shown.to_string(), &text) {
            return Err(refusal(mistake));
        }
        let mut plan: Self = toml::from_str(&text).map_err(|e| refusal(format!("{shown}: {e}")))?;
        if let Some(own) =
            plan.arguments.iter().find(|a| OWN.contains(&a.split('=').next().unwrap_or_default()))
        {
            return refused(format!(
                "`arguments` have {own}: the file has a key for it, or each shard its own"
            ));
        }
        plan.total = match (plan.command, plan.samples) {
            (CommandWord::Montecarlo, Some(samples)) => samples,
            (CommandWord::Montecarlo, None) => {
                return refused(
                    "`samples` is missing: those of the whole run, as in `samples = 1000`".into(),
                );
            }
            (CommandWord::Sweep, None) => 0,
            (CommandWord::Sweep, Some(_)) => {
                return refused(
                    "`samples` is of `montecarlo`: the cases of a sweep are those of its `--set`".into(),
                );
            }
        };
        if plan.command == CommandWord::Sweep && plan.format != SampleFormat::Csv {
            return refused("`format` is of samples: a sweep is a table of CSV".into());
        }
        let absolute = file.canonicalize().map_err(|e| refusal(format!("{shown}: {e}")))?;
        if let Some(directory) = absolute.parent() {
            std::env::set_current_dir(directory)
                .map_err(|e| refusal(format!("{}: {e}", directory.display())))?;
        }
        plan.file = absolute;
        if plan.command == CommandWord::Sweep {
            plan.total = plan.count_cases()?;
        }
        Ok(plan)
    }

    /// The command of a shard.
    pub(crate) fn parsed(&self, shard: usize) -> Result<Command, Refusal> {
        self.parse(self.command_line(shard))
    }

    fn parse(&self, words: Vec<String>) -> Result<Command, Refusal> {
        let shown = self.file.display();
        let parsed = Arguments::try_parse_from(std::iter::once("apsides".to_owned()).chain(words));
        Ok(parsed.map_err(|e| refusal(format!("{shown}: `mission` or `arguments`: {e}")))?.command)
    }

    /// The cases of a sweep: all combinations of the values of its keys.
    fn count_cases(&self) -> Result<u32, Refusal> {
        let shown = self.file.display();
        let refused = |reason: &str| Err(refusal(format!("{shown}: {reason}")));
        let Command::Sweep(sweep) = self.parse(self.words())? else {
            return refused("`mission` is a name or a file");
        };
        let Some(chain) = sweep.chain else {
            return refused(
                "a sweep is divided between chains: `arguments` need `--chain N`, the cases that start from one another",
            );
        };
        if !self.shard_size.is_multiple_of(chain) {
            let size = self.shard_size;
            return refused(&format!(
                "`shard_size` is {size}, it has to be a multiple of the chain, {chain}"
            ));
        }
        let sizes =
            sweep.axes()?.into_iter().map(|axis| u32::try_from(axis.values.len()).unwrap_or(u32::MAX));
        Ok(sizes.fold(1, u32::saturating_mul))
    }

    /// Directory of shards, logs and result.
    pub(crate) fn out(&self) -> PathBuf {
        let usual = || self.file.with_extension("");
        let home = self.file.parent().unwrap_or(Path::new("."));
        self.out.as_ref().map_or_else(usual, |out| home.join(out))
    }

    pub(crate) fn shards_directory(&self) -> PathBuf {
        self.out().join("shards")
    }

    /// The directory of the joined shards.
    pub(crate) fn merged(&self) -> PathBuf {
        self.out().join("merged")
    }

    /// Samples or cases of the whole run.
    pub(crate) fn total(&self) -> usize {
        self.total as usize
    }

    /// Number of shards.
    pub(crate) fn shards(&self) -> usize {
        self.total.div_ceil(self.shard_size) as usize
    }

    pub(crate) fn indices(&self, shard: usize) -> Range<usize> {
        let size = self.shard_size as usize;
        shard * size..((shard + 1) * size).min(self.total())
    }

    /// The directory of the results of a shard, which its process locks.
    pub(crate) fn shard_place(&self, shard: usize) -> PathBuf {
        self.shards_directory().join(format!("{shard:06}"))
    }

    /// The manifest of a shard that has all its samples or cases.
    pub(crate) fn complete(&self, shard: usize) -> Option<Shard> {
        complete(&self.shard_place(shard))
    }

    /// Shards at a time.
    pub(crate) fn workers(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        self.workers.map_or_else(|| (cores / self.threads as usize).max(1), |workers| workers as usize)
    }

    /// The beginning of the command line, the same for all shards.
    fn words(&self) -> Vec<String> {
        let mut words: Vec<String> = vec![self.command.word().into(), self.mission.clone()];
        words.extend(self.arguments.iter().cloned());
        words
    }

    /// The command line of a shard, behind the name of the program.
    pub(crate) fn command_line(&self, shard: usize) -> Vec<String> {
        let indices = self.indices(shard);
        let mut words = self.words();
        let mut option = |name: &str, value: String| words.extend([name.to_owned(), value]);
        if let Some(samples) = self.samples {
            option("--samples", samples.to_string());
        }
        option("--seed", self.seed.to_string());
        option("--first", indices.start.to_string());
        option("--count", indices.len().to_string());
        option("--threads", self.threads.to_string());
        option("--out", self.shard_place(shard).display().to_string());
        if let Some(limit) = self.time_limit_s {
            option("--time-limit", limit.to_string());
        }
        if let Some(memory) = self.memory_mib {
            option("--memory", memory.to_string());
        }
        words.push("--quiet".into());
        words
    }

    /// A digest of all that decides the samples and their division.
    pub(crate) fn digest(&self) -> String {
        let all = (self.command, &self.mission, &self.arguments, self.samples, self.seed, self.shard_size);
        sha256(format!("{all:?}").as_bytes())
    }
}

/// The manifest of a place where all is there.
pub(crate) fn complete(place: &Path) -> Option<Shard> {
    let manifest = place.join(SHARD);
    if !manifest.exists() {
        return None;
    }
    Shard::read(&manifest).ok().filter(|shard| shard.state.is_complete())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(more: &str) -> Result<Plan, toml::de::Error> {
        let text = format!("mission = \"lunar\"\nsamples = 1001\nshard_size = 250\n{more}");
        toml::from_str(&text).map(|plan: Plan| Plan { total: 1001, ..plan })
    }

    #[test]
    fn shards_cover_the_samples() {
        let plan = plan("").unwrap();
        assert_eq!((plan.shards(), plan.indices(0), plan.indices(4)), (5, 0..250, 1000..1001));
        let line = plan.command_line(4).join(" ");
        assert!(
            line.starts_with("montecarlo lunar --samples 1001 --seed 0 --first 1000 --count 1 "),
            "{line}"
        );
    }

    #[test]
    fn what_decides_no_sample_is_not_in_the_digest() {
        let digest = |more: &str| plan(more).unwrap().digest();
        assert_eq!(digest(""), digest("engine = \"slurm\"\nthreads = 2"));
        assert_ne!(digest(""), digest("seed = 1"));
        assert_ne!(digest(""), digest("arguments = [\"--position-m\", \"1\"]"));
    }
}
