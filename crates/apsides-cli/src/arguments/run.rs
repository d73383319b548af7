//! Arguments that long commands share: threads, seed, progress, the longest time.

use std::num::NonZero;

use clap::Args;

use crate::stop::StopFlag;

/// The number of threads.
#[derive(Debug, Args)]
pub(crate) struct Threads {
    /// Threads to use, by default one for each core; the results do not depend on it.
    #[arg(long = "threads", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    given: Option<u32>,
}

impl Threads {
    pub(crate) fn count(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
        self.given.map_or_else(cores, |given| given as usize)
    }
}

/// Arguments that solves share.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) threads: Threads,
    /// Seed of everything random: searches.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) limit: TimeLimit,
    /// Memory that the work may take as far as that is foreseen, MiB; by default half of the machine's.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    memory: Option<u32>,
}

impl RunArguments {
    /// Bytes that the work may take.
    pub(crate) fn memory(&self) -> u64 {
        allowed_memory(self.memory)
    }
}

/// Bytes that work may take, where so many MiB are allowed, or none are said.
pub(crate) fn allowed_memory(mebibytes: Option<u32>) -> u64 {
    mebibytes.map_or_else(half_of_the_machine, |mebibytes| u64::from(mebibytes) << 20)
}

/// Memory of a machine that does not tell, bytes.
const USUAL: u64 = 8 << 30;

/// Half of the memory of the machine, bytes.
fn half_of_the_machine() -> u64 {
    let told = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| total(&text));
    told.unwrap_or(USUAL) / 2
}

/// Bytes of memory by the text of `/proc/meminfo`.
fn total(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes << 10)
}

/// The longest time of a command.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct TimeLimit {
    /// End after so many seconds with what was found until then, and exit status 3.
    #[arg(long = "time-limit", value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub(crate) time_limit: Option<f64>,
}

impl TimeLimit {
    /// The flag that is set once a signal comes or the time is over.
    pub(crate) fn stop(self) -> StopFlag {
        StopFlag::within(self.time_limit)
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(seconds) if seconds > 0.0 && f64::is_finite(seconds) => Ok(seconds),
        _ => Err("a number of seconds above 0 is expected".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::total;

    #[test]
    fn the_memory_of_the_machine_is_read() {
        let text = "MemTotal:       24649916 kB\nMemFree:        21924020 kB\n";
        assert_eq!(total(text), Some(24_649_916 << 10));
        assert_eq!(total("MemFree: 1 kB"), None);
        assert_eq!(total("MemTotal: many"), None);
    }
}
