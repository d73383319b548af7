//! The file of a campaign, and the shards that it makes.

use std::ops::Range;
use std::path::{Path, PathBuf};

use apsides::pipeline::digest::sha256;
use apsides::pipeline::regular_file;
use apsides::pipeline::shard::{SHARD, Shard};
use serde::Deserialize;

use crate::exit::{Refusal, refusal};

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
    /// Mission file, or the name of a mission.
    mission: String,
    /// Options of `montecarlo`.
    #[serde(default)]
    arguments: Vec<String>,
    /// Samples of the whole run.
    samples: u32,
    /// Seed of the run.
    #[serde(default)]
    seed: u64,
    /// Samples of a shard.
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
    /// Keys of Slurm.
    #[serde(default)]
    pub(crate) slurm: SlurmKeys,
    /// Keys of Dask.
    #[serde(default)]
    pub(crate) dask: DaskKeys,
    /// The file.
    #[serde(skip)]
    pub(crate) file: PathBuf,
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

/// Options of `montecarlo` that the file has keys for, or that shards set.
const OWN: [&str; 11] = [
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
];

impl Plan {
    /// Reads a file and goes to its directory, to which its paths are relative.
    pub(crate) fn read(file: &Path) -> Result<Self, Refusal> {
        let shown = file.display();
        let text = regular_file::read_text(file).map_err(|e| refusal(format!("{shown}: {e}")))?;
        let mut plan: Self = toml::from_str(&text).map_err(|e| refusal(format!("{shown}: {e}")))?;
        let refused = |reason: String| Err(refusal(format!("{shown}: {reason}")));
        if let Some(own) =
            plan.arguments.iter().find(|a| OWN.contains(&a.split('=').next().unwrap_or_default()))
        {
            return refused(format!(
                "`arguments` have {own}: the file has a key for it, or each shard its own"
            ));
        }
        for (key, value) in [("samples", plan.samples), ("shard_size", plan.shard_size)] {
            let least = if key == "samples" { 2 } else { 1 };
            if !(least..=1_000_000_000).contains(&value) {
                return refused(format!("`{key}` is {value}, allowed is {least} to 1000000000"));
            }
        }
        for (key, value) in
            [("threads", Some(plan.threads)), ("workers", plan.workers), ("attempts", Some(plan.attempts))]
        {
            if value.is_some_and(|value| !(1..=1024).contains(&value)) {
                return refused(format!("`{key}` is {}, allowed is 1 to 1024", value.unwrap_or_default()));
            }
        }
        if plan.time_limit_s.is_some_and(|limit| !(limit > 0.0 && limit.is_finite())) {
            return refused("`time_limit_s` has to be a number of seconds above 0".into());
        }
        let absolute = file.canonicalize().map_err(|e| refusal(format!("{shown}: {e}")))?;
        if let Some(directory) = absolute.parent() {
            std::env::set_current_dir(directory)
                .map_err(|e| refusal(format!("{}: {e}", directory.display())))?;
        }
        plan.file = absolute;
        Ok(plan)
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

    /// Directory of the joined shards.
    pub(crate) fn merged(&self) -> PathBuf {
        self.out().join("merged")
    }

    pub(crate) fn samples(&self) -> usize {
        self.samples as usize
    }

    /// Number of shards.
    pub(crate) fn shards(&self) -> usize {
        self.samples.div_ceil(self.shard_size) as usize
    }

    pub(crate) fn indices(&self, shard: usize) -> Range<usize> {
        let size = self.shard_size as usize;
        shard * size..((shard + 1) * size).min(self.samples())
    }

    pub(crate) fn shard_directory(&self, shard: usize) -> PathBuf {
        self.shards_directory().join(format!("{shard:06}"))
    }

    /// True if a shard has all its samples.
    pub(crate) fn is_complete(&self, shard: usize) -> bool {
        let manifest = self.shard_directory(shard).join(SHARD);
        manifest.exists() && Shard::read(&manifest).is_ok_and(|shard| shard.state.is_complete())
    }

    /// Shards at a time.
    pub(crate) fn workers(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        self.workers.map_or_else(|| (cores / self.threads as usize).max(1), |workers| workers as usize)
    }

    /// The command line of a shard, behind the name of the program.
    pub(crate) fn command_line(&self, shard: usize) -> Vec<String> {
        let indices = self.indices(shard);
        let mut words: Vec<String> = vec!["montecarlo".into(), self.mission.clone()];
        words.extend(self.arguments.iter().cloned());
        let mut option = |name: &str, value: String| words.extend([name.to_owned(), value]);
        option("--samples", self.samples.to_string());
        option("--seed", self.seed.to_string());
        option("--first", indices.start.to_string());
        option("--count", indices.len().to_string());
        option("--threads", self.threads.to_string());
        option("--out", self.shard_directory(shard).display().to_string());
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
        let all = format!("{:?}", (&self.mission, &self.arguments, self.samples, self.seed, self.shard_size));
        sha256(all.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(more: &str) -> Result<Plan, toml::de::Error> {
        toml::from_str(&format!("mission = \"lunar\"\nsamples = 1001\nshard_size = 250\n{more}"))
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
    fn keys_that_are_not_there_are_refused() {
        assert!(plan("engin = \"local\"").unwrap_err().to_string().contains("unknown field `engin`"));
        assert!(plan("engine = \"pbs\"").unwrap_err().to_string().contains("`local`, `slurm`, `dask`"));
        assert!(plan("[slurm]\nacount = \"x\"").unwrap_err().to_string().contains("acount"));
    }

    #[test]
    fn what_decides_no_sample_is_not_in_the_digest() {
        let digest = |more: &str| plan(more).unwrap().digest();
        assert_eq!(digest(""), digest("engine = \"slurm\"\nthreads = 2"));
        assert_ne!(digest(""), digest("seed = 1"));
        assert_ne!(digest(""), digest("arguments = [\"--position-m\", \"1\"]"));
    }
}
