//! Rules of style that rustfmt and clippy do not know.

use crate::finding::{Finding, report};
use crate::workspace::Workspace;

mod docs;
mod rust;
pub(crate) mod text;
mod tolerances;

/// Directories of data that come with the missions, and where their files are listed.
const LISTED: [(&str, &str); 4] = [
    ("crates/apsides-missions/missions/", "crates/apsides-missions/src/catalogue.rs"),
    ("crates/apsides-missions/missions/bodies/", "crates/apsides-missions/src/data.rs"),
    ("crates/apsides-missions/missions/sites/", "crates/apsides-missions/src/data.rs"),
    ("crates/apsides-missions/missions/vehicles/", "crates/apsides-missions/src/data.rs"),
];

/// Endings of the files that are read.
const TEXT: &[&str] = &["rs", "toml", "md", "py", "sh", "yml", "yaml", "css", "html"];

/// Checks every file that git tracks or would track.
pub(crate) fn run(workspace: &Workspace) -> Result<(), String> {
    let files = workspace.files()?;
    let mut findings = Vec::new();
    for path in files.iter().filter(|p| is_text(p)) {
        let bytes = std::fs::read(workspace.root.join(path)).map_err(|e| format!("{path}: {e}"))?;
        let Ok(text) = String::from_utf8(bytes) else {
            findings.push(Finding::of(path, "not UTF-8"));
            continue;
        };
        findings.extend(text::whitespace(path, &text));
        findings.extend(text::machine_paths(path, &text));
        if path.ends_with(".rs") {
            findings.extend(rust::check(path, &text));
            findings.extend(docs::check(path, &text));
            findings.extend(tolerances::check(path, &text));
        }
        if path.ends_with(".md") {
            findings.extend(text::links(path, &text, |target| workspace.root.join(target).exists()));
        }
        for (directory, list) in LISTED.iter().filter(|(_, list)| path == list) {
            findings.extend(unlisted(&files, directory, list, &text));
        }
    }
    report("tidy", &findings)
}

fn is_text(path: &str) -> bool {
    path.starts_with(".ci/") || path.rsplit_once('.').is_some_and(|(_, end)| TEXT.contains(&end))
}

/// The path of a file inside the package that it belongs to.
fn in_package(path: &str) -> &str {
    path.strip_prefix("crates/").and_then(|p| p.split_once('/')).map_or(path, |(_, inside)| inside)
}

/// Files of a directory, not of those below, that the facade does not carry.
fn unlisted(files: &[String], directory: &str, list: &str, text: &str) -> Vec<Finding> {
    let inside = |f: &str| {
        f.strip_prefix(directory).is_some_and(|name| name.ends_with(".toml") && !name.contains('/'))
    };
    files
        .iter()
        .filter(|f| inside(f) && !text.contains(in_package(f)))
        .map(|f| Finding::of(f, format!("not listed in {list}")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missions_are_listed() {
        let files = ["missions/a.toml", "missions/b.toml", "missions/vehicles/c.toml", "missions/README.md"]
            .map(String::from);
        let found =
            unlisted(&files, "missions/", "list.rs", r#"("a", include_str!("../../missions/a.toml"))"#);
        assert_eq!(found.iter().map(|f| f.path.as_str()).collect::<Vec<_>>(), ["missions/b.toml"]);
    }

    #[test]
    fn files_that_are_read() {
        assert!(is_text(".ci/run") && is_text("docs/glossary.md") && is_text("a.rs"));
        assert!(!is_text("figure.png") && !is_text("LICENSE-MIT"));
    }
}
