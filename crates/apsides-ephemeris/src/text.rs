//! All columns as CSV and as JSON.

use serde_json::json;

use crate::EphemerisError;
use crate::table::Ephemeris;

/// Names of the files.
pub(crate) const CSV: &str = "ephemeris.csv";
pub(crate) const JSON: &str = "ephemeris.json";

/// The table as CSV: phase, instant, time, then every column. Numbers have the fewest digits that give the same number again.
pub(crate) fn csv(table: &Ephemeris) -> Result<Vec<u8>, EphemerisError> {
    let failed = |source: csv::Error| EphemerisError::Table { file: CSV, source: Box::new(source) };
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = ["phase".to_owned(), table.epoch_header(), "time_s".to_owned()];
    let headers = head.into_iter().chain(table.columns.iter().map(|(column, _)| column.header()));
    writer.write_record(headers).map_err(failed)?;
    for row in 0..table.times.len() {
        let shortest = |v: f64| if v.is_nan() { String::new() } else { format!("{v:?}") };
        let head =
            [table.phase_of(row).to_owned(), table.epoch_of(row).calendar(), shortest(table.times[row])];
        let values = table.columns.iter().map(|(_, values)| shortest(values[row]));
        writer.write_record(head.into_iter().chain(values)).map_err(failed)?;
    }
    let failed =
        |e: csv::IntoInnerError<_>| EphemerisError::Table { file: CSV, source: Box::new(e.into_error()) };
    writer.into_inner().map_err(failed)
}

/// The table as one JSON object; what a phase does not have is null.
pub(crate) fn json(table: &Ephemeris) -> Result<Vec<u8>, EphemerisError> {
    let phases = table
        .phases
        .iter()
        .map(|phase| json!({"name": phase.name, "first_row": phase.rows.start, "rows": phase.rows.len()}));
    let column =
        |name: String, unit: &str, values: &[f64]| json!({"name": name, "unit": unit, "values": values});
    let columns = std::iter::once(column("time_s".into(), "s", &table.times))
        .chain(table.columns.iter().map(|(c, values)| column(c.header(), &c.unit, values)));
    let object = json!({
        "mission": table.name,
        "epoch": table.epoch.calendar(),
        "time_scale": table.epoch.scale().word(),
        "body": table.body.map(|body| body.word()),
        "phases": phases.collect::<Vec<_>>(),
        "columns": columns.collect::<Vec<_>>(),
    });
    let failed = |source| EphemerisError::Table { file: JSON, source: Box::new(source) };
    let mut text = serde_json::to_vec(&object).map_err(failed)?;
    text.push(b'\n');
    Ok(text)
}
