//! Solves on disk: work that was ended goes on from there.
//!
//! While a [`Record`] is open, every solve of a mission, and what it decides before, is kept in its directory, under a digest of all that decides it: the mission with its
//! values, the seed, the trajectory it starts from. The same work done again takes from there what is done, to the last bit, and solves the
//! rest; a file that was altered is none. The directory is removed when the work is complete.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use apsides_nlp::Status;
use apsides_ocp::Trajectory;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::Error;
use crate::digest::digits;
use crate::outcome::{Decisions, Outcome, Price, Reduced, Summary};
use crate::pipeline::Pipeline;
use crate::regular_file;
use crate::sealed::{seal, unseal};
use crate::whole_file::write_whole;
use stored::Stored;

mod decided;
mod stored;

/// Name of the directory of solves in a directory of results.
pub const SOLVES: &str = ".apsides-solves";

/// Digits of the digest that names a solve.
const KEY_DIGITS: usize = 32;

/// The record that the solves of this process are kept in.
static OPEN: RwLock<Option<Arc<Directory>>> = RwLock::new(None);

/// An open record. One is open at a time; it is closed when dropped.
#[derive(Debug)]
pub struct Record(Arc<Directory>);

#[derive(Debug)]
pub(crate) struct Directory {
    path: PathBuf,
    /// The first failure to keep a solve.
    lost: Mutex<Option<String>>,
    found: Mutex<usize>,
    /// True if solves of earlier work were there at the beginning.
    goes_on: bool,
    /// The decisions of the mission that was decided last, with its digest: a solve asks for them several times.
    decided: Mutex<Option<(String, Decisions)>>,
}

