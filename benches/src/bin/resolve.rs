//! Times re-solves of a mission after changes of its values: a cold solve, one change after the other, and a cloud of dispersed values.
//!
//! ```text
//! cargo run --release -p apsides-benches --bin resolve -- [--mission NAME] [--intervals N --points N] [--change 0.01] [KEY...]
//! ```
#![allow(clippy::print_stdout)]

use apsides::ocp::Mesh;
use apsides::radau::{Radau, RadauSettings, Resolved, Session};
use apsides::verify::{Verdict, VerifySettings, verify};
use apsides::{Posed, load};
use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use clap::Parser;

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

    println!(
        "\n| change | ms | iterations | same active set or near it | objective | cold / re-solve |\n| --- | ---: | ---: | --- | ---: | ---: |"
    );
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
            println!(
                "| {} {:+} % | {least:.3} | {iterations} | {followed} | {} | {:.1} |",
                arguments.keys[key],
                100.0 * changes[key],
                solution.trajectory.objective,
                cold / least
            );
        }
    }
    cloud(&case, &radau, &solution.trajectory)
}

/// Dispersed sets of values, each re-solved from the nominal solution and certified.
fn cloud(case: &Case<'_>, radau: &Radau, nominal: &apsides::ocp::Trajectory) -> Result<(), Failure> {
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
    println!(
        "\n{} samples within {} %: re-solve mean {:.3} ms, 99.9 % {:.3} ms, largest {:.3} ms; {:.2} iterations; certificate mean {:.3} ms",
        times.len(),
        100.0 * arguments.change,
        mean(&times),
        quantile(0.999),
        quantile(1.0),
        iterations as f64 / times.len().max(1) as f64,
        mean(&checks)
    );
    println!("by the active set {followed}, by other meshes {}, failed {failed}", times.len() - followed);
    let [rejected, feasible, extremal, strict, global] = verdicts;
    println!(
        "rejected {rejected}, feasible {feasible}, extremal {extremal}, strict {strict}, global {global}"
    );
    Ok(())
}
