//! `apsides sweep`.

use std::path::{Path, PathBuf};

use apsides::pipeline::sweep::{Axis, Case, cases, priced_axes, prices, sweep};
use apsides::{Outcome, Price};
use apsides_report::stacked_svg;

use crate::arguments::SweepArguments;
use crate::commands::{Refusal, refusal};
use crate::figures::PriceCurves;
use crate::output::{Exit, print, significant};
use crate::progress::{Progress, StopFlag};

pub(crate) fn run_sweep(a: &SweepArguments) -> Result<Exit, Refusal> {
    let mut axes = a.set.iter().map(|t| Axis::parse(t)).collect::<Result<Vec<_>, _>>().map_err(refusal)?;
    if let Some(m) = &a.method {
        axes.push(Axis { key: "method".into(), values: vec![m.clone()] });
    }
    let mut cases = cases(&apsides::registry(), &a.mission, &axes).map_err(refusal)?;
    for case in &mut cases {
        case.mission = case.mission.clone().with_threads(a.run.threads.count()).with_seed(a.run.seed);
    }
    let priced =
        if a.sensitivity { priced_axes(&axes, &cases).map_err(refusal)? } else { vec![false; axes.len()] };
    let mut curves = a.figure.as_deref().map(|path| Drawing::create(path, &axes, &priced)).transpose()?;
    let mut csv = a.out.as_deref().map(SweepFile::create).transpose()?;
    let stop = StopFlag::install();
    let mut progress = Progress::line(a.run.quiet, stop.clone(), cases.len() as u64);
    let ticker = progress.clone();
    let mut worst = Exit::Verified;
    let mut failure = None;
    let mut first = true;
    print(&format!("sweep of {} cases: {}\n", cases.len(), a.mission));
    sweep(&cases, &mut progress, |case, solved| {
        let prices = if a.sensitivity { prices(&axes, case, solved) } else { Ok(Vec::new()) };
        let prices = prices.unwrap_or_else(|e| {
            failure = Some(refusal(e));
            Vec::new()
        });
        let row = Row { axes: &axes, case, solved, priced: &priced, prices: &prices };
        if std::mem::take(&mut first) {
            ticker.above(&row.header());
        }
        ticker.above(&row.text());
        ticker.step();
        worst = worse(worst, Exit::of(&solved.summary));
        if let Some(file) = &mut csv
            && let Err(e) = file.row(&row)
        {
            failure = Some(e);
        }
        if let Some(drawing) = &mut curves {
            drawing.curves.add(case, solved, &prices);
        }
        failure.is_none() && !stop.is_set()
    })
    .map_err(refusal)?;
    if let Some(e) = failure {
        return Err(e);
    }
    if let Some(file) = csv {
        print(&format!("written: {}\n", file.finish()?));
    }
    if let Some(drawing) = curves {
        print(&format!("written: {}\n", drawing.finish()?));
    }
    Ok(worst)
}

fn worse(a: Exit, b: Exit) -> Exit {
    let rank = |e| match e {
        Exit::Verified => 0,
        Exit::NotVerified => 1,
        Exit::NotSolved => 2,
        Exit::BadInput => 3,
    };
    if rank(b) > rank(a) { b } else { a }
}

/// A case with what is shown of it.
struct Row<'a> {
    axes: &'a [Axis],
    case: &'a Case,
    solved: &'a Outcome,
    /// True for each axis whose price is shown.
    priced: &'a [bool],
    /// By axis; empty if prices were not asked for.
    prices: &'a [Option<Price>],
}

