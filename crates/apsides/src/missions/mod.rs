//! The missions that come with the program.

use std::collections::BTreeMap;

use apsides_flatness::FlatSystem;
use apsides_ocp::{Guess, Ocp, Trajectory};

use crate::key::{Key, Values};
use crate::{Curve, Error, method};

pub(crate) mod lunar;

/// A problem with a start.
pub struct Posed {
    /// The problem.
    pub ocp: Ocp,
    /// Where a method starts.
    pub guess: Guess,
    /// The flat description of each phase, if all have one.
    pub flat_systems: Option<Vec<FlatSystem>>,
}

/// A kind of mission: its keys, how they make a problem, and what its results are.
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    /// Keys of the vehicle and the flight.
    pub(crate) flight_keys: &'static [&'static [Key]],
    /// Values that do not go together, in words.
    pub(crate) check: fn(&Values) -> Result<(), String>,
    pub(crate) pose: fn(&Values) -> Result<Posed, Error>,
    /// Scalars for the summary; the unit ends the key.
    pub(crate) results: fn(&Values, &Trajectory) -> BTreeMap<String, f64>,
    /// Results that name a case in a table.
    pub(crate) headline: &'static [&'static str],
    /// Figures besides the standard ones.
    pub(crate) curves: fn(&Values, &Trajectory) -> Vec<Curve>,
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Kind {
    pub(crate) fn keys(&self) -> impl Iterator<Item = &'static Key> + use<> {
        self.flight_keys.iter().copied().flatten().chain(method::keys())
    }
}

const KINDS: &[Kind] = &[lunar::DIRECT, lunar::PERILUNE, lunar::TWO_PHASE, lunar::TRANSFER];

/// Files by their names; one that is not named like its kind says what is special about it.
const FILES: &[(&str, &str)] = &[
    ("lunar-direct", include_str!("../../missions/lunar-direct.toml")),
    ("lunar-perilune", include_str!("../../missions/lunar-perilune.toml")),
    ("lunar-two-phase", include_str!("../../missions/lunar-two-phase.toml")),
    ("lunar-transfer", include_str!("../../missions/lunar-transfer.toml")),
    ("lunar-coast", include_str!("../../missions/lunar-coast.toml")),
    ("lunar-throttled", include_str!("../../missions/lunar-throttled.toml")),
    ("lunar-vertical", include_str!("../../missions/lunar-vertical.toml")),
];

pub(crate) fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|k| k.name == name)
}

pub(crate) fn file(name: &str) -> Option<&'static str> {
    FILES.iter().find(|f| f.0 == name).map(|f| f.1)
}

pub(crate) fn names() -> String {
    KINDS.iter().map(|k| format!("`{}`", k.name)).collect::<Vec<_>>().join(", ")
}

/// Name and title of every mission file; the title is its first line.
pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES
        .iter()
        .map(|(name, text)| (*name, text.lines().next().map_or("", |line| line.trim_start_matches("# "))))
}
