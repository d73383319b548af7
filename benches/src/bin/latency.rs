//! Latency of powered descents: one conic program each from dispersed starts, with and without glide slope.

use std::io::{Write, stdout};

use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use apsides_conic::{Cone, ConicSettings, Status};
use apsides_convex::{ConeSolver, DescentLimits, DescentProblem, DescentSettings, DescentSolver, Outcome};
use clap::{Parser, ValueEnum};
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::Serialize;

/// Latency of one powered descent at a given flight time from dispersed starts: mean, 99.9 % and largest CPU time, iterations, bytes.
#[derive(Debug, Parser)]
#[command(name = "latency")]
struct Arguments {
    /// Starts.
    #[arg(long, default_value_t = 10_000)]
    starts: usize,
    /// Solves of each start; the least time counts.
    #[arg(long, default_value_t = 1)]
    runs: usize,
    /// Intervals.
    #[arg(long, default_value_t = 50)]
    intervals: usize,
    /// Seed of the starts.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Gap and residuals.
    #[arg(long, default_value_t = ConicSettings::default().gap_tolerance)]
    tolerance: f64,
    /// Solver.
    #[arg(long, value_enum, default_value = "stages")]
    solver: Solver,
    /// Writes the conic programs of this case and their objectives as JSON, one a line, instead of times.
    #[arg(long, value_enum)]
    write: Option<Case>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Solver {
    Stages,
    Clarabel,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Case {
    Free,
    GlideSlope,
}

/// A conic program for a peer: `min q'x, A x + s = b`, `s` in zero, nonnegative and second-order cones of these sizes.
#[derive(Debug, Serialize)]
struct Written {
    objective: f64,
    linear: Vec<f64>,
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    right_hand_side: Vec<f64>,
    zero: usize,
    nonnegative: usize,
    second_order: Vec<usize>,
}

/// A uniform number between -1 and 1.
fn uniform(random: &mut SplitMix64) -> f64 {
    2.0 * (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
}

/// Around the start of cases a and c of Acikmese and Ploen 2007, with 500 kg of propellant: 300 m, 15 m/s and 20 kg to each side. Some starts
/// cannot reach the target at the given time, and some cannot fly at all.
fn dispersed(random: &mut SplitMix64, problem: &DescentProblem) -> DescentProblem {
    let mut p = *problem;
    for c in 0..3 {
        p.position[c] += 300.0 * uniform(random);
        p.velocity[c] += 15.0 * uniform(random);
    }
    p.mass += 20.0 * uniform(random);
    p
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    if arguments.write.is_none() {
        writeln!(
            stdout(),
            "| case | starts | mean, ms | 99.9 %, ms | largest, ms | iterations: mean | largest | reached | missed | infeasible | \
             bytes |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        )?;
    }
    for (case, name, glide_slope, flight_time) in [
        (Case::Free, "a, free", None, 72.0),
        (Case::GlideSlope, "c, glide slope", Some(4_f64.to_radians()), 81.0),
    ] {
        if arguments.write.is_some_and(|write| write != case) {
            continue;
        }
        let limits = DescentLimits { glide_slope, ..DescentLimits::default() };
        let problem = DescentProblem { limits, dry_mass: 1405.0, ..DescentProblem::mars_lander() };
        measure(&arguments, name, &problem, flight_time)?;
    }
    Ok(())
}

fn measure(
    arguments: &Arguments,
    name: &str,
    problem: &DescentProblem,
    flight_time: f64,
) -> Result<(), Failure> {
    let tolerance = arguments.tolerance;
    let settings = DescentSettings {
        intervals: arguments.intervals,
        cone_solver: match arguments.solver {
            Solver::Stages => ConeSolver::Stages,
            Solver::Clarabel => ConeSolver::Clarabel,
        },
        conic: ConicSettings {
            gap_tolerance: tolerance,
            feasibility_tolerance: tolerance,
            ..ConicSettings::default()
        },
        ..DescentSettings::default()
    };
    let mut random = SplitMix64::seed_from_u64(arguments.seed);
    let mut solver = DescentSolver::new(problem, settings)?;
    let (mut times, mut iterations) = (Vec::new(), Vec::new());
    let (mut reached, mut missed, mut infeasible) = (0, 0, 0);
    for _ in 0..arguments.starts {
        let p = dispersed(&mut random, problem);
        let mut least = f64::INFINITY;
        let mut last = None;
        for _ in 0..arguments.runs.max(1) {
            let clock = CpuTime::start();
            solver.set_start(p.position, p.velocity, p.mass)?;
            let solution = solver.solve_at(flight_time, 1)?;
            least = least.min(clock.milliseconds());
            last = Some(solution);
        }
        let solution = last.ok_or("no run")?;
        let report = solution.report.ok_or("no report")?;
        if arguments.write.is_some() {
            write(&solver, report.objective)?;
            continue;
        }
        times.push(least);
        iterations.push(solution.iterations);
        match report.status {
            Status::Solved if solution.outcome == Outcome::Landed => reached += 1,
            Status::Solved => missed += 1,
            Status::Infeasible => infeasible += 1,
            // The rest of the starts is what is neither solved nor certified.
            _ => {}
        }
    }
    if times.is_empty() {
        return Ok(());
    }
    times.sort_by(f64::total_cmp);
    let count = times.len();
    let mean = times.iter().sum::<f64>() / count as f64;
    let most = times[(count * 999 / 1000).min(count - 1)];
    let total = iterations.iter().map(|&i| f64::from(i)).sum::<f64>() / count as f64;
    let bytes = solver.bytes().map_or_else(|| "-".to_owned(), |b| b.to_string());
    writeln!(
        stdout(),
        "| {name} | {count} | {mean:.3} | {most:.3} | {:.3} | {total:.1} | {} | {reached} | {missed} | {infeasible} | {bytes} |",
        times[count - 1],
        iterations.iter().max().copied().unwrap_or(0),
    )?;
    Ok(())
}

fn write(solver: &DescentSolver, objective: f64) -> Result<(), Failure> {
    let data = solver.conic_data();
    let mut written = Written {
        objective,
        linear: data.linear,
        rows: data.matrix.rows,
        columns: data.matrix.columns,
        values: data.matrix.values,
        right_hand_side: data.right_hand_side,
        zero: 0,
        nonnegative: 0,
        second_order: Vec::new(),
    };
    for cone in data.cones {
        match cone {
            Cone::Zero(n) => written.zero += n,
            Cone::NonNegative(n) => written.nonnegative += n,
            Cone::SecondOrder(n) => written.second_order.push(n),
        }
    }
    let mut out = stdout().lock();
    serde_json::to_writer(&mut out, &written)?;
    writeln!(out)?;
    Ok(())
}
