//! Times re-solves of a mission after changes of its values: a cold solve, one change after the other, a step along the derivative of the
//! solution, and a cloud of dispersed values.
//!
//! ```text
//! cargo run --release -p apsides-benches --bin resolve -- [--mission NAME] [--intervals N --points N] [--change 0.01] [KEY...]
//! ```
#![allow(clippy::print_stdout)]

use apsides::nlp::{InteriorPoint, Perturbation};
use apsides::ocp::{Guess, Mesh, Trajectory};
use apsides::radau::{Radau, RadauSettings, Resolved, Session, Transcription};
use apsides::verify::{Verdict, VerifySettings, verify};
use apsides::{Posed, load};
use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use clap::Parser;

/// Relative change of a value over which its derivative is taken, to both sides.
const SMALL_CHANGE: f64 = 1e-4;

/// Steps along the derivative that are timed.
const STEPS: usize = 200;

/// The tolerance of a mesh that is not refined.
const ANY_ERROR: f64 = 1e6;

/// Times re-solves of a mission.
#[derive(Debug, Parser)]
#[command(name = "resolve")]
struct Arguments {
    /// Name of the mission, or its file.
    #[arg(long, default_value = "lunar-perilune")]
    mission: String,
    /// Intervals of a uniform mesh that is not refined; the method's own meshes without it.
    #[arg(long)]
    intervals: Option<usize>,
    /// Points per interval of such a mesh.
    #[arg(long, default_value_t = 3)]
    points: usize,
    /// Relative change of a value.
    #[arg(long, default_value_t = 0.01)]
    change: f64,
    /// Dispersed sets of values.
    #[arg(long, default_value_t = 1000)]
    samples: usize,
    /// Re-solve without certificates.
    #[arg(long)]
    uncertified: bool,
    /// Keys whose values change.
    #[arg(default_values_t = ["initial_mass_kg", "thrust_n", "isp_s", "perilune_altitude_km"].map(String::from))]
    keys: Vec<String>,
}

/// Numbers from -1 to 1, evenly spread: the fractional parts of the multiples of an irrational number for each key (H. Weyl 1916).
fn dispersed(sample: usize, key: usize) -> f64 {
    2.0 * ((sample + 1) as f64 * ((key + 2) as f64).ln()).fract() - 1.0
}

struct Case<'a> {
    arguments: &'a Arguments,
    values: Vec<f64>,
}

impl Case<'_> {
    /// The mission with the values of the keys times one and the changes.
    fn posed(&self, changes: &[f64]) -> Result<Posed, Failure> {
        let values = self.arguments.keys.iter().zip(&self.values).zip(changes);
        let sets: Vec<String> =
            values.map(|((k, v), change)| format!("{k}={}", v * (1.0 + change))).collect();
        Ok(load(&self.arguments.mission, &sets)?.pose()?)
    }
}

fn main() -> Result<(), Failure> {
    let arguments = &Arguments::parse();
    let nominal = load(&arguments.mission, &[])?;
    let values =
        arguments.keys.iter().map(|key| nominal.values().number(key)).collect::<Result<Vec<f64>, _>>()?;
    let case = Case { arguments, values };
    let none = vec![0.0; arguments.keys.len()];

    let Posed { ocp, guess, .. } = case.posed(&none)?;
    let mut settings = RadauSettings::default();
    if arguments.intervals.is_some() {
        settings.max_refinements = 0;
        settings.tolerance = ANY_ERROR;
    }
    let radau = Radau { settings };
    let mesh = match arguments.intervals {
        Some(intervals) => Mesh::uniform(&ocp, intervals, arguments.points)?,
        None => radau.uniform_mesh(&ocp)?,
    };
    let mut lines = Vec::new();
    let mut cold = f64::INFINITY;
    let mut solution = radau.solve_on(&ocp, &guess, mesh.clone(), &mut ())?;
    for _ in 0..5 {
        let clock = CpuTime::start();
        solution = radau.solve_on(&ocp, &guess, mesh.clone(), &mut ())?;
        cold = cold.min(clock.milliseconds());
    }
    let iterations: usize = solution.meshes.iter().map(|m| m.counters.iterations).sum();
    let last = solution.meshes.last().ok_or("no mesh")?;
    println!(
        "cold: {cold:.2} ms, {} meshes, {iterations} iterations, last mesh {} points, {} variables; objective {}",
        solution.meshes.len(),
        last.points,
        last.counters.variables,
        solution.trajectory.objective
    );

    lines.push(format!("| cold solve | {cold:.2} ms | {iterations} | {} meshes |", solution.meshes.len()));
    lines.push(parametric_step(&case, &radau, &solution.trajectory)?);

    println!(
        "\n| change | ms | iterations | same active set or near it | objective | cold / re-solve |\n| --- | ---: | ---: | --- | ---: | ---: |"
    );
    let (mut slowest, mut most) = (0.0_f64, 0);
    for key in 0..arguments.keys.len() {
        for sign in [1.0, -1.0] {
            let mut changes = none.clone();
            changes[key] = sign * arguments.change;
            let Posed { ocp, .. } = case.posed(&changes)?;
            let mut least = f64::INFINITY;
            let mut found = None;
            for _ in 0..5 {
                let mut session = Session::new(radau.clone(), solution.trajectory.clone());
                session.resolve(&case.posed(&none)?.ocp, &mut ())?;
                let clock = CpuTime::start();
                found = Some(session.resolve(&ocp, &mut ())?);
                least = least.min(clock.milliseconds());
            }
            let Some(Resolved { solution, followed }) = found else { continue };
            let iterations: usize = solution.meshes.iter().map(|m| m.counters.iterations).sum();
            (slowest, most) = (slowest.max(least), most.max(iterations));
            println!(
                "| {} {:+} % | {least:.3} | {iterations} | {followed} | {} | {:.1} |",
                arguments.keys[key],
                100.0 * changes[key],
                solution.trajectory.objective,
                cold / least
            );
        }
    }
    let change = 100.0 * arguments.change;
    let times = cold / slowest;
    lines.push(format!(
        "| a value changed by {change} %, the slowest | {slowest:.3} ms | {most} | {times:.1} times cheaper than cold |"
    ));
    lines.extend(cloud(&case, &radau, &solution.trajectory)?);
    println!("\n| work | time | iterations | remarks |\n| --- | ---: | ---: | --- |\n{}", lines.join("\n"));
    Ok(())
}

