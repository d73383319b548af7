//! Reading mission files: every mistake is reported with file, line and key, and the nearest key is suggested.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::key::{Key, KeyKind, Value, Values};
use crate::{Error, missions, vehicle};

/// Largest mission file: a few kB is usual, so anything above is a mistake.
pub const MAX_FILE_BYTES: u64 = 1 << 20;

/// A mission with all its values, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Mission {
    /// The kind of mission.
    pub(crate) kind: &'static missions::Kind,
    /// All values.
    pub values: Values,
    /// Threads of a solve; no value of the mission, since no result depends on it.
    pub(crate) threads: usize,
    /// Of everything random.
    pub(crate) seed: u64,
    /// Where a search is kept.
    pub(crate) checkpoint: Option<PathBuf>,
}

/// One value with its place, before it is matched with a key.
pub(crate) struct Entry {
    pub(crate) path: String,
    pub(crate) value: Value,
    pub(crate) place: String,
}

/// The key of a table: its value is the text, or the path of the file that has it.
pub(crate) const ATMOSPHERE_TABLE: &str = "atmosphere_table";

impl Entry {
    /// Whether the value is the path of a table.
    fn names_table(&self) -> bool {
        let is_path = |word: &str| word.ends_with(".csv") && !word.contains('\n');
        self.path == ATMOSPHERE_TABLE && matches!(&self.value, Value::Word(word) if is_path(word))
    }

    /// The key that it is for, if it takes the value.
    pub(crate) fn key<'a>(&self, keys: &[&'a Key], owner: &str) -> Result<&'a Key, Error> {
        let Some(key) = keys.iter().find(|k| k.path == self.path) else {
            return Err(Error::UnknownKey {
                suggestion: suggestion(&self.path, keys),
                place: self.place.clone(),
                owner: owner.into(),
                key: self.path.clone(),
            });
        };
        key.accept(&self.value, &self.place)?;
        Ok(key)
    }
}

impl Mission {
    /// Reads a mission from a file, or by its name from those that come with the program.
    ///
    /// `overrides` are `key=value` texts that replace values of the file.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn load(file_or_name: &str, overrides: &[String]) -> Result<Self, Error> {
        let path = Path::new(file_or_name);
        if let Some(text) = missions::file(file_or_name)
            && !path.is_file()
        {
            return Self::parse(text, &format!("mission `{file_or_name}`"), overrides);
        }
        let text = read(path, "mission", &missions::names())?;
        Self::parse_in(path.parent(), &text, &format!("file `{file_or_name}`"), overrides)
    }

    /// Reads a mission from the text of a file; `source` names it in messages.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn parse(text: &str, source: &str, overrides: &[String]) -> Result<Self, Error> {
        Self::parse_in(None, text, source, overrides)
    }

    /// Reads a mission from the text of a file in a directory.
    fn parse_in(
        directory: Option<&Path>,
        text: &str,
        source: &str,
        overrides: &[String],
    ) -> Result<Self, Error> {
        let mut entries = entries(text, |offset| format!("{source}, line {}", line(text, offset)))?;
        let Some(position) = entries.iter().position(|e| e.path == "mission") else {
            return Err(Error::Value {
                place: source.into(),
                key: "mission".into(),
                found: "missing".into(),
                allowed: format!("one of {}", missions::names()),
            });
        };
        let header = entries.remove(position);
        let kind = match &header.value {
            Value::Word(name) => missions::kind(name).ok_or_else(|| Error::UnknownMission {
                place: header.place.clone(),
                name: name.clone(),
                known: missions::names(),
            })?,
            other => {
                return Err(Error::Value {
                    place: header.place,
                    key: "mission".into(),
                    found: other.to_string(),
                    allowed: format!("one of {}", missions::names()),
                });
            }
        };
        let keys: Vec<&Key> = kind.keys().collect();
        for e in &mut entries {
            let is_path = keys.iter().any(|k| k.path == e.path && matches!(k.kind, KeyKind::Path(..)));
            let names_table = e.names_table();
            // A mission file and the files that it names move together.
            if let (Some(directory), Value::Word(word)) = (directory, &mut e.value)
                && (names_table
                    || (e.path == vehicle::KEY && vehicle::is_file(word))
                    || (is_path && directory.join(&*word).is_file()))
            {
                *word = directory.join(&*word).display().to_string();
            }
        }
        for o in overrides {
            entries.push(parse_override(o)?);
        }
        for e in entries.iter_mut().filter(|e| e.names_table()) {
            if let Value::Word(word) = &mut e.value {
                *word = read(Path::new(&*word), "atmosphere table", "none")?;
            }
        }
        let mut values: BTreeMap<_, _> = keys.iter().map(|k| (k.path, k.default())).collect();
        let owner = format!("mission `{}`", kind.name);
        for e in &entries {
            values.insert(e.key(&keys, &owner)?.path, e.value.clone());
        }
        if let Some(Value::Word(name)) = values.get(vehicle::KEY) {
            let named = entries.iter().rfind(|e| e.path == vehicle::KEY);
            let place = named.map_or(source, |e| &e.place);
            for (path, number) in vehicle::numbers(name, &keys, place)? {
                if entries.iter().all(|e| e.path != path) {
                    values.insert(path, Value::Number(number));
                }
            }
        }
        let mission = Self { kind, values: Values(values), threads: 1, seed: 0, checkpoint: None };
        (kind.check)(&mission.values).map_err(|reason| Error::Conflict {
            place: format!("{source} (mission `{}`)", kind.name),
            reason,
        })?;
        mission.check_method()?;
        Ok(mission)
    }

    /// The mission, to be solved with so many threads, 1 to 1024; no result depends on it.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// The mission, to be solved with this seed of everything random.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The mission, whose search is kept in a file: it goes on from there if the file exists.
    #[must_use]
    pub fn with_checkpoint(self, file: PathBuf) -> Self {
        Self { checkpoint: Some(file), ..self }
    }

    /// Name of the mission.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.kind.name
    }

    /// One line on what the mission does.
    #[must_use]
    pub fn title(&self) -> &'static str {
        self.kind.title
    }

    /// Keys of the mission.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> {
        self.kind.keys()
    }

    /// The mission file with every value written out.
    #[must_use]
    pub fn to_file(&self) -> String {
        let mut text = format!("# {}\nmission = \"{}\"\n", self.title(), self.name());
        let mut tables: BTreeMap<&str, String> = BTreeMap::new();
        for key in self.keys() {
            let value = match &self.values.0[key.path] {
                // TOML tells whole numbers and fractions apart.
                Value::Number(v) if key.is_number() => format!("{v:?}"),
                // Text of several lines is escaped.
                Value::Word(w) => toml::Value::from(w.as_str()).to_string(),
                other => other.to_string(),
            };
            match key.path.split_once('.') {
                None => text += &format!("{} = {value} # {}\n", key.path, key.meaning),
                Some((table, name)) => {
                    *tables.entry(table).or_default() += &format!("{name} = {value} # {}\n", key.meaning);
                }
            }
        }
        for (name, body) in tables {
            text += &format!("\n[{name}]\n{body}");
        }
        text
    }
}

