//! The result directory: all files of an outcome, replaced together or not at all.

use std::io;
use std::path::{Path, PathBuf};

use apsides_ocp::{Ocp, PhaseTrajectory, Trajectory};
use apsides_pipeline::{Outcome, regular_file};

use crate::digests::digests;
use crate::files::{Item, TRAJECTORY, failed, json, replace, with_stale_ephemerides};
use crate::site_files::site_files;
use crate::{Figure, Multipliers, Presentation, ReportError, read_trajectory, render_page, write_trajectory};

const SUMMARY: &str = "summary.json";
const CERTIFICATE: &str = "certificate.json";
const SENSITIVITY: &str = "sensitivity.json";
const MULTIPLIERS: &str = "multipliers.json";
const MISSION: &str = "mission.toml";
const REPORT: &str = "report.html";

/// Writes the result directory of an outcome and returns the paths written: `summary.json`, `certificate.json`,
/// `sensitivity.json` (when it was asked for), `trajectory.csv`, `multipliers.json` (when there are any), `mission.toml`, `report.html` with the mission's own
/// `figures` before the standard ones, a picture and the candidates of each map that a site was chosen on, and `digests.json` with the SHA-256 of
/// every other file.
///
/// The directory and its parents are made when missing. Numbers that are not finite are `null` in JSON.
///
/// # Errors
/// [`ReportError`] with the path and the reason. The earlier content of the directory is then as it was.
pub fn write_outcome(dir: &Path, outcome: &Outcome, figures: &[Figure]) -> Result<Vec<PathBuf>, ReportError> {
    let shown = Presentation { paths: figures.to_vec(), ..Presentation::default() };
    write_outcome_with(dir, outcome, &shown, Vec::new())
}

/// As [`write_outcome`], with all that a page can show of the flight, and with the files of an ephemeris, which follow from the others and
/// have no digest.
///
/// # Errors
/// As of [`write_outcome`].
pub fn write_outcome_with(
    dir: &Path,
    outcome: &Outcome,
    shown: &Presentation,
    ephemeris: Vec<Item>,
) -> Result<Vec<PathBuf>, ReportError> {
    let mut items = render(outcome, shown)?;
    items.extend(with_stale_ephemerides(ephemeris));
    replace(dir, &items)
}

/// Reads the trajectory of a result directory: `trajectory.csv`, and `multipliers.json` when it exists.
///
/// # Errors
/// [`ReportError`] as of [`read_trajectory`], or when a file cannot be read.
pub fn read_outcome_trajectory(dir: &Path, ocp: &Ocp) -> Result<Trajectory, ReportError> {
    let path = dir.join(MULTIPLIERS);
    let multipliers: Option<Multipliers> = match regular_file::read(&path) {
        Ok(text) => Some(
            serde_json::from_slice(&text)
                .map_err(|source| ReportError::Json { file: MULTIPLIERS, source })?,
        ),
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        Err(e) => return Err(failed("read", &path)(e)),
    };
    let path = dir.join(TRAJECTORY);
    let file = regular_file::open(&path).map_err(failed("read", &path))?;
    read_trajectory(file, ocp, multipliers.as_ref())
}

/// The trajectory as files hold it: with as many nodes of the controls as its states need.
fn stored(trajectory: &Trajectory) -> Result<Trajectory, ReportError> {
    let phase = |t: &PhaseTrajectory| {
        let refused = |source| ReportError::Nodes { phase: t.name.clone(), source };
        t.with_controls_at_state_nodes().map_err(refused)
    };
    let phases = trajectory.phases.iter().map(phase).collect::<Result<_, _>>()?;
    Ok(Trajectory { phases, ..trajectory.clone() })
}

fn render(outcome: &Outcome, shown: &Presentation) -> Result<Vec<Item>, ReportError> {
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
        (REPORT, Some(render_page(outcome, shown)?.into_bytes())),
    ];
    items.extend(site_files(&outcome.decisions.sites)?);
    items.push(digests(&items, &[MISSION, TRAJECTORY, MULTIPLIERS])?);
    Ok(items)
}
