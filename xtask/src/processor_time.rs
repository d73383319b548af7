//! Processor time of commands with all that they begin: also of daemons, whose processes are nobody's children.

use std::fs::{read_to_string, write};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::output;

/// Counts processor time until it is dropped.
#[derive(Debug)]
pub(crate) enum Counter {
    /// A control group that this process is in, and so is all that it begins.
    Group {
        /// The group that it was in.
        home: PathBuf,
        folder: PathBuf,
    },
    /// The whole machine, with what others do on it.
    Machine,
}

impl Counter {
    /// A control group where one can be made, by its name.
    pub(crate) fn start(name: &str) -> Self {
        let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
        for home in homes(&groups) {
            let folder = home.join(format!("{name}-{}", std::process::id()));
            if std::fs::create_dir(&folder).is_err() {
                continue;
            }
            let counter = Self::Group { home, folder };
            if counter.enter().is_some() && counter.seconds().is_ok() {
                return counter;
            }
        }
        Self::Machine
    }

    /// Its name in a table.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Group { .. } => "processors, s",
            Self::Machine => "processors of the machine, s",
        }
    }

    fn enter(&self) -> Option<()> {
        let Self::Group { folder, .. } = self else { return None };
        write(folder.join("cgroup.procs"), std::process::id().to_string()).ok()
    }

    /// The time until now, s.
    pub(crate) fn seconds(&self) -> Result<f64, String> {
        match self {
            Self::Group { folder, .. } => {
                let [old, new] = ["cpuacct.usage", "cpu.stat"].map(|name| read_to_string(folder.join(name)));
                let found = match (old, new) {
                    (Ok(nanoseconds), _) => nanoseconds.trim().parse().ok().map(|ns: f64| 1e-9 * ns),
                    (_, Ok(stat)) => microseconds(&stat).map(|us| 1e-6 * us),
                    _ => None,
                };
                found.ok_or_else(|| format!("{}: has no processor time", folder.display()))
            }
            Self::Machine => {
                let place = "/proc/stat";
                let text = read_to_string(place).map_err(|e| format!("{place}: {e}"))?;
                let ticks = output(Command::new("getconf").arg("CLK_TCK"))?;
                let ticks: f64 = ticks.trim().parse().map_err(|e| format!("getconf CLK_TCK: {e}"))?;
                let busy = busy_ticks(&text).map(|busy| busy / ticks);
                busy.ok_or_else(|| format!("{place}: has no times"))
            }
        }
    }
}

impl Drop for Counter {
    fn drop(&mut self) {
        if let Self::Group { home, folder } = self {
            // A daemon that is still there keeps the group, which is empty of anything else.
            let _ = write(home.join("cgroup.procs"), std::process::id().to_string());
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// Folders of the groups of a process that count time: of version 1 by their controller, and of version 2.
fn homes(groups: &str) -> Vec<PathBuf> {
    let place = |line: &str| -> Option<PathBuf> {
        let (_, rest) = line.split_once(':')?;
        let (controllers, path) = rest.split_once(':')?;
        let root = Path::new("/sys/fs/cgroup");
        let root = match controllers {
            "" => root.to_owned(),
            _ if controllers.split(',').any(|c| c == "cpuacct") => root.join("cpuacct"),
            _ => return None,
        };
        Some(root.join(path.trim_start_matches('/')))
    };
    groups.lines().filter_map(place).collect()
}

fn microseconds(stat: &str) -> Option<f64> {
    stat.lines().find_map(|line| line.strip_prefix("usage_usec ")?.trim().parse().ok())
}

/// Ticks of user, nice, system, interrupts; idle and waiting are the fourth and the fifth.
fn busy_ticks(stat: &str) -> Option<f64> {
    let line = stat.lines().find_map(|line| line.strip_prefix("cpu "))?;
    let ticks: Vec<f64> = line.split_whitespace().take(7).map(str::parse).collect::<Result<_, _>>().ok()?;
    let [user, nice, system, _, _, interrupts, soft] = ticks[..] else { return None };
    Some(user + nice + system + interrupts + soft)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_of_both_versions_are_found() {
        let root = Path::new("/sys/fs/cgroup");
        let first = homes("4:memory:/a\n2:cpu,cpuacct:/b/c\n0::/\n");
        assert_eq!(first, [root.join("cpuacct/b/c"), root.join("")]);
        assert_eq!(homes("0::/user.slice\nnonsense"), [root.join("user.slice")]);
        assert_eq!(microseconds("nr 1\nusage_usec 2500\nuser_usec 1\n"), Some(2500.0));
    }

    #[test]
    fn busy_time_has_no_idle_time() {
        assert_eq!(busy_ticks("cpu  1 2 4 800 1600 8 16 32 0 0\ncpu0 1 1 1 1"), Some(31.0));
        assert_eq!(busy_ticks("cpu  1 2"), None);
        assert_eq!(busy_ticks(""), None);
    }
}
