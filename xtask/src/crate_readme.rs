//! README.md of each crate, from the documentation at the head of its library or program, so that nothing is written twice.
//!
//! A reader of a package finds the statement, the example, what the crate does not do. Tables of modules, sections
//! and references stay in the documentation.

use crate::finding::{Finding, report};
use crate::workspace::{Package, Workspace};

/// Writes the README of every crate.
pub(crate) fn write(workspace: &Workspace) -> Result<(), String> {
    for package in crates(workspace) {
        let path = workspace.root.join(&package.folder).join("README.md");
        std::fs::write(&path, generate(workspace, package)?)
            .map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(())
}

/// Fails where a README is absent or is not what would be written.
pub(crate) fn check(workspace: &Workspace) -> Result<(), String> {
    let mut findings = Vec::new();
    for package in crates(workspace) {
        let path = format!("{}/README.md", package.folder.to_string_lossy().replace('\\', "/"));
        let present = std::fs::read_to_string(workspace.root.join(&path)).unwrap_or_default();
        if present != generate(workspace, package)? {
            findings.push(Finding::of(&path, "out of date; `cargo xtask readmes` writes it"));
        }
    }
    report("readmes", &findings)
}

/// Members below `crates/`.
fn crates(workspace: &Workspace) -> impl Iterator<Item = &Package> {
    workspace.packages.iter().filter(|p| p.folder.starts_with("crates"))
}

fn generate(workspace: &Workspace, package: &Package) -> Result<String, String> {
    let source = workspace.root.join(&package.folder).join("src");
    let root = ["lib.rs", "main.rs"].map(|name| source.join(name)).into_iter().find(|p| p.is_file());
    let root = root.ok_or_else(|| format!("{}: no lib.rs or main.rs", package.name))?;
    let text = std::fs::read_to_string(&root).map_err(|e| format!("{}: {e}", root.display()))?;
    let body = head(&text);
    if body.trim().is_empty() {
        return Err(format!("{}: no documentation at the head", root.display()));
    }
    let name = &package.name;
    let home = &package.repository;
    let mut end = String::new();
    if package.publish {
        end = format!("Documentation: <https://docs.rs/{name}>. ");
    }
    Ok(format!(
        "# {name}\n\n{body}\n{end}One of the crates of [apsides]({home}), spaceflight trajectory optimisation.\n\n\
         Licensed under MIT or Apache-2.0, at your choice.\n"
    ))
}

/// The documentation at the head of a file as Markdown for readers outside rustdoc, without tables of modules, sections and references.
fn head(source: &str) -> String {
    let mut out = String::new();
    let mut in_code = false;
    let lines = source.lines().take_while(|l| l.starts_with("//!"));
    for line in lines.map(|l| l.trim_start_matches("//!")).map(|l| l.strip_prefix(' ').unwrap_or(l)) {
        if let Some(language) = line.strip_prefix("```") {
            in_code = !in_code;
            let opening = if in_code && (language.is_empty() || language.contains("no_run")) {
                "rust"
            } else {
                language
            };
            out.push_str(&format!("```{opening}\n"));
        } else if in_code {
            if line != "#" && !line.starts_with("# ") {
                out.push_str(line);
                out.push('\n');
            }
        } else if line.starts_with("# ") || line.starts_with("Reference") {
            break;
        } else if !line.starts_with('|') {
            out.push_str(&without_items(line));
            out.push('\n');
        }
    }
    // What is left out leaves blank lines behind.
    let mut short = out.trim().to_owned();
    while short.contains("\n\n\n") {
        short = short.replace("\n\n\n", "\n\n");
    }
    short + "\n"
}

/// A line whose links to items of Rust are plain text.
fn without_items(line: &str) -> String {
    let (mut out, mut rest) = (String::new(), line);
    while let Some(open) = rest.find("[`") {
        let Some(close) = rest[open..].find("`]").map(|k| open + k) else { break };
        out.push_str(&rest[..open]);
        let (text, after) = (&rest[open + 1..=close], &rest[close + 2..]);
        let target = after.strip_prefix('(').and_then(|a| a.split_once(')'));
        rest = match target {
            Some((link, _)) if link.contains("://") => {
                out.push_str(&format!("[{text}]"));
                after
            }
            Some((_, after)) => {
                out.push_str(text);
                after
            }
            None => {
                out.push_str(text);
                after
            }
        };
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statement_example_and_limits_are_taken_over() {
        let source = "\
//! Solves `f(x) = 0` of [`Problem`](crate::Problem) by [`solve`].
//!
//! ```
//! assert_eq!(1 + 1, 2);
//! # Ok::<(), Error>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`a`] | b |
//!
//! It knows no integers; see [`faer`](https://docs.rs/faer).
//!
//! # Method
//! Newton.

mod a;
";
        assert_eq!(
            head(source),
            "Solves `f(x) = 0` of `Problem` by `solve`.\n\n```rust\nassert_eq!(1 + 1, 2);\n```\n\n\
             It knows no integers; see [`faer`](https://docs.rs/faer).\n"
        );
    }

    #[test]
    fn fences_keep_their_language() {
        assert_eq!(head("//! ```text\n//! # x\n//! y\n//! ```\n"), "```text\ny\n```\n");
    }
}
