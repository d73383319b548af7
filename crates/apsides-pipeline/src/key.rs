//! Keys of mission files: name with unit, meaning, default, allowed values.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use apsides_expressions::suggestion::{distance, is_slip, nearest, quoted};

use crate::Error;
use crate::unit_ending::{name_of, unit_of};

/// Ends of an interval of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value, and whether it is allowed itself.
    pub least: (f64, bool),
    /// Largest value, and whether it is allowed itself.
    pub most: (f64, bool),
}

/// Sizes of numbers, in the units of the keys: far beyond any quantity of spaceflight; products of a few of them are still numbers.
const SIZES: RangeInclusive<f64> = 1e-30..=1e30;

impl Range {
    /// Above zero.
    pub const POSITIVE: Self = Self::open(0.0, f64::INFINITY);

    /// Above zero, or infinite for what is not limited.
    pub const POSITIVE_OR_UNLIMITED: Self = Self { least: (0.0, false), most: (f64::INFINITY, true) };

    /// Any number, or infinite for what is open.
    pub const ANY_OR_UNLIMITED: Self =
        Self { least: (f64::NEG_INFINITY, false), most: (f64::INFINITY, true) };

    /// Between two values that are allowed themselves.
    #[must_use]
    pub const fn closed(least: f64, most: f64) -> Self {
        Self { least: (least, true), most: (most, true) }
    }

    /// Between two values that are not allowed themselves.
    #[must_use]
    pub const fn open(least: f64, most: f64) -> Self {
        Self { least: (least, false), most: (most, false) }
    }

    /// From a value, which is allowed, up.
    #[must_use]
    pub const fn from(least: f64) -> Self {
        Self { least: (least, true), most: (f64::INFINITY, false) }
    }

    /// A part of what double precision resolves: from a hundred times its spacing up, below one.
    pub const TOLERANCE: Self = Self { least: (1e-14, true), most: (1.0, false) };

    pub(crate) fn contains(&self, v: f64) -> bool {
        let above = v > self.least.0 || (self.least.1 && v == self.least.0);
        let below = v < self.most.0 || (self.most.1 && v == self.most.0);
        (v.is_finite() || self.takes(v)) && above && below
    }

    /// Returns true if `v` is an infinite end that is allowed itself.
    fn takes(&self, v: f64) -> bool {
        [self.least, self.most].contains(&(v, true)) && v.is_infinite()
    }

    fn describe(&self) -> String {
        let bound = |(v, included): (f64, bool), least: bool| match (Value::Number(v), included, least) {
            _ if !v.is_finite() => None,
            (v, true, true) => Some(format!("at least {v}")),
            (v, false, true) => Some(format!("above {v}")),
            (v, true, false) => Some(format!("at most {v}")),
            (v, false, false) => Some(format!("below {v}")),
        };
        let parts: Vec<_> =
            [bound(self.least, true), bound(self.most, false)].into_iter().flatten().collect();
        let unlimited = if self.takes(f64::INFINITY) { ", or inf" } else { "" };
        if parts.is_empty() {
            format!("a finite number{unlimited}")
        } else {
            format!("a number {}{unlimited}", parts.join(" and "))
        }
    }
}

/// The values that a key takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyKind {
    /// A number with its default and range.
    Number(f64, Range),
    /// A whole number with its default, smallest and largest value.
    Count(u32, u32, u32),
    /// One of several words, the first being the default.
    Choice(&'static [&'static str]),
    /// True or false, with its default.
    Flag(bool),
    /// Free text with its default, and what is allowed in words; the mission looks at it.
    Text(&'static str, &'static str),
    /// A word or the path of a file, with its default, and what is allowed in words. A path of a mission file counts from the directory
    /// of that file.
    Path(&'static str, &'static str),
    /// A table as text, with its default and what is allowed in words. A value that ends with `.csv` or `.opm` is the path of the file
    /// that has it.
    Table(&'static str, &'static str),
    /// A number in a range that may be left open.
    Optional(Range),
    /// A number in a range; the named data (a body, a vehicle) of the given key have it unless the mission file does.
    Named(&'static str, Range),
}

