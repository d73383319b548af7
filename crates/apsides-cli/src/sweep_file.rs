//! The table of a sweep: one record a case.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use apsides::Summary;
use apsides::pipeline::digest::sha256;
use apsides::pipeline::shard::{SHARD, Shard, ShardState};
use apsides::pipeline::unit_ending::{name_of, unit_of};
use apsides::pipeline::whole_file::{WholeFile, publish_together};
use apsides_nlp::Status;
use apsides_report::{Axis, Figure, Page, Series};

use crate::commands::made;
use crate::exit::{Refusal, refusal, unwritten_option};

/// Characters of a number that is shown with all its digits.
const SHOWN: usize = 10;

/// The command, as manifests name it.
pub(crate) const COMMAND: &str = "sweep";

/// Names of the files.
const TABLE: &str = "sweep.csv";
const PAGE: &str = "sweep.html";

/// The table in the directory of a sweep.
pub(crate) fn table_of(dir: &Path) -> PathBuf {
    dir.join(TABLE)
}

/// Columns of every case behind its results and prices.
const LAST: [&str; 5] = ["status", "verdict", "iterations", "mesh_iterations", "solve_ms"];

/// The rows of a sweep, as CSV in one piece at the end, in a directory of its own.
///
/// Cases need not have the same results: another method gives other results, and a case that was interrupted gives fewer.
/// The columns are the results of all cases; where a case has none, its cell is empty.
pub(crate) struct SweepFile {
    dir: PathBuf,
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

/// True for the last columns of a case whose solve a signal or a time limit ended.
fn is_ended(last: &[String; 5]) -> bool {
    last[0] == Status::Interrupted.word()
}

/// Refuses the directory of a table with other columns of keys, or with cases that are not among these.
pub(crate) fn refuse_other_cases(dir: &Path, keys: &[&str], cases: &[Vec<&str>]) -> Result<(), Refusal> {
    let table = table_of(dir);
    if !table.is_file() {
        return Ok(());
    }
    let cases: BTreeSet<&[&str]> = cases.iter().map(Vec::as_slice).collect();
    let is_case = |row: &csv::StringRecord| cases.contains(&*row.iter().take(keys.len()).collect::<Vec<_>>());
    let is_own = |mut reader: csv::Reader<std::fs::File>| {
        reader.headers().is_ok_and(|header| header.iter().take(keys.len()).eq(keys.iter().copied()))
            && reader.records().all(|row| row.is_ok_and(|row| is_case(&row)))
    };
    if csv::Reader::from_path(&table).is_ok_and(is_own) {
        return Ok(());
    }
    let dir = dir.display();
    Err(format!("--out {dir}: {TABLE} there is not of this sweep; name another directory, or remove it")
        .into())
}

impl SweepFile {
    /// A table without rows: `keys` are the keys that vary, `prices` the names of the columns of prices. A directory with the manifest of
    /// another command is refused.
    pub(crate) fn create(
        dir: &Path,
        keys: impl Iterator<Item = String>,
        prices: impl Iterator<Item = String>,
    ) -> Result<Self, Refusal> {
        if let Some(other) = Shard::read(&dir.join(SHARD)).ok().filter(|shard| shard.command != COMMAND) {
            let sentence =
                format!("--out {}: has a run of `{}`; name another directory", dir.display(), other.command);
            return Err(sentence.into());
        }
        let (keys, prices) = (keys.collect(), prices.collect());
        Ok(Self { dir: dir.into(), keys, prices, results: Vec::new(), rows: Vec::new() })
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

    /// Adds the rows of another table of the same cases, but for those whose solve was ended, and returns their number.
    pub(crate) fn append(&mut self, table: &[u8]) -> Result<usize, Refusal> {
        let mut reader = csv::Reader::from_reader(table);
        let heads: Vec<String> = reader.headers().map_err(refusal)?.iter().map(str::to_owned).collect();
        let own = self.keys.len() + self.prices.len() + LAST.len();
        let results = self.keys.len()..heads.len().saturating_sub(self.prices.len() + LAST.len());
        let (Some(names), true) = (heads.get(results.clone()), heads.len() >= own) else {
            return Err("its table lacks columns".into());
        };
        for name in names.iter().filter(|name| !self.results.contains(name)).collect::<Vec<_>>() {
            self.results.push(name.clone());
        }
        let mut count = 0;
        for record in reader.records() {
            let record = record.map_err(refusal)?;
            let cells =
                |range: Range<usize>| record.iter().skip(range.start).take(range.len()).map(str::to_owned);
            let filled =
                names.iter().cloned().zip(cells(results.clone())).filter(|(_, cell)| !cell.is_empty());
            let mut last = LAST.map(|_| String::new());
            for (cell, text) in last.iter_mut().zip(cells(results.end + self.prices.len()..heads.len())) {
                *cell = text;
            }
            if is_ended(&last) {
                continue;
            }
            self.rows.push(Record {
                values: cells(0..self.keys.len()).collect(),
                results: filled.collect(),
                prices: cells(results.end..results.end + self.prices.len()).collect(),
                last,
            });
            count += 1;
        }
        Ok(count)
    }

    /// The page of the rows: each result over the first key that has several numbers, and all values.
    fn page(&self, mission: &str) -> String {
        let mut page = Page::new(&format!("Sweep of {mission}"));
        let [cases, without] = self.counts();
        let solved =
            if without == 0 { "all solved".to_owned() } else { format!("{without} of them not solved") };
        page.lead(&format!("{cases} cases over {}: {solved}.", self.keys.join(", ")));
        page.figures(&self.figures());
        page.heading("Cases");
        let heads = ["verdict"].into_iter().chain(self.keys.iter().map(String::as_str));
        let heads = heads
            .chain(self.results.iter().map(String::as_str))
            .chain(self.prices.iter().map(String::as_str));
        let shown = |cell: &String| match cell.parse::<f64>() {
            Ok(number) if cell.len() > SHOWN => format!("{number:.6}"),
            _ => cell.clone(),
        };
        let row = |row: &Record| {
            let verdict = if row.last[0] == "optimal" { &row.last[1] } else { &row.last[0] };
            let result = |name: &String| row.results.get(name).map_or_else(|| "-".to_owned(), shown);
            let cells = std::iter::once(verdict.clone()).chain(row.values.iter().cloned());
            cells.chain(self.results.iter().map(result)).chain(row.prices.iter().map(shown)).collect()
        };
        page.table(&heads.collect::<Vec<_>>(), &self.rows.iter().map(row).collect::<Vec<Vec<String>>>());
        page.finish()
    }

    /// Each result over the first key with several numbers, a line for each set of the other values.
    fn figures(&self) -> Vec<Figure> {
        let number = |row: &Record, k: usize| row.values.get(k).and_then(|v| v.parse::<f64>().ok());
        let varies = |k: &usize| {
            let numbers: Vec<f64> = self.rows.iter().filter_map(|row| number(row, *k)).collect();
            numbers.iter().any(|v| Some(v) != numbers.first())
        };
        let Some(k) = (0..self.keys.len()).find(varies) else { return Vec::new() };
        let Some(key) = self.keys.get(k) else { return Vec::new() };
        let axis = |key: &str| Axis::new(name_of(key).replace('_', " "), unit_of(key));
        let figure = |result: &String| {
            let mut lines: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
            for row in &self.rows {
                let value = row.results.get(result).and_then(|v| v.parse::<f64>().ok());
                let (Some(x), Some(y)) = (number(row, k).filter(|x| x.is_finite()), value) else { continue };
                let others = self.keys.iter().zip(&row.values).enumerate().filter(|(other, _)| *other != k);
                let label = others.map(|(_, (key, v))| format!("{key} = {v}")).collect::<Vec<_>>().join(", ");
                match lines.iter_mut().find(|(known, _)| *known == label) {
                    Some((_, points)) => points.push([x, y]),
                    None => lines.push((label, vec![[x, y]])),
                }
            }
            let title =
                format!("{} over {}", name_of(result).replace('_', " "), name_of(key).replace('_', " "));
            let mut figure = Figure::new(title, axis(key), axis(result));
            for (k, (label, mut points)) in lines.into_iter().enumerate() {
                points.sort_by(|a, b| a[0].total_cmp(&b[0]));
                figure = figure.with(Series::line(label, points.clone()).colored(k));
                figure = figure.with(Series::dots("", points).colored(k));
            }
            figure
        };
        self.results.iter().map(figure).filter(|figure| !figure.series.is_empty()).collect()
    }

    /// Number of rows, and of those without a solution.
    pub(crate) fn counts(&self) -> [usize; 2] {
        let solved = |row: &&Record| matches!(&*row.last[0], "optimal" | "acceptable");
        [self.rows.len(), self.rows.len() - self.rows.iter().filter(solved).count()]
    }

    /// Writes the rows that there are, with their page, or with the manifest of a part beside them; returns the names of table and page.
    pub(crate) fn finish(self, mission: &str, shard: Option<Shard>) -> Result<Vec<String>, Refusal> {
        let text = self.table().map_err(refusal)?;
        // That of a part would be a page a shard.
        let has_page = shard.as_ref().is_none_or(Shard::is_whole);
        let dir = made(&self.dir)?;
        let [table, page, manifest] = [TABLE, PAGE, SHARD].map(|name| dir.join(name));
        let unwritten = unwritten_option("--out", dir);
        let file = |path: &Path, content: &[u8]| {
            let mut file = WholeFile::create(path)?;
            file.write_all(content)?;
            Ok::<_, std::io::Error>(file)
        };
        let mut files = vec![file(&table, &text).map_err(&unwritten)?];
        let mut written = vec![table.display().to_string()];
        // Those of other rows.
        let mut stale = Vec::new();
        if has_page {
            files.push(file(&page, self.page(mission).as_bytes()).map_err(&unwritten)?);
            written.push(page.display().to_string());
        } else {
            stale.push(page);
        }
        match shard {
            Some(shard) => {
                let text = self.counted(shard, &text).to_file();
                files.push(file(&manifest, text.as_bytes()).map_err(&unwritten)?);
            }
            None => stale.push(manifest),
        }
        stale.retain(|path| path.exists());
        publish_together(files, &stale).map_err(|(_, e)| unwritten(e))?;
        Ok(written)
    }

    /// A manifest with what the rows tell.
    fn counted(&self, shard: Shard, text: &[u8]) -> Shard {
        let ended = self.rows.iter().filter(|row| is_ended(&row.last)).count();
        let [rows, without] = self.counts();
        let (done, failed) = (rows - ended, without - ended);
        let state = match (done == shard.count, failed) {
            (false, _) => ShardState::Interrupted,
            (true, 0) => ShardState::Complete,
            (true, _) => ShardState::CompleteWithFailures,
        };
        Shard { done, failed, state, rows_sha256: Some(sha256(text)), ..shard }
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
