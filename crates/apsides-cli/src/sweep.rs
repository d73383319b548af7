//! `apsides sweep`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use apsides::pipeline::shard::Shard;
use apsides::pipeline::sweep::{Axis, Case, cases, priced_axes, prices, sweep_in_chains};
use apsides::pipeline::whole_file::write_whole;
use apsides::{Outcome, Price};
use apsides_nlp::Status;
use apsides_report::stacked_svg;
use serde_json::json;

use crate::arguments::SweepArguments;
use crate::commands::{KeptWork, probe_file};
use crate::exit::{Exit, Refusal, refusal, unwritten_option};
use crate::figures::PriceCurves;
use crate::output::{columns, heads, print, print_json, significant, warn};
use crate::progress::Progress;
use crate::speech::{is_json, is_verbose};
use crate::sweep_file::{COMMAND, SweepFile, refuse_other_cases};

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
    let kept = KeptWork::open(a.out.as_deref())?;
    if let Some(dir) = &a.out {
        let keys: Vec<&str> = axes.iter().map(|axis| &*axis.key).collect();
        let values: Vec<Vec<&str>> = cases.iter().map(|case| case_values(case).collect()).collect();
        refuse_other_cases(dir, &keys, &values)?;
    }
    let price_names: Vec<String> =
        axes.iter().zip(&priced).filter(|(_, shown)| **shown).map(|(axis, _)| price_name(axis)).collect();
    let mut shard = Shard::begun(COMMAND, &a.mission, &statement(&cases), a.run.seed, total, indices.clone());
    for axis in &axes {
        shard.settings.insert(format!("--set {}", axis.key), axis.values.clone().into());
    }
    shard.settings.insert("--chain".into(), a.chain.into());
    shard.settings.insert(KEYS.into(), axes.iter().map(|axis| axis.key.clone()).collect());
    shard.settings.insert(PRICES.into(), price_names.clone().into());
    let keys = axes.iter().map(|axis| axis.key.clone());
    let mut csv =
        a.out.as_deref().map(|dir| SweepFile::create(dir, keys, price_names.into_iter())).transpose()?;
    let mut progress = Progress::line(stop, indices.len() as u64);
    let ticker = progress.clone();
    let mut worst = Exit::Verified;
    let mut failure = None;
    let (mut first, mut done) = (true, 0);
    let part = if indices.len() == total {
        String::new()
    } else {
        format!(" of {total}, from index {}", indices.start)
    };
    if !is_json() {
        print(&format!("sweep of {} cases{part}: {}\n", indices.len(), a.mission));
    }
    let mut objects = Vec::new();
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
                warn(&format!(
                    "{}: no result by a fault of the program ({fault}): please report it",
                    case.overrides.join(", ")
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
        if is_json() {
            objects.push(row.object());
        } else {
            if std::mem::take(&mut first) {
                ticker.above(&row.header());
            }
            ticker.above(&row.text());
        }
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
    let mut files = Vec::new();
    if let Some(file) = csv {
        files.extend(file.finish(&a.mission, a.chain.map(|_| shard))?);
    }
    if let Some(drawing) = curves {
        files.push(drawing.finish()?);
    }
    if is_json() {
        print_json(&json!({ "mission": a.mission, "cases": objects, "complete": done == indices.len() }))?;
    } else {
        files.iter().for_each(|file| print(&format!("written: {file}\n")));
    }
    Ok(kept.settle(done == indices.len(), worst))
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
    /// Names of the columns with numbers.
    fn names(&self) -> Vec<String> {
        let axes = self.axes.iter().map(|axis| axis.key.clone());
        axes.chain(self.solved.headline.iter().cloned()).chain(self.price_names()).collect()
    }

    fn header(&self) -> String {
        let more = if is_verbose() { "iterations        ms  " } else { "" };
        heads(&self.names(), &format!("  {more}certificate"))
    }

    /// The case with its summary.
    fn object(&self) -> serde_json::Value {
        let axes = self.axes.iter().map(|axis| axis.key.as_str());
        let set: serde_json::Map<_, _> = axes.zip(self.values()).map(|(k, v)| (k.into(), v.into())).collect();
        let prices: serde_json::Map<_, _> =
            self.price_names().zip(self.shown_prices()).map(|(name, price)| (name, price.into())).collect();
        json!({ "set": set, "prices": prices, "summary": self.solved.summary })
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
        let s = &self.solved.summary;
        let results = self.solved.headline.iter().map(|key| s.results.get(key).copied().unwrap_or(f64::NAN));
        let prices = self.shown_prices().map(|price| price.map_or_else(|| "-".into(), significant));
        let cells: Vec<String> = self
            .values()
            .map(str::to_owned)
            .chain(results.map(|v| format!("{v:.3}")))
            .chain(prices)
            .collect();
        let why = self.solved.explanation.as_ref().map_or(String::new(), |e| format!("; {e}"));
        let work = format!("  {:>10}  {:>8.1}", s.counters.iterations, s.timing_ms.solve);
        let work = if is_verbose() { work } else { String::new() };
        let verdict = s.certificate.verdict.word();
        let verdict =
            if s.status == "optimal" { verdict.to_owned() } else { format!("{}, {verdict}", s.status) };
        format!("{}{work}  {verdict}{why}\n", columns(&self.names(), &cells))
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
