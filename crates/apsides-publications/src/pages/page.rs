//! `reproduction.html`: everything on one page.

use apsides_pipeline::unit_ending::quantity_label;
use apsides_report::Page;

use super::{COMPARISON_HEADS, comparison_columns, figure, findings, miss_sentence};
use crate::sheet_text;
use crate::{Reproduction, Sheet, Table, find};

/// Tables, sheets, figures, verdicts, items, and the mission files (name and text) that stand beside the page.
pub(super) fn html<'a>(done: &Reproduction, missions: &[(&'a str, &str)]) -> String {
    let mut page = Page::new(done.title);
    page.lead(&format!("Source of the printed values: {}.", done.source));
    if !done.complete {
        page.lead("Interrupted: rows are missing.");
    }
    if !missions.is_empty() {
        page.heading("Missions to run");
        let registry = apsides_missions::registry();
        let run = |(file, text): &(&'a str, &str)| {
            let is_simulated = registry.parse(text, file, &[]).is_ok_and(|mission| mission.is_simulated());
            (*file, format!("apsides {} {file}", if is_simulated { "simulate" } else { "solve" }))
        };
        let links: Vec<(&str, String)> = missions.iter().map(run).collect();
        page.links(&links);
    }
    for table in done.tables.iter().filter(|t| !t.rows.is_empty()) {
        rows(&mut page, table);
    }
    for sheet in &done.sheets {
        of_sheet(&mut page, sheet);
    }
    let items = find(done.name).map_or(&[][..], |publication| publication.items);
    if !items.is_empty() {
        page.heading("Item by item");
        let row = |item: &crate::PaperItem| {
            let command = item.command(done.name).unwrap_or_else(|| "-".into());
            vec![item.item.to_owned(), command, item.verdict_by(&done.sheets)]
        };
        page.table(&["item", "command", "verdict"], &items.iter().map(row).collect::<Vec<_>>());
    }
    if !done.remarks.is_empty() {
        page.heading("Misprints and inconsistencies of the text");
        page.list(&done.remarks);
    }
    page.finish()
}

fn rows(page: &mut Page, table: &Table) {
    page.heading(table.title);
    let parameter = quantity_label(table.parameter);
    let heads: Vec<&str> =
        [parameter.as_str(), "quantity"].into_iter().chain(COMPARISON_HEADS).chain(["findings"]).collect();
    let mut cells = Vec::new();
    for row in &table.rows {
        for q in &row.quantities {
            let own = [row.parameter.to_string(), quantity_label(q.key)];
            cells.push(own.into_iter().chain(comparison_columns(q)).chain([findings(q)]).collect());
        }
    }
    page.table(&heads, &cells);
    page.list(table.remarks);
    page.list(
        table.rows.iter().map(|row| format!("{} {}: {}", parameter, row.parameter, miss_sentence(row))),
    );
    page.figures(&[figure(table)]);
}

fn of_sheet(page: &mut Page, sheet: &Sheet) {
    page.heading(&sheet.title);
    let labels: Vec<String> = sheet.columns.iter().map(|c| quantity_label(c.key)).collect();
    let heads: Vec<&str> = [sheet.heading].into_iter().chain(labels.iter().map(String::as_str)).collect();
    let cells: Vec<Vec<String>> = (sheet.rows.iter().enumerate())
        .map(|(k, row)| [row.label.clone()].into_iter().chain(sheet_text::cells(sheet, k)).collect())
        .collect();
    page.table(&heads, &cells);
    page.list(sheet_text::sentences(sheet));
    page.note(&format!("Sheet {}, computed in {:.1} s.", sheet.id, sheet.seconds));
    page.figures(&sheet.graphs.iter().map(sheet_text::figure).collect::<Vec<_>>());
}
