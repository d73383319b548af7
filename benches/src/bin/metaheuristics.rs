//! Searches on shifted and rotated functions: success, evaluations to the target, own time per evaluation.

use std::collections::VecDeque;
use std::hint::black_box;
use std::io::{Write, stdout};
use std::sync::Mutex;
use std::thread;

use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use apsides_metaheuristics::{
    AnnealingSettings, AntColonySettings, CmaEsSettings, CooperationSettings, DifferentialEvolutionSettings,
    GeneticSettings, Method, ParticleSwarmSettings, Restarts, Search, SearchSpace,
};
use apsides_problems::search::{Landscape, ShiftedRotated, Transform};
use clap::{Args, Parser, Subcommand};
use serde::Serialize;

/// Shifted and rotated functions for searches without derivatives.
#[derive(Debug, Parser)]
#[command(name = "metaheuristics")]
struct Arguments {
    #[command(subcommand)]
    which: Which,
}

#[derive(Clone, Debug, Subcommand)]
enum Which {
    /// Writes shifts, rotations and sample values of instances 1 to a number as JSON.
    Instances {
        /// Number of variables.
        #[arg(long)]
        dimension: usize,
        /// Number of instances.
        #[arg(long)]
        seeds: u64,
    },
    /// Runs algorithms until the target of 1e-8 or 10^4 evaluations for each variable.
    Runs(Runs),
    /// Measures the time per evaluation on the function of Rosenbrock, less the function itself.
    Overhead {
        /// Algorithms by name, all by default.
        #[arg(long, num_args = 1..)]
        algorithms: Vec<String>,
        /// Numbers of variables.
        #[arg(long, num_args = 1.., default_values_t = [10, 30])]
        dimensions: Vec<usize>,
        /// JSON instead of Markdown.
        #[arg(long)]
        json: bool,
    },
}

#[derive(Clone, Debug, Args)]
struct Runs {
    /// Algorithms by name, all by default.
    #[arg(long, num_args = 1..)]
    algorithms: Vec<String>,
    /// Functions by name, all by default.
    #[arg(long, num_args = 1..)]
    functions: Vec<String>,
    /// Numbers of variables.
    #[arg(long, num_args = 1.., default_values_t = [10, 30])]
    dimensions: Vec<usize>,
    /// Runs of each.
    #[arg(long, default_value_t = 20)]
    seeds: u64,
    /// The first seed; instances have the same.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Runs at a time.
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// JSON instead of Markdown.
    #[arg(long)]
    json: bool,
}

/// A value below this counts as the minimum, which is 0.
const TARGET: f64 = 1e-8;

/// An algorithm with a name for tables.
#[derive(Clone, Debug)]
struct Entry {
    name: &'static str,
    method: Method,
}

/// All algorithms with their defaults.
fn algorithms() -> Vec<Entry> {
    let cma = |restarts| Method::CmaEs(CmaEsSettings { restarts, ..CmaEsSettings::default() });
    let de = Method::DifferentialEvolution;
    let entry = |name, method| Entry { name, method };
    vec![
        entry("GA", Method::Genetic(GeneticSettings::default())),
        entry("PSO", Method::ParticleSwarm(ParticleSwarmSettings::default())),
        entry("ACO_R", Method::AntColony(AntColonySettings::default())),
        entry("SA", Method::SimulatedAnnealing(AnnealingSettings::default())),
        entry("cooperation", Method::Cooperation(CooperationSettings::default())),
        entry("DE rand/1", de(DifferentialEvolutionSettings::classic())),
        entry("jDE", de(DifferentialEvolutionSettings::self_adaptive())),
        entry("L-SHADE", de(DifferentialEvolutionSettings::default())),
        entry("CMA-ES", cma(Restarts::None)),
        entry("IPOP-CMA-ES", cma(Restarts::Increasing)),
        entry("BIPOP-CMA-ES", cma(Restarts::TwoRegimes)),
    ]
}

