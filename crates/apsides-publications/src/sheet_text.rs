//! Tables of any columns as text for terminals and Markdown, as records, and their figures.

use std::fmt::Write as _;

use apsides_pipeline::unit_ending::quantity_label;
use apsides_report::{Axis, Figure, Series, with_scale};

use crate::sheet::{Column, Graph, GraphSeries, Sheet};

/// Widest line of a column's head in a terminal.
const HEAD_WIDTH: usize = 12;
/// Least width of a column of numbers.
const LEAST_WIDTH: usize = 6;

/// Heads of the data file of sheets.
pub(crate) const DATA_HEADS: [&str; 4] = ["table", "row", "quantity", "value"];

/// One line per row, under heads of several lines; then what is to be said.
#[must_use]
pub fn sheet_text(sheet: &Sheet) -> String {
    let heads: Vec<Vec<String>> = sheet.columns.iter().map(|c| wrapped(&quantity_label(c.key))).collect();
    let rows: Vec<Vec<String>> = (0..sheet.rows.len()).map(|k| cells(sheet, k)).collect();
    let widths: Vec<usize> = (heads.iter().enumerate())
        .map(|(c, head)| {
            let cells = rows.iter().map(|r| r[c].len());
            head.iter().map(String::len).chain(cells).fold(LEAST_WIDTH, usize::max)
        })
        .collect();
    let first = sheet.rows.iter().map(|r| r.label.len()).fold(sheet.heading.len(), usize::max);
    let mut text = format!("\n{}\n\n", sheet.title);
    let mut line = |label: &str, cells: &mut dyn Iterator<Item = &str>| {
        let mut line = format!("  {label:<first$}");
        for (cell, width) in cells.zip(&widths) {
            let _ = write!(line, "  {cell:>width$}");
        }
        text += line.trim_end();
        text.push('\n');
    };
    let height = heads.iter().map(Vec::len).max().unwrap_or(0);
    for k in 0..height {
        // Heads stand on the line above the numbers.
        let of = |head: &Vec<String>| {
            (k + head.len()).checked_sub(height).map_or("", |i| head[i].as_str()).to_owned()
        };
        let cells: Vec<String> = heads.iter().map(of).collect();
        line(if k + 1 == height { sheet.heading } else { "" }, &mut cells.iter().map(String::as_str));
    }
    for (row, cells) in sheet.rows.iter().zip(&rows) {
        line(&row.label, &mut cells.iter().map(String::as_str));
    }
    for sentence in sentences(sheet) {
        let _ = writeln!(text, "  * {sentence}");
    }
    if sheet.seconds > 0.0 {
        let _ = writeln!(text, "  ({}, {:.1} s)", sheet.id, sheet.seconds);
    }
    text
}

pub(crate) fn sheet_markdown(sheet: &Sheet) -> String {
    let mut text = format!("\n## {}\n\n", sheet.title);
    let heads: Vec<String> = sheet.columns.iter().map(|c| quantity_label(c.key)).collect();
    let _ = writeln!(text, "| {} | {} |", sheet.heading, heads.join(" | "));
    let _ = writeln!(text, "| --- |{}", " --: |".repeat(heads.len()));
    for (k, row) in sheet.rows.iter().enumerate() {
        let _ = writeln!(text, "| {} | {} |", row.label, cells(sheet, k).join(" | "));
    }
    let mut gap = "\n";
    for sentence in sentences(sheet) {
        let _ = writeln!(text, "{gap}* {sentence}");
        gap = "";
    }
    for graph in &sheet.graphs {
        let legend = figure(graph).legend();
        let _ = writeln!(text, "\n![{}]({})\n\n{}: {legend}.", graph.title, graph.file, graph.title);
    }
    text
}

/// One record per number.
pub(crate) fn records(sheet: &Sheet) -> impl Iterator<Item = [String; 4]> + '_ {
    sheet.rows.iter().flat_map(move |row| {
        let value = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:?}"));
        (sheet.columns.iter().zip(&row.values))
            .map(move |(c, v)| [sheet.id.to_owned(), row.label.clone(), c.key.to_owned(), value(*v)])
    })
}

pub(crate) fn figure(graph: &Graph) -> Figure {
    let axis = |(name, unit): (&str, &str)| Axis::new(name, unit);
    let mut figure = Figure::new(graph.title.clone(), axis(graph.x), axis(graph.y));
    let drawn = |s: &&GraphSeries| !(s.line.is_empty() && s.dots.is_empty());
    for (k, s) in graph.series.iter().enumerate().filter(|(_, s)| drawn(s)) {
        figure = figure
            .with(Series::line(s.label.clone(), s.line.clone()).colored(k))
            .with(Series::dots("", s.dots.clone()).colored(k));
    }
    with_scale(figure)
}

/// Numbers of a row as text, `-` for what is missing.
pub(crate) fn cells(sheet: &Sheet, row: usize) -> Vec<String> {
    (sheet.columns.iter().zip(&sheet.rows[row].values))
        .map(|(c, value)| value.map_or_else(|| "-".into(), |v| shown(*c, v)))
        .collect()
}

/// A value of a column: a number, or yes or no.
fn shown(column: Column, value: f64) -> String {
    match (column.is_flag, value == 0.0) {
        (false, _) => rounded(value, column.decimals),
        (true, true) => "no".into(),
        (true, false) => "yes".into(),
    }
}

/// A number with so many decimals; what rounds to zero has no sign.
fn rounded(v: f64, decimals: usize) -> String {
    let text = format!("{v:.decimals$}");
    let is_zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

pub(crate) fn sentences(sheet: &Sheet) -> impl Iterator<Item = String> + '_ {
    let failures = sheet.failures.iter().map(|f| format!("not solved: {f}"));
    let unverified = sheet.unverified.iter().map(|u| format!("not verified: {u}"));
    sheet.findings.iter().cloned().chain(failures).chain(unverified)
}

/// Words in lines that are not wider than the longest word or [`HEAD_WIDTH`].
fn wrapped(label: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in label.split(' ') {
        match lines.last_mut() {
            Some(last) if last.len() + word.len() < HEAD_WIDTH => {
                last.push(' ');
                last.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::{rounded, shown};
    use crate::sheet::Column;

    #[test]
    fn flags_are_words() {
        let flag = Column { key: "printed_is_reproduced", decimals: 0, is_flag: true };
        assert_eq!([0.0, 1.0].map(|v| shown(flag, v)), ["no", "yes"]);
        assert_eq!(shown(Column { is_flag: false, ..flag }, 1.0), "1");
    }

    #[test]
    fn what_rounds_to_zero_has_no_sign() {
        for (v, decimals, text) in [
            (-4e-7, 6, "0.000000"),
            (-0.0, 0, "0"),
            (-6e-7, 6, "-0.000001"),
            (-3.24, 1, "-3.2"),
            (f64::NAN, 2, "NaN"),
        ] {
            assert_eq!(rounded(v, decimals), text);
        }
    }
}
