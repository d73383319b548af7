//! Parts of a large run (shards): what each is of, how far it came, and whether parts make a whole.
//!
//! A sample or a case depends on the seed, the settings and its index alone, so that parts may be computed anywhere. `shard.json` beside the rows of
//! a part states all that decides them; parts are joined only where these statements agree and their ranges leave neither gap nor overlap.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::Error;
use crate::arithmetic::vector_level;
use crate::digest::sha256;
use crate::fault::Fault;
use crate::regular_file;

/// Name of the file.
pub const SHARD: &str = "shard.json";

/// The refusal of a file with something else, or with a part of a manifest.
const NO_MANIFEST: &str =
    "is no manifest of a part, or was altered: run the command of the part again, which writes it";

/// Stands between kinds of machines, where the parts of a part come from several.
const BETWEEN: &str = ", ";

/// The form of the file; another one is refused.
const FORM: u32 = 1;

/// The state of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShardState {
    /// At work, or killed.
    Running,
    /// Ended before its end by a signal or a time limit.
    Interrupted,
    /// All there.
    Complete,
    /// All there; some samples or cases have no result.
    CompleteWithFailures,
}

impl ShardState {
    /// True where nothing is left to do.
    #[must_use]
    pub fn is_complete(self) -> bool {
        matches!(self, Self::Complete | Self::CompleteWithFailures)
    }

    /// The state in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Running => "at work, or killed",
            Self::Interrupted => "interrupted",
            Self::Complete => "complete",
            Self::CompleteWithFailures => "complete, with failures",
        }
    }
}

/// The manifest of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shard {
    /// The form of this file.
    pub form: u32,
    /// The command that made it.
    pub command: String,
    /// Name of the mission.
    pub mission: String,
    /// SHA-256 of the statement of what is computed (mission file, steering).
    pub statement_sha256: String,
    /// Settings that decide the rows besides, by name.
    pub settings: BTreeMap<String, Value>,
    /// Version of the program.
    pub version: String,
    /// Operating system and architecture.
    pub platform: String,
    /// Level of the vector instructions of the machine.
    pub vectors: String,
    /// A digest of the [arithmetic](crate::arithmetic) of the machine: where it is the same, so are the rows.
    pub arithmetic: String,
    /// Seed.
    pub seed: u64,
    /// Samples or cases of the whole run.
    pub total: usize,
    /// Index of the first one of this part.
    pub first: usize,
    /// Number of this part.
    pub count: usize,
    /// Number of those that are there.
    pub done: usize,
    /// Number of those without a result.
    pub failed: usize,
    /// Its state.
    pub state: ShardState,
    /// SHA-256 of the rows, once all are there.
    pub rows_sha256: Option<String>,
    /// Covariance of the first results by the state-transition matrix, row-major.
    pub linear_covariance: Option<Vec<f64>>,
    /// Samples whose computation panicked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// SHA-256 of all above.
    #[serde(default)]
    pub sha256: String,
}

impl Shard {
    /// A part of a run at its beginning.
    #[must_use]
    pub fn begun(
        command: &str,
        mission: &str,
        statement: &str,
        seed: u64,
        total: usize,
        indices: Range<usize>,
    ) -> Self {
        Self {
            form: FORM,
            command: command.into(),
            mission: mission.into(),
            statement_sha256: sha256(statement.as_bytes()),
            settings: BTreeMap::new(),
            version: env!("CARGO_PKG_VERSION").into(),
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            vectors: vector_level().into(),
            arithmetic: crate::arithmetic::digest_of_arithmetic(),
            seed,
            total,
            first: indices.start,
            count: indices.len(),
            done: 0,
            failed: 0,
            state: ShardState::Running,
            rows_sha256: None,
            linear_covariance: None,
            faults: Vec::new(),
            sha256: String::new(),
        }
    }

