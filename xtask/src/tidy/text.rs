//! Rules for all text files.

use crate::finding::Finding;

/// Blanks at the ends of lines, tabs in Rust, and the end of the file.
pub(crate) fn whitespace(path: &str, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (k, line) in text.split('\n').enumerate() {
        if line.ends_with([' ', '\t', '\r']) {
            findings.push(Finding::at(path, k + 1, "blanks at the end of the line"));
        }
        if path.ends_with(".rs") && line.contains('\t') {
            findings.push(Finding::at(path, k + 1, "a tab: indent with blanks, write `\\t` in literals"));
        }
    }
    if !text.is_empty() && !text.ends_with('\n') {
        findings.push(Finding::of(path, "no line break at the end"));
    }
    findings
}

/// First folders of absolute paths that exist on one machine only.
const MACHINE_FOLDERS: &[&str] = &["work", "root", "home", "tmp"];

/// Absolute paths of the machine that a file was written on.
pub(crate) fn machine_paths(path: &str, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let found = MACHINE_FOLDERS.iter().find(|folder| {
            let needle = format!("/{folder}");
            line.match_indices(&needle).any(|(at, _)| {
                let (before, after) = (&line[..at], &line[at + needle.len()..]);
                // Part of an address or of a longer name otherwise.
                let begins = !before.ends_with(|c: char| c.is_alphanumeric() || "_-./~}*>)".contains(c));
                begins && after.starts_with('/')
            })
        });
        if let Some(folder) = found {
            findings.push(Finding::at(
                path,
                k + 1,
                format!("an absolute path of one machine, `/{folder}/..`"),
            ));
        }
    }
    findings
}

/// Links of a Markdown file to files that do not exist; `exists` takes paths relative to the root.
pub(crate) fn links(path: &str, text: &str, exists: impl Fn(&str) -> bool) -> Vec<Finding> {
    let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut findings = Vec::new();
    let mut is_text = outside_fences();
    for (k, line) in text.lines().enumerate() {
        if !is_text(line) {
            continue;
        }
        for target in targets(line) {
            let file = target.split('#').next().unwrap_or_default();
            let elsewhere = file.is_empty() || file.contains("://") || file.starts_with("mailto:");
            if !elsewhere && !resolve(folder, file).is_some_and(|f| exists(&f)) {
                findings.push(Finding::at(path, k + 1, format!("a link to `{file}`, which does not exist")));
            }
        }
    }
    findings
}

/// Says of one line after the other whether it is text, and not within a block of code.
pub(crate) fn outside_fences() -> impl FnMut(&str) -> bool {
    let mut fenced = false;
    move |line| {
        fenced ^= line.trim_start().starts_with("```");
        !fenced
    }
}

/// Targets of the links and images of a line: `[text](target)`, `[label]: target`, `src="target"`.
pub(crate) fn targets(line: &str) -> Vec<&str> {
    let inline = line.split("](").skip(1).filter_map(|rest| {
        let inside = rest.split(')').next()?;
        inside.split_whitespace().next()
    });
    let defined =
        line.strip_prefix('[').and_then(|rest| rest.split_once("]: ")).map(|(_, target)| target.trim());
    let tags = ["src=\"", "href=\""]
        .into_iter()
        .flat_map(|attribute| line.split(attribute).skip(1).filter_map(|rest| rest.split('"').next()));
    inline.chain(defined).chain(tags).collect()
}

/// A relative link as a path from the root; none when it leaves the root.
pub(crate) fn resolve(folder: &str, link: &str) -> Option<String> {
    let mut parts: Vec<&str> = folder.split('/').filter(|p| !p.is_empty()).collect();
    for part in link.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            _ => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(findings: &[Finding]) -> Vec<usize> {
        findings.iter().map(|f| f.line).collect()
    }

    #[test]
    fn blanks_and_tabs() {
        assert_eq!(lines(&whitespace("a.rs", "a \n\tb\nc\n")), [1, 2]);
        assert_eq!(lines(&whitespace("a.md", "a\n\tb\r\nc")), [2, 0]);
        assert!(whitespace("a.toml", "").is_empty());
    }

    #[test]
    fn paths_of_one_machine() {
        // Put together here, so that this file passes its own check.
        let own = |folder: &str| format!("see \"/{folder}/x\"\n");
        for folder in MACHINE_FOLDERS {
            assert_eq!(lines(&machine_paths("a.md", &own(folder))), [1], "{folder}");
        }
        for text in ["https://example.org/home/x", "~/tmp/x", "src/work/x", "/workspace/x", "a /tmp b"] {
            assert!(machine_paths("a.md", text).is_empty(), "{text}");
        }
    }

    #[test]
    fn links_resolve_from_their_folder() {
        let exists = |p: &str| ["README.md", "docs/glossary.md", "docs/a.svg"].contains(&p);
        let text =
            "[a](glossary.md#units) ![b](a.svg \"title\") [c](../README.md) [d](https://x.org/y) [e](#top)\n";
        assert!(links("docs/b.md", text, exists).is_empty());
        assert_eq!(lines(&links("README.md", text, exists)), [1, 1, 1]);
        assert_eq!(
            lines(&links("README.md", "```\n[a](b.md)\n```\n[a]: c.md\n<img src=\"d.svg\">\n", exists)),
            [4, 5]
        );
    }
}