/// One key of a mission file.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Path with the unit at its end: `perilune_altitude_km`, `radau.points`.
    pub path: Cow<'static, str>,
    /// Meaning, in one line.
    pub meaning: Cow<'static, str>,
    /// Type, default, allowed values.
    pub kind: KeyKind,
    /// The unit, where the path does not end with it.
    pub unit: Option<Cow<'static, str>>,
}

impl Key {
    const fn of(path: &'static str, meaning: &'static str, kind: KeyKind) -> Self {
        Self { path: Cow::Borrowed(path), meaning: Cow::Borrowed(meaning), kind, unit: None }
    }

    /// A number of a file that says itself which keys it has, with its unit.
    #[must_use]
    pub fn of_file(path: String, default: f64, range: Range, meaning: String, unit: String) -> Self {
        Self {
            path: path.into(),
            meaning: meaning.into(),
            kind: KeyKind::Number(default, range),
            unit: Some(unit.into()),
        }
    }

    /// The unit, which the path ends with unless the key states it; empty without one.
    #[must_use]
    pub fn unit(&self) -> Cow<'_, str> {
        self.unit.as_deref().map_or_else(|| unit_of(&self.path), Cow::Borrowed)
    }

    /// A number.
    #[must_use]
    pub const fn number(path: &'static str, default: f64, range: Range, meaning: &'static str) -> Self {
        Self::of(path, meaning, KeyKind::Number(default, range))
    }

    /// A whole number.
    #[must_use]
    pub const fn count(
        path: &'static str,
        default: u32,
        least: u32,
        most: u32,
        meaning: &'static str,
    ) -> Self {
        Self::of(path, meaning, KeyKind::Count(default, least, most))
    }

    /// One of several words, the first being the default.
    #[must_use]
    pub const fn choice(path: &'static str, words: &'static [&'static str], meaning: &'static str) -> Self {
        Self::of(path, meaning, KeyKind::Choice(words))
    }

    /// True or false.
    #[must_use]
    pub const fn flag(path: &'static str, default: bool, meaning: &'static str) -> Self {
        Self::of(path, meaning, KeyKind::Flag(default))
    }

    /// Free text; `allowed` says in words what it may be.
    #[must_use]
    pub const fn text(
        path: &'static str,
        default: &'static str,
        allowed: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self::of(path, meaning, KeyKind::Text(default, allowed))
    }

    /// A word or the path of a file; `allowed` says in words what it may be.
    #[must_use]
    pub const fn path(
        path: &'static str,
        default: &'static str,
        allowed: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self::of(path, meaning, KeyKind::Path(default, allowed))
    }

    /// A table as text or the path of its file; `allowed` says in words what it may be.
    #[must_use]
    pub const fn table(
        path: &'static str,
        default: &'static str,
        allowed: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self::of(path, meaning, KeyKind::Table(default, allowed))
    }

    /// A number that may be left open: it has no value unless the file, or a decision on the way, states one.
    #[must_use]
    pub const fn optional(path: &'static str, range: Range, meaning: &'static str) -> Self {
        Self::of(path, meaning, KeyKind::Optional(range))
    }

    /// A number that the data named by the key `data`, such as `vehicle`, have unless the mission file states it.
    #[must_use]
    pub const fn named(data: &'static str, path: &'static str, range: Range, meaning: &'static str) -> Self {
        Self::of(path, meaning, KeyKind::Named(data, range))
    }

    /// Returns true if the key takes any number of a range.
    #[must_use]
    pub const fn is_number(&self) -> bool {
        matches!(self.kind, KeyKind::Number(..) | KeyKind::Optional(_) | KeyKind::Named(..))
    }

    /// Allowed values in words.
    #[must_use]
    pub fn allowed(&self) -> String {
        match self.kind {
            KeyKind::Number(_, range) | KeyKind::Optional(range) | KeyKind::Named(_, range) => {
                range.describe()
            }
            KeyKind::Count(_, least, most) => format!("a whole number from {least} to {most}"),
            KeyKind::Choice(words) => {
                words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(" or ")
            }
            KeyKind::Flag(_) => "true or false".into(),
            KeyKind::Text(_, allowed) | KeyKind::Path(_, allowed) | KeyKind::Table(_, allowed) => {
                allowed.into()
            }
        }
    }

    /// The value where neither a file nor named data state one; none of a key that is open then.
    #[must_use]
    pub fn default(&self) -> Option<Value> {
        match self.kind {
            KeyKind::Number(v, _) => Some(Value::Number(v)),
            KeyKind::Count(v, ..) => Some(Value::Number(f64::from(v))),
            KeyKind::Choice(words) => Some(Value::Word(words[0].to_owned())),
            KeyKind::Flag(v) => Some(Value::Flag(v)),
            KeyKind::Text(v, _) | KeyKind::Path(v, _) | KeyKind::Table(v, _) => {
                Some(Value::Word(v.to_owned()))
            }
            KeyKind::Optional(_) | KeyKind::Named(..) => None,
        }
    }

    /// Checks a value that stands at `place`.
    ///
    /// # Errors
    /// [`Error::Value`] when the key does not take it.
    pub fn accept(&self, value: &Value, place: &str) -> Result<(), Error> {
        let fits = match (&self.kind, value) {
            (
                KeyKind::Number(_, range) | KeyKind::Optional(range) | KeyKind::Named(_, range),
                Value::Number(v),
            ) => range.contains(*v),
            (KeyKind::Count(_, least, most), Value::Number(v)) => {
                v.fract() == 0.0 && Range::closed(f64::from(*least), f64::from(*most)).contains(*v)
            }
            (KeyKind::Choice(words), Value::Word(w)) => words.contains(&w.as_str()),
            (KeyKind::Flag(_), Value::Flag(_))
            | (KeyKind::Text(..) | KeyKind::Path(..) | KeyKind::Table(..), Value::Word(_)) => true,
            _ => false,
        };
        if fits { Ok(()) } else { Err(self.refusal(value, place, self.allowed())) }
    }

    /// Checks the size of a number that stands at `place`: no method gets anywhere with one that no quantity has.
    ///
    /// # Errors
    /// [`Error::Value`] when the size is beyond any.
    pub(crate) fn accept_size(&self, value: &Value, place: &str) -> Result<(), Error> {
        match value {
            Value::Number(v) if *v != 0.0 && v.is_finite() && !SIZES.contains(&v.abs()) => {
                let zero = if self.accept(&Value::Number(0.0), place).is_ok() { "0 or " } else { "" };
                let (least, most) = (SIZES.start(), SIZES.end());
                let allowed = format!("{}; in size {zero}{least:e} to {most:e}", self.allowed());
                Err(self.refusal(value, place, allowed))
            }
            _ => Ok(()),
        }
    }

    fn refusal(&self, value: &Value, place: &str, allowed: String) -> Error {
        Error::Value {
            place: place.into(),
            key: self.path.clone().into_owned(),
            found: value.to_string(),
            allowed,
        }
    }
}