/// One step along the derivative of the solution to the first key, from derivatives of the data that are known: one solve with the factor
/// at the solution.
fn parametric_step(case: &Case<'_>, radau: &Radau, nominal: &Trajectory) -> Result<String, Failure> {
    let none = vec![0.0; case.arguments.keys.len()];
    let pose = |change: f64| -> Result<Transcription, Failure> {
        let mut changes = none.clone();
        changes[0] = change;
        Ok(Transcription::new(&case.posed(&changes)?.ocp, &nominal.mesh(), &Guess::earlier(nominal))?)
    };
    let (solver, mut nlp) = (InteriorPoint::new(radau.settings.nlp.clone()), pose(0.0)?);
    let Some(warm) = nlp.warm_start(&case.posed(&none)?.ocp, &Guess::earlier(nominal)) else {
        return Err("the solution has no multipliers".into());
    };
    let report = solver.solve_from(&mut nlp, &warm, &mut ())?;
    let width = 2.0 * SMALL_CHANGE;
    let (mut before, mut after) = (pose(-SMALL_CHANGE)?, pose(SMALL_CHANGE)?);
    let perturbation = Perturbation::between(&mut before, &mut after, &report, width)?;
    let mut sensitivity = solver.sensitivity(&mut nlp, &report)?;
    let mut times = Vec::new();
    let mut step = report.x.clone();
    for _ in 0..STEPS {
        let clock = CpuTime::start();
        let derivative = sensitivity.solve(&perturbation)?;
        for ((step, x), slope) in step.iter_mut().zip(&report.x).zip(&derivative.x) {
            *step = x + case.arguments.change * slope;
        }
        times.push(1e3 * clock.milliseconds());
    }
    times.sort_by(f64::total_cmp);
    let (key, variables) = (&case.arguments.keys[0], step.len());
    Ok(format!("| a step along the derivative to `{key}` | {:.0} us | - | {variables} variables |", times[0]))
}

/// Dispersed sets of values, each re-solved from the nominal solution and certified.
fn cloud(case: &Case<'_>, radau: &Radau, nominal: &Trajectory) -> Result<Vec<String>, Failure> {
    let arguments = case.arguments;
    let (mut times, mut checks) = (Vec::new(), Vec::new());
    let mut followed = 0;
    let mut verdicts = [0; 5];
    let mut iterations = 0;
    let mut failed = 0;
    let mut session = Session::new(radau.clone(), nominal.clone());
    session.resolve(&case.posed(&vec![0.0; arguments.keys.len()])?.ocp, &mut ())?;
    for sample in 0..arguments.samples {
        let changes: Vec<f64> =
            (0..arguments.keys.len()).map(|key| arguments.change * dispersed(sample, key)).collect();
        let Posed { ocp, .. } = case.posed(&changes)?;
        let clock = CpuTime::start();
        let Resolved { solution, followed: solution_followed } = session.resolve(&ocp, &mut ())?;
        times.push(clock.milliseconds());
        followed += usize::from(solution_followed);
        iterations += solution.meshes.iter().map(|m| m.counters.iterations).sum::<usize>();
        if !solution.status.is_success() {
            failed += 1;
            continue;
        }
        if arguments.uncertified {
            continue;
        }
        let clock = CpuTime::start();
        let verdict: Verdict =
            verify(&ocp, &solution.trajectory, &VerifySettings::default())?.certificate.verdict;
        checks.push(clock.milliseconds());
        verdicts[verdict as usize] += 1;
    }
    let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
    times.sort_by(f64::total_cmp);
    let quantile = |q: f64| times[((times.len() - 1) as f64 * q) as usize];
    let change = 100.0 * arguments.change;
    let count = times.len();
    let [rejected, feasible, extremal, strict, global] = verdicts;
    let other = count - followed;
    Ok(vec![
        format!(
            "| {count} sets of values within {change} %, all | {:.0} ms | {:.2} each | by the active set {followed}, by other meshes {other}, failed {failed} |",
            times.iter().sum::<f64>(),
            iterations as f64 / count.max(1) as f64,
        ),
        format!("| mean of them | {:.3} ms | - | |", mean(&times)),
        format!("| 99.9 % of them within | {:.3} ms | - | |", quantile(0.999)),
        format!("| the slowest of them | {:.3} ms | - | |", quantile(1.0)),
        format!(
            "| a certificate of one of them, mean | {:.3} ms | - | rejected {rejected}, feasible {feasible}, extremal {extremal}, strict {strict}, global {global} |",
            mean(&checks)
        ),
    ])
}
