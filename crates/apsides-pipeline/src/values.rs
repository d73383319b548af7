//! The values of all keys of a mission, each with the place where it is stated.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::Error;
use crate::error::Source;
use crate::key::{Key, KeyKind, Value, renamed, suggestion};

/// The place of a value that Rust code sets.
const FROM_RUST: &str = "set";
/// The option of the program that replaces a value.
const OPTION: &str = "--set ";

/// The place of a value that the program's option for it states, as `key=value`.
pub(crate) fn place_of_option(text: &str) -> String {
    // A sentence is one line.
    format!("{OPTION}{}", text.replace('\n', "\\n"))
}

/// A value and where it is stated.
#[derive(Clone, Debug)]
struct Stated {
    value: Value,
    /// File and line, or `--set`; none of a default.
    place: Option<String>,
    /// True if named data have it, such as those of a vehicle.
    of_data: bool,
}

/// Values of the keys of a mission, checked one by one; a key that is open has none.
///
/// Two of them are equal when their values are, wherever these are stated.
#[derive(Clone, Debug)]
pub struct Values {
    /// The owner of the keys in messages: mission `lunar-perilune`.
    owner: String,
    /// Where all keys are listed, in messages; empty where nothing lists them.
    list: String,
    /// Where the values come from, in messages: a file.
    source: String,
    keys: Arc<[Key]>,
    /// Former paths of keys, each with the one of today.
    renamed: Vec<(&'static str, &'static str)>,
    stated: BTreeMap<Cow<'static, str>, Stated>,
}

impl PartialEq for Values {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Values {
    /// The defaults of keys. `owner` and `source` name in messages what they belong to and where they come from.
    #[must_use]
    pub fn new(owner: String, source: String, keys: Arc<[Key]>) -> Self {
        let default = |key: &Key| {
            Some((key.path.clone(), Stated { value: key.default()?, place: None, of_data: false }))
        };
        let stated = keys.iter().filter_map(default).collect();
        Self { owner, list: String::new(), source, keys, renamed: Vec::new(), stated }
    }

    /// The same, whose messages say where all keys are listed.
    #[must_use]
    pub fn with_list(self, list: String) -> Self {
        Self { list, ..self }
    }

    /// The same with more former paths of keys, each with the one of today, which messages name.
    #[must_use]
    pub fn with_renamed(mut self, renamed: &[(&'static str, &'static str)]) -> Self {
        self.renamed.extend_from_slice(renamed);
        self
    }

    /// The keys that have or may have a value.
    pub fn keys(&self) -> impl Iterator<Item = &Key> {
        self.keys.iter()
    }

    /// The key of this path.
    ///
    /// # Errors
    /// [`Error::UnknownKey`], with the nearest key, when the mission declares none; `place` is where it is asked for.
    pub fn key(&self, path: &str, place: &str) -> Result<&Key, Error> {
        self.keys.iter().find(|k| k.path == path).ok_or_else(|| {
            let keys: Vec<&Key> = self.keys.iter().collect();
            self.unknown(path, &keys, place)
        })
    }

    /// The refusal of a path that none of `keys` has; `place` is where it is asked for.
    pub(crate) fn unknown(&self, path: &str, keys: &[&Key], place: &str) -> Error {
        let renamed = renamed(path, keys, &self.renamed);
        Error::UnknownKey {
            place: place.into(),
            owner: self.owner.clone(),
            key: path.into(),
            suggestion: renamed.unwrap_or_else(|| suggestion(path, keys, &self.list)),
        }
    }

    /// Returns true if the mission declares a key of this path.
    #[must_use]
    pub fn declares(&self, path: &str) -> bool {
        self.keys.iter().any(|k| k.path == path)
    }

    /// States a value that stands at `place`.
    ///
    /// # Errors
    /// A key that the mission does not declare, a value that it does not take.
    pub fn state(&mut self, path: &str, value: Value, place: &str) -> Result<(), Error> {
        let key = self.key(path, place).map_err(|e| with_refinements(e, path, &value))?;
        key.accept(&value, place)?;
        let path = key.path.clone();
        self.stated.insert(path, Stated { value, place: Some(place.into()), of_data: false });
        Ok(())
    }

    /// States a number of named data, unless the mission states one of its own.
    ///
    /// # Errors
    /// A key that the mission does not declare, a value that it does not take.
    pub(crate) fn state_of_data(&mut self, path: &str, number: f64, place: &str) -> Result<(), Error> {
        if self.stated.get(path).is_some_and(|s| s.place.is_some() && !s.of_data) {
            return Ok(());
        }
        self.state(path, Value::Number(number), place)?;
        if let Some(stated) = self.stated.get_mut(path) {
            stated.of_data = true;
        }
        Ok(())
    }

