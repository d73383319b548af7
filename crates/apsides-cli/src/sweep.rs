//! `apsides sweep`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use apsides::pipeline::shard::Shard;
use apsides::pipeline::sweep::{Axis, Case, cases, priced_axes, prices, sweep_in_chains};
use apsides::pipeline::whole_file::write_whole;
use apsides::{Outcome, Price};
use apsides_nlp::Status;
use apsides_report::stacked_svg;

use crate::arguments::SweepArguments;
use crate::commands::{claim, keep_solves, probe_file, settle};
use crate::exit::{Exit, Refusal, refusal, unwritten_option};
use crate::figures::PriceCurves;
use crate::output::{print, significant};
use crate::progress::Progress;
use crate::sweep_file::SweepFile;

pub(crate) fn run_sweep(a: &SweepArguments) -> Result<Exit, Refusal> {
    let axes = a.axes()?;
    let mut cases = cases(&apsides::registry(), &a.mission, &axes).map_err(refusal)?;
    let stop = a.run.limit.stop();
    for case in &mut cases {
        case.mission = case
            .mission
            .clone()
            .with_threads(a.run.threads.count())
            .with_seed(a.run.seed)
            .with_memory(a.run.memory())
            .with_cancellation(stop.cancellation())
            .with_prices(a.sensitivity);
    }
    let total = cases.len();
    let indices = a.indices(total)?;
    let priced =
        if a.sensitivity { priced_axes(&axes, &cases).map_err(refusal)? } else { vec![false; axes.len()] };
    let mut curves = a.figure.as_deref().map(|path| Drawing::create(path, &axes, &priced)).transpose()?;
    // The solves are kept beside the file until all are done.
    let solves = a.out.as_deref().map(partial).unwrap_or_default();
    let _lock = a.out.as_ref().map(|_| claim(&solves)).transpose()?;
    let record = a.out.as_ref().map(|_| keep_solves(&solves)).transpose()?;
    let price_names: Vec<String> =
        axes.iter().zip(&priced).filter(|(_, shown)| **shown).map(|(axis, _)| price_name(axis)).collect();
    let mut shard = Shard::begun("sweep", &a.mission, &statement(&cases), a.run.seed, total, indices.clone());
    for axis in &axes {
        shard.settings.insert(format!("--set {}", axis.key), axis.values.clone().into());
    }
    shard.settings.insert("--chain".into(), a.chain.into());
    shard.settings.insert(KEYS.into(), axes.iter().map(|axis| axis.key.clone()).collect());
    shard.settings.insert(PRICES.into(), price_names.clone().into());
    let keys = axes.iter().map(|axis| axis.key.clone());
    let mut csv =
        a.out.as_deref().map(|path| SweepFile::create(path, keys, price_names.into_iter())).transpose()?;
    let mut progress = Progress::line(a.run.quiet, stop, indices.len() as u64);
    let ticker = progress.clone();
    let mut worst = Exit::Verified;
    let mut failure = None;
    let (mut first, mut done) = (true, 0);
    let part = if indices.len() == total {
        String::new()
    } else {
        format!(" of {total}, from index {}", indices.start)
    };
    print(&format!("sweep of {} cases{part}: {}\n", indices.len(), a.mission));
    let chain = a.chain.map_or(total, |chain| chain as usize);
    sweep_in_chains(&cases, indices.clone(), chain.max(1), &mut progress, |case, solved| {
        done += 1;
        let solved = match solved {
            Ok(solved) if solved.status == Status::Interrupted => {
                done -= 1;
                solved
            }
            Ok(solved) => solved,
            Err(fault) => {
                let values: String = case_values(case).map(|v| format!("{v:>22} ")).collect();
                ticker.above(&format!(
                    "{values}no result by a fault of the program ({fault}): please report it\n"
                ));
                ticker.step();
                worst = worst.or(Exit::NotSolved);
                if let Some(file) = &mut csv {
                    file.fault(case_values(case));
                }
                return !stop.is_set();
            }
        };
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
        worst = worst.or(Exit::of(&solved.summary));
        if let Some(file) = &mut csv {
            file.row(&row.solved.summary, row.values(), row.shown_prices());
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
        print(&format!("written: {}\n", file.finish(a.chain.map(|_| shard))?));
    }
    if let Some(drawing) = curves {
        print(&format!("written: {}\n", drawing.finish()?));
    }
    Ok(settle(record, &solves, done == indices.len(), worst))
}

/// Names in the settings of a manifest: of the columns of keys and of prices.
pub(crate) const KEYS: &str = "keys";
pub(crate) const PRICES: &str = "prices";

impl SweepArguments {
    /// The keys that vary, with their values.
    pub(crate) fn axes(&self) -> Result<Vec<Axis>, Refusal> {
        let axes = self.set.iter().map(|text| Axis::parse(text)).collect::<Result<Vec<_>, _>>();
        let mut axes = axes.map_err(refusal)?;
        if let Some(method) = &self.method {
            axes.push(Axis { key: "method".into(), values: vec![method.clone()] });
        }
        Ok(axes)
    }

    /// The indices of the cases that are asked for.
    fn indices(&self, total: usize) -> Result<Range<usize>, Refusal> {
        let first = self.first.map_or(0, |first| first as usize);
        let count = self.count.map_or(total.saturating_sub(first), |count| count as usize);
        if first + count <= total && (count > 0 || total == 0) {
            return Ok(first..first + count);
        }
        Err(format!("--first {first} --count {count}: the sweep has {total} cases, of indices from 0 on")
            .into())
    }
}

/// The statement of what is solved: the first case, with the number of all; their values are in the settings.
fn statement(cases: &[Case]) -> String {
    cases.first().map(|case| case.mission.to_file()).unwrap_or_default()
}

/// The directory of the solves of a sweep.
pub(crate) fn partial(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(".partial");
    name.into()
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
        let price = |k: usize| self.prices.get(k).and_then(Option::as_ref).and_then(|p| p.objective);
        self.priced.iter().enumerate().filter(|(_, shown)| **shown).map(move |(k, _)| price(k))
    }

    fn values(&self) -> impl Iterator<Item = &str> {
        case_values(self.case)
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

fn case_values(case: &Case) -> impl Iterator<Item = &str> {
    case.overrides.iter().map(|o| o.split_once('=').map_or("", |(_, v)| v))
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
        probe_file("--figure", path)?;
        Ok(Self { path: path.into(), curves: PriceCurves::new(axes, priced) })
    }

    fn finish(self) -> Result<String, Refusal> {
        let svg = stacked_svg(&self.curves.figures());
        write_whole(&self.path, svg.as_bytes()).map_err(unwritten_option("--figure", &self.path))?;
        let legend = self.curves.legend();
        let legend = if legend.is_empty() { legend } else { format!(" ({legend})") };
        Ok(format!("{}{legend}", self.path.display()))
    }
}