impl Row<'_> {
    fn header(&self) -> String {
        let mut text = String::new();
        for axis in self.axes {
            text += &format!("{:>22} ", axis.key);
        }
        for key in &self.solved.headline {
            text += &format!("{key:>24} ");
        }
        for name in self.price_names() {
            text += &format!("{name:>24} ");
        }
        text + "iterations  ms      status, certificate\n"
    }

    /// Columns of the prices.
    fn price_names(&self) -> impl Iterator<Item = String> {
        self.axes.iter().zip(self.priced).filter(|(_, shown)| **shown).map(|(axis, _)| price_name(axis))
    }

    fn shown_prices(&self) -> impl Iterator<Item = Option<f64>> {
        let price = |k: usize| self.prices.get(k).and_then(Option::as_ref).map(|p| p.objective);
        self.priced.iter().enumerate().filter(|(_, shown)| **shown).map(move |(k, _)| price(k))
    }

    fn values(&self) -> impl Iterator<Item = &str> {
        self.case.overrides.iter().map(|o| o.split_once('=').map_or("", |(_, v)| v))
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for value in self.values() {
            text += &format!("{value:>22} ");
        }
        let s = &self.solved.summary;
        for key in &self.solved.headline {
            text += &format!("{:>24.8} ", s.results.get(key).copied().unwrap_or(f64::NAN));
        }
        for (name, price) in self.price_names().zip(self.shown_prices()) {
            let price = price.map_or_else(|| "-".into(), significant);
            text += &format!("{price:>width$} ", width = name.len().max(24));
        }
        let why = self.solved.explanation.as_ref().map_or(String::new(), |e| format!("; {e}"));
        text + &format!(
            "{:>10}  {:<6.1}  {}, {}{why}\n",
            s.counters.iterations, s.timing_ms.solve, s.status, s.certificate.verdict
        )
    }
}

/// Name of the column with the prices of a key.
fn price_name(axis: &Axis) -> String {
    format!("price_{}", axis.key)
}

/// A figure that is drawn at the end.
struct Drawing {
    path: PathBuf,
    curves: PriceCurves,
}

impl Drawing {
    fn create(path: &Path, axes: &[Axis], priced: &[bool]) -> Result<Self, Refusal> {
        let refused = |why: &str| format!("--figure {}: {why}", path.display());
        if path.is_dir() {
            return Err(refused("is a directory; give a file"));
        }
        if path.parent().is_some_and(|p| !p.as_os_str().is_empty() && !p.is_dir()) {
            return Err(refused("its directory does not exist"));
        }
        Ok(Self { path: path.into(), curves: PriceCurves::new(axes, priced) })
    }

    fn finish(self) -> Result<String, Refusal> {
        let svg = stacked_svg(&self.curves.figures());
        std::fs::write(&self.path, svg).map_err(|e| format!("--figure {}: {e}", self.path.display()))?;
        let legend = self.curves.legend();
        let legend = if legend.is_empty() { legend } else { format!(" ({legend})") };
        Ok(format!("{}{legend}", self.path.display()))
    }
}

/// A CSV file that grows next to its final place and is renamed at the end: what was there before stays until then,
/// and what was computed is never lost.
struct SweepFile {
    path: std::path::PathBuf,
    partial: std::path::PathBuf,
    writer: csv::Writer<std::fs::File>,
    header: bool,
}

impl SweepFile {
    fn create(path: &Path) -> Result<Self, Refusal> {
        if path.is_dir() {
            return Err(format!("--out {}: is a directory; give a file", path.display()));
        }
        let mut name = path.as_os_str().to_owned();
        name.push(".partial");
        let partial = std::path::PathBuf::from(name);
        let writer =
            csv::Writer::from_path(&partial).map_err(|e| format!("--out {}: {e}", path.display()))?;
        Ok(Self { path: path.into(), partial, writer, header: false })
    }

    fn row(&mut self, row: &Row<'_>) -> Result<(), Refusal> {
        let s = &row.solved.summary;
        let fail = |e: csv::Error| e.to_string();
        if !std::mem::replace(&mut self.header, true) {
            let header = (row.axes.iter().map(|a| a.key.clone()))
                .chain(s.results.keys().cloned())
                .chain(row.price_names())
                .chain(["status", "verdict", "iterations", "mesh_iterations", "solve_ms"].map(String::from));
            self.writer.write_record(header).map_err(fail)?;
        }
        let prices = row.shown_prices().map(|p| p.map_or(String::new(), |p| p.to_string()));
        let results = s.results.values().map(f64::to_string);
        let last = [
            s.status.clone(),
            s.certificate.verdict.to_string(),
            s.counters.iterations.to_string(),
            s.counters.mesh_iterations.to_string(),
            s.timing_ms.solve.to_string(),
        ];
        self.writer
            .write_record(row.values().map(str::to_owned).chain(results).chain(prices).chain(last))
            .map_err(fail)?;
        self.writer.flush().map_err(refusal)
    }

    fn finish(mut self) -> Result<String, Refusal> {
        self.writer.flush().map_err(refusal)?;
        std::fs::rename(&self.partial, &self.path).map_err(|e| {
            format!("--out {}: {e}; the rows are in {}", self.path.display(), self.partial.display())
        })?;
        Ok(self.path.display().to_string())
    }
}