    /// The keys, shared.
    pub(crate) fn shared_keys(&self) -> Arc<[Key]> {
        Arc::clone(&self.keys)
    }

    /// The place where the value of a key is stated, or that of all values for a default.
    pub(crate) fn place_or_source(&self, path: &str) -> &str {
        self.place(path).unwrap_or(&self.source)
    }

    /// Former paths of keys, each with the one of today.
    pub(crate) fn renamed(&self) -> &[(&'static str, &'static str)] {
        &self.renamed
    }

    /// Refuses numbers of a size that no quantity has. Models come before: they say more of what they refuse.
    ///
    /// # Errors
    /// [`Error::Value`] of the first of them.
    pub(crate) fn check_sizes(&self) -> Result<(), Error> {
        for key in self.keys.iter() {
            if let Some(Stated { value, place, .. }) = self.stated.get(&key.path) {
                key.accept_size(value, place.as_deref().unwrap_or(&self.source))?;
            }
        }
        Ok(())
    }

    /// Sets a value from Rust: a number, a word, a flag.
    ///
    /// # Errors
    /// A key that the mission does not declare, a value that it does not take.
    pub fn set(&mut self, path: &str, value: impl Into<Value>) -> Result<(), Error> {
        self.state(path, value.into(), FROM_RUST)
    }

    /// True if the value of a key replaces the one of the mission's file or the default: by `--set`, or from Rust.
    #[must_use]
    pub(crate) fn is_replaced(&self, path: &str) -> bool {
        self.place(path).is_some_and(|place| place == FROM_RUST || place.starts_with(OPTION))
    }

    /// The value of a key.
    #[must_use]
    pub fn get(&self, path: &str) -> Option<&Value> {
        self.stated.get(path).map(|s| &s.value)
    }

    /// The place where the value of a key is stated; none of a default.
    #[must_use]
    pub fn place(&self, path: &str) -> Option<&str> {
        self.stated.get(path)?.place.as_deref()
    }

    /// The number of a key.
    ///
    /// # Errors
    /// A key that is not declared as a number, or is open.
    pub fn number(&self, path: &str) -> Result<f64, Error> {
        match self.get(path) {
            Some(Value::Number(v)) => Ok(*v),
            other => Err(self.missing(path, other, "a number")),
        }
    }

    /// The number of a limit: none where it is infinite, which is how a file says that nothing is limited.
    ///
    /// # Errors
    /// As of [`Self::number`].
    pub fn limit(&self, path: &str) -> Result<Option<f64>, Error> {
        self.number(path).map(|v| v.is_finite().then_some(v))
    }

    /// The number of a key that may be open.
    ///
    /// # Errors
    /// A key that is not declared as such a number.
    pub fn optional(&self, path: &str) -> Result<Option<f64>, Error> {
        match (self.get(path), &self.key(path, &self.source)?.kind) {
            (Some(Value::Number(v)), _) => Ok(Some(*v)),
            (None, KeyKind::Optional(_)) => Ok(None),
            (other, _) => Err(self.missing(path, other, "a number that may be open")),
        }
    }

    /// The whole number of a key.
    ///
    /// # Errors
    /// A key that is not declared as one.
    pub fn count(&self, path: &str) -> Result<usize, Error> {
        self.number(path).map(|v| v as usize)
    }

    /// The word or text of a key.
    ///
    /// # Errors
    /// A key that is not declared as one.
    pub fn word(&self, path: &str) -> Result<&str, Error> {
        match self.get(path) {
            Some(Value::Word(w)) => Ok(w),
            other => Err(self.missing(path, other, "a word")),
        }
    }

    /// The flag of a key.
    ///
    /// # Errors
    /// A key that is not declared as one.
    pub fn flag(&self, path: &str) -> Result<bool, Error> {
        match self.get(path) {
            Some(Value::Flag(v)) => Ok(*v),
            other => Err(self.missing(path, other, "true or false")),
        }
    }

    /// A key that the mission does not declare, or not as what is asked for: a mistake of the kind of mission.
    fn missing(&self, path: &str, found: Option<&Value>, wanted: &str) -> Error {
        match self.key(path, &self.source) {
            Err(unknown) => unknown,
            Ok(_) => Error::Value {
                place: self.source.clone(),
                key: path.into(),
                found: found.map_or_else(|| "missing".into(), ToString::to_string),
                allowed: wanted.into(),
            },
        }
    }

    /// The values do not go together: `reason` names the keys between backticks and says what to change. The message stands where the
    /// first of these keys is stated.
    #[must_use]
    pub fn conflict(&self, reason: impl Into<String>) -> Error {
        let reason = reason.into();
        let place = self.place_of(reason.split('`').skip(1).step_by(2));
        Error::Conflict { place, reason }
    }

