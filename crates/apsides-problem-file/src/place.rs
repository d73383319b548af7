//! Places in a file: line, column and the line itself with a caret.

use std::fmt;
use std::ops::Range;

/// Characters of a line that a message shows.
const WIDEST: usize = 100;

/// The file or the program that the parts of a problem are stated in.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Source {
    /// Name of the file or of the problem.
    pub(crate) name: String,
    pub(crate) stated: StatedIn,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum StatedIn {
    /// The text of a file.
    Text(String),
    /// Places in a program, by their index.
    Program(Vec<Place>),
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Name of the file.
    pub source: String,
    /// Line, from 1; 0 where it is not known.
    pub line: usize,
    /// Column in characters, from 1; 0 where it is the whole line.
    pub column: usize,
    /// The part of the line that is shown, the column of its first character less one, and the number of carets.
    shown: (String, usize, usize),
}

impl Source {
    /// The text; empty of a program.
    pub(crate) fn text(&self) -> &str {
        match &self.stated {
            StatedIn::Text(text) => text,
            StatedIn::Program(_) => "",
        }
    }

    /// The place of some bytes, or of the index of one.
    pub(crate) fn place(&self, bytes: &Range<usize>) -> Box<Place> {
        let text = match &self.stated {
            StatedIn::Text(text) => text,
            StatedIn::Program(places) => {
                let unknown = || Place::of_line(self.name.clone(), 0, "");
                return Box::new(places.get(bytes.start).cloned().unwrap_or_else(unknown));
            }
        };
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
    /// A line of a program, from 1, and its text; 0 where the line is not known.
    #[must_use]
    pub fn of_line(source: String, line: usize, text: &str) -> Self {
        let part = text.trim().chars().take(WIDEST).collect();
        Self { source, line, column: 0, shown: (part, 0, 0) }
    }

    /// The place in one line, with the line that it is in.
    #[must_use]
    pub fn with_line(&self) -> String {
        let (part, ..) = &self.shown;
        format!("{self}: `{}`", part.trim())
    }

    /// The line with carets under the place, with a line break before it.
    #[must_use]
    pub fn caret(&self) -> String {
        if self.column == 0 {
            let (part, ..) = &self.shown;
            return if part.is_empty() { String::new() } else { format!("\n  {} | {part}", self.line) };
        }
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
        match (self.line, self.column) {
            (0, _) => f.write_str(&self.source),
            (line, 0) => write!(f, "{}, line {line}", self.source),
            (line, column) => write!(f, "{}, line {line}, column {column}", self.source),
        }
    }
}
