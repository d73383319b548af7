//! Published tables computed again: each part on stdout as it is done.

use apsides::pipeline::unit_ending::quantity_label;
use apsides_publications::{
    COMPARISON_HEADS, Comparison, Part, Reproduction, Row, Sheet, SheetRow, Table, comparison_columns,
    foreseen_memory, items_markdown, list, miss_sentence, parts as count, reproduce as compute, sheet_text,
    write_reproduction,
};
use serde_json::{Map, Value, json};

use crate::arguments::ReproduceArguments;
use crate::commands::KeptWork;
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, print_json, print_words, titles, written};
use crate::progress::Progress;
use crate::speech::{is_json, is_verbose};

pub(crate) fn reproduce(a: &ReproduceArguments) -> Result<Exit, Refusal> {
    if a.items {
        if is_json() {
            print_json(&json!({ "items": items_markdown() }))?;
        } else {
            print(&items_markdown());
        }
        return Ok(Exit::Verified);
    }
    let Some(name) = &a.name else {
        if is_json() {
            let listed = list().map(|(name, title)| json!({ "name": name, "title": title }));
            print_json(&listed.collect::<Vec<_>>())?;
        } else {
            print_words(&titles(list()));
        }
        return Ok(Exit::Verified);
    };
    let parts = count(name).map_err(refusal)?;
    foreseen_memory(name, a.run.threads.count()).and_then(|f| f.within(a.run.memory())).map_err(refusal)?;
    let kept = KeptWork::open(a.out.as_deref())?;
    let stop = a.run.limit.stop();
    let mut progress = Progress::line(stop, parts as u64);
    let ticker = progress.clone();
    let done = compute(name, a.run.threads.count(), &mut progress, |part| {
        if !is_json() {
            ticker.above(&match part {
                Part::Row(table) => newest_row(table),
                Part::Sheet(sheet) => sheet_text(sheet),
            });
        }
        ticker.step();
        !stop.is_set()
    })
    .map_err(refusal)?;
    progress.finish();
    let files = a.out.as_deref().map(|dir| write_reproduction(dir, &done)).transpose()?;
    if is_json() {
        print_json(&object(&done))?;
    } else {
        print("\nmisprints and inconsistencies of the text\n");
        for remark in &done.remarks {
            print_words(&format!("  * {remark}\n"));
        }
        if !done.complete {
            print("\ninterrupted: rows are missing\n");
        }
        print(&files.as_deref().map(written).unwrap_or_default());
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

/// The computed tables as data.
fn object(done: &Reproduction) -> Value {
    let quantity = |q: &Comparison| {
        let heads = COMPARISON_HEADS.into_iter().map(str::to_owned);
        let values = heads.zip(comparison_columns(q).map(|cell| match cell.parse::<f64>() {
            Ok(number) => json!(number),
            Err(_) => Value::Null,
        }));
        let findings: Vec<&str> = q.findings.iter().map(|f| f.text.as_str()).collect();
        json!({ "key": q.key, "values": values.collect::<Map<_, _>>(), "findings": findings })
    };
    let row = |row: &Row| {
        json!({
            "parameter": row.parameter,
            "solved": row.solved,
            "verified": row.verified,
            "quantities": row.quantities.iter().map(quantity).collect::<Vec<_>>(),
        })
    };
    let table = |table: &Table| {
        json!({
            "title": table.title,
            "parameter": table.parameter,
            "rows": table.rows.iter().map(row).collect::<Vec<_>>(),
        })
    };
    let sheet = |sheet: &Sheet| {
        let row = |row: &SheetRow| {
            let heads = sheet.columns.iter().map(|column| column.key.to_owned());
            let cells: Map<_, _> = heads.zip(row.values.iter().map(|value| json!(value))).collect();
            json!({ "label": row.label, "values": cells })
        };
        json!({
            "title": sheet.title,
            "rows": sheet.rows.iter().map(row).collect::<Vec<_>>(),
            "failures": sheet.failures,
            "unverified": sheet.unverified,
        })
    };
    json!({
        "publication": done.name,
        "title": done.title,
        "complete": done.complete,
        "tables": done.tables.iter().map(table).collect::<Vec<_>>(),
        "sheets": done.sheets.iter().map(sheet).collect::<Vec<_>>(),
        "remarks": done.remarks,
    })
}

/// Widths of a name and of a cell: four cells fit a terminal.
const QUANTITY_WIDTH: usize = 24;
const WIDTH: usize = 12;
/// Cells that are shown without `--verbose`: the values; their differences stand behind them.
const VALUES: usize = 4;

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
    let shown = if is_verbose() { columns.len() } else { VALUES };
    let columns: String = columns.iter().take(shown).map(|c| format!(" {c:>WIDTH$}")).collect();
    format!("  {name:<QUANTITY_WIDTH$}{columns}\n")
}
