//! Bodies, vehicles, sites as data: TOML files of numbers, by name or by path, for the keys of any mission.

use std::path::Path;

use crate::Error;
use crate::file::{StatedValue, entries, line, read};
use crate::key::{Key, KeyKind, Value};
use crate::values::Values;

/// Named data of one sort, such as vehicles. A mission that has the key `key` takes from them the numbers of its keys
/// [`KeyKind::Named`], unless its own file states these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedData {
    /// The key that names one of them, which is also what they are called in messages: `vehicle`.
    pub key: &'static str,
    /// The keys that a file may have.
    pub keys: &'static [Key],
    /// Names and texts of those that come with the program.
    pub files: &'static [(&'static str, &'static str)],
}

/// Words that every file may have.
static WORDS: [Key; 2] = [
    Key::text("source", "", "text", "where the numbers come from"),
    Key::text("remarks", "", "text", "what to know about them"),
];

impl NamedData {
    /// Names of those that come with the program.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.files.iter().map(|(name, _)| *name)
    }

    /// The words `source` and `remarks` of one that comes with the program, where it has them.
    #[must_use]
    pub fn words(&self, name: &str) -> [Option<String>; 2] {
        let text = self.files.iter().find(|(n, _)| *n == name).map_or("", |(_, text)| text);
        let found = entries(text, |_| String::new()).unwrap_or_default();
        WORDS.each_ref().map(|key| match found.iter().find(|e| e.path == key.path).map(|e| &e.value) {
            Some(Value::Word(word)) => Some(word.clone()),
            _ => None,
        })
    }

    /// Returns true if a value of the key is the path of a file, not a name.
    #[must_use]
    pub fn is_file(name: &str) -> bool {
        name.ends_with(".toml")
    }

    fn known(&self) -> String {
        self.names().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
    }

    /// States the numbers of the one that `values` name, but those that the mission states itself.
    ///
    /// # Errors
    /// As of [`Self::numbers`].
    pub(crate) fn state_numbers(&self, values: &mut Values) -> Result<(), Error> {
        let Some(Value::Word(name)) = values.get(self.key).cloned() else { return Ok(()) };
        let keys = values.shared_keys();
        let place = values.place_or_source(self.key).to_owned();
        for (path, number, place) in self.numbers(&name, &keys, &place, values.renamed())? {
            values.state_of_data(path, number, &place)?;
        }
        Ok(())
    }

    /// The numbers that the keys `wanted` take from the data of this name or path, each with its place. `place` is where the name stands,
    /// `renamed` has former paths of keys with those of today.
    ///
    /// # Errors
    /// A name that is not known, a file that cannot be read, an unknown key, a number that is missing or not allowed.
    pub fn numbers<'k>(
        &self,
        name: &str,
        wanted: &'k [Key],
        place: &str,
        renamed: &[(&str, &str)],
    ) -> Result<Vec<(&'k str, f64, String)>, Error> {
        let (text, source) = if Self::is_file(name) {
            (read(Path::new(name), self.key, &self.known())?, format!("file `{name}`"))
        } else {
            let Some((_, text)) = self.files.iter().find(|(n, _)| *n == name) else {
                return Err(Error::Value {
                    place: place.into(),
                    key: self.key.into(),
                    found: format!("\"{name}\""),
                    allowed: format!("one of {}, or a path that ends with .toml", self.known()),
                });
            };
            ((*text).to_owned(), format!("{} `{name}`", self.key))
        };
        let allowed: Vec<&Key> = self.keys.iter().chain(&WORDS).collect();
        let found = entries(&text, |offset| format!("{source}, line {}", line(&text, offset)))?;
        for entry in &found {
            entry.key(&allowed, &format!("a {}", self.key)).map_err(|e| match e {
                Error::UnknownKey { place, owner, key, suggestion } => {
                    let suggestion = crate::key::renamed(&key, &allowed, renamed).unwrap_or(suggestion);
                    Error::UnknownKey { place, owner, key, suggestion }
                }
                other => other,
            })?;
        }
        let number = |key: &'k Key| match found.iter().find(|e| e.path == key.path) {
            Some(StatedValue { value: value @ Value::Number(v), place, .. }) => {
                key.accept(value, place)?;
                Ok((&*key.path, *v, place.clone()))
            }
            _ => Err(Error::Value {
                place: source.clone(),
                key: key.path.clone().into_owned(),
                found: "missing".into(),
                allowed: key.allowed(),
            }),
        };
        let of_this = |k: &&'k Key| matches!(k.kind, KeyKind::Named(data, _) if data == self.key);
        wanted.iter().filter(of_this).map(number).collect()
    }
}