/// A value in a mission file.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
    /// True or false.
    Flag(bool),
    /// Anything that no key takes, described in words.
    Other(String),
}

impl From<f64> for Value {
    fn from(v: f64) -> Self {
        Self::Number(v)
    }
}

impl From<u32> for Value {
    fn from(v: u32) -> Self {
        Self::Number(f64::from(v))
    }
}

impl From<bool> for Value {
    fn from(v: bool) -> Self {
        Self::Flag(v)
    }
}

impl From<&str> for Value {
    fn from(v: &str) -> Self {
        Self::Word(v.to_owned())
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            // Hundreds of digits say less than an exponent.
            Self::Number(v) if *v != 0.0 && v.is_finite() && !(1e-7..1e15).contains(&v.abs()) => {
                write!(f, "{v:e}")
            }
            Self::Number(v) => write!(f, "{v}"),
            Self::Word(w) => write!(f, "\"{}\"", w.replace('\n', "\\n")),
            Self::Flag(v) => write!(f, "{v}"),
            Self::Other(what) => f.write_str(what),
        }
    }
}

/// The end of the sentence that refuses a former path of a key, `renamed` being pairs of former paths and those of today; none where no
/// key of today answers to it.
#[must_use]
pub fn renamed(path: &str, keys: &[&Key], renamed: &[(&str, &str)]) -> Option<String> {
    let today = |(former, today): &&(&str, &str)| *former == path && keys.iter().any(|k| k.path == *today);
    renamed.iter().find(today).map(|(_, today)| format!("; it is now `{today}`"))
}

