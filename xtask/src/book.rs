//! The pages of `docs`: their commands are run, all of them are in the table of contents, and mdbook makes a book of them where it is.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use crate::book_site;
use crate::command::{cargo, run, succeeds};
use crate::python::empty;
use crate::readme::fenced_lines;
use crate::workspace::Workspace;

const FOLDER: &str = "docs";
const CONTENTS: &str = "docs/SUMMARY.md";

/// A command of a page, and the exit status that stands behind it, else 0.
#[derive(Debug, PartialEq, Eq)]
struct Step {
    command: String,
    status: i32,
}

/// Runs the commands of all pages, each page in an empty folder, and builds the book.
pub(crate) fn run_book(workspace: &Workspace) -> Result<(), String> {
    let contents = read(&workspace.root.join(CONTENTS))?;
    let pages = pages(&contents);
    let files = workspace.files()?;
    let named: BTreeSet<String> = pages.iter().map(|page| format!("{FOLDER}/{page}")).collect();
    let is_page = |f: &&String| f.starts_with("docs/") && f.ends_with(".md") && f.as_str() != CONTENTS;
    if let Some(file) = files.iter().filter(is_page).find(|f| !named.contains(*f)) {
        return Err(format!("{file} is not in {CONTENTS}"));
    }
    run(&mut cargo(&workspace.root, ["build", "--release", "--locked", "-p", "apsides-cli"]))?;
    let folder = workspace.target.join("book-commands");
    let mut count = 0;
    for page in &pages {
        let steps = steps(&read(&workspace.root.join(FOLDER).join(page))?);
        if steps.is_empty() {
            continue;
        }
        empty(&folder)?;
        let start = Instant::now();
        for step in &steps {
            perform(workspace, &folder, page, step)?;
        }
        count += steps.len();
        println!("{FOLDER}/{page}: {} commands, {:.1} s", steps.len(), start.elapsed().as_secs_f64());
    }
    println!("{count} commands of {} pages do what is said of them", pages.len());
    if !succeeds(Command::new("mdbook").arg("--version")) {
        println!(
            "the book itself was not built: mdbook is not installed (`cargo install --locked mdbook` gets it)"
        );
        return Ok(());
    }
    book_site::build(workspace, FOLDER)
}

/// Runs one command with the program that was built, and holds its status against the page.
fn perform(workspace: &Workspace, folder: &Path, page: &str, step: &Step) -> Result<(), String> {
    let mut words = words(&step.command).into_iter();
    match words.next().as_deref() {
        Some("apsides") => {}
        _ => return Err(format!("{FOLDER}/{page}: `{}` does not run apsides", step.command)),
    }
    let program = workspace.target.join("release").join(format!("apsides{}", std::env::consts::EXE_SUFFIX));
    let output = Command::new(program)
        .current_dir(folder)
        .args(words)
        .output()
        .map_err(|e| format!("{FOLDER}/{page}: `{}`: {e}", step.command))?;
    if output.status.code() == Some(step.status) {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().last().unwrap_or_default();
    Err(format!(
        "{FOLDER}/{page}: `{}` ends with {}, not with status {}: {last}",
        step.command, output.status, step.status
    ))
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// The pages that the table of contents links.
fn pages(contents: &str) -> Vec<String> {
    let links = contents.split("](").skip(1);
    links
        .filter_map(|rest| rest.split(')').next())
        .filter(|l| l.ends_with(".md"))
        .map(str::to_owned)
        .collect()
}

/// The lines of the blocks marked `sh`, in order; `# status N` behind three spaces is the status.
fn steps(page: &str) -> Vec<Step> {
    let lines = fenced_lines(page, |language| language == "sh");
    let step = |line: &str| {
        let (command, note) = line.split_once("   # ").unwrap_or((line, ""));
        let status = note.strip_prefix("status ").and_then(|n| n.trim().parse().ok()).unwrap_or(0);
        Step { command: command.trim().to_owned(), status }
    };
    lines.filter(|line| !line.is_empty()).map(step).collect()
}

/// Words of a command; single quotes hold one together.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in command.chars() {
        match c {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            _ => {
                if let Some(word) = words.last_mut() {
                    word.push(c);
                }
            }
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_come_from_marked_blocks_with_their_status() {
        let page = "```sh\napsides missions\napsides solve x   # status 3\n```\n```console\napsides footprint y\n```\n";
        let step = |command: &str, status| Step { command: command.into(), status };
        assert_eq!(steps(page), [step("apsides missions", 0), step("apsides solve x", 3)]);
    }

    #[test]
    fn quotes_hold_words_together() {
        assert_eq!(
            words("apsides solve x --set 'epoch=2027-03-01T06:00:00 UTC'")[4],
            "epoch=2027-03-01T06:00:00 UTC"
        );
    }

    #[test]
    fn pages_are_those_that_are_linked() {
        assert_eq!(pages("[A](a.md)\n- [B](methods/b.md)\n- [C](https://x.org)"), ["a.md", "methods/b.md"]);
    }
}