    /// Returns true if it is the whole run.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.count == self.total
    }

    /// The indices of the part.
    #[must_use]
    pub fn indices(&self) -> Range<usize> {
        self.first..self.first.saturating_add(self.count)
    }

    /// True for the statement of what is computed that the part was begun with.
    #[must_use]
    pub fn states(&self, statement: &str) -> bool {
        self.statement_sha256 == sha256(statement.as_bytes())
    }

    /// The text of the file.
    #[must_use]
    pub fn to_file(&self) -> String {
        let sealed = Self { sha256: self.digest(), ..self.clone() };
        // Numbers, words and lists always have a text.
        serde_json::to_string_pretty(&sealed).unwrap_or_default() + "\n"
    }

    fn digest(&self) -> String {
        let unsealed = Self { sha256: String::new(), ..self.clone() };
        sha256(&serde_json::to_vec(&unsealed).unwrap_or_default())
    }

    /// Reads the file.
    ///
    /// # Errors
    /// A file that is not there, is no manifest of this form, or was altered.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let refused = |reason: String| Error::File { path: path.into(), reason };
        let text = regular_file::read_text(path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => {
                refused("is not there: parts are made by `montecarlo --out` and `sweep --chain --out`".into())
            }
            _ => refused(e.to_string()),
        })?;
        let value: Value = serde_json::from_str(&text).map_err(|_| refused(NO_MANIFEST.into()))?;
        if !value.is_object() {
            return Err(refused(NO_MANIFEST.into()));
        }
        match value.get("form").and_then(Value::as_u64) {
            Some(form) if form == u64::from(FORM) => {}
            form => {
                let form = form.map_or_else(|| "no number".into(), |form| form.to_string());
                let reason =
                    format!("has form {form}, this program reads form {FORM}: take the version that made it");
                return Err(refused(reason));
            }
        }
        let shard: Self = serde_json::from_value(value).map_err(|_| refused(NO_MANIFEST.into()))?;
        match shard.sha256 == shard.digest() {
            true => Ok(shard),
            false => Err(refused("was altered: run the command of the part again".into())),
        }
    }
}

/// A part with its place on the disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Directory, or file beside which the manifest is.
    pub place: PathBuf,
    /// Its manifest.
    pub shard: Shard,
}

impl Part {
    /// A sentence about a part that is not at its end; none of one that is.
    fn lacks(&self) -> Option<String> {
        let Shard { command, done, count, first, state, .. } = &self.shard;
        let missing = count.checked_sub(*done).filter(|missing| *missing > 0)?;
        let place = self.place.display();
        let counted = if command == "sweep" { "cases" } else { "samples" };
        Some(format!(
            "`{place}` ({}) has {done} of {count} {counted}, {missing} are missing: its own command (`apsides {command} .. --first \
             {first} --count {count} --out {place}`) goes on from them, then merge again",
            state.words()
        ))
    }
}

/// Parts in the order of their indices, with what they make together.
#[derive(Clone, Debug, PartialEq)]
pub struct Joined {
    /// The parts.
    pub parts: Vec<Part>,
    /// The manifest of all of them as one, complete but for what depends on the rows.
    pub whole: Shard,
    /// Parts that are not at their end, as sentences: what they lack, and how to finish them.
    pub unfinished: Vec<String>,
    /// Levels of vector instructions, where parts come from machines whose arithmetic differs.
    pub levels: Vec<String>,
}

