//! A type has a name of its own in its crate, so that a reader who meets it needs no path to know which one it is.

use std::collections::BTreeMap;

use crate::finding::Finding;
use crate::source::{code, is_test_file, is_word, lines_before_tests};

/// Words that begin the declaration of a type.
const KEYWORDS: [&str; 5] = ["struct ", "enum ", "union ", "trait ", "type "];

/// Types of one crate that share a name, where `files` are paths and texts under `src/`. Tests may repeat names.
pub(crate) fn check<'a>(files: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<Finding> {
    let mut first = BTreeMap::<String, (&str, usize)>::new();
    let mut findings = Vec::new();
    for (path, text) in files.filter(|(path, _)| !is_test_file(path)) {
        let own = lines_before_tests(text);
        for (k, line) in code(text).lines().take(own).enumerate() {
            let Some(name) = declared(line) else { continue };
            match first.get(name) {
                Some((other, line)) => findings.push(Finding::at(
                    path,
                    k + 1,
                    format!("the type `{name}` has the name of another one of its crate, at {other}:{line}"),
                )),
                None => {
                    first.insert(name.into(), (path, k + 1));
                }
            }
        }
    }
    findings
}

/// The name of the type that a line declares for a module; those inside functions and traits are indented.
fn declared(line: &str) -> Option<&str> {
    let visible = match line.strip_prefix("pub(") {
        Some(rest) => rest.split_once(") ")?.1,
        None => line.strip_prefix("pub ").unwrap_or(line),
    };
    let rest = KEYWORDS.iter().find_map(|keyword| visible.strip_prefix(keyword))?;
    Some(&rest[..rest.find(|c| !is_word(c)).unwrap_or(rest.len())])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_found_the_second_time() {
        let files = [
            ("crates/a/src/lib.rs", "pub struct Layout;\nenum Sample {}\n    struct Inner;\n"),
            ("crates/a/src/b.rs", "// struct Sample;\npub(super) type Layout<'a> = &'a ();\nstruct Inner;\n"),
            ("crates/a/src/b/tests.rs", "struct Sample;\n"),
            ("crates/a/src/c.rs", "#[cfg(test)]\nmod tests {\nstruct Sample;\n}\n"),
        ];
        let found: Vec<String> = check(files.into_iter()).iter().map(ToString::to_string).collect();
        let expected = "crates/a/src/b.rs:2: the type `Layout` has the name of another one of its crate, at crates/a/src/lib.rs:1";
        assert_eq!(found, [expected]);
    }
}