    /// Refuses an option `--set` for one of these keys, which have no effect where the key `by` has its value: who asks for it expects one.
    ///
    /// # Errors
    /// The first such option.
    pub fn refuse_without_effect(&self, keys: &[&str], by: &str, instead: &str) -> Result<(), Error> {
        let is_option = |key: &&&str| self.place(key).is_some_and(|place| place.starts_with(OPTION));
        let Some(key) = keys.iter().find(is_option) else { return Ok(()) };
        let value = self.get(by).map_or_else(|| "open".to_owned(), ToString::to_string);
        Err(self.conflict(format!("`{key}` has no effect while `{by}` is {value}: {instead}")))
    }

    /// Makes an error of the refusal of a model whose parameters are the values of `keys`. It stands where the first of these is stated.
    pub fn refusal<E: Into<Source>>(&self, keys: &[&str]) -> impl FnOnce(E) -> Error + use<E> {
        let names: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
        let place = format!("{}: {}: ", self.place_of(keys.iter().copied()), names.join(", "));
        |source| Error::Model { place, source: source.into() }
    }

    /// The place of the first key that is stated, and the owner.
    fn place_of<'a>(&self, mut keys: impl Iterator<Item = &'a str>) -> String {
        match keys.find_map(|path| self.place(path)).unwrap_or(&self.source) {
            place if place.starts_with(&self.owner) => place.to_owned(),
            place => format!("{place} ({})", self.owner),
        }
    }

    /// A request that the mission does not take, in words.
    #[must_use]
    pub fn refused(&self, reason: &str) -> Error {
        Error::Conflict { place: self.owner.clone(), reason: reason.into() }
    }

    /// Every key that has a value, with it, by key.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.stated.iter().map(|(k, s)| (&**k, &s.value))
    }
}

/// The refusal of a former number of meshes says the number of refinements too, which is one less.
fn with_refinements(error: Error, path: &str, value: &Value) -> Error {
    match (error, value) {
        (Error::UnknownKey { place, owner, key, suggestion }, Value::Number(meshes))
            if path.ends_with(".max_meshes") && suggestion.contains("max_refinements") && *meshes >= 1.0 =>
        {
            let suggestion =
                format!("{suggestion} = {}, one less: the first mesh does not count", meshes - 1.0);
            Error::UnknownKey { place, owner, key, suggestion }
        }
        (error, _) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::key::Range;

    const KEYS: [Key; 4] = [
        Key::number("thrust_n", 440.0, Range::POSITIVE, "full thrust"),
        Key::number("rate_limit_deg_s", f64::INFINITY, Range::POSITIVE_OR_UNLIMITED, "largest rate"),
        Key::optional("site_m", Range::ANY_OR_UNLIMITED, "place of the site"),
        Key::choice("throttle", &["full", "free"], "size of the thrust"),
    ];

    fn values() -> Values {
        Values::new("mission `m`".into(), "file `f`".into(), KEYS.into())
    }

    #[test]
    fn values_have_their_types_and_open_ones_have_none() {
        let mut v = values();
        assert_eq!(v.number("thrust_n").unwrap(), 440.0);
        assert_eq!(v.limit("rate_limit_deg_s").unwrap(), None);
        assert_eq!(v.optional("site_m").unwrap(), None);
        assert_eq!(v.word("throttle").unwrap(), "full");
        v.set("thrust_n", 500.0).unwrap();
        v.set("site_m", -3.5).unwrap();
        v.set("throttle", "free").unwrap();
        assert_eq!(v.number("thrust_n").unwrap(), 500.0);
        assert_eq!(v.optional("site_m").unwrap(), Some(-3.5));
        assert_eq!(v.word("throttle").unwrap(), "free");
    }

    #[test]
    fn what_is_not_declared_is_an_error() {
        let mut v = values();
        assert!(v.number("thrst_n").unwrap_err().to_string().contains("the nearest is `thrust_n`"));
        assert!(v.number("throttle").unwrap_err().to_string().contains("allowed is a number"));
        assert!(v.optional("thrust_n").is_ok());
        assert!(v.set("thrust_n", "much").unwrap_err().to_string().contains("above 0"));
        assert!(v.set("thrust_n", -1.0).unwrap_err().to_string().contains("above 0"));
    }

    #[test]
    fn a_conflict_stands_where_its_key_does() {
        let mut v = values();
        let message = |v: &Values| v.conflict("`thrust_n` is too small").to_string();
        assert_eq!(message(&v), "file `f` (mission `m`): `thrust_n` is too small");
        v.state("thrust_n", Value::Number(1.0), "file `f`, line 3").unwrap();
        assert_eq!(message(&v), "file `f`, line 3 (mission `m`): `thrust_n` is too small");
    }
}
