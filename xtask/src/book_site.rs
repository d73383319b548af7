//! The book as pages for a browser: a copy of `docs` whose links to other files of the repository lead to its home, made by mdbook, and its links.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::run;
use crate::python::empty;
use crate::tidy::text::{outside_fences, resolve, targets};
use crate::workspace::Workspace;

/// Page of mdbook for addresses that are none: its links count from the root of a server.
const NOWHERE: &str = "404.html";

/// Builds the book of the pages in `folder` and follows its links.
pub(crate) fn build(workspace: &Workspace, folder: &str) -> Result<(), String> {
    let home = workspace.packages.first().map_or("", |package| &package.repository);
    let (source, book) = (workspace.target.join("book-pages"), workspace.target.join("book"));
    empty(&source)?;
    empty(&book)?;
    for file in workspace.files()?.iter().filter(|f| f.starts_with(&format!("{folder}/"))) {
        let (from, to) = (workspace.root.join(file), source.join(&file[folder.len() + 1..]));
        let fail = |e: std::io::Error| format!("{}: {e}", from.display());
        fs::create_dir_all(to.parent().unwrap_or(&source)).map_err(fail)?;
        if file.ends_with(".md") {
            let text = fs::read_to_string(&from).map_err(fail)?;
            let is_folder = |path: &str| workspace.root.join(path).is_dir();
            fs::write(to, with_home(file, &text, folder, home, is_folder)).map_err(fail)?;
        } else {
            fs::copy(&from, to).map_err(fail)?;
        }
    }
    run(Command::new("mdbook").arg("build").arg(&source).arg("--dest-dir").arg(&book))?;
    let (pages, broken) = follow(&book)?;
    if let Some(first) = broken.first() {
        return Err(format!("{} links of the book lead nowhere, the first: {first}", broken.len()));
    }
    println!("{}: {pages} pages, every link of theirs leads somewhere", book.display());
    Ok(())
}

/// A page whose links out of `folder` are those of the repository at `home`.
fn with_home(page: &str, text: &str, folder: &str, home: &str, is_folder: impl Fn(&str) -> bool) -> String {
    let own = page.rsplit_once('/').map_or("", |(own, _)| own);
    let mut fence = outside_fences();
    let line = |line: &str| {
        let mut shown = line.to_owned();
        if !fence(line) {
            return shown;
        }
        for target in targets(line) {
            let (file, place) = target.split_once('#').unwrap_or((target, ""));
            let Some(path) = resolve(own, file).filter(|_| !file.is_empty() && !file.contains(':')) else {
                continue;
            };
            if path.starts_with(&format!("{folder}/")) {
                continue;
            }
            let kind = if is_folder(&path) { "tree" } else { "blob" };
            let place = if place.is_empty() { String::new() } else { format!("#{place}") };
            let there = format!("]({home}/{kind}/main/{path}{place})");
            shown = shown.replace(&format!("]({target})"), &there);
        }
        shown
    };
    text.split_inclusive('\n').map(line).collect()
}

/// The number of pages of a book, and the links of theirs that lead to no file, or to no place of it.
fn follow(book: &Path) -> Result<(usize, Vec<String>), String> {
    let mut pages = Vec::new();
    html_files(book, &mut pages)?;
    let (mut broken, mut texts) = (Vec::new(), Vec::new());
    for page in &pages {
        let text = fs::read_to_string(page).map_err(|e| format!("{}: {e}", page.display()))?;
        texts.push((page.clone(), text));
    }
    for (page, text) in texts.iter().filter(|(page, _)| !page.ends_with(NOWHERE)) {
        for link in ["href=\"", "src=\""].iter().flat_map(|a| text.split(a).skip(1)) {
            let link = link.split('"').next().unwrap_or_default();
            let (file, place) = link.split_once('#').unwrap_or((link, ""));
            let elsewhere = file.contains(':') || link.is_empty();
            if elsewhere || leads(page, file, place, &texts) {
                continue;
            }
            let name = page.strip_prefix(book).unwrap_or(page).display();
            broken.push(format!("{name}: {link}"));
        }
    }
    Ok((pages.len(), broken))
}

fn leads(page: &Path, file: &str, place: &str, texts: &[(PathBuf, String)]) -> bool {
    let file = file.split('?').next().unwrap_or_default();
    let to = if file.is_empty() { page.to_owned() } else { page.parent().unwrap_or(page).join(file) };
    let Ok(to) = to.canonicalize() else { return false };
    let is_there = |text: &str| text.contains(&format!("id=\"{place}\""));
    let known = texts.iter().find(|(known, _)| known.canonicalize().is_ok_and(|known| known == to));
    place.is_empty() || known.is_none_or(|(_, text)| is_there(text))
}

fn html_files(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), String> {
    let fail = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).map_err(fail)?.flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            html_files(&path, found)?;
        } else if path.extension().is_some_and(|e| e == "html") {
            found.push(path);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_out_of_the_book_lead_to_the_repository() {
        let page = "[a](b.md#c), [d](../../python/README.md#e) and [f](../../crates/g)\n```\n[h](../../i.md)\n```\n[j](https://k.org) [l](#m)\n";
        let shown = with_home("docs/methods/x.md", page, "docs", "https://home", |path| path == "crates/g");
        let expected = "[a](b.md#c), [d](https://home/blob/main/python/README.md#e) and [f](https://home/tree/main/crates/g)\n```\n[h](../../i.md)\n```\n[j](https://k.org) [l](#m)\n";
        assert_eq!(shown, expected);
    }

    #[test]
    fn links_of_pages_are_followed() {
        let book = std::env::temp_dir().join(format!("book-{}", std::process::id()));
        empty(&book.join("methods")).unwrap();
        let page = |name: &str, text: &str| fs::write(book.join(name), text).unwrap();
        page(
            "a.html",
            "<a href=\"methods/b.html#there\"></a><a href=\"https://x.org/y\"></a><h1 id=\"top\"></h1>",
        );
        page(
            "methods/b.html",
            "<p id=\"there\"></p><a href=\"../a.html#top\"></a><img src=\"../none.svg\"><a href=\"#nowhere\">",
        );
        page("404.html", "<a href=\"/root.html\">");
        let (pages, broken) = follow(&book).unwrap();
        assert_eq!(
            (pages, &broken[..]),
            (3, &["methods/b.html: #nowhere".to_owned(), "methods/b.html: ../none.svg".to_owned()][..])
        );
        fs::remove_dir_all(&book).unwrap();
    }
}