impl Joined {
    /// Puts parts in order. With `partly` they need not begin at the first index of the run nor end at its last. A part that was ended before its
    /// end counts with what it has (`done`).
    ///
    /// # Errors
    /// Parts of which nothing is there, that state different things, overlap or leave a gap; each by name.
    pub fn of(mut parts: Vec<Part>, partly: bool) -> Result<Self, Error> {
        let refused = |reason: String| Err(Error::Conflict { place: "merge".into(), reason });
        for Part { place, shard } in &parts {
            let Shard { done, count, state, .. } = shard;
            if done > count || (state.is_complete() && done != count) {
                let (place, words) = (place.display(), state.words());
                return refused(format!(
                    "`{place}` has {done} of {count} by its manifest, and is {words}: run its command again"
                ));
            }
        }
        // By place where two begin alike, so that the sentence does not depend on the order of the arguments.
        parts.sort_by(|a, b| (a.shard.first, &a.place).cmp(&(b.shard.first, &b.place)));
        let Some(head) = parts.first().cloned() else { return refused("no parts are given".into()) };
        if let Some((part, what)) = parts.iter().find_map(|p| Some((p, difference(&head.shard, &p.shard)?))) {
            let (a, b) = (head.place.display(), part.place.display());
            return refused(format!("`{a}` and `{b}` are not of one run: {what}"));
        }
        // A part that was killed has none yet.
        let mut with_covariance =
            parts.iter().filter(|p| p.shard.state.is_complete() || p.shard.linear_covariance.is_some());
        let plan = with_covariance.next();
        let linear_covariance = plan.and_then(|p| p.shard.linear_covariance.clone());
        if let Some((one, other)) =
            plan.zip(with_covariance.find(|p| p.shard.linear_covariance != linear_covariance))
        {
            let (a, b) = (one.place.display(), other.place.display());
            return refused(format!(
                "`{a}` and `{b}` are not of one run: the covariance by the state-transition matrix differs, so that their \
                 plans do ({}, {})",
                one.shard.vectors, other.shard.vectors
            ));
        }
        let mut next = if partly { head.shard.first } else { 0 };
        let mut before: Option<&Part> = None;
        for part in &parts {
            let Range { start, end } = part.shard.indices();
            if start > next {
                return refused(gap(next, start, head.shard.total));
            }
            if let Some(before) = before.filter(|_| start < next) {
                let (a, b) = (before.place.display(), part.place.display());
                let last = end.min(next) - 1;
                return refused(format!("`{a}` and `{b}` overlap: both have {}", indices(start, last)));
            }
            (next, before) = (end, Some(part));
        }
        if next < head.shard.total && !partly {
            return refused(gap(next, head.shard.total, head.shard.total));
        }
        let kinds = |of: fn(&Shard) -> &String| {
            let kinds: BTreeSet<&str> = parts.iter().flat_map(|p| of(&p.shard).split(BETWEEN)).collect();
            kinds.into_iter().map(str::to_owned).collect::<Vec<_>>()
        };
        let (levels, arithmetic) = (kinds(|s| &s.vectors), kinds(|s| &s.arithmetic));
        let sum = |of: fn(&Shard) -> usize| parts.iter().map(|p| of(&p.shard)).sum::<usize>();
        let unfinished: Vec<String> = parts.iter().filter_map(Part::lacks).collect();
        if sum(|s| s.done) == 0 && !unfinished.is_empty() {
            return refused(format!("nothing of the parts is there yet: {}", unfinished.join("; ")));
        }
        let whole = Shard {
            vectors: levels.join(BETWEEN),
            arithmetic: arithmetic.join(BETWEEN),
            count: sum(|s| s.count),
            done: sum(|s| s.done),
            failed: sum(|s| s.failed),
            state: match (unfinished.is_empty(), sum(|s| s.failed)) {
                (false, _) => ShardState::Interrupted,
                (true, 0) => ShardState::Complete,
                (true, _) => ShardState::CompleteWithFailures,
            },
            linear_covariance,
            faults: parts.iter().flat_map(|p| p.shard.faults.clone()).collect(),
            ..head.shard
        };
        Ok(Self { whole, unfinished, levels: if arithmetic.len() > 1 { levels } else { Vec::new() }, parts })
    }
}

fn indices(first: usize, last: usize) -> String {
    if first == last { format!("index {first}") } else { format!("indices {first} to {last}") }
}

fn gap(next: usize, start: usize, total: usize) -> String {
    format!("{} of {total} are in no part", indices(next, start - 1))
}

