//! Times the landing from perilune on a uniform mesh: set-up and solve, in CPU time of one thread.

use std::fs::File;
use std::io::{BufWriter, Write, stdout};
use std::path::PathBuf;
use std::time::Duration;

use apsides::nlp::{BarrierStrategy, Flow, InteriorPoint, IterationRecord, NlpSettings, SolveReport};
use apsides_benches::landing::{Dump, Failure, method_settings, settings};
use apsides_benches::timed::status;
use apsides_benches::{CpuTime, Landing, Numbers, Start, peak_memory};
use clap::Parser;
use serde::Serialize;

/// Solves the landing from perilune on a uniform mesh and prints what it took.
#[derive(Debug, Parser)]
#[command(name = "landing")]
struct Arguments {
    /// Intervals of the mesh.
    #[arg(long, default_value_t = 100)]
    intervals: usize,
    /// Collocation points per interval.
    #[arg(long, default_value_t = 3)]
    points: usize,
    /// Timed repetitions of set-up and solve.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    repeat: u32,
    /// The start of the solve.
    #[arg(long, value_enum, default_value = "auto")]
    start: Start,
    /// Settings of the Radau method instead of Ipopt's defaults.
    #[arg(long, conflicts_with_all = ["adaptive", "initial_barrier"])]
    method_settings: bool,
    /// Choose the barrier parameter anew at each iteration.
    #[arg(long)]
    adaptive: bool,
    /// Barrier parameter at the start.
    #[arg(long, default_value_t = 0.1)]
    initial_barrier: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Print the iterations of one more solve.
    #[arg(long)]
    log: bool,
    /// Write the discretised problem to this file.
    #[arg(long, value_name = "FILE")]
    dump: Option<PathBuf>,
}

/// Result of all repetitions. Times are ms of CPU time, one entry per repetition.
#[derive(Serialize)]
struct Summary {
    intervals: usize,
    points: usize,
    variables: usize,
    constraints: usize,
    status: String,
    objective: f64,
    iterations: usize,
    factorisations: usize,
    solves: usize,
    evaluations: Evaluations,
    setup_ms: Vec<f64>,
    solve_ms: Vec<f64>,
    /// Parts of the last solve, wall clock.
    evaluation_ms: f64,
    linear_systems_ms: f64,
    total_ms: f64,
    /// Largest resident set of the process, where the system tells it.
    peak_memory_kb: Option<u64>,
}

#[derive(Serialize)]
struct Evaluations {
    objective: usize,
    gradient: usize,
    constraints: usize,
    jacobian: usize,
    hessian: usize,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let Arguments { intervals, points, .. } = arguments;
    let landing = Landing::pose()?;
    let guess = landing.start(arguments.start, intervals, points)?;
    if let Some(path) = &arguments.dump {
        let mut nlp = landing.transcription(&guess, intervals, points)?;
        let dump = Dump {
            mission_file: landing.mission_file.clone(),
            intervals,
            points,
            numbers: Numbers::new(&mut nlp),
        };
        serde_json::to_writer(BufWriter::new(File::create(path)?), &dump)?;
    }
    let barrier = if arguments.adaptive { BarrierStrategy::Adaptive } else { BarrierStrategy::Monotone };
    let solver = InteriorPoint::new(if arguments.method_settings {
        method_settings()
    } else {
        NlpSettings { initial_barrier: arguments.initial_barrier, ..settings(barrier) }
    });
    if arguments.log {
        let mut nlp = landing.transcription(&guess, intervals, points)?;
        solver.solve_observed(&mut nlp, &mut |r: &IterationRecord| match print_iteration(r) {
            Ok(()) => Flow::Continue,
            Err(_) => Flow::Stop,
        })?;
    }
    let (mut setup_ms, mut solve_ms) = (Vec::new(), Vec::new());
    let mut last = None;
    for _ in 0..arguments.repeat {
        let clock = CpuTime::start();
        let mut nlp = landing.transcription(&guess, intervals, points)?;
        setup_ms.push(clock.milliseconds());
        let clock = CpuTime::start();
        let report = solver.solve(&mut nlp)?;
        solve_ms.push(clock.milliseconds());
        last = Some(report);
    }
    let report = last.ok_or("no repetition")?;
    let summary = summary(&arguments, &report, setup_ms, solve_ms);
    if arguments.json {
        writeln!(stdout(), "{}", serde_json::to_string(&summary)?)?;
    } else {
        print_summary(&summary)?;
    }
    Ok(())
}

fn summary(arguments: &Arguments, report: &SolveReport, setup_ms: Vec<f64>, solve_ms: Vec<f64>) -> Summary {
    let ms = |d: Duration| d.as_secs_f64() * 1e3;
    let c = report.counters;
    Summary {
        intervals: arguments.intervals,
        points: arguments.points,
        variables: report.x.len(),
        constraints: report.constraint_values.len(),
        status: status(report),
        objective: report.objective,
        iterations: c.iterations,
        factorisations: c.factorisations,
        solves: c.solves,
        evaluations: Evaluations {
            objective: c.objective,
            gradient: c.gradient,
            constraints: c.constraints,
            jacobian: c.jacobian,
            hessian: c.hessian,
        },
        setup_ms,
        solve_ms,
        evaluation_ms: ms(report.timing.evaluation),
        linear_systems_ms: ms(report.timing.linear_systems),
        total_ms: ms(report.timing.total),
        peak_memory_kb: peak_memory(),
    }
}

fn print_iteration(r: &IterationRecord) -> std::io::Result<()> {
    writeln!(
        stdout(),
        "{:4}{} {:16.9} {:8.1e} {:8.1e} {:8.1e} {:8.1e} {:8.1e} {:7.1e} {:7.1e} {} {}",
        r.iteration,
        if r.restoration { 'r' } else { ' ' },
        r.objective,
        r.primal_infeasibility,
        r.dual_infeasibility,
        r.barrier,
        r.step_norm,
        r.regularisation,
        r.dual_step,
        r.primal_step,
        r.line_search_trials,
        r.step_kind
    )
}

fn print_summary(s: &Summary) -> std::io::Result<()> {
    let mut out = stdout();
    writeln!(
        out,
        "{} intervals x {} points: {} variables, {} constraints",
        s.intervals, s.points, s.variables, s.constraints
    )?;
    writeln!(out, "{}, flight time {:.9} s", s.status, s.objective)?;
    writeln!(out, "{} iterations, {} factorisations, {} solves", s.iterations, s.factorisations, s.solves)?;
    let e = &s.evaluations;
    writeln!(
        out,
        "evaluations: {} objective, {} gradient, {} constraints, {} Jacobian, {} Hessian",
        e.objective, e.gradient, e.constraints, e.jacobian, e.hessian
    )?;
    writeln!(out, "set-up: {}", spread(&s.setup_ms))?;
    writeln!(out, "solve:  {}", spread(&s.solve_ms))?;
    writeln!(
        out,
        "last solve: {:.3} ms, of which evaluation {:.3} and linear systems {:.3} (wall clock)",
        s.total_ms, s.evaluation_ms, s.linear_systems_ms
    )
}

/// Minimum and median.
fn spread(times: &[f64]) -> String {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (least, median) = (sorted.first().copied(), sorted.get(sorted.len() / 2).copied());
    format!(
        "{:.3} ms minimum, {:.3} ms median of {}",
        least.unwrap_or(f64::NAN),
        median.unwrap_or(f64::NAN),
        sorted.len()
    )
}
