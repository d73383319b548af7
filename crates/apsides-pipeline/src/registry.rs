//! The kinds of mission, mission files and named data that a program knows: reading a mission by file or name.

use std::path::Path;
use std::sync::Arc;

use apsides_expressions::suggestion::{quoted, suggested_name};

use crate::Error;
use crate::file::{StatedValue, entries, line, parse_override, read};
use crate::key::{Key, KeyKind, Value};
use crate::method;
use crate::mission::{Kind, Mission};
use crate::named_data::NamedData;
use crate::pipeline::Pipeline;
use crate::values::Values;

/// The kinds, files and data that missions are read by. Later additions of a name replace earlier ones.
#[derive(Clone, Debug, Default)]
pub struct Registry {
    kinds: Vec<Kind>,
    files: Vec<(&'static str, &'static str)>,
    data: Vec<NamedData>,
    renamed: &'static [(&'static str, &'static str)],
    of_files: Vec<KindOfFile>,
}

/// The text of a mission file that says itself what its mission is.
#[derive(Clone, Copy, Debug)]
pub struct Document<'a> {
    /// The text.
    pub text: &'a str,
    /// Name of the file in messages.
    pub source: &'a str,
    /// The directory that paths in the file count from; none of a text that is in no file.
    pub directory: Option<&'a Path>,
}

/// The name or file by which a mission is asked for.
#[derive(Clone, Copy, Default)]
struct Asked<'a> {
    /// The directory that paths in its file count from; none of a text that is in no file.
    directory: Option<&'a Path>,
    /// The name of the mission, or the path of its file; none of a text.
    name: Option<&'a str>,
    /// Says whether the name is the path of a file.
    is_file: bool,
}

/// Values that replace those of a file, in their order; one may be a text that is none.
type Changes<'a> = &'a mut dyn Iterator<Item = Result<StatedValue, Error>>;

