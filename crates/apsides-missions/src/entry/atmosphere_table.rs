//! The atmosphere as a table in a mission file.

use apsides_dynamics::atmosphere::{AtmosphereTable, Gas};

use apsides_pipeline::Error;

use super::keys::ATMOSPHERE_TABLE;

/// The numbers of a row.
const COLUMNS: &str = "altitude in m, density in kg/m3, temperature in K";

/// Reads rows of [`COLUMNS`], one per line, separated by commas. Empty lines and lines after `#` say nothing; a first line of words is a
/// heading. `refuse` makes an error of a reason.
pub(super) fn parse(
    text: &str,
    gas: Gas,
    refuse: impl Fn(String) -> Error,
) -> Result<AtmosphereTable, Error> {
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for (line, row) in text.lines().enumerate() {
        let row = row.split('#').next().unwrap_or("").trim();
        let is_heading = columns[0].is_empty() && row.starts_with(|c: char| c.is_alphabetic());
        if row.is_empty() || is_heading {
            continue;
        }
        let numbers: Result<Vec<f64>, _> = row.split(',').map(|n| n.trim().parse::<f64>()).collect();
        match numbers.as_deref() {
            Ok([altitude, density, temperature]) => {
                for (column, number) in columns.iter_mut().zip([altitude, density, temperature]) {
                    column.push(*number);
                }
            }
            _ => {
                return Err(refuse(format!(
                    "`{ATMOSPHERE_TABLE}`, line {}: \"{row}\" is not three numbers ({COLUMNS})",
                    line + 1
                )));
            }
        }
    }
    if columns[0].is_empty() {
        return Err(refuse(format!(
            "`{ATMOSPHERE_TABLE}` has no row; give rows of {COLUMNS}, or the path of a file that ends with .csv"
        )));
    }
    let [altitudes, densities, temperatures] = &columns;
    AtmosphereTable::new(altitudes, densities, temperatures, gas)
        .map_err(|e| refuse(format!("`{ATMOSPHERE_TABLE}`: {e}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn rows_headings_and_comments() {
        let rows = "altitude, density, temperature\n0, 1.2, 288 # ground\n\n10000, 0.4, 223\n";
        let table = parse(rows, Gas::AIR, Error::in_mission).unwrap();
        assert_eq!(table.range(), [0.0, 10_000.0]);
        assert!((table.density(0.0) - 1.2).abs() < ROUNDING);
    }

    #[test]
    fn refuses_by_line_or_row() {
        let cases = [
            ("", "has no row"),
            ("0, 1.2\n", "line 1: \"0, 1.2\" is not three numbers"),
            ("0, 1, 300\n5, x, 300\n", "line 2"),
            ("0, 1, 300\n5, 1, 300\n5, 1, 300\n", "row 3"),
            ("0, 1, 300\n5, -1, 300\n", "row 2"),
        ];
        for (text, expected) in cases {
            let found = parse(text, Gas::AIR, Error::in_mission).unwrap_err().to_string();
            assert!(found.contains(expected), "{text}: {found}");
        }
    }
}
