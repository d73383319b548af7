//! The result directory: all files of an outcome, replaced together or not at all.
//!
//! Every file is first rendered in memory, then written and flushed to the disk in a hidden directory inside the result
//! directory (so on the same file system), and only then are they moved into place by renaming. If a rename fails, the
//! ones done are undone. A file of the earlier result that the new one does not have is removed. Readers see each file
//! old or new, never in part; a program that is killed between two renames leaves the hidden directory
//! `.apsides-*` behind with the missing files.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use apsides::Outcome;
use apsides_ocp::{Ocp, OcpError, PhaseTrajectory, Trajectory};
use serde::Serialize;

use crate::site_files::site_files;
use crate::{Figure, Multipliers, ReportError, read_trajectory, render_html, write_trajectory};

const SUMMARY: &str = "summary.json";
const CERTIFICATE: &str = "certificate.json";
const SENSITIVITY: &str = "sensitivity.json";
const TRAJECTORY: &str = "trajectory.csv";
const MULTIPLIERS: &str = "multipliers.json";
const MISSION: &str = "mission.toml";
const REPORT: &str = "report.html";

/// A file name and its content; none for a file that must not stay.
pub(crate) type Item = (&'static str, Option<Vec<u8>>);

/// Writes the result directory of an outcome and returns the paths written: `summary.json`, `certificate.json`,
/// `sensitivity.json` (when it was asked for), `trajectory.csv`, `multipliers.json` (when there are any), `mission.toml`, `report.html` with the mission's own
/// `figures` before the standard ones, and a picture and the candidates of each map that a site was chosen on.
///
/// The directory and its parents are made when missing. Numbers that are not finite are `null` in JSON.
///
/// # Errors
/// [`ReportError`] with the path and the reason. The earlier content of the directory is then as it was.
pub fn write_outcome(dir: &Path, outcome: &Outcome, figures: &[Figure]) -> Result<Vec<PathBuf>, ReportError> {
    replace(dir, &render(outcome, figures)?)
}

/// Reads the trajectory of a result directory: `trajectory.csv`, and `multipliers.json` when it exists.
///
/// # Errors
/// [`ReportError`] as of [`read_trajectory`], or when a file cannot be read.
pub fn read_outcome_trajectory(dir: &Path, ocp: &Ocp) -> Result<Trajectory, ReportError> {
    let path = dir.join(MULTIPLIERS);
    let multipliers: Option<Multipliers> = match fs::read(&path) {
        Ok(text) => Some(
            serde_json::from_slice(&text)
                .map_err(|source| ReportError::Json { file: MULTIPLIERS, source })?,
        ),
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        Err(e) => return Err(failed("read", &path)(e)),
    };
    let path = dir.join(TRAJECTORY);
    let file = File::open(&path).map_err(failed("read", &path))?;
    read_trajectory(file, ocp, multipliers.as_ref())
}

/// The trajectory as files hold it: with as many nodes of the controls as its states need.
fn stored(trajectory: &Trajectory) -> Result<Trajectory, ReportError> {
    let phase = |t: &PhaseTrajectory| {
        let refused = |e: OcpError| ReportError::Shape { place: t.name.clone(), reason: e.to_string() };
        t.with_controls_at_state_nodes().map_err(refused)
    };
    let phases = trajectory.phases.iter().map(phase).collect::<Result<_, _>>()?;
    Ok(Trajectory { phases, ..trajectory.clone() })
}

fn render(outcome: &Outcome, figures: &[Figure]) -> Result<Vec<Item>, ReportError> {
    let stored = stored(&outcome.trajectory)?;
    let mut trajectory = Vec::new();
    write_trajectory(&mut trajectory, &outcome.ocp, &stored)?;
    let sensitivity = outcome.summary.sensitivity.as_ref();
    let multipliers = Multipliers::of(&outcome.ocp, &stored);
    let mut items = vec![
        (SUMMARY, Some(json(SUMMARY, &outcome.summary)?)),
        (CERTIFICATE, Some(json(CERTIFICATE, &outcome.summary.certificate)?)),
        (SENSITIVITY, sensitivity.map(|s| json(SENSITIVITY, s)).transpose()?),
        (TRAJECTORY, Some(trajectory)),
        (MULTIPLIERS, multipliers.map(|m| json(MULTIPLIERS, &m)).transpose()?),
        (MISSION, Some(outcome.mission_file.clone().into_bytes())),
        (REPORT, Some(render_html(outcome, figures)?.into_bytes())),
    ];
    items.extend(site_files(&outcome.decisions.sites)?);
    Ok(items)
}

pub(crate) fn json(file: &'static str, value: &impl Serialize) -> Result<Vec<u8>, ReportError> {
    let mut text = serde_json::to_vec_pretty(value).map_err(|source| ReportError::Json { file, source })?;
    text.push(b'\n');
    Ok(text)
}

fn failed(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> ReportError + use<> {
    let path = path.to_owned();
    move |source| ReportError::Io { action, path, source }
}

pub(crate) fn replace(dir: &Path, items: &[Item]) -> Result<Vec<PathBuf>, ReportError> {
    if dir.exists() && !dir.is_dir() {
        return Err(ReportError::NotADirectory { path: dir.to_owned() });
    }
    if let Some(path) = items.iter().map(|(name, _)| dir.join(name)).find(|path| path.is_dir()) {
        return Err(ReportError::IsADirectory { path });
    }
    let missing: Vec<&Path> =
        dir.ancestors().take_while(|d| !d.as_os_str().is_empty() && !d.exists()).collect();
    let written = fs::create_dir_all(dir)
        .map_err(failed("create the directory", dir))
        .and_then(|()| Staging::new(dir))
        .and_then(|staging| {
            items.iter().try_for_each(|item| staging.write(item))?;
            staging.publish(dir, items)
        });
    if written.is_err() {
        for made in missing {
            // Not empty if somebody else uses it by now: then it stays.
            let _ = fs::remove_dir(made);
        }
    }
    written
}

/// A hidden directory for files in the making, removed when dropped.
struct Staging {
    new: PathBuf,
    old: PathBuf,
    root: PathBuf,
}

impl Staging {
    fn new(dir: &Path) -> Result<Self, ReportError> {
        let process = std::process::id();
        let mut number = 0;
        loop {
            let root = dir.join(format!(".apsides-{process}-{number}"));
            match fs::create_dir(&root) {
                Ok(()) => {
                    let staging = Self { new: root.join("new"), old: root.join("old"), root };
                    for part in [&staging.new, &staging.old] {
                        fs::create_dir(part).map_err(failed("write into", dir))?;
                    }
                    return Ok(staging);
                }
                // Another thread of this process, or a killed one, has this number.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && number < 10_000 => number += 1,
                Err(e) => return Err(failed("write into", dir)(e)),
            }
        }
    }

    fn write(&self, (name, content): &Item) -> Result<(), ReportError> {
        let Some(content) = content else { return Ok(()) };
        let path = self.new.join(name);
        let write = |path: &Path| -> io::Result<()> {
            let mut file = File::create_new(path)?;
            file.write_all(content)?;
            file.sync_all()
        };
        write(&path).map_err(failed("write", &path))
    }

    /// Moves every file into place, the earlier ones aside; undoes all moves when one fails.
    fn publish(&self, dir: &Path, items: &[Item]) -> Result<Vec<PathBuf>, ReportError> {
        let mut moves: Vec<(PathBuf, PathBuf)> = Vec::new();
        let mut written = Vec::new();
        for (name, content) in items {
            let target = dir.join(name);
            let mut steps = vec![(target.clone(), self.old.join(name))];
            if content.is_some() {
                steps.push((self.new.join(name), target.clone()));
                written.push(target.clone());
            }
            for (from, to) in steps {
                match fs::rename(&from, &to) {
                    Ok(()) => moves.push((from, to)),
                    // No earlier result to move aside.
                    Err(e) if e.kind() == io::ErrorKind::NotFound && from == target => {}
                    Err(e) => {
                        for (from, to) in moves.iter().rev() {
                            let _ = fs::rename(to, from);
                        }
                        return Err(failed("replace", &target)(e));
                    }
                }
            }
        }
        Ok(written)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.root);
    }
}

#[cfg(test)]
mod tests;
