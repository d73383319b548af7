//! Rules for Rust files.

use crate::finding::Finding;
use crate::source::{code, has_word, is_test_file, is_word, lines_before_tests};

/// Most lines of a file without its tests.
const MAX_LINES: usize = 600;

/// Names that say nothing of the subject.
const EMPTY_NAMES: &[&str] = &["util", "utils", "helper", "helpers", "manager", "managers"];

/// Macros of unfinished code.
const LEFTOVERS: &[&str] = &["todo!", "unimplemented!", "dbg!"];

/// Crates that read and write files; all others take and return values.
const WITH_FILES: &[&str] = &[
    "crates/apsides-pipeline/",
    "crates/apsides-missions/",
    "crates/apsides-report/",
    "crates/apsides-cli/",
];

/// Every rule for one file.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
    let code = code(text);
    let production = if is_test_file(path) { 0 } else { lines_before_tests(text) };
    let mut findings = Vec::new();
    if production > MAX_LINES {
        findings.push(Finding::of(path, format!("{production} lines without tests; at most {MAX_LINES}")));
    }
    findings.extend(module_name(path));
    if path.contains("src/") && !is_test_file(path) && !has_module_docs(text) {
        findings.push(Finding::at(path, 1, "no module documentation: begin with `//!`"));
    }
    for (k, line) in code.lines().enumerate() {
        let mut found = |message: String| findings.push(Finding::at(path, k + 1, message));
        for leftover in LEFTOVERS {
            if line.match_indices(leftover).any(|(at, _)| !line[..at].ends_with(is_word)) {
                found(format!("`{leftover}` is for unfinished code"));
            }
        }
        if let Some(c) = line.chars().find(|c| !c.is_ascii()) {
            found(format!("`{c}` in code: identifiers are ASCII"));
        }
        if let Some(name) = declared_module(line).filter(|n| EMPTY_NAMES.contains(n)) {
            found(format!("module `{name}`: name the subject"));
        }
        if k < production && is_library(path) {
            for outside in ["std::fs", "std::env", "std::io::stdin"] {
                if has_word(line, outside) {
                    found(format!(
                        "`{outside}`: libraries below the pipeline read neither files nor the environment"
                    ));
                }
            }
        }
    }
    findings
}

/// Returns true if a file belongs to a library below the facade.
fn is_library(path: &str) -> bool {
    path.starts_with("crates/") && path.contains("/src/") && !WITH_FILES.iter().any(|c| path.starts_with(c))
}

/// Files and folders are modules too.
fn module_name(path: &str) -> Option<Finding> {
    let name = path.strip_suffix(".rs").unwrap_or(path).split('/').find(|part| EMPTY_NAMES.contains(part))?;
    Some(Finding::of(path, format!("module `{name}`: name the subject")))
}

/// The name after `mod`, for a module with a body.
fn declared_module(line: &str) -> Option<&str> {
    let (before, after) = line.split_once("mod ")?;
    let open = after.trim_end().ends_with('{') && !before.ends_with(is_word);
    open.then(|| after.split(|c| !is_word(c)).next()).flatten()
}

/// Returns true if the first line, inner attributes aside, is module documentation.
fn has_module_docs(text: &str) -> bool {
    let first = text.lines().find(|l| !l.trim().is_empty() && !l.starts_with("#![") && !l.starts_with("// "));
    first.is_none_or(|l| l.starts_with("//!"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "crates/apsides-kkt/src/factor.rs";

    fn messages(path: &str, text: &str) -> Vec<String> {
        check(path, text).into_iter().map(|f| f.to_string()).collect()
    }

    #[test]
    fn a_clean_file_passes() {
        let text = "//! Factors.\n\n/// L, D: \u{3b4} and `todo!()`.\npub fn factor() -> &'static str {\n    \"dbg!\"\n}\n";
        assert_eq!(messages(FILE, text), Vec::<String>::new());
    }

    #[test]
    fn leftovers_are_found_in_code_alone() {
        let found =
            messages(FILE, "//! A.\nfn f() {\n    todo!(); // dbg!\n    my_dbg!(\"unimplemented!\")\n}\n");
        assert_eq!(found, [format!("{FILE}:3: `todo!` is for unfinished code")]);
    }

    #[test]
    fn long_files_are_found_and_tests_do_not_count() {
        let long = format!("//! A.\n{}", "fn f() {}\n".repeat(600));
        assert!(messages(FILE, &long)[0].contains("601 lines"));
        assert!(messages("crates/apsides-kkt/tests/kkt.rs", &long).is_empty());
        let tested = format!("//! A.\n#[cfg(test)]\nmod tests {{\n{}}}\n", "fn f() {}\n".repeat(600));
        assert!(messages(FILE, &tested).is_empty());
    }

    #[test]
    fn empty_names_are_found() {
        assert!(messages("crates/apsides-kkt/src/utils.rs", "//! A.\n")[0].contains("module `utils`"));
        assert!(messages("crates/apsides-kkt/src/helper/a.rs", "//! A.\n")[0].contains("module `helper`"));
        assert!(messages(FILE, "//! A.\npub(crate) mod manager {\n}\n")[0].contains("module `manager`"));
    }

    #[test]
    fn module_docs_come_first() {
        assert_eq!(
            messages(FILE, "use x;\n"),
            [format!("{FILE}:1: no module documentation: begin with `//!`")]
        );
        assert!(messages(FILE, "#![allow(x)]\n//! A.\n").is_empty());
        assert!(messages("crates/apsides-ad/src/node/tests.rs", "use x;\n").is_empty());
    }

    #[test]
    fn identifiers_are_ascii() {
        assert!(messages(FILE, "//! A.\nlet \u{3bc} = '\u{3bc}';\n")[0].contains(":2:"));
    }

    #[test]
    fn libraries_read_no_files() {
        let text = "//! A.\nuse std::fs::File;\n";
        assert!(messages(FILE, text)[0].contains("`std::fs`"));
        assert!(messages("crates/apsides-pipeline/src/file.rs", text).is_empty());
        assert!(messages("xtask/src/main.rs", text).is_empty());
        let in_tests = "//! A.\n#[cfg(test)]\nmod tests {\n    use std::env;\n}\n";
        assert!(messages(FILE, in_tests).is_empty());
    }
}
