//! Published tables computed again, as text for readers, data and figures.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use apsides_pipeline::unit_ending::{name_of, quantity_label, unit_of};
use apsides_report::{Axis, Figure, Item, ReportError, Series, replace, stacked_svg, table_error};

use crate::sheet_text::{self as sheet, sheet_markdown};
use crate::{Comparison, Miss, Reproduction, Row, Table, find};

mod page;

const MARKDOWN: &str = "reproduction.md";
const PAGE: &str = "reproduction.html";
const DATA: &str = "reproduction.csv";
/// Numbers of sheets beside those of tables.
const SHEETS: &str = "sheets.csv";
/// Heads of the columns of [`comparison_columns`].
pub const COMPARISON_HEADS: [&str; 7] =
    ["paper", "paper's NLP", "flatness", "Radau", "paper - Radau", "NLP - Radau", "flatness - Radau"];

/// A comparison as text: the printed value, the computed ones to 1e-6, the differences to the optimum; `-` for what is missing.
#[must_use]
pub fn comparison_columns(c: &Comparison) -> [String; 7] {
    let text = |v: Option<f64>, show: fn(f64) -> String| v.map_or_else(|| "-".into(), show);
    let computed = |v: Option<f64>| text(v, |v| format!("{v:.6}"));
    let difference = |v: Option<f64>| text(v, |v| format!("{v:+.4}"));
    [
        format!("{:.3}", c.paper),
        computed(c.paper_nlp),
        computed(c.flatness),
        computed(c.radau),
        difference(c.paper_difference()),
        difference(c.paper_nlp_difference()),
        text(c.flatness_difference(), |v| format!("{v:+.0e}")),
    ]
}

/// Where the paper's nonlinear program leads when it is flown, in words.
#[must_use]
pub fn miss_sentence(row: &Row) -> String {
    let size = row.size.map_or(String::new(), |(n, m)| format!(" ({n} variables, {m} constraints)"));
    match row.miss {
        Some(Miss { radius_m, horizontal_speed_m_s, radial_speed_m_s }) => format!(
            "the paper's NLP{size}, flown again, misses by {radius_m:+.1} m, {horizontal_speed_m_s:+.2} m/s horizontally, \
             {radial_speed_m_s:+.2} m/s radially"
        ),
        None => "the paper's NLP does not converge".into(),
    }
}

/// Writes `reproduction.html`, `reproduction.md`, `reproduction.csv`, the figures of all tables and sheets, and the mission files of the publication
/// into a directory, and returns the paths written. The page has all but the numbers of the data files inside.
///
/// The directory and its parents are made when missing. Files of an earlier reproduction are replaced, all or none.
///
/// # Errors
/// [`ReportError`] with the path and the reason.
pub fn write_reproduction(dir: &Path, done: &Reproduction) -> Result<Vec<PathBuf>, ReportError> {
    let missions = mission_files(done.name);
    let mut items: Vec<Item> = vec![
        (MARKDOWN, Some(markdown(done).into_bytes())),
        (PAGE, Some(page::html(done, &missions).into_bytes())),
        (DATA, Some(data(done)?)),
    ];
    let both = !done.tables.is_empty() && !done.sheets.is_empty();
    items.push((SHEETS, both.then(|| sheet_data(done)).transpose()?));
    items.extend(missions.iter().map(|(file, text)| (*file, Some(text.as_bytes().to_vec()))));
    for table in &done.tables {
        let drawn = (!table.rows.is_empty()).then(|| stacked_svg(&[figure(table)]).into_bytes());
        items.push((table.figure, drawn));
    }
    for graph in done.sheets.iter().flat_map(|s| &s.graphs) {
        items.push((graph.file, Some(stacked_svg(&[sheet::figure(graph)]).into_bytes())));
    }
    replace(dir, &items)
}

/// Flight times less the optimum, as printed and by the paper's own nonlinear program.
fn figure(table: &Table) -> Figure {
    let key = table.rows.first().and_then(|row| row.quantities.first()).map_or("", |q| q.key);
    let points = |of: fn(&Comparison) -> Option<f64>| {
        let point = |row: &Row| Some([row.parameter, of(row.quantities.first()?)?]);
        table.rows.iter().filter_map(point).collect::<Vec<_>>()
    };
    let x = Axis::new(name_of(table.parameter).replace('_', " "), unit_of(table.parameter));
    let y = Axis::new(format!("{} less the optimum", name_of(key).replace('_', " ")), unit_of(key));
    Figure::new(table.title, x, y.including(0.0))
        .with(Series::dots("paper", points(Comparison::paper_difference)))
        .with(Series::dots("paper's NLP", points(Comparison::paper_nlp_difference)))
        .horizontal("optimum", 0.0)
}