/// The end of the sentence that refuses a key: it names the nearest key, and the unit where only that is wrong or missing. Where no key is
/// near, it names those that are similar and where the `list` of all stands.
#[must_use]
pub fn suggestion(key: &str, keys: &[&Key], list: &str) -> String {
    let stem = key.rsplit_once('_').map_or(key, |(stem, _)| stem);
    let named = |name: &str| keys.iter().find(|k| !unit_of(&k.path).is_empty() && name_of(&k.path) == name);
    if let Some(k) = named(key) {
        return format!("; its unit is missing: `{}`", k.path);
    }
    if let Some(k) = named(stem).or_else(|| named(name_of(key))) {
        return format!("; in its unit it is `{}`", k.path);
    }
    let paths: Vec<&str> = keys.iter().map(|k| &*k.path).collect();
    let similar = similar(key, &paths);
    match nearest(key, paths.iter().copied()) {
        Some(path) if similar.is_empty() || is_slip(key, path) || similar[..] == [path] => {
            format!("; the nearest is `{path}`")
        }
        _ if paths.is_empty() => "; there are none".to_owned(),
        _ if paths.len() <= MOST_SIMILAR => format!("; keys: {}", quoted(&paths)),
        _ => {
            let named = match similar[..] {
                [] => "none is similar".to_owned(),
                [one] => format!("similar is {}", quoted(&[one])),
                _ => format!("similar are {}", quoted(&similar)),
            };
            let all = if list.is_empty() { String::new() } else { format!("; all keys: {list}") };
            format!("; {named}{all}")
        }
    }
}

/// As many keys are named where none is near.
const MOST_SIMILAR: usize = 5;

/// The keys that share words with a path, most words first, then those that begin with the same table, then the nearest.
fn similar<'a>(path: &str, keys: &[&'a str]) -> Vec<&'a str> {
    let asked = words(path);
    let ranked = keys.iter().filter_map(|key| {
        let found = words(key);
        let shared = asked.iter().filter(|a| found.iter().any(|b| is_like(a, b))).count();
        (shared > 0).then(|| (std::cmp::Reverse(shared), distance(path, key), *key))
    });
    let mut ranked: Vec<_> = ranked.collect();
    ranked.sort_unstable();
    ranked.into_iter().take(MOST_SIMILAR).map(|(.., key)| key).collect()
}

/// The words of a path without its unit; those of two letters say nothing.
fn words(path: &str) -> Vec<&str> {
    name_of(path).split(['_', '.', '-', ' ']).filter(|w| w.len() > 2).collect()
}

/// Returns true if two words are the same but for an ending of at most two letters, or a slip.
fn is_like(a: &str, b: &str) -> bool {
    let ending = |long: &str, short: &str| long.strip_prefix(short).is_some_and(|end| end.len() <= 2);
    ending(a, b) || ending(b, a) || (a.len() > 4 && is_slip(a, b))
}
