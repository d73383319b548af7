//! Keys of mission files: name with unit, meaning, default, allowed values.

use std::collections::BTreeMap;

use crate::Error;

/// Ends of an interval of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value, and whether it is allowed itself.
    pub least: (f64, bool),
    /// Largest value, and whether it is allowed itself.
    pub most: (f64, bool),
}

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

    fn contains(&self, v: f64) -> bool {
        let above = v > self.least.0 || (self.least.1 && v == self.least.0);
        let below = v < self.most.0 || (self.most.1 && v == self.most.0);
        (v.is_finite() || self.takes(v)) && above && below
    }

    /// Whether `v` is an infinite end that is allowed itself.
    fn takes(&self, v: f64) -> bool {
        [self.least, self.most].contains(&(v, true)) && v.is_infinite()
    }

    fn describe(&self) -> String {
        let bound = |(v, included): (f64, bool), least: bool| match (v.is_finite(), included, least) {
            (false, ..) => None,
            (_, true, true) => Some(format!("at least {v}")),
            (_, false, true) => Some(format!("above {v}")),
            (_, true, false) => Some(format!("at most {v}")),
            (_, false, false) => Some(format!("below {v}")),
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

/// What a key takes.
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
    /// A number in a range; the file of the vehicle has it unless the mission file does.
    OfVehicle(Range),
}

/// One key of a mission file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Path with the unit at its end: `perilune_altitude_km`, `radau.points`.
    pub path: &'static str,
    /// Meaning, in one line.
    pub meaning: &'static str,
    /// Type, default, allowed values.
    pub kind: KeyKind,
}

impl Key {
    /// A number.
    #[must_use]
    pub const fn number(path: &'static str, default: f64, range: Range, meaning: &'static str) -> Self {
        Self { path, meaning, kind: KeyKind::Number(default, range) }
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
        Self { path, meaning, kind: KeyKind::Count(default, least, most) }
    }

    /// One of several words, the first being the default.
    #[must_use]
    pub const fn choice(path: &'static str, words: &'static [&'static str], meaning: &'static str) -> Self {
        Self { path, meaning, kind: KeyKind::Choice(words) }
    }

    /// True or false.
    #[must_use]
    pub const fn flag(path: &'static str, default: bool, meaning: &'static str) -> Self {
        Self { path, meaning, kind: KeyKind::Flag(default) }
    }

    /// Free text; `allowed` says in words what it may be.
    #[must_use]
    pub const fn text(
        path: &'static str,
        default: &'static str,
        allowed: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self { path, meaning, kind: KeyKind::Text(default, allowed) }
    }

    /// A word or the path of a file; `allowed` says in words what it may be.
    #[must_use]
    pub const fn path(
        path: &'static str,
        default: &'static str,
        allowed: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self { path, meaning, kind: KeyKind::Path(default, allowed) }
    }

    /// A number that the file of the vehicle has.
    #[must_use]
    pub const fn of_vehicle(path: &'static str, range: Range, meaning: &'static str) -> Self {
        Self { path, meaning, kind: KeyKind::OfVehicle(range) }
    }

    /// Whether it takes any number of a range.
    #[must_use]
    pub const fn is_number(&self) -> bool {
        matches!(self.kind, KeyKind::Number(..) | KeyKind::OfVehicle(_))
    }

    /// Allowed values in words.
    #[must_use]
    pub fn allowed(&self) -> String {
        match self.kind {
            KeyKind::Number(_, range) | KeyKind::OfVehicle(range) => range.describe(),
            KeyKind::Count(_, least, most) => format!("a whole number from {least} to {most}"),
            KeyKind::Choice(words) => {
                words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(" or ")
            }
            KeyKind::Flag(_) => "true or false".into(),
            KeyKind::Text(_, allowed) | KeyKind::Path(_, allowed) => allowed.into(),
        }
    }

    pub(crate) fn default(&self) -> Value {
        match self.kind {
            KeyKind::Number(v, _) => Value::Number(v),
            KeyKind::Count(v, ..) => Value::Number(f64::from(v)),
            KeyKind::Choice(words) => Value::Word(words[0].to_owned()),
            KeyKind::Flag(v) => Value::Flag(v),
            KeyKind::Text(v, _) | KeyKind::Path(v, _) => Value::Word(v.to_owned()),
            // Replaced by the file of the vehicle before anything is computed.
            KeyKind::OfVehicle(_) => Value::Number(f64::NAN),
        }
    }

    pub(crate) fn accept(&self, value: &Value, place: &str) -> Result<(), Error> {
        let fits = match (&self.kind, value) {
            (KeyKind::Number(_, range) | KeyKind::OfVehicle(range), Value::Number(v)) => range.contains(*v),
            (KeyKind::Count(_, least, most), Value::Number(v)) => {
                v.fract() == 0.0 && Range::closed(f64::from(*least), f64::from(*most)).contains(*v)
            }
            (KeyKind::Choice(words), Value::Word(w)) => words.contains(&w.as_str()),
            (KeyKind::Flag(_), Value::Flag(_)) | (KeyKind::Text(..) | KeyKind::Path(..), Value::Word(_)) => {
                true
            }
            _ => false,
        };
        if fits {
            return Ok(());
        }
        Err(Error::Value {
            place: place.into(),
            key: self.path.into(),
            found: value.to_string(),
            allowed: self.allowed(),
        })
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

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(v) => write!(f, "{v}"),
            Self::Word(w) => write!(f, "\"{w}\""),
            Self::Flag(v) => write!(f, "{v}"),
            Self::Other(what) => f.write_str(what),
        }
    }
}