fn markdown(done: &Reproduction) -> String {
    let mut text = format!("# {}\n\nSource of the printed values: {}.\n\n", done.title, done.source);
    if !done.tables.is_empty() {
        text += "* paper's NLP: its own nonlinear program; its misses are those of its controls, flown again\n\
             * flatness: refined until the splines meet the equations of motion between the points\n\
             * Radau: collocation with mesh refinement; its solution is the optimum of the differences\n";
    }
    if !done.complete {
        text += "\nInterrupted: rows are missing.\n";
    }
    for table in done.tables.iter().filter(|t| !t.rows.is_empty()) {
        text += &table_markdown(table);
    }
    for sheet in &done.sheets {
        text += &sheet_markdown(sheet);
    }
    if !done.remarks.is_empty() {
        text += "\n## Misprints and inconsistencies of the text\n\n";
        for remark in &done.remarks {
            let _ = writeln!(text, "* {remark}");
        }
    }
    text
}

fn table_markdown(table: &Table) -> String {
    let mut text = format!("\n## {}\n\n", table.title);
    let _ = writeln!(text, "![Time less the optimum: paper in blue, its NLP in orange]({})\n", table.figure);
    let heads = COMPARISON_HEADS.join(" | ");
    let _ = writeln!(
        text,
        "| {} | quantity | {heads} | miss of the NLP: m, m/s horizontal, m/s radial | findings |",
        quantity_label(table.parameter)
    );
    let _ = writeln!(text, "| --: | --- |{} --: | --- |", " --: |".repeat(COMPARISON_HEADS.len()));
    for row in &table.rows {
        for (k, q) in row.quantities.iter().enumerate() {
            let miss = row.miss.filter(|_| k == 0).map_or(String::new(), |m| {
                let Miss { radius_m, horizontal_speed_m_s, radial_speed_m_s } = m;
                format!("{radius_m:+.1}, {horizontal_speed_m_s:+.2}, {radial_speed_m_s:+.2}")
            });
            let _ = writeln!(
                text,
                "| {} | {} | {} | {miss} | {} |",
                row.parameter,
                quantity_label(q.key),
                comparison_columns(q).join(" | "),
                findings(q)
            );
        }
    }
    for (k, remark) in table.remarks.iter().enumerate() {
        let _ = writeln!(text, "{}* {remark}", if k == 0 { "\n" } else { "" });
    }
    text
}

fn findings(q: &Comparison) -> String {
    q.findings.iter().map(|f| f.text.as_str()).collect::<Vec<_>>().join("; ")
}

/// One record per row and quantity.
fn data(done: &Reproduction) -> Result<Vec<u8>, ReportError> {
    if done.tables.is_empty() {
        return sheet_data(done);
    }
    let failed = |e: csv::Error| table_error(DATA, e);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = [
        "table",
        "parameter",
        "value",
        "quantity",
        "paper",
        "paper_nlp",
        "flatness",
        "radau",
        "paper_difference",
        "paper_nlp_difference",
        "flatness_difference",
        "miss_radius_m",
        "miss_horizontal_speed_m_s",
        "miss_radial_speed_m_s",
        "variables",
        "constraints",
        "verified",
        "findings",
    ];
    writer.write_record(head).map_err(failed)?;
    let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:?}"));
    for table in &done.tables {
        for (row, q) in table.rows.iter().flat_map(|row| row.quantities.iter().map(move |q| (row, q))) {
            let record = [
                table.id.to_owned(),
                table.parameter.to_owned(),
                format!("{:?}", row.parameter),
                q.key.to_owned(),
                format!("{:?}", q.paper),
                number(q.paper_nlp),
                number(q.flatness),
                number(q.radau),
                number(q.paper_difference()),
                number(q.paper_nlp_difference()),
                number(q.flatness_difference()),
                number(row.miss.map(|m| m.radius_m)),
                number(row.miss.map(|m| m.horizontal_speed_m_s)),
                number(row.miss.map(|m| m.radial_speed_m_s)),
                row.size.map_or(String::new(), |(n, _)| n.to_string()),
                row.size.map_or(String::new(), |(_, m)| m.to_string()),
                row.verified.to_string(),
                findings(q),
            ];
            writer.write_record(record).map_err(failed)?;
        }
    }
    writer.into_inner().map_err(|e| table_error(DATA, e.into_error()))
}

/// One record per number of the sheets.
fn sheet_data(done: &Reproduction) -> Result<Vec<u8>, ReportError> {
    let failed = |e: csv::Error| table_error(SHEETS, e);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(sheet::DATA_HEADS).map_err(failed)?;
    for record in done.sheets.iter().flat_map(sheet::records) {
        writer.write_record(record).map_err(failed)?;
    }
    writer.into_inner().map_err(|e| table_error(SHEETS, e.into_error()))
}

/// The files of the missions of a publication with their texts.
fn mission_files(name: &str) -> Vec<(&'static str, &'static str)> {
    let registry = apsides_missions::registry();
    let files = find(name).map_or(&[][..], |publication| publication.missions);
    let text = |file: &&'static str| Some((*file, registry.text(file.strip_suffix(".toml")?)?));
    files.iter().filter_map(text).collect()
}

#[cfg(test)]
mod tests;
