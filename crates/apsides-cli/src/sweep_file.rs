//! The table of a sweep: one record a case.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use apsides::Summary;
use apsides::pipeline::whole_file::write_whole;

use crate::commands::probe_file;
use crate::exit::{Refusal, refusal, unwritten_option};

/// Columns of every case behind its results and prices.
const LAST: [&str; 5] = ["status", "verdict", "iterations", "mesh_iterations", "solve_ms"];

/// The rows of a sweep, as CSV in one piece at the end.
///
/// Cases need not have the same results: another method gives other results, and a case that was interrupted gives fewer.
/// The columns are the results of all cases; where a case has none, its cell is empty.
pub(crate) struct SweepFile {
    path: PathBuf,
    keys: Vec<String>,
    prices: Vec<String>,
    results: Vec<String>,
    rows: Vec<Record>,
}

struct Record {
    /// The values of the keys.
    values: Vec<String>,
    results: BTreeMap<String, String>,
    /// A cell for each column of prices.
    prices: Vec<String>,
    last: [String; 5],
}

impl SweepFile {
    /// A table without rows: `keys` are the keys that vary, `prices` the names of the columns of prices.
    pub(crate) fn create(
        path: &Path,
        keys: impl Iterator<Item = String>,
        prices: impl Iterator<Item = String>,
    ) -> Result<Self, Refusal> {
        probe_file("--out", path)?;
        let (keys, prices) = (keys.collect(), prices.collect());
        Ok(Self { path: path.into(), keys, prices, results: Vec::new(), rows: Vec::new() })
    }

    /// A case with its outcome.
    pub(crate) fn row<'a>(
        &mut self,
        summary: &Summary,
        values: impl Iterator<Item = &'a str>,
        prices: impl Iterator<Item = Option<f64>>,
    ) {
        for name in summary.results.keys() {
            if !self.results.contains(name) {
                self.results.push(name.clone());
            }
        }
        self.rows.push(Record {
            values: values.map(str::to_owned).collect(),
            results: summary.results.iter().map(|(name, v)| (name.clone(), v.to_string())).collect(),
            prices: prices.map(|p| p.map_or(String::new(), |p| p.to_string())).collect(),
            last: [
                summary.status.clone(),
                summary.certificate.verdict.to_string(),
                summary.counters.iterations.to_string(),
                summary.counters.mesh_iterations.to_string(),
                summary.timing_ms.solve.to_string(),
            ],
        });
    }

    /// A case that a fault of the program ended.
    pub(crate) fn fault<'a>(&mut self, values: impl Iterator<Item = &'a str>) {
        self.rows.push(Record {
            values: values.map(str::to_owned).collect(),
            results: BTreeMap::new(),
            prices: vec![String::new(); self.prices.len()],
            last: ["fault", "", "", "", ""].map(String::from),
        });
    }

    /// Writes the rows that there are and returns the name of the file.
    pub(crate) fn finish(self) -> Result<String, Refusal> {
        let text = self.table().map_err(refusal)?;
        write_whole(&self.path, &text).map_err(unwritten_option("--out", &self.path))?;
        Ok(self.path.display().to_string())
    }

    fn table(&self) -> Result<Vec<u8>, csv::Error> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let results = self.results.iter().map(String::as_str);
        let prices = self.prices.iter().map(String::as_str);
        table.write_record(self.keys.iter().map(String::as_str).chain(results).chain(prices).chain(LAST))?;
        for row in &self.rows {
            let results = self.results.iter().map(|name| row.results.get(name).map_or("", String::as_str));
            let cells = row.values.iter().map(String::as_str).chain(results);
            table.write_record(cells.chain(row.prices.iter().chain(&row.last).map(String::as_str)))?;
        }
        table.into_inner().map_err(|e| e.into_error().into())
    }
}
