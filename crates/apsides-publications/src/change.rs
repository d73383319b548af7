//! Values that a case of a publication sets, by their types.

use std::fmt;

use apsides_pipeline::key::Value;

/// Another value of a key of a mission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change<'a> {
    key: &'a str,
    value: ChangedTo<'a>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ChangedTo<'a> {
    Number(f64),
    Word(&'a str),
    Flag(bool),
}

pub(super) const fn number(key: &str, value: f64) -> Change<'_> {
    Change { key, value: ChangedTo::Number(value) }
}

pub(super) const fn word<'a>(key: &'a str, value: &'a str) -> Change<'a> {
    Change { key, value: ChangedTo::Word(value) }
}

pub(super) const fn flag(key: &str, value: bool) -> Change<'_> {
    Change { key, value: ChangedTo::Flag(value) }
}

impl<'a> Change<'a> {
    /// Key and value, as a registry takes them.
    pub(super) fn stated(&self) -> (&'a str, Value) {
        let value = match self.value {
            ChangedTo::Number(number) => number.into(),
            ChangedTo::Word(word) => word.into(),
            ChangedTo::Flag(flag) => flag.into(),
        };
        (self.key, value)
    }
}

impl fmt::Display for Change<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value } = self;
        match value {
            ChangedTo::Number(number) => write!(f, "{key}={number}"),
            ChangedTo::Word(word) => write!(f, "{key}={word}"),
            ChangedTo::Flag(flag) => write!(f, "{key}={flag}"),
        }
    }
}