/// Those of some names.
fn chosen(names: &[String]) -> Result<Vec<Entry>, Failure> {
    let all = algorithms();
    if names.is_empty() {
        return Ok(all);
    }
    let of_name = |name: &String| {
        let known = || all.iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
        let entry = all.iter().find(|e| e.name == name).cloned();
        entry.ok_or_else(|| format!("no algorithm `{name}`; there are {}", known()).into())
    };
    names.iter().map(of_name).collect()
}

/// One shift and rotation, and values that the peer's functions must have.
#[derive(Debug, Serialize)]
struct Instance {
    shift: Vec<f64>,
    rotation: Vec<f64>,
    point: Vec<f64>,
    values: Vec<f64>,
}

/// All runs of an algorithm on a function.
#[derive(Debug, Serialize)]
struct Record {
    algorithm: &'static str,
    function: &'static str,
    dimension: usize,
    runs: usize,
    successes: usize,
    /// Median over the runs that succeeded.
    evaluations: Option<f64>,
    /// Median of the least value over all runs.
    error: f64,
}

/// Time of an algorithm.
#[derive(Debug, Serialize)]
struct Overhead {
    algorithm: &'static str,
    dimension: usize,
    /// Per evaluation, less the function itself.
    nanoseconds: f64,
    /// The name of the function.
    function: f64,
}

fn main() -> Result<(), Failure> {
    match Arguments::parse().which {
        Which::Instances { dimension, seeds } => {
            let instances: Vec<Instance> = (1..=seeds).map(|seed| instance(dimension, seed)).collect();
            serde_json::to_writer(stdout().lock(), &instances)?;
        }
        Which::Runs(arguments) => runs(&arguments)?,
        Which::Overhead { algorithms, dimensions, json } => {
            let mut records = Vec::new();
            for entry in chosen(&algorithms)? {
                for &dimension in &dimensions {
                    records.push(overhead(&entry, dimension)?);
                }
            }
            if json {
                serde_json::to_writer(stdout().lock(), &records)?;
                return Ok(());
            }
            writeln!(stdout(), "| algorithm | D | ns per evaluation | function |")?;
            writeln!(stdout(), "| --- | ---: | ---: | ---: |")?;
            for r in &records {
                writeln!(
                    stdout(),
                    "| {} | {} | {:.0} | {:.0} |",
                    r.algorithm,
                    r.dimension,
                    r.nanoseconds,
                    r.function
                )?;
            }
        }
    }
    Ok(())
}

fn instance(dimension: usize, seed: u64) -> Instance {
    let transform = Transform::seeded(dimension, seed);
    let point: Vec<f64> = (0..dimension).map(|k| 90.0 * (1.0 + k as f64).sin()).collect();
    let value = |landscape| ShiftedRotated { landscape, transform: transform.clone() }.value(&point);
    let values = Landscape::ALL.map(value).into();
    Instance { shift: transform.shift, rotation: transform.rotation, point, values }
}

fn runs(arguments: &Runs) -> Result<(), Failure> {
    let known = |name: &String| Landscape::ALL.iter().any(|l| l.name() == name);
    if let Some(unknown) = arguments.functions.iter().find(|name| !known(name)) {
        return Err(format!("no function `{unknown}`").into());
    }
    let functions: Vec<Landscape> = (Landscape::ALL.into_iter())
        .filter(|l| arguments.functions.is_empty() || arguments.functions.iter().any(|n| n == l.name()))
        .collect();
    if !arguments.json {
        writeln!(stdout(), "| algorithm | function | D | success | evaluations | error |")?;
        writeln!(stdout(), "| --- | --- | ---: | ---: | ---: | ---: |")?;
    }
    let mut records = Vec::new();
    for &dimension in &arguments.dimensions {
        for entry in chosen(&arguments.algorithms)? {
            for &landscape in &functions {
                let record = record(&entry, landscape, dimension, arguments)?;
                if !arguments.json {
                    let evaluations = record.evaluations.map_or_else(|| "-".into(), |e| format!("{e:.0}"));
                    writeln!(
                        stdout(),
                        "| {} | {} | {dimension} | {}/{} | {evaluations} | {:.1e} |",
                        record.algorithm,
                        record.function,
                        record.successes,
                        record.runs,
                        record.error
                    )?;
                }
                records.push(record);
            }
        }
    }
    if arguments.json {
        serde_json::to_writer(stdout().lock(), &records)?;
    }
    Ok(())
}

