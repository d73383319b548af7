//! Explanations of missions that cannot be flown, in the words and units of the mission's keys: altitudes in km, angles in deg, the key that
//! states a requirement where one does.

use std::f64::consts::PI;

use apsides_nlp::Side;
use apsides_radau::{Conflict, Explanation, Remedy, Requirement, RequirementKind};
use serde::{Deserialize, Serialize};

use crate::key::{Key, KeyKind, Value};
use crate::unit_ending::name_of;
use crate::values::Values;

/// The requirements of a mission that conflict, and the relaxations that help; all numbers in the unit beside them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExplanationSummary {
    /// The requirements that conflict, those of values that replace the mission's own first, then those of
    /// other keys. Relaxing all by their amounts restores feasibility.
    pub conflicts: Vec<ConflictSummary>,
    /// Each of these relaxations alone restores feasibility, as far as is said of it; in the same order.
    pub remedies: Vec<RemedySummary>,
    /// A sentence on what is missing besides, where the kind of mission has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
}

/// A requirement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RequirementSummary {
    /// Its phase, where it belongs to one.
    pub phase: Option<String>,
    /// The quantity in words: `final radial speed`.
    pub quantity: String,
    /// `=`, `at least` or `at most`.
    pub relation: String,
    /// The bound.
    pub limit: f64,
    /// Unit of all numbers but times.
    pub unit: String,
    /// The key that states the bound, where one does.
    pub key: Option<String>,
}

/// A requirement that cannot be met together with the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConflictSummary {
    /// The requirement.
    #[serde(flatten)]
    pub requirement: RequirementSummary,
    /// By how much it is violated where all give way as little as possible.
    pub amount: f64,
    /// When it is violated most, for one that holds along a phase.
    pub time: Option<f64>,
    /// Unit of that time; empty without one.
    pub time_unit: String,
    /// The bound with which the mission can be flown where nothing else gives way, if there is one.
    pub relaxed_to: Option<f64>,
}

/// A relaxation that alone restores feasibility, on a mesh at least.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RemedySummary {
    /// The requirement.
    #[serde(flatten)]
    pub requirement: RequirementSummary,
    /// The nearest bound with which the mission can be flown.
    pub relaxed_to: f64,
    /// The bound that an accurate flight shows to be enough: this one, or one a little beyond. None where it is the estimate of a mesh, which may not be
    /// enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shown_with: Option<f64>,
}

impl ExplanationSummary {
    /// The summary of an explanation that [`in_keys`] has worded.
    pub(crate) fn new(explanation: &Explanation, missing: Option<String>) -> Self {
        let alone = |r: &Requirement| explanation.remedies.iter().find(|m| m.requirement == *r).map(|m| m.to);
        let conflict = |c: &Conflict| ConflictSummary {
            requirement: RequirementSummary::new(&c.requirement),
            amount: c.amount,
            time: c.at,
            time_unit: c.time_unit.clone(),
            relaxed_to: alone(&c.requirement),
        };
        let remedy = |m: &Remedy| RemedySummary {
            requirement: RequirementSummary::new(&m.requirement),
            relaxed_to: m.to,
            shown_with: m.shown_with,
        };
        Self {
            conflicts: explanation.conflicts.iter().map(conflict).collect(),
            remedies: explanation.remedies.iter().map(remedy).collect(),
            missing,
        }
    }
}

impl RequirementSummary {
    fn new(r: &Requirement) -> Self {
        let relation = match (r.fixed, r.side) {
            (true, _) => "=",
            (_, Side::Lower) => "at least",
            (_, Side::Upper) => "at most",
        };
        Self {
            phase: r.phase.clone(),
            quantity: Requirement { phase: None, ..r.clone() }.quantity(),
            relation: relation.into(),
            limit: r.limit,
            unit: r.unit.clone(),
            key: r.stated_by.clone(),
        }
    }
}

/// The same explanation in the keys' words and units, what replaces the mission's own values first, then what its file states, then defaults. Radii become altitudes above `datum`, where there is one.
pub(crate) fn in_keys(explanation: &Explanation, values: &Values, datum: Option<f64>) -> Explanation {
    let conflict = |c: &Conflict| {
        let (requirement, unit) = worded(&c.requirement, values, datum);
        Conflict { requirement, amount: c.amount / unit.size, ..c.clone() }
    };
    let remedy = |m: &Remedy| {
        let (requirement, unit) = worded(&m.requirement, values, datum);
        Remedy { requirement, to: unit.of(m.to), shown_with: m.shown_with.map(|bound| unit.of(bound)) }
    };
    let mut conflicts: Vec<_> = explanation.conflicts.iter().map(conflict).collect();
    let mut remedies: Vec<_> = explanation.remedies.iter().map(remedy).collect();
    let rank = |r: &Requirement| match &r.stated_by {
        Some(key) if values.is_replaced(key) => 0,
        Some(key) if values.place(key).is_some() => 1,
        Some(_) => 2,
        None => 3,
    };
    // A value that its key does not take is no advice, unless there is no other.
    if remedies.iter().any(|m| is_taken(m, values)) {
        remedies.retain(|m| is_taken(m, values));
    }
    conflicts.sort_by_key(|c| rank(&c.requirement));
    remedies.sort_by_key(|m| rank(&m.requirement));
    // Of several sets that conflict the one of a value that the user set: alone, it restores feasibility as well.
    if let Some(first) = remedies.first()
        && conflicts.first().is_some_and(|c| rank(&first.requirement) < rank(&c.requirement))
    {
        let Remedy { requirement, to, .. } = first.clone();
        let amount = (to - requirement.limit).abs();
        conflicts = vec![Conflict { requirement, amount, at: None, time_unit: String::new() }];
    }
    Explanation { conflicts, remedies, ..explanation.clone() }
}

