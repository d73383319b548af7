//! Tables of one and two variables, in the file or in a CSV file beside it.

use std::ops::Range;

use apsides_expressions::{Table, Unit};
use toml::de::DeValue;

use crate::error::ProblemError;
use crate::model::{Shape, TableData};
use crate::reader::{Field, Files, Node, Reader, described};

const KEYS: [&str; 8] = ["x", "y", "values", "csv", "x_unit", "y_unit", "unit", "shape"];

/// Knots and values as they are written, in the units of the table.
#[derive(Default)]
struct Numbers {
    x: Option<Vec<f64>>,
    y: Option<Vec<f64>>,
    values: Option<Vec<Vec<f64>>>,
}

/// A table with its data in coherent SI units.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    field: &Field<'_, '_>,
    files: &Files<'_>,
) -> Result<(Table, TableData), ProblemError> {
    let name = reader.name(field, "the name of a table")?;
    let what = format!("tables.{name}");
    let mut numbers = Numbers::default();
    let mut units = [Unit::none(), Unit::none(), Unit::none()];
    let (mut csv, mut shape) = (None, Shape::Spline);
    for field in reader.table_of(field.value, &what, &KEYS)? {
        let (value, what) = (field.value, format!("{what}.{}", field.name));
        match field.name {
            "x" => numbers.x = Some(list(reader, value, &what)?),
            "y" => numbers.y = Some(list(reader, value, &what)?),
            "values" => numbers.values = Some(rows(reader, value, &what)?),
            "csv" => csv = Some((content(reader, value, &what, files)?, value.span())),
            "x_unit" => units[0] = reader.unit(value, &what)?,
            "y_unit" => units[1] = reader.unit(value, &what)?,
            "unit" => units[2] = reader.unit(value, &what)?,
            _ => {
                shape = match reader.string(value, &what)? {
                    "spline" => Shape::Spline,
                    "monotone" => Shape::Monotone,
                    other => {
                        let allowed = "\"spline\" or \"monotone\"";
                        return Err(reader.refused(&value.span(), &what, format!("\"{other}\""), allowed));
                    }
                }
            }
        }
    }
    if let Some((text, at)) = &csv {
        if numbers.x.is_some() || numbers.y.is_some() || numbers.values.is_some() {
            let reason =
                format!("`{what}` has its numbers twice: state either `csv` or `x`, `y` and `values`");
            return Err(reader.conflict(&field.at, reason));
        }
        numbers = parse(reader, text, at, &what)?;
    }
    let (Some(x), Some(values)) = (numbers.x, numbers.values) else {
        let allowed = "x = [..] and values = [..], y = [..] for two variables, or csv = \"file.csv\"";
        return Err(reader.refused(&field.at, &what, "without numbers".into(), allowed));
    };
    let y = numbers.y.unwrap_or_default();
    let width = y.len().max(1);
    if values.len() != x.len() || values.iter().any(|row| row.len() != width) {
        let found = match values.iter().find(|row| row.len() != width) {
            Some(row) => format!("{} rows, one of {} numbers", values.len(), row.len()),
            None => format!("{} rows", values.len()),
        };
        let allowed = format!("one row for each of the {} `x`, with {width} numbers in each", x.len());
        return Err(reader.refused(&field.at, &format!("{what}.values"), found, &allowed));
    }
    if shape == Shape::Monotone && !y.is_empty() {
        let reason = format!("`{what}` has two variables, which only shape = \"spline\" takes");
        return Err(reader.conflict(&field.at, reason));
    }
    let [x_unit, y_unit, unit] = units;
    let sized = |numbers: Vec<f64>, unit: &Unit| numbers.into_iter().map(|v| v * unit.factor).collect();
    let variables =
        if y.is_empty() { vec![x_unit.dimension] } else { vec![x_unit.dimension, y_unit.dimension] };
    let table = Table { name: name.clone(), variables, dimension: unit.dimension };
    let data = TableData {
        name,
        x: sized(x, &x_unit),
        y: sized(y, &y_unit),
        values: sized(values.concat(), &unit),
        shape,
        csv: csv.map(|(text, _)| text),
        at: field.at.clone(),
    };
    Ok((table, data))
}

fn list(reader: &Reader<'_>, value: &Node<'_>, what: &str) -> Result<Vec<f64>, ProblemError> {
    reader.list(value, what)?.into_iter().map(|v| reader.finite(v, what)).collect()
}

/// A list of numbers is a column.
fn rows(reader: &Reader<'_>, value: &Node<'_>, what: &str) -> Result<Vec<Vec<f64>>, ProblemError> {
    let row = |v: &Node<'_>| match v.get_ref() {
        DeValue::Array(_) => list(reader, v, what),
        _ => Ok(vec![reader.finite(v, what)?]),
    };
    reader.list(value, what)?.into_iter().map(row).collect()
}

/// The text of a file, or the text that stands in its place.
fn content(
    reader: &Reader<'_>,
    value: &Node<'_>,
    what: &str,
    files: &Files<'_>,
) -> Result<String, ProblemError> {
    let text = reader.string(value, what)?;
    if text.contains('\n') {
        return Ok(text.to_owned());
    }
    files(text).map_err(|e| {
        let allowed = "the path of a CSV file, which counts from the directory of this file";
        reader.refused(&value.span(), what, format!("{} ({e})", described(value.get_ref())), allowed)
    })
}

/// Reads `x,value` lines, or a first line with the `y` and lines that begin with their `x`. A first line of words is a heading.
fn parse(reader: &Reader<'_>, text: &str, at: &Range<usize>, what: &str) -> Result<Numbers, ProblemError> {
    let mut lines: Vec<(usize, Vec<&str>)> = Vec::new();
    for (k, line) in text.lines().enumerate() {
        if !line.trim().is_empty() && !line.trim_start().starts_with('#') {
            lines.push((k + 1, line.split([',', ';', '\t']).map(str::trim).collect()));
        }
    }
    let number = |line: usize, cell: &str| match cell.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(reader.refused(
            at,
            what,
            format!("`{cell}` in line {line} of the CSV"),
            "a finite number in each cell",
        )),
    };
    let width = lines.first().map_or(0, |(_, cells)| cells.len());
    if width < 2 {
        let allowed =
            "two columns, or a first line with the second variable and lines that begin with the first";
        return Err(reader.refused(at, what, "a CSV with fewer than two columns".into(), allowed));
    }
    if let Some((line, cells)) = lines.iter().find(|(_, cells)| cells.len() != width) {
        let found = format!("a CSV with {} cells in line {line}", cells.len());
        return Err(reader.refused(at, what, found, &format!("{width} cells in each line, as in the first")));
    }
    let mut y = None;
    let (line, first) = &lines[0];
    if width > 2 {
        y = Some(first[1..].iter().map(|cell| number(*line, cell)).collect::<Result<Vec<_>, _>>()?);
        lines.remove(0);
    } else if first.iter().all(|cell| cell.parse::<f64>().is_err()) {
        lines.remove(0);
    }
    let (mut x, mut values) = (Vec::new(), Vec::new());
    for (line, cells) in &lines {
        x.push(number(*line, cells[0])?);
        values.push(cells[1..].iter().map(|cell| number(*line, cell)).collect::<Result<Vec<_>, _>>()?);
    }
    Ok(Numbers { x: Some(x), y, values: Some(values) })
}