/// All seeds of an algorithm on a function, several at a time.
fn record(
    entry: &Entry,
    landscape: Landscape,
    dimension: usize,
    arguments: &Runs,
) -> Result<Record, Failure> {
    let seeds = arguments.first_seed..arguments.first_seed + arguments.seeds;
    let jobs: Mutex<VecDeque<u64>> = Mutex::new(seeds.collect());
    let next = || jobs.lock().ok()?.pop_front();
    let results: Result<Vec<(usize, f64)>, Failure> = thread::scope(|scope| {
        let worker = || {
            let mut done = Vec::new();
            while let Some(seed) = next() {
                done.push(solve(entry, landscape, dimension, seed)?);
            }
            Ok::<_, String>(done)
        };
        let threads: Vec<_> = (0..arguments.threads.max(1)).map(|_| scope.spawn(worker)).collect();
        let mut all = Vec::new();
        for thread in threads {
            all.extend(thread.join().map_err(|_| "a run panicked")??);
        }
        Ok(all)
    });
    let results = results?;
    let reached: Vec<f64> = results.iter().filter(|r| r.1 <= TARGET).map(|r| r.0 as f64).collect();
    Ok(Record {
        algorithm: entry.name,
        function: landscape.name(),
        dimension,
        runs: results.len(),
        successes: reached.len(),
        evaluations: median(reached),
        error: median(results.iter().map(|r| r.1).collect()).unwrap_or(f64::NAN),
    })
}

/// Evaluations and least value of one run.
fn solve(entry: &Entry, landscape: Landscape, dimension: usize, seed: u64) -> Result<(usize, f64), String> {
    let function = ShiftedRotated { landscape, transform: Transform::seeded(dimension, seed) };
    let bound = ShiftedRotated::BOUND;
    let space = SearchSpace::cube(dimension, -bound, bound).map_err(|e| e.to_string())?;
    let search = Search {
        seed,
        budget: 10_000 * dimension,
        target: Some(TARGET),
        threads: 1,
        ..Search::new(entry.method.clone())
    };
    let report = search.minimize(&space, &|x: &[f64]| function.value(x)).map_err(|e| e.to_string())?;
    Ok((report.evaluations, report.best.map_or(f64::NAN, |b| b.evaluation.objective)))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// The function of Rosenbrock on the box of `pygmo.rosenbrock`.
fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|w| 100.0 * (w[0] * w[0] - w[1]).powi(2) + (w[0] - 1.0).powi(2)).sum()
}

/// Least of five searches of 100 000 evaluations.
fn overhead(entry: &Entry, dimension: usize) -> Result<Overhead, Failure> {
    let space = SearchSpace::cube(dimension, -5.0, 10.0)?;
    let (mut total, mut function) = (f64::INFINITY, f64::INFINITY);
    for seed in 1..=5 {
        let search = Search { seed, budget: 100_000, threads: 1, ..Search::new(entry.method.clone()) };
        let clock = CpuTime::start();
        let report = search.minimize(&space, &rosenbrock)?;
        total = total.min(clock.milliseconds() * 1e6 / report.evaluations as f64);
        let x = vec![0.5; dimension];
        let clock = CpuTime::start();
        (0..100_000).for_each(|_| {
            black_box(rosenbrock(black_box(&x)));
        });
        function = function.min(clock.milliseconds() * 1e6 / 100_000.0);
    }
    Ok(Overhead { algorithm: entry.name, dimension, nanoseconds: total - function, function })
}
