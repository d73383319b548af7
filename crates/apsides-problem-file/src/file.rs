//! Problems in TOML files.

use crate::error::ProblemError;
use crate::place::{Source, StatedIn};
use crate::read;
use crate::reader::Files;
use crate::statement::Statement;

/// A problem that was read from a file: its statement, and the text.
#[derive(Clone, Debug)]
pub struct ProblemFile {
    statement: Statement,
}

impl ProblemFile {
    /// Reads a problem. `source` names the text in messages, `files` reads the CSV files that it names, and `others` are the first words of
    /// keys that belong to somebody else, such as the settings of methods.
    ///
    /// # Errors
    /// The first mistake with its place; all that is missing at once.
    pub fn parse(
        text: &str,
        source: &str,
        files: &dyn Fn(&str) -> std::io::Result<String>,
        others: &[&str],
    ) -> Result<Self, ProblemError> {
        let source = Source { name: source.to_owned(), stated: StatedIn::Text(text.to_owned()) };
        let files: &Files<'_> = files;
        let (model, texts) = read::read(&source, files, others)?;
        Ok(Self { statement: Statement::checked(source, texts, model)? })
    }

    /// The problem that the file states.
    #[must_use]
    pub fn statement(&self) -> &Statement {
        &self.statement
    }

    /// The text of the file.
    #[must_use]
    pub fn text(&self) -> &str {
        self.statement.source.text()
    }

    /// The texts of the CSV files that tables were read from, each with the name of its table.
    pub fn csv_tables(&self) -> impl Iterator<Item = (&str, &str)> {
        let tables = self.statement.model.tables.iter();
        tables.filter_map(|t| Some((t.name.as_str(), t.csv.as_deref()?)))
    }
}
