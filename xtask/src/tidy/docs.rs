//! Rules for documentation comments.

use crate::finding::Finding;

/// First words of a clause that leans on the name of the item: such a comment is no sentence.
const FRAGMENTS: &[&str] = &["What", "Whether", "Of", "How", "Why", "Which"];

/// Comments of a Rust file that begin in the middle of a sentence.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
    fragments(text)
        .map(|(line, word)| {
            let message = format!("a comment that begins with \"{word}\": write a whole sentence");
            Finding::at(path, line, message)
        })
        .collect()
}

/// Lines that begin a documentation comment or a paragraph of it with a fragment, from one, with its first word.
fn fragments(text: &str) -> impl Iterator<Item = (usize, &'static str)> {
    let mut begins = true;
    text.lines().enumerate().filter_map(move |(k, line)| {
        let comment = comment(line);
        let first = std::mem::replace(&mut begins, comment.is_none_or(str::is_empty));
        let word = comment?.split([' ', ',', ':']).next()?;
        FRAGMENTS.iter().find(|f| first && **f == word).map(|f| (k + 1, *f))
    })
}

/// The text of a line of documentation.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix("///").or_else(|| line.strip_prefix("//!")).map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fragments_are_found_where_a_comment_begins() {
        let text = "//! What a thing is.\n\n/// A sentence.\n/// What follows goes on.\n///\n/// Of a new paragraph.\nfn f();\n    /// Whether so.\n/// Offset.\n// Of code.\n";
        assert_eq!(fragments(text).collect::<Vec<_>>(), [(1, "What"), (6, "Of"), (8, "Whether")]);
    }
}
