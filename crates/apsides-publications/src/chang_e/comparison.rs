//! Rows of a printed value, one found here and one of the reference, with a verdict.

use apsides_report::measure;

use crate::sheet::Sheet;

/// A value with what it may differ by.
#[derive(Clone, Copy)]
pub(super) struct Known {
    pub(super) value: f64,
    pub(super) within: f64,
}

/// A value that the paper prints to its last digit, or the reference gives to its accuracy.
pub(super) fn to(value: f64, within: f64) -> Option<Known> {
    Some(Known { value, within })
}

/// One quantity; the unit ends the label.
pub(super) struct Compared<'a> {
    pub(super) label: &'a str,
    pub(super) printed: Option<Known>,
    pub(super) found: f64,
    pub(super) reference: Option<Known>,
    /// The reason for which the printed value is not found, if it is not.
    pub(super) why: String,
}

/// A row; `why` is empty where the printed value is found.
pub(super) fn row(
    label: &str,
    printed: Option<Known>,
    found: f64,
    reference: Option<Known>,
    why: impl Into<String>,
) -> Compared<'_> {
    Compared { label, printed, found, reference, why: why.into() }
}

const COLUMNS: &[(&str, usize)] = &[
    ("printed", 4),
    ("found", 5),
    ("reference", 5),
    ("printed_less_found", 4),
    ("found_less_reference", 5),
    ("printed_is_reproduced", 0),
    ("reference_is_reproduced", 0),
];

pub(super) fn sheet(id: &'static str, title: &str, rows: Vec<Compared<'_>>) -> Sheet {
    let any_printed = rows.iter().any(|r| r.printed.is_some());
    let shown = |key: &str| any_printed || !key.starts_with("printed");
    let columns: Vec<(&'static str, usize)> = COLUMNS.iter().copied().filter(|(key, _)| shown(key)).collect();
    let mut sheet = Sheet::new(id, title, "quantity", &columns)
        .with_flags(&["printed_is_reproduced", "reference_is_reproduced"]);
    for row in rows {
        let off = |k: Known| (k.value - row.found).abs();
        let holds = |k: Known| off(k) <= k.within;
        let flag = |k: Known| f64::from(u8::from(holds(k)));
        let values = [
            row.printed.map(|k| k.value),
            Some(row.found),
            row.reference.map(|k| k.value),
            row.printed.map(|k| k.value - row.found),
            row.reference.map(|k| row.found - k.value),
            row.printed.map(flag),
            row.reference.map(flag),
        ];
        let values = COLUMNS.iter().zip(values).filter(|((key, _), _)| shown(key)).map(|(_, v)| v);
        sheet.push(row.label, values.collect());
        if let Some(printed) = row.printed {
            let verdict = if holds(printed) { "reproduced" } else { "not reproduced" };
            let why = if row.why.is_empty() { String::new() } else { format!(": {}", row.why) };
            sheet.findings.push(format!("{}: {verdict}{why}.", row.label));
        }
        if let Some(known) = row.reference.filter(|k| !holds(*k)) {
            sheet.findings.push(format!(
                "{}: differs from the reference by {}, more than {}.",
                row.label,
                measure(row.found - known.value, ""),
                measure(known.within, "")
            ));
        }
    }
    sheet
}
