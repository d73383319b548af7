//! Vehicles as data: files that hold the numbers of a vehicle, some of them part of the program.

use std::path::Path;

use crate::Error;
use crate::key::{Key, KeyKind, Value};
use crate::mission_file::{entries, line, read};

/// The key that names a vehicle, in missions that take one.
pub const KEY: &str = "vehicle";

/// Where the numbers of a vehicle come from, and what to know about them.
const WORDS: [Key; 2] = [
    Key::text("source", "", "text", "where the numbers come from"),
    Key::text("remarks", "", "text", "what to know about them"),
];

const BUILT_IN: &[(&str, &str)] = &[
    ("block-dm", include_str!("../missions/vehicles/block-dm.toml")),
    ("breeze-m", include_str!("../missions/vehicles/breeze-m.toml")),
    ("centaur-d", include_str!("../missions/vehicles/centaur-d.toml")),
    ("fregat", include_str!("../missions/vehicles/fregat.toml")),
    ("fregat-sb", include_str!("../missions/vehicles/fregat-sb.toml")),
    ("yastreb", include_str!("../missions/vehicles/yastreb.toml")),
];

/// Names of the vehicles that come with the program.
pub fn names() -> impl Iterator<Item = &'static str> {
    BUILT_IN.iter().map(|(name, _)| *name)
}

/// Whether a value of [`KEY`] is the path of a file, not a name.
pub(crate) fn is_file(name: &str) -> bool {
    name.ends_with(".toml")
}

/// The numbers that `keys` want of a vehicle, by key; `place` is where its name stands.
pub(crate) fn numbers(
    name: &str,
    keys: &[&'static Key],
    place: &str,
) -> Result<Vec<(&'static str, f64)>, Error> {
    let wanted: Vec<&'static Key> =
        keys.iter().copied().filter(|k| matches!(k.kind, KeyKind::OfVehicle(_))).collect();
    let known = || names().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
    let (text, source) = if is_file(name) {
        (read(Path::new(name), "vehicle", &known())?, format!("file `{name}`"))
    } else {
        let Some((_, text)) = BUILT_IN.iter().find(|(n, _)| *n == name) else {
            return Err(Error::Value {
                place: place.into(),
                key: KEY.into(),
                found: format!("\"{name}\""),
                allowed: format!("one of {}, or a path that ends with .toml", known()),
            });
        };
        ((*text).to_owned(), format!("vehicle `{name}`"))
    };
    let allowed: Vec<&Key> = wanted.iter().copied().chain(&WORDS).collect();
    let found = entries(&text, |offset| format!("{source}, line {}", line(&text, offset)))?;
    for entry in &found {
        entry.key(&allowed, "a vehicle")?;
    }
    let number = |key: &&'static Key| match found.iter().find(|e| e.path == key.path).map(|e| &e.value) {
        Some(Value::Number(v)) => Ok((key.path, *v)),
        _ => Err(Error::Value {
            place: source.clone(),
            key: key.path.into(),
            found: "missing".into(),
            allowed: key.allowed(),
        }),
    };
    wanted.iter().map(number).collect()
}