/// Makes the kind of mission of one file, and the values that the file states.
pub type ReadsKind = fn(&Document<'_>) -> Result<(Kind, Vec<StatedValue>), Error>;

/// The schemas of the keys at the top of such files, by their names: JSON Schema, draft 2020-12.
pub type SchemaOfFile = fn() -> serde_json::Map<String, serde_json::Value>;

/// Files that say themselves what their mission is.
#[derive(Clone, Copy, Debug)]
struct KindOfFile {
    /// The word that they begin with.
    word: &'static str,
    reads: ReadsKind,
    schema: SchemaOfFile,
}

/// The key of the word that such files begin with.
const KIND: &str = "kind";

impl Registry {
    /// A registry that knows nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same with a kind of mission.
    #[must_use]
    pub fn with<M: Mission>(mut self) -> Self {
        let kind = M::kind();
        self.kinds.retain(|k| k.name != kind.name);
        self.kinds.push(kind);
        self
    }

    /// The same with files that say themselves what their mission is, which begin with `kind = ` and the word; `schema` has the keys that
    /// they have besides those of all missions.
    #[must_use]
    pub fn with_kind_of_file(mut self, word: &'static str, reads: ReadsKind, schema: SchemaOfFile) -> Self {
        self.of_files.retain(|k| k.word != word);
        self.of_files.push(KindOfFile { word, reads, schema });
        self
    }

    /// The same with a mission file: its name and its text, the first line of which is a comment that says what it is.
    #[must_use]
    pub fn with_file(mut self, name: &'static str, text: &'static str) -> Self {
        self.files.retain(|f| f.0 != name);
        self.files.push((name, text));
        self
    }

    /// The same with named data of one sort, such as vehicles.
    #[must_use]
    pub fn with_data(mut self, data: NamedData) -> Self {
        self.data.retain(|d| d.key != data.key);
        self.data.push(data);
        self
    }

    /// The same with former paths of keys, each with the one of today, which messages name.
    #[must_use]
    pub fn with_renamed(self, renamed: &'static [(&'static str, &'static str)]) -> Self {
        Self { renamed, ..self }
    }

    /// The kinds of mission.
    #[must_use]
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// The words that files begin with which say themselves what their mission is, each with the schemas of its keys.
    pub fn kinds_of_files(&self) -> impl Iterator<Item = (&'static str, SchemaOfFile)> + use<'_> {
        self.of_files.iter().map(|k| (k.word, k.schema))
    }

    /// Name and title of every mission file.
    pub fn files(&self) -> impl Iterator<Item = (&'static str, &'static str)> + use<'_> {
        let title = |text: &'static str| text.lines().next().map_or("", |l| l.trim_start_matches("# "));
        self.files.iter().map(move |(name, text)| (*name, title(text)))
    }

    /// The text of the mission file of this name.
    #[must_use]
    pub fn text(&self, name: &str) -> Option<&'static str> {
        self.files.iter().find(|f| f.0 == name).map(|f| f.1)
    }

    /// The named data of the key `key`, for instance the vehicles.
    #[must_use]
    pub fn data(&self, key: &str) -> Option<&NamedData> {
        self.data.iter().find(|d| d.key == key)
    }

    fn names(&self) -> String {
        self.kinds.iter().map(|k| format!("`{}`", k.name)).collect::<Vec<_>>().join(", ")
    }

    /// Reads a mission from a file, or by its name from those of the registry.
    ///
    /// `overrides` are `key=value` texts that replace values of the file.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn load(&self, file_or_name: &str, overrides: &[String]) -> Result<Pipeline, Error> {
        self.load_stated(file_or_name, &mut overrides.iter().map(|o| parse_override(o)))
    }

    /// Reads a mission as [`Self::load`] does, where `changes` replace values of the file by ones of their types.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn load_with<'a>(
        &self,
        file_or_name: &str,
        changes: impl IntoIterator<Item = (&'a str, Value)>,
    ) -> Result<Pipeline, Error> {
        let stated = |(path, value): (&str, Value)| StatedValue {
            place: format!("{path} = {value}"),
            path: path.to_owned(),
            value,
        };
        self.load_stated(file_or_name, &mut changes.into_iter().map(|change| Ok(stated(change))))
    }

    fn load_stated(&self, file_or_name: &str, changes: Changes<'_>) -> Result<Pipeline, Error> {
        let path = Path::new(file_or_name);
        if let Some((_, text)) = self.files.iter().find(|f| f.0 == file_or_name)
            && !path.is_file()
        {
            let source = format!("mission `{file_or_name}`");
            let asked = Asked { directory: None, name: Some(file_or_name), is_file: false };
            return self.parse_in(asked, text, &source, changes);
        }
        if !path.exists() {
            return Err(self.no_mission(path));
        }
        let text = read(path, "mission", &self.names())?;
        let asked = Asked { directory: path.parent(), name: Some(file_or_name), is_file: true };
        self.parse_in(asked, &text, &format!("file `{file_or_name}`"), changes)
    }

    /// There is neither a file nor a mission of this name: what may be meant.
    fn no_mission(&self, path: &Path) -> Error {
        let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let whole = path.to_string_lossy();
        let files: Vec<&str> = self.files.iter().map(|(name, _)| *name).collect();
        let of_kind = |kind: &Kind| -> Vec<&str> {
            let is_of = |text: &str| text.lines().any(|l| l.trim() == format!("mission = \"{}\"", kind.name));
            self.files.iter().filter(|(_, text)| is_of(text)).map(|(name, _)| *name).collect()
        };
        let hint = match self.kinds.iter().find(|k| k.name == whole) {
            Some(kind) => match of_kind(kind)[..] {
                [] => "; it is a kind of mission: name a file with `mission = ` and this name".into(),
                ref names => format!("; it is the kind of mission of {}", quoted(names)),
            },
            None if files.contains(&&*name) => format!("; without its ending `{name}` is a mission"),
            None => suggested_name(&name, "missions", &files),
        };
        Error::File { path: path.into(), reason: format!("no such file, and no mission of this name{hint}") }
    }

    /// Reads a mission from the text of a file; `source` names it in messages.
    ///
    /// # Errors
    /// The first mistake, with its place.
    pub fn parse(&self, text: &str, source: &str, overrides: &[String]) -> Result<Pipeline, Error> {
        self.parse_in(Asked::default(), text, source, &mut overrides.iter().map(|o| parse_override(o)))
    }

    /// Reads a mission from the text of a file, as it is asked for.
    fn parse_in(
        &self,
        asked: Asked<'_>,
        text: &str,
        source: &str,
        changes: Changes<'_>,
    ) -> Result<Pipeline, Error> {
        let directory = asked.directory;
        let mut stated = entries(text, |offset| format!("{source}, line {}", line(text, offset)))?;
        let (kind, mut stated) = match stated.iter().find(|e| e.path == KIND) {
            Some(word) => self.kind_of_file(word)?(&Document { text, source, directory })?,
            None => (self.take_kind(&mut stated, source)?, stated),
        };
        let keys = kind.all_keys();
        if let Some(directory) = directory {
            // A mission file and the files that it names move together.
            stated.iter_mut().for_each(|e| self.relative_to(directory, &keys, e));
        }
        for change in changes {
            stated.push(change?);
        }
        let owner = asked.name.filter(|_| !asked.is_file).unwrap_or(&kind.name);
        let mut values = Values::new(format!("mission `{owner}`"), source.into(), Arc::clone(&keys))
            .with_list(asked.name.map_or_else(String::new, |name| format!("`apsides missions {name}`")))
            .with_renamed(self.renamed)
            .with_renamed(method::RENAMED);
        for e in &mut stated {
            if e.names_table(&keys)
                && let Value::Word(word) = &mut e.value
            {
                *word = read(Path::new(&*word), &e.path.replace('_', " "), "none")?;
            }
            values.state(&e.path, e.value.clone(), &e.place)?;
        }
        for data in &self.data {
            data.state_numbers(&mut values)?;
        }
        Ok(Pipeline::new(kind, self.kinds.as_slice().into(), values)?.with_data(self.data.as_slice().into()))
    }

    /// The function that reads a file that begins with a word.
    fn kind_of_file(&self, word: &StatedValue) -> Result<ReadsKind, Error> {
        let words: Vec<&str> = self.of_files.iter().map(|k| k.word).collect();
        let found = self.of_files.iter().find(|k| word.value == Value::from(k.word));
        found.map(|k| k.reads).ok_or_else(|| Error::Value {
            place: word.place.clone(),
            key: KIND.into(),
            found: word.value.to_string(),
            allowed: match words[..] {
                [] => format!(
                    "no word here; a mission file begins with `mission = ` and one of {}",
                    self.names()
                ),
                _ => format!("{}; a mission file begins with `mission = ` instead", quoted(&words)),
            },
        })
    }

    /// The kind that the entries name, which leaves them.
    fn take_kind(&self, stated: &mut Vec<StatedValue>, source: &str) -> Result<Kind, Error> {
        let refused = |place: &str, found: String| Error::Value {
            place: place.into(),
            key: "mission".into(),
            found,
            allowed: format!("one of {}", self.names()),
        };
        let Some(position) = stated.iter().position(|e| e.path == "mission") else {
            let words =
                self.of_files.iter().map(|k| format!("; other files begin with `kind = \"{}\"`", k.word));
            let allowed = format!("one of {}{}", self.names(), words.collect::<String>());
            let (place, key, found) = (source.into(), "mission".into(), "missing".into());
            return Err(Error::Value { place, key, found, allowed });
        };
        let header = stated.remove(position);
        let Value::Word(name) = header.value else {
            return Err(refused(&header.place, header.value.to_string()));
        };
        self.kinds.iter().find(|k| k.name == name).cloned().ok_or_else(|| Error::UnknownMission {
            place: header.place,
            suggestion: {
                let kinds: Vec<&str> = self.kinds.iter().map(|k| &*k.name).collect();
                suggested_name(&name, "known", &kinds)
            },
            name,
        })
    }

    /// Makes the path of a file that an entry names one that counts from a directory.
    fn relative_to(&self, directory: &Path, keys: &[Key], entry: &mut StatedValue) {
        let is_path = keys.iter().any(|k| k.path == entry.path && matches!(k.kind, KeyKind::Path(..)));
        let is_table = entry.names_table(keys);
        let is_data = self.data.iter().any(|d| d.key == entry.path);
        if let Value::Word(word) = &mut entry.value
            && (is_table
                || (is_data && NamedData::is_file(word))
                || (is_path && directory.join(&*word).is_file()))
        {
            *word = directory.join(&*word).display().to_string();
        }
    }
}