/// Values of all keys of a mission, defaults included.
#[derive(Clone, Debug, PartialEq)]
pub struct Values(pub(crate) BTreeMap<&'static str, Value>);

impl Values {
    /// The number of a key that the mission declares as a number.
    pub(crate) fn number(&self, path: &str) -> f64 {
        match self.0.get(path) {
            Some(Value::Number(v)) => *v,
            // A key that the mission does not declare shows up as NaN in every check that follows.
            _ => f64::NAN,
        }
    }

    /// The whole number of a key that the mission declares as one.
    pub(crate) fn count(&self, path: &str) -> usize {
        self.number(path) as usize
    }

    /// The word of a key that the mission declares as a choice.
    pub(crate) fn word(&self, path: &str) -> &str {
        match self.0.get(path) {
            Some(Value::Word(w)) => w,
            _ => "",
        }
    }

    /// Whether the flag of a key that the mission declares as one is set.
    pub(crate) fn flag(&self, path: &str) -> bool {
        self.0.get(path) == Some(&Value::Flag(true))
    }

    /// The same with another number.
    pub(crate) fn with_number(&self, path: &'static str, number: f64) -> Self {
        let mut changed = self.clone();
        changed.0.insert(path, Value::Number(number));
        changed
    }

    /// The same with another flag.
    pub(crate) fn with_flag(&self, path: &'static str, flag: bool) -> Self {
        let mut changed = self.clone();
        changed.0.insert(path, Value::Flag(flag));
        changed
    }

    /// The same with another word.
    pub(crate) fn with_word(&self, path: &'static str, word: &str) -> Self {
        let mut changed = self.clone();
        changed.0.insert(path, Value::Word(word.to_owned()));
        changed
    }

    /// Every key and its value, by key.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(k, v)| (*k, v))
    }
}

/// Ends of keys and the units they stand for, longer ones first.
const UNITS: &[(&str, &str)] = &[
    ("_km3_s2", "km3/s2"),
    ("_kg_m3", "kg/m3"),
    ("_mj_m2", "MJ/m2"),
    ("_kw_m2", "kW/m2"),
    ("_m_s2", "m/s2"),
    ("_deg_s2", "deg/s2"),
    ("_deg_s", "deg/s"),
    ("_kg_s", "kg/s"),
    ("_km_s", "km/s"),
    ("_m_s", "m/s"),
    ("_deg", "deg"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_cm", "cm"),
    ("_km", "km"),
    ("_kn", "kN"),
    ("_kpa", "kPa"),
    ("_m2", "m2"),
    ("_pa", "Pa"),
    ("_w", "W"),
    ("_k", "K"),
    ("_m", "m"),
    ("_n", "N"),
    ("_s", "s"),
    ("_h", "h"),
];

/// The unit that ends the path of a key or result: `N` of `thrust_n`; empty without one.
#[must_use]
pub fn unit_of(path: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| path.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// The path of a key or result without its unit: `thrust` of `thrust_n`.
#[must_use]
pub fn name_of(path: &str) -> &str {
    UNITS.iter().find_map(|(end, _)| path.strip_suffix(end)).unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::{name_of, unit_of};

    #[test]
    fn units_end_keys() {
        let keys = [
            ("thrust_n", "thrust", "N"),
            ("gravitational_parameter_km3_s2", "gravitational_parameter", "km3/s2"),
            ("touchdown_radial_velocity_m_s", "touchdown_radial_velocity", "m/s"),
            ("standard_gravity_m_s2", "standard_gravity", "m/s2"),
            ("flight_time_s", "flight_time", "s"),
            ("eccentricity", "eccentricity", ""),
        ];
        for (key, name, unit) in keys {
            assert_eq!((name_of(key), unit_of(key)), (name, unit));
        }
    }
}
