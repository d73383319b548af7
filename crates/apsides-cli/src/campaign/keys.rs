//! Keys of the file of a campaign, and what each takes: a mistake is told with its file, line and key before anything is read.

use std::collections::BTreeSet;

use apsides::pipeline::file::scalar;
use apsides_expressions::suggestion::suggested_name;
use apsides_expressions::toml_mistake::plain_words;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The values that a key takes.
#[derive(Clone, Copy)]
enum Takes {
    /// A text in quotes.
    Text,
    /// Texts in quotes between brackets.
    Texts,
    /// One of some words.
    Word(&'static [&'static str]),
    /// A whole number from the first to the second.
    Whole(i64, i64),
    /// A number above zero.
    Above0,
    /// A table with keys of its own.
    Table(&'static [Key]),
}

type Key = (&'static str, Takes);

/// Most samples or cases.
const MOST: i64 = 1_000_000_000;
/// Most processes, threads, attempts.
const MANY: i64 = 1024;

const KEYS: &[Key] = &[
    ("command", Takes::Word(&["montecarlo", "sweep"])),
    ("mission", Takes::Text),
    ("arguments", Takes::Texts),
    ("samples", Takes::Whole(2, MOST)),
    ("seed", Takes::Whole(0, i64::MAX)),
    (SHARD_SIZE, Takes::Whole(1, MOST)),
    ("engine", Takes::Word(&["local", "slurm", "dask"])),
    ("out", Takes::Text),
    ("workers", Takes::Whole(1, MANY)),
    ("threads", Takes::Whole(1, MANY)),
    ("attempts", Takes::Whole(1, MANY)),
    ("time_limit_s", Takes::Above0),
    ("memory_mib", Takes::Whole(1, u32::MAX as i64)),
    ("format", Takes::Word(&["csv", "parquet"])),
    ("slurm", Takes::Table(&[("options", Takes::Texts)])),
    ("dask", Takes::Table(&[("python", Takes::Text), ("scheduler", Takes::Text)])),
];

const SHARD_SIZE: &str = "shard_size";

/// Keys that every file has.
const NEEDED: [(&str, &str); 2] = [
    ("mission", "the name of a mission or the path of its file, as in `mission = \"chang-e-3-braking\"`"),
    (SHARD_SIZE, "samples or cases of a shard, as in `shard_size = 1000`"),
];

/// The first mistake of a file in a sentence; none of a file that can be read.
pub(super) fn mistake(file: &str, text: &str) -> Option<String> {
    let line = |byte: usize| format!("file `{file}`, line {}", apsides::pipeline::file::line(text, byte));
    let table = match DeTable::parse(text) {
        Ok(table) => table,
        Err(e) => {
            let at = e.span().map_or(0, |span| span.start);
            return Some(format!("{}: {}", line(at), plain_words(e.message(), text, at)));
        }
    };
    let mut found = Vec::new();
    in_table(table.get_ref(), "", KEYS, &mut found);
    // The first one in the file.
    if let Some((at, sentence)) = found.into_iter().min_by_key(|(at, _)| *at) {
        return Some(format!("{}: {sentence}", line(at)));
    }
    let stated: BTreeSet<&str> = table.get_ref().keys().map(|key| key.get_ref().as_ref()).collect();
    NEEDED
        .iter()
        .find(|(key, _)| !stated.contains(key))
        .map(|(key, takes)| format!("file `{file}`: `{key}` is missing: {takes}"))
}

/// Mistakes with the byte at which each stands.
fn in_table(table: &DeTable<'_>, prefix: &str, keys: &[Key], found: &mut Vec<(usize, String)>) {
    for (name, value) in table {
        let path = format!("{prefix}{}", name.get_ref());
        let Some((_, takes)) = keys.iter().find(|(key, _)| key == name.get_ref()) else {
            let names: Vec<&str> = keys.iter().map(|(key, _)| *key).collect();
            let owner = prefix.strip_suffix('.').map_or("a campaign".to_owned(), |name| format!("[{name}]"));
            let suggestion = suggested_name(name.get_ref(), "keys", &names);
            found.push((name.span().start, format!("{owner} has no key `{}`{suggestion}", name.get_ref())));
            continue;
        };
        if let (Takes::Table(keys), DeValue::Table(inner)) = (takes, value.get_ref()) {
            in_table(inner, &format!("{path}."), keys, found);
        } else if !takes.accepts(value.get_ref()) {
            let sentence =
                format!("`{path}` is {}, allowed is {}", described(value), takes.words(name.get_ref()));
            found.push((value.span().start, sentence));
        }
    }
}

impl Takes {
    fn accepts(self, value: &DeValue<'_>) -> bool {
        match (self, value) {
            (Self::Text, DeValue::String(_)) => true,
            (Self::Texts, DeValue::Array(list)) => {
                list.iter().all(|item| matches!(item.get_ref(), DeValue::String(_)))
            }
            (Self::Word(words), DeValue::String(word)) => words.contains(&word.as_ref()),
            (Self::Whole(least, most), DeValue::Integer(_)) => {
                whole(value).is_some_and(|number| (least..=most).contains(&number))
            }
            (Self::Above0, DeValue::Integer(_)) => whole(value).is_some_and(|number| number > 0),
            (Self::Above0, DeValue::Float(number)) => {
                let number = number.as_str().replace('_', "").parse::<f64>();
                number.is_ok_and(|number| number > 0.0 && number.is_finite())
            }
            _ => false,
        }
    }

    fn words(self, name: &str) -> String {
        match self {
            Self::Text => "a text in quotes".into(),
            Self::Texts => format!("a list of texts, as in {name} = [\"--one\", \"2\"]"),
            Self::Word(words) => {
                words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ")
            }
            Self::Whole(least, most) => format!("a whole number from {least} to {most}"),
            Self::Above0 => "a number above 0".into(),
            Self::Table(keys) => {
                let names: Vec<String> = keys.iter().map(|(key, _)| format!("`{key}`")).collect();
                format!("a table [{name}] with {}", names.join(", "))
            }
        }
    }
}

fn whole(value: &DeValue<'_>) -> Option<i64> {
    let DeValue::Integer(number) = value else { return None };
    let digits = number.as_str().replace('_', "");
    let digits =
        if number.radix() == 10 { digits.as_str() } else { digits.trim_start_matches(['0', 'x', 'o', 'b']) };
    i64::from_str_radix(if digits.is_empty() { "0" } else { digits }, number.radix()).ok()
}

fn described(value: &Spanned<DeValue<'_>>) -> String {
    let DeValue::Array(list) = value.get_ref() else { return scalar(value).to_string() };
    match list.iter().find(|item| !matches!(item.get_ref(), DeValue::String(_))) {
        Some(item) => format!("a list with {}", scalar(item)),
        None => "a list".into(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const WHOLE: &str = "mission = \"chang-e-3-braking\"\nsamples = 100\nshard_size = 10\n";

    /// Every kind of mistake, each in words of the file.
    #[test]
    fn mistakes_are_told_by_line_and_key() {
        for (more, sentence) in [
            (
                "seed = -1",
                "file `c`, line 4: `seed` is -1, allowed is a whole number from 0 to 9223372036854775807",
            ),
            ("seed = 1.5", "file `c`, line 4: `seed` is 1.5, allowed is a whole number from 0 to"),
            (
                "workers = \"x\"",
                "file `c`, line 4: `workers` is \"x\", allowed is a whole number from 1 to 1024",
            ),
            ("threads = 0", "file `c`, line 4: `threads` is 0, allowed is a whole number from 1 to 1024"),
            (
                "memory_mib = 99999999999",
                "file `c`, line 4: `memory_mib` is 99999999999, allowed is a whole number from 1 to 4294967295",
            ),
            ("attempts = 99999999999999999999999", "file `c`, line 4: `attempts` is 1e23, allowed"),
            ("wrokers = 1", "file `c`, line 4: a campaign has no key `wrokers`; the nearest is `workers`"),
            (
                "\n[slurm]\noption = 1",
                "file `c`, line 6: [slurm] has no key `option`; the nearest is `options`",
            ),
            (
                "engine = \"pbs\"",
                "file `c`, line 4: `engine` is \"pbs\", allowed is \"local\" or \"slurm\" or \"dask\"",
            ),
            ("engine = 2", "file `c`, line 4: `engine` is 2, allowed is \"local\" or"),
            (
                "arguments = \"--x\"",
                "file `c`, line 4: `arguments` is \"--x\", allowed is a list of texts, as in",
            ),
            (
                "arguments = [\"--x\", 3]",
                "file `c`, line 4: `arguments` is a list with 3, allowed is a list of texts",
            ),
            (
                "dask = 3",
                "file `c`, line 4: `dask` is 3, allowed is a table [dask] with `python`, `scheduler`",
            ),
            ("[dask]\npython = true", "file `c`, line 5: `dask.python` is true, allowed is a text in quotes"),
            ("time_limit_s = -4", "file `c`, line 4: `time_limit_s` is -4, allowed is a number above 0"),
            ("time_limit_s = inf", "file `c`, line 4: `time_limit_s` is inf, allowed is a number above 0"),
            ("out = 2026-01-01", "file `c`, line 4: `out` is a date, allowed is a text in quotes"),
            ("out = {}", "file `c`, line 4: `out` is a table, allowed is a text in quotes"),
        ] {
            let found = mistake("c", &format!("{WHOLE}{more}\n")).unwrap();
            assert!(found.starts_with(sentence), "{more}: {found}");
        }
        assert_eq!(mistake("c", WHOLE), None);
        assert_eq!(mistake("c", &format!("{WHOLE}seed = 0x1f\ntime_limit_s = 1e3\nworkers = 1_0\n")), None);
        let missing = mistake("c", "mission = \"lunar\"\nsamples = 2\n").unwrap();
        assert_eq!(
            missing,
            "file `c`: `shard_size` is missing: samples or cases of a shard, as in `shard_size = 1000`"
        );
        assert!(
            mistake("c", "shard_size = 2")
                .unwrap()
                .starts_with("file `c`: `mission` is missing: the name of a mission")
        );
        // The first of several.
        let first = mistake("c", "mission = 3\nshard_size = true\n").unwrap();
        assert_eq!(first, "file `c`, line 1: `mission` is 3, allowed is a text in quotes");
    }
}
