//! Places in a file: line, column and the line itself with a caret.

use std::fmt;
use std::ops::Range;

/// Characters of a line that a message shows.
const WIDEST: usize = 100;

/// The text of a file with its name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Source {
    pub(crate) name: String,
    pub(crate) text: String,
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Name of the file.
    pub source: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The part of the line that is shown, the column of its first character less one, and the number of carets.
    shown: (String, usize, usize),
}

impl Source {
    /// The place of some bytes.
    pub(crate) fn place(&self, bytes: &Range<usize>) -> Box<Place> {
        let text = &self.text;
        let floor = |mut at: usize| {
            at = at.min(text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let (start, end) = (floor(bytes.start), floor(bytes.end));
        let first = text[..start].rfind('\n').map_or(0, |k| k + 1);
        let last = text[start..].find('\n').map_or(text.len(), |k| start + k);
        let column = text[first..start].chars().count();
        let length = text[start..end.clamp(start, last)].chars().count();
        // A long line is cut around the place.
        let skipped = if column > WIDEST { column - WIDEST / 2 } else { 0 };
        let part: String = text[first..last].chars().skip(skipped).take(WIDEST).collect();
        let carets = length.clamp(1, (WIDEST + skipped).saturating_sub(column).max(1));
        Box::new(Place {
            source: self.name.clone(),
            line: text[..start].matches('\n').count() + 1,
            column: column + 1,
            shown: (part.trim_end().to_owned(), skipped, carets),
        })
    }
}

impl Place {
    /// The line with carets under the place, with a line break before it.
    #[must_use]
    pub fn caret(&self) -> String {
        let (part, skipped, carets) = &self.shown;
        let indent = " ".repeat(self.line.to_string().len());
        let before = " ".repeat(self.column - 1 - skipped);
        // A tab moves the carets as far as the text.
        format!(
            "\n  {} | {}\n  {indent} | {before}{}",
            self.line,
            part.replace('\t', " "),
            "^".repeat(*carets)
        )
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, line {}, column {}", self.source, self.line, self.column)
    }
}