impl Record {
    /// Keeps solves in a directory, which is made when missing, and takes from there those that were kept before.
    ///
    /// # Errors
    /// The system's.
    pub fn open(path: &Path) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        let directory = Arc::new(Directory::at(path));
        *OPEN.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&directory));
        Ok(Self(directory))
    }

    /// Solves that were taken from those that earlier work left in the directory.
    #[must_use]
    pub fn found(&self) -> usize {
        if !self.0.goes_on {
            return 0;
        }
        *self.0.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The reason for which a solve could not be kept.
    #[must_use]
    pub fn lost(&self) -> Option<String> {
        self.0.lost.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Removes the directory: the work is complete.
    pub fn remove(self) {
        let _ = fs::remove_dir_all(&self.0.path);
    }
}

impl Drop for Record {
    fn drop(&mut self) {
        *OPEN.write().unwrap_or_else(PoisonError::into_inner) = None;
        // One without solves is of no use.
        let _ = fs::remove_dir(&self.0.path);
    }
}

/// The open record.
pub(crate) fn current() -> Option<Arc<Directory>> {
    OPEN.read().unwrap_or_else(PoisonError::into_inner).clone()
}

impl Pipeline {
    /// The outcome of a solve from the open record; else that of `solve`, which is kept there.
    pub(crate) fn kept(
        &self,
        start: Option<&Trajectory>,
        margins: bool,
        priced: bool,
        solve: impl FnOnce() -> Result<Outcome, Error>,
    ) -> Result<Outcome, Error> {
        let Some(record) = current() else { return solve() };
        let Some(key) = record.key(self, start, margins) else { return solve() };
        if let Some(kept) = record.find(&key, self, priced) {
            return Ok(kept);
        }
        let outcome = solve()?;
        // Scalars whose solves were cancelled are missing.
        if margins && self.is_cancelled() {
            return Ok(outcome);
        }
        record.keep(&key, &outcome);
        Ok(Outcome { kept: Some(key), ..outcome })
    }
}

/// The file of a solve.
#[derive(Serialize, Deserialize)]
struct Kept {
    status: String,
    /// TOML, which has numbers that are not finite.
    summary: String,
    explanation: Option<String>,
    trajectory: Stored,
    reduced: Option<Stored>,
}

/// Prices, as TOML needs a table around them.
#[derive(Serialize, Deserialize)]
struct Prices {
    prices: Vec<Price>,
}

/// Statuses of solves that end the same way when they are made again.
const REPEATABLE: [Status; 8] = [
    Status::Optimal,
    Status::Acceptable,
    Status::Infeasible,
    Status::NoFeasiblePoint,
    Status::Diverging,
    Status::IterationLimit,
    Status::RestorationFailed,
    Status::StepTooSmall,
];

impl Directory {
    fn at(path: &Path) -> Self {
        let (lost, found, decided) = Default::default();
        let goes_on = fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some());
        Self { path: path.into(), lost, found, goes_on, decided }
    }

    /// A digest of all that decides a solve.
    pub(crate) fn key(
        &self,
        mission: &Pipeline,
        start: Option<&Trajectory>,
        margins: bool,
    ) -> Option<String> {
        let mut digest = Sha256::new();
        digest.update(env!("CARGO_PKG_VERSION"));
        digest.update(mission.statement());
        digest.update([u8::from(margins), u8::from(start.is_some())]);
        if let Some(start) = start {
            digest.update(serde_json::to_vec(&Stored::of(start)).ok()?);
        }
        let mut key = digits(&digest.finalize());
        key.truncate(KEY_DIGITS);
        Some(key)
    }

    fn file(&self, key: &str) -> PathBuf {
        self.path.join(format!("{key}.json"))
    }

    fn prices_file(&self, key: &str) -> PathBuf {
        self.path.join(format!("{key}.prices.toml"))
    }

    /// A solve that was kept, if all of it can be read. With `priced`, only one whose prices are kept too.
    pub(crate) fn find(&self, key: &str, mission: &Pipeline, priced: bool) -> Option<Outcome> {
        let content = regular_file::read(&self.file(key)).ok()?;
        let kept: Kept = serde_json::from_str(unseal(&content)?).ok()?;
        let status = REPEATABLE.into_iter().find(|status| status.word() == kept.status)?;
        if priced && status.is_success() && !self.prices_file(key).exists() {
            return None;
        }
        let summary: Summary = toml::from_str(&kept.summary).ok()?;
        let decisions = mission.decide().ok()?;
        let decided = mission.decided(&decisions).ok()?;
        let posed = decided.pose_decided().ok()?;
        let trajectory = kept.trajectory.restored()?;
        let (ocp, reduced) = match kept.reduced {
            Some(reduced) => {
                let reduced = Reduced { ocp: posed.ocp, trajectory: reduced.restored()? };
                (posed.expansion?.ocp, Some(reduced))
            }
            None => (posed.ocp, None),
        };
        *self.found.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        Some(Outcome {
            headline: decided.mission().headline().into_iter().map(str::to_owned).collect(),
            curves: decided.mission().curves(&trajectory),
            ocp,
            trajectory,
            reduced,
            status,
            report: None,
            summary,
            mission_file: mission.to_file(),
            decisions,
            explanation: kept.explanation,
            kept: Some(key.into()),
        })
    }

    /// Keeps a solve that would end the same way again.
    pub(crate) fn keep(&self, key: &str, outcome: &Outcome) {
        if !REPEATABLE.contains(&outcome.status) {
            return;
        }
        let Ok(summary) = toml::to_string(&outcome.summary) else { return };
        let kept = Kept {
            status: outcome.status.word().into(),
            summary,
            explanation: outcome.explanation.clone(),
            trajectory: Stored::of(&outcome.trajectory),
            reduced: outcome.reduced.as_ref().map(|r| Stored::of(&r.trajectory)),
        };
        if let Ok(text) = serde_json::to_string(&kept) {
            self.write(&self.file(key), &text);
        }
    }

    /// Prices that were kept for a solve.
    pub(crate) fn find_prices(&self, key: &str) -> Option<Vec<Price>> {
        let content = regular_file::read(&self.prices_file(key)).ok()?;
        toml::from_str(unseal(&content)?).ok().map(|Prices { prices }| prices)
    }

    /// Keeps the prices of a solve.
    pub(crate) fn keep_prices(&self, key: &str, prices: &[Price]) {
        if let Ok(text) = toml::to_string(&Prices { prices: prices.to_vec() }) {
            self.write(&self.prices_file(key), &text);
        }
    }

    fn write(&self, path: &Path, text: &str) {
        if let Err(e) = write_whole(path, seal(text).as_bytes()) {
            let mut lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
            lost.get_or_insert_with(|| format!("{}: {e}", path.display()));
        }
    }
}
