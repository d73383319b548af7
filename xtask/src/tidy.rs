//! Rules of style that rustfmt and clippy do not know.

use crate::finding::{Finding, report};
use crate::workspace::Workspace;

mod rust;
mod text;

/// Where the missions that come with the facade are listed.
const MISSION_LIST: &str = "crates/apsides/src/missions/mod.rs";

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
        }
        if path.ends_with(".md") {
            findings.extend(text::links(path, &text, |target| workspace.root.join(target).exists()));
        }
        if path == MISSION_LIST {
            findings.extend(unlisted_missions(&files, &text));
        }
    }
    report("tidy", &findings)
}

fn is_text(path: &str) -> bool {
    path.starts_with(".ci/") || path.rsplit_once('.').is_some_and(|(_, end)| TEXT.contains(&end))
}

/// Mission files that the facade does not carry.
fn unlisted_missions(files: &[String], list: &str) -> Vec<Finding> {
    files
        .iter()
        .filter(|f| f.starts_with("missions/") && f.ends_with(".toml") && !list.contains(f.as_str()))
        .map(|f| Finding::of(f, format!("not listed in {MISSION_LIST}")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missions_are_listed() {
        let files =
            ["missions/a.toml".to_owned(), "missions/b.toml".to_owned(), "missions/README.md".to_owned()];
        let found = unlisted_missions(&files, r#"("a", include_str!("../../missions/a.toml"))"#);
        assert_eq!(found.iter().map(|f| f.path.as_str()).collect::<Vec<_>>(), ["missions/b.toml"]);
    }

    #[test]
    fn files_that_are_read() {
        assert!(is_text(".ci/run") && is_text("docs/glossary.md") && is_text("a.rs"));
        assert!(!is_text("figure.png") && !is_text("LICENSE-MIT"));
    }
}
