//! Published tables computed again: each part on stdout as it is done.

use apsides::pipeline::key::quantity_label;
use apsides_publications::{
    COMPARISON_HEADS, Part, Row, Sheet, Table, comparison_columns, foreseen_memory, items_markdown, list,
    miss_sentence, parts as count, reproduce as compute, sheet_text, write_reproduction,
};

use crate::arguments::ReproduceArguments;
use crate::commands::KeptWork;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, titles, written};
use crate::progress::Progress;

pub(crate) fn reproduce(a: &ReproduceArguments) -> Result<Exit, Refusal> {
    if a.items {
        print(&items_markdown());
        return Ok(Exit::Verified);
    }
    let Some(name) = &a.name else {
        print(&titles(list()));
        return Ok(Exit::Verified);
    };
    let parts = count(name).map_err(refusal)?;
    foreseen_memory(name, a.run.threads.count()).and_then(|f| f.within(a.run.memory())).map_err(refusal)?;
    let kept = KeptWork::open(a.out.as_deref())?;
    let stop = a.run.limit.stop();
    let mut progress = Progress::line(a.run.quiet, stop, parts as u64);
    let ticker = progress.clone();
    let done = compute(name, a.run.threads.count(), &mut progress, |part| {
        ticker.above(&match part {
            Part::Row(table) => newest_row(table),
            Part::Sheet(sheet) => sheet_text(sheet),
        });
        ticker.step();
        !stop.is_set()
    })
    .map_err(refusal)?;
    print("\nmisprints and inconsistencies of the text\n");
    for remark in &done.remarks {
        print(&format!("  * {remark}\n"));
    }
    if !done.complete {
        print("\ninterrupted: rows are missing\n");
    }
    if let Some(dir) = &a.out {
        print(&written(&write_reproduction(dir, &done)?));
    }
    let any = |test: fn(&Row) -> bool| done.tables.iter().flat_map(|t| &t.rows).any(test);
    let any_sheet = |test: fn(&Sheet) -> bool| done.sheets.iter().any(test);
    let exit = if !done.complete || any(|row| !row.solved) || any_sheet(|s| !s.failures.is_empty()) {
        Exit::NotSolved
    } else if any(|row| !row.verified) || any_sheet(|s| !s.unverified.is_empty()) {
        Exit::NotVerified
    } else {
        Exit::Verified
    };
    Ok(kept.settle(done.complete, exit))
}

const QUANTITY_WIDTH: usize = 30;
const WIDTH: usize = 16;

/// The last row of a table, with what stands above the first one.
fn newest_row(table: &Table) -> String {
    let mut text = String::new();
    if table.rows.len() == 1 {
        text += &format!("\n{}\n", table.title);
        for remark in table.remarks {
            text += &format!("  * {remark}\n");
        }
        text += &line("", COMPARISON_HEADS);
    }
    table.rows.last().map_or(text.clone(), |row| text + &of_row(table, row))
}

fn of_row(table: &Table, row: &Row) -> String {
    let mut text = format!("\n{}: {}\n", quantity_label(table.parameter), row.parameter);
    for q in &row.quantities {
        text += &line(&quantity_label(q.key), comparison_columns(q));
    }
    text += &format!("  {}\n", miss_sentence(row));
    for finding in row.quantities.iter().flat_map(|q| &q.findings) {
        text += &format!("  * {}\n", finding.text);
    }
    text
}

fn line(name: &str, columns: [impl std::fmt::Display; 7]) -> String {
    let columns: String = columns.iter().map(|c| format!(" {c:>WIDTH$}")).collect();
    format!("  {name:<QUANTITY_WIDTH$}{columns}\n")
}