/// The first statement in which two parts differ, in words.
fn difference(a: &Shard, b: &Shard) -> Option<String> {
    let words = |what: &str, a: &dyn std::fmt::Display, b: &dyn std::fmt::Display| {
        Some(format!("{what} is {a} of the one, {b} of the other"))
    };
    if a.command != b.command {
        return words("the command", &a.command, &b.command);
    }
    if a.version != b.version {
        return words("the version of the program", &a.version, &b.version);
    }
    if a.platform != b.platform {
        return words("the platform", &a.platform, &b.platform);
    }
    if a.mission != b.mission {
        return words("the mission", &a.mission, &b.mission);
    }
    if a.seed != b.seed {
        return words("the seed", &a.seed, &b.seed);
    }
    if a.total != b.total {
        return words("the number of samples or cases", &a.total, &b.total);
    }
    let none = Value::Null;
    let names = a.settings.keys().chain(b.settings.keys());
    let value = |shard: &Shard, name: &String| shard.settings.get(name).unwrap_or(&none).clone();
    if let Some(name) = names.into_iter().find(|name| value(a, name) != value(b, name)) {
        return words(&format!("`{name}`"), &value(a, name), &value(b, name));
    }
    (a.statement_sha256 != b.statement_sha256).then(|| "values of the mission differ".into())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn part(name: &str, indices: Range<usize>) -> Part {
        let mut shard = Shard::begun("montecarlo", "chang-e-3-braking", "mission", 7, 100, indices);
        shard.state = ShardState::Complete;
        shard.done = shard.count;
        shard.settings.insert("position_m".into(), 333.0.into());
        Part { place: name.into(), shard }
    }

    fn refusal(parts: &[Part]) -> String {
        Joined::of(parts.to_vec(), false).unwrap_err().to_string()
    }

    #[test]
    fn parts_without_gap_or_overlap_make_a_whole() {
        let [a, mut b, c] = [part("a", 0..30), part("b", 30..31), part("c", 31..100)];
        b.shard.failed = 1;
        b.shard.state = ShardState::CompleteWithFailures;
        let joined = Joined::of(vec![c.clone(), a.clone(), b.clone()], false).unwrap();
        assert_eq!(joined.parts, [a.clone(), b, c.clone()]);
        let whole = &joined.whole;
        assert_eq!((whole.first, whole.count, whole.done, whole.failed), (0, 100, 100, 1));
        assert_eq!((whole.state, &joined.levels[..]), (ShardState::CompleteWithFailures, &[][..]));
        assert!(refusal(&[a.clone(), c.clone()]).ends_with("index 30 of 100 are in no part"));
        assert!(refusal(std::slice::from_ref(&c)).ends_with("indices 0 to 30 of 100 are in no part"));
        assert!(refusal(std::slice::from_ref(&a)).ends_with("indices 30 to 99 of 100 are in no part"));
        assert!(
            refusal(&[a.clone(), a.clone(), c.clone()])
                .ends_with("`a` and `a` overlap: both have indices 0 to 29")
        );
        let inside = part("inside", 5..9);
        assert!(
            refusal(&[a.clone(), inside]).ends_with("`a` and `inside` overlap: both have indices 5 to 8")
        );
        assert!(refusal(&[]).ends_with("no parts are given"));
        // A part of the whole, of parts.
        let some = Joined::of(vec![c], true).unwrap().whole;
        assert_eq!((some.first, some.count), (31, 69));
        assert!(Joined::of(vec![a, part("d", 40..100)], true).is_err());
    }

    #[test]
    fn what_is_not_of_one_run_is_named() {
        let a = part("a", 0..50);
        let changed = |change: &dyn Fn(&mut Shard)| {
            let mut b = part("b", 50..100);
            change(&mut b.shard);
            refusal(&[a.clone(), b])
        };
        for (change, words) in [
            (
                &(|s: &mut Shard| s.version = "0.0.9".into()) as &dyn Fn(&mut Shard),
                concat!("the version of the program is ", env!("CARGO_PKG_VERSION")),
            ),
            (
                &|s| s.mission = "lunar".into(),
                "the mission is chang-e-3-braking of the one, lunar of the other",
            ),
            (&|s| s.seed = 8, "the seed is 7 of the one, 8 of the other"),
            (&|s| s.total = 101, "the number of samples or cases is 100"),
            (&|s| s.command = "sweep".into(), "the command is montecarlo"),
            (&|s| s.platform = "plan9 vax".into(), "the platform is "),
            (&|s| s.statement_sha256 = "0".into(), "values of the mission differ"),
            (&|s| s.linear_covariance = Some(vec![1.0]), "by the state-transition matrix differs"),
            (
                &|s| {
                    s.settings.insert("position_m".into(), 300.0.into());
                },
                "`position_m` is 333.0 of the one, 300.0 of the other",
            ),
            (
                &|s| {
                    s.settings.insert("mass_kg".into(), 1.0.into());
                },
                "`mass_kg` is null of the one, 1.0 of the other",
            ),
            (&|s| s.done = 49, "`b` has 49 of 50 by its manifest, and is complete: run its command again"),
        ] {
            let sentence = changed(change);
            assert!(sentence.contains(words), "{words}: {sentence}");
        }
        // Another machine is no other run; one of another arithmetic is told.
        let mut b = part("b", 50..100);
        b.shard.vectors = "x86-64-v5".into();
        let joined = Joined::of(vec![a.clone(), b.clone()], false).unwrap();
        assert_eq!((joined.levels.len(), joined.whole.vectors.contains(", x86-64-v5")), (0, true));
        b.shard.arithmetic = "0".into();
        let joined = Joined::of(vec![a.clone(), b.clone()], false).unwrap();
        assert_eq!((joined.levels.len(), joined.whole.arithmetic.split(", ").count()), (2, 2));
        // Each is named once, also where parts were joined before.
        let mut c = part("c", 0..50);
        c.shard.vectors = joined.whole.vectors.clone();
        let again = Joined::of(vec![c, b], false).unwrap();
        assert_eq!(again.whole.vectors, joined.whole.vectors);
    }

    #[test]
    fn a_part_that_was_ended_counts_with_what_it_has() {
        let [mut a, mut b] = [part("a", 0..50), part("b", 50..100)];
        b.shard.linear_covariance = Some(vec![1.0]);
        (a.shard.state, a.shard.done) = (ShardState::Running, 20);
        let joined = Joined::of(vec![a.clone(), b.clone()], false).unwrap();
        let whole = &joined.whole;
        assert_eq!((whole.count, whole.done, whole.state), (100, 70, ShardState::Interrupted));
        // That of the part which is at its end.
        assert_eq!(whole.linear_covariance, Some(vec![1.0]));
        assert_eq!(
            joined.unfinished,
            [
                "`a` (at work, or killed) has 20 of 50 samples, 30 are missing: its own command (`apsides montecarlo .. --first 0 \
              --count 50 --out a`) goes on from them, then merge again"
            ]
        );
        // All of it is there, only its manifest is not at the end.
        a.shard.done = 50;
        let joined = Joined::of(vec![a.clone(), b.clone()], false).unwrap();
        assert_eq!((joined.whole.state, joined.unfinished.len()), (ShardState::Complete, 0));
        a.shard.done = 51;
        assert!(refusal(&[a.clone(), b.clone()]).contains("`a` has 51 of 50 by its manifest"));
        // Nothing at all.
        for part in [&mut a, &mut b] {
            (part.shard.state, part.shard.done) = (ShardState::Interrupted, 0);
        }
        assert!(
            refusal(&[a, b]).contains("nothing of the parts is there yet: `a` (interrupted) has 0 of 50")
        );
    }

    #[test]
    fn a_manifest_is_read_as_it_was_written_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(SHARD);
        let mut shard = part("a", 0..50).shard;
        shard.linear_covariance = Some(vec![0.1, 1.0 / 3.0, 5e-324]);
        shard.faults = vec![Fault { index: 3, seed: 7, message: "broke off".into() }];
        let text = shard.to_file();
        std::fs::write(&path, &text).unwrap();
        let mut read = Shard::read(&path).unwrap();
        read.sha256.clear();
        assert_eq!(read, shard);
        let refused = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Shard::read(&path).unwrap_err().to_string()
        };
        assert!(refused(&text.replace("\"seed\": 7", "\"seed\": 8")).contains("was altered"));
        assert!(refused(&text.replace("\"form\": 1", "\"form\": 2")).contains("has form 2"));
        assert!(refused(&text[..text.len() / 2]).contains("is no manifest"));
        assert!(refused("{}").contains("has form no number"));
        std::fs::remove_file(&path).unwrap();
        assert!(Shard::read(&path).unwrap_err().to_string().contains("is not there"));
    }
}
