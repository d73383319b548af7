//! Reading files of keys: every mistake is reported with file, line and key, and the nearest key is suggested.

use std::path::Path;

use apsides_expressions::toml_mistake::plain_words;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::Error;
use crate::key::{Key, KeyKind, Value, suggestion};
use crate::lines::{commented, wrapped};
use crate::placing::is_placing;
use crate::regular_file;
use crate::values::{Values, place_of_option};

/// Largest mission file: a few kB is usual, so anything above is a mistake.
pub const MAX_FILE_BYTES: u64 = 1 << 20;

/// Ends of the names of files whose text is the value of a key.
const TABLES: [&str; 2] = [".csv", ".opm"];

/// One value with its place, before it is matched with a key.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedValue {
    /// Path of the key: tables and name, joined by dots.
    pub path: String,
    /// The value.
    pub value: Value,
    /// File and line, or `--set`.
    pub place: String,
}

impl StatedValue {
    /// The key that it is for.
    ///
    /// # Errors
    /// None of `keys` has its path, or the key does not take the value; `owner` says in the message what the keys belong to.
    pub fn key<'a>(&self, keys: &[&'a Key], owner: &str) -> Result<&'a Key, Error> {
        let Some(key) = keys.iter().find(|k| k.path == self.path) else {
            return Err(Error::UnknownKey {
                suggestion: suggestion(&self.path, keys, ""),
                place: self.place.clone(),
                owner: owner.into(),
                key: self.path.clone(),
            });
        };
        key.accept(&self.value, &self.place)?;
        Ok(key)
    }

    /// Returns true if its key is a table or a message and its value the path of the file that has it.
    pub(crate) fn names_table(&self, keys: &[Key]) -> bool {
        let is_path = |word: &str| TABLES.iter().any(|end| word.ends_with(end)) && !word.contains('\n');
        let is_table = |k: &Key| k.path == self.path && matches!(k.kind, KeyKind::Table(..));
        keys.iter().any(is_table) && matches!(&self.value, Value::Word(word) if is_path(word))
    }
}

/// The mission file with every value written out, by the title and name of its kind. Comments that do not fit a terminal beside their keys
/// stand above them.
pub(crate) fn written(title: &str, name: &str, values: &Values) -> String {
    let mut text = format!("{}mission = \"{name}\"\n", wrapped("# ", title));
    let mut tables: std::collections::BTreeMap<&str, String> = std::collections::BTreeMap::new();
    for key in values.keys() {
        // Epoch and axes change no flight: files say nothing of them unless somebody did.
        if is_placing(&key.path) && values.place(&key.path).is_none() {
            continue;
        }
        // What is open stays open.
        let Some(value) = values.get(&key.path) else { continue };
        let value = match value {
            // TOML tells whole numbers and fractions apart.
            Value::Number(v) if key.is_number() => format!("{v:?}"),
            // Text of several lines is escaped.
            Value::Word(w) => toml::Value::from(w.as_str()).to_string(),
            other => other.to_string(),
        };
        match key.path.split_once('.') {
            None => text += &commented(&format!("{} = {value}", key.path), &key.meaning),
            Some((table, name)) => {
                *tables.entry(table).or_default() += &commented(&format!("{name} = {value}"), &key.meaning);
            }
        }
    }
    for (name, body) in tables {
        text += &format!("\n[{name}]\n{body}");
    }
    text
}

/// Reads the text of a file. `what` it is and the names that are known without a file stand in messages.
///
/// # Errors
/// [`Error::File`] when there is no such file, or it is too large or no text.
pub fn read(path: &Path, what: &str, known: &str) -> Result<String, Error> {
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
    match std::fs::read(path).map(regular_file::text) {
        Ok(Ok(text)) => Ok(text),
        Ok(Err(reason)) => fail(reason),
        Err(e) => fail(e.to_string()),
    }
}

/// The line, counted from 1, of a byte offset in a text.
#[must_use]
pub fn line(text: &str, offset: usize) -> usize {
    text.as_bytes()[..offset.min(text.len())].iter().filter(|b| **b == b'\n').count() + 1
}

/// The values of a TOML text; `place` says where a byte offset is.
///
/// # Errors
/// [`Error::Syntax`] when the text is not TOML.
pub fn entries(text: &str, place: impl Fn(usize) -> String) -> Result<Vec<StatedValue>, Error> {
    let table = DeTable::parse(text).map_err(|e| Error::Syntax {
        place: place(e.span().map_or(0, |s| s.start)),
        reason: plain_words(e.message(), text, e.span().map_or(0, |s| s.start)),
    })?;
    let mut entries = Vec::new();
    flatten(table.get_ref(), "", &place, &mut entries);
    Ok(entries)
}

fn flatten(
    table: &DeTable<'_>,
    prefix: &str,
    place: &impl Fn(usize) -> String,
    entries: &mut Vec<StatedValue>,
) {
    for (key, value) in table {
        let path =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        match value.get_ref() {
            DeValue::Table(inner) => flatten(inner, &path, place, entries),
            _ => entries.push(StatedValue { path, value: scalar(value), place: place(key.span().start) }),
        }
    }
}

/// The value of a key that is no table; a list and a date are none that a key of a mission takes, and are described.
pub fn scalar(value: &Spanned<DeValue<'_>>) -> Value {
    let number = |text: &str| text.replace('_', "").parse().map(Value::Number);
    match value.get_ref() {
        DeValue::Float(f) => number(f.as_str()).unwrap_or_else(|_| Value::Other(f.as_str().into())),
        DeValue::Integer(i) if i.radix() == 10 => {
            number(i.as_str()).unwrap_or_else(|_| Value::Other(i.as_str().into()))
        }
        DeValue::Integer(i) => {
            let digits =
                i.as_str().trim_start_matches("0x").trim_start_matches("0o").trim_start_matches("0b");
            match i64::from_str_radix(&digits.replace('_', ""), i.radix()) {
                Ok(whole) => Value::Number(whole as f64),
                Err(_) => Value::Other(format!("{} to base {}", i.as_str(), i.radix())),
            }
        }
        DeValue::String(s) => Value::Word(s.to_string()),
        DeValue::Boolean(v) => Value::Flag(*v),
        DeValue::Array(_) => Value::Other("a list".into()),
        DeValue::Datetime(_) => Value::Other("a date".into()),
        DeValue::Table(_) => Value::Other("a table".into()),
    }
}

/// Reads `key=value`; a bare word needs no quotes.
///
/// # Errors
/// [`Error::Syntax`] when there is no equals sign.
pub(crate) fn parse_override(text: &str) -> Result<StatedValue, Error> {
    let place = place_of_option(text);
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
    Ok(StatedValue { path, value, place })
}