/// The text of a file; `what` it is and the names that are known without one stand in messages.
pub(crate) fn read(path: &Path, what: &str, known: &str) -> Result<String, Error> {
    let fail = |reason: String| Err(Error::File { path: path.into(), reason });
    let metadata = match std::fs::metadata(path) {
        Ok(m) => m,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            return fail(format!("no such file, and no {what} of this name; {what}s: {known}"));
        }
        Err(e) => return fail(e.to_string()),
    };
    if !metadata.is_file() {
        return fail(format!("not a file; give a {what} file or the name of a {what}"));
    }
    if metadata.len() > MAX_FILE_BYTES {
        return fail(format!("has {} bytes; a {what} file has at most {MAX_FILE_BYTES}", metadata.len()));
    }
    match std::fs::read(path).map(String::from_utf8) {
        Ok(Ok(text)) => Ok(text),
        Ok(Err(_)) => fail("is not UTF-8 text".into()),
        Err(e) => fail(e.to_string()),
    }
}

pub(crate) fn line(text: &str, offset: usize) -> usize {
    text.as_bytes()[..offset.min(text.len())].iter().filter(|b| **b == b'\n').count() + 1
}

pub(crate) fn entries(text: &str, place: impl Fn(usize) -> String) -> Result<Vec<Entry>, Error> {
    let table = DeTable::parse(text).map_err(|e| Error::Syntax {
        place: place(e.span().map_or(0, |s| s.start)),
        reason: e.message().to_owned(),
    })?;
    let mut entries = Vec::new();
    flatten(table.get_ref(), "", &place, &mut entries);
    Ok(entries)
}

fn flatten(table: &DeTable<'_>, prefix: &str, place: &impl Fn(usize) -> String, entries: &mut Vec<Entry>) {
    for (key, value) in table {
        let path =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        match value.get_ref() {
            DeValue::Table(inner) => flatten(inner, &path, place, entries),
            _ => entries.push(Entry { path, value: scalar(value), place: place(key.span().start) }),
        }
    }
}

fn scalar(value: &Spanned<DeValue<'_>>) -> Value {
    let number = |text: &str| text.replace('_', "").parse().map(Value::Number);
    match value.get_ref() {
        DeValue::Float(f) => number(f.as_str()).unwrap_or_else(|_| Value::Other(f.as_str().into())),
        DeValue::Integer(i) if i.radix() == 10 => {
            number(i.as_str()).unwrap_or_else(|_| Value::Other(i.as_str().into()))
        }
        DeValue::String(s) => Value::Word(s.to_string()),
        DeValue::Boolean(v) => Value::Flag(*v),
        other => Value::Other(format!("a value of type {}", other.type_str())),
    }
}

fn parse_override(text: &str) -> Result<Entry, Error> {
    let place = format!("--set {text}");
    let Some((key, value)) = text.split_once('=') else {
        return Err(Error::Syntax { place, reason: "expected key=value".into() });
    };
    let (path, value) = (key.trim().to_owned(), value.trim());
    // A bare word needs no quotes on a command line.
    let parsed = entries(&format!("v = {value}"), |_| String::new()).ok().and_then(|mut e| e.pop());
    let value = match parsed {
        Some(e) => e.value,
        None => Value::Word(value.to_owned()),
    };
    Ok(Entry { path, value, place })
}

/// End of the sentence that refuses a key: the nearest one, and a word on units where only they are wrong.
pub(crate) fn suggestion(key: &str, keys: &[&Key]) -> String {
    let stem = |s: &str| s.rsplit_once('_').map_or(s.to_owned(), |(a, _)| a.to_owned());
    if let Some(k) = keys.iter().find(|k| stem(k.path) == key) {
        return format!("; its unit is missing: `{}`", k.path);
    }
    if let Some(k) = keys.iter().find(|k| stem(k.path) == stem(key) && k.path.contains('_')) {
        return format!("; in its unit it is `{}`", k.path);
    }
    let nearest = keys
        .iter()
        .map(|k| (strsim::damerau_levenshtein(key, k.path), k.path))
        .min()
        .filter(|(distance, path)| *distance <= path.len() / 2);
    match nearest {
        Some((_, path)) => format!("; the nearest is `{path}`"),
        None => format!("; keys: {}", keys.iter().map(|k| k.path).collect::<Vec<_>>().join(", ")),
    }
}