/// True unless the key of a remedy does not take its value.
fn is_taken(remedy: &Remedy, values: &Values) -> bool {
    let key = remedy.requirement.stated_by.as_ref().and_then(|path| values.keys().find(|k| k.path == *path));
    key.is_none_or(|key| match &key.kind {
        KeyKind::Number(_, range) => range.contains(remedy.to),
        _ => true,
    })
}

/// A unit of the reader: `shown = (value - origin) / size`.
struct Unit {
    name: String,
    origin: f64,
    size: f64,
}

impl Unit {
    fn of(&self, value: f64) -> f64 {
        (value - self.origin) / self.size
    }
}

/// Units of keys, those of the problem that they measure the same in, and the size of one in the other.
const UNITS: &[(&str, &str, f64)] = &[
    ("km", "m", 1e3),
    ("cm", "m", 1e-2),
    ("deg", "rad", PI / 180.0),
    ("deg/s", "rad/s", PI / 180.0),
    ("km/s", "m/s", 1e3),
    ("kW/m2", "W/m2", 1e3),
    ("MJ/m2", "J/m2", 1e6),
    ("kPa", "Pa", 1e3),
    ("kN", "N", 1e3),
    ("h", "s", 3600.0),
];

/// Two numbers are the same if they differ by rounding.
const ROUNDING: f64 = 1e-12;

/// A requirement with its key, if one states it, and the unit in which it is said.
fn worded<'a>(r: &Requirement, values: &'a Values, datum: Option<f64>) -> (Requirement, Unit) {
    let above = datum.filter(|_| r.name == RADIUS);
    let name = if above.is_some() { ALTITUDE.to_owned() } else { r.name.clone() };
    let origin = above.unwrap_or(0.0);
    let words = words_of(r, &name);
    let shared =
        |key: &Key| words.iter().filter(|w| name_of(&key.path).split(['_', '.']).any(|p| p == **w)).count();
    let size = |unit: &str| match UNITS.iter().find(|(key, si, _)| *key == unit && *si == r.unit) {
        Some((_, _, size)) => Some(*size),
        None => (unit == r.unit).then_some(1.0),
    };
    let states = |key: &'a Key| {
        let Some(Value::Number(value)) = values.get(&key.path) else { return None };
        let size = size(&key.unit())?;
        let same = *value != 0.0 && (value * size - (r.limit - origin)).abs() <= ROUNDING * r.limit.abs();
        (same && shared(key) > 0).then_some((key, size))
    };
    let found = values.keys().filter(|k| k.is_number()).filter_map(states);
    // The first of those that share most words.
    let stated = found.reduce(|best, next| if shared(next.0) > shared(best.0) { next } else { best });
    let (unit, size) = match (stated, &*r.unit) {
        (Some((key, size)), _) => (key.unit(), size),
        (None, "rad") => ("deg".into(), PI / 180.0),
        (None, "rad/s") => ("deg/s".into(), PI / 180.0),
        (None, "m") if name == ALTITUDE => ("km".into(), 1e3),
        (None, unit) => (unit.into(), 1.0),
    };
    let unit = Unit { name: unit.into_owned(), origin, size };
    let requirement = Requirement {
        name,
        limit: stated.and_then(|(key, _)| values.number(&key.path).ok()).unwrap_or_else(|| unit.of(r.limit)),
        unit: unit.name.clone(),
        stated_by: stated.map(|(key, _)| key.path.clone().into_owned()),
        ..r.clone()
    };
    (requirement, unit)
}

/// The name of a distance from the centre of the body, and of one above its surface.
const RADIUS: &str = "radius";
const ALTITUDE: &str = "altitude";

/// Words that a key of a requirement may have.
fn words_of<'a>(r: &Requirement, name: &'a str) -> Vec<&'a str> {
    let mut words: Vec<&str> = name.split([' ', ':', '-']).filter(|w| w.len() > 2).collect();
    match r.kind {
        RequirementKind::Duration | RequirementKind::FinalTime | RequirementKind::InitialTime => {
            words.push("time");
        }
        _ if words.contains(&"speed") => words.push("velocity"),
        _ => {}
    }
    words
}
