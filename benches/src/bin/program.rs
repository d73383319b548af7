//! Solves nonlinear programs of the gallery and of the collection of Hock and Schittkowski, or writes them for a peer.
//! Prints JSON.

use std::io::{Write, stdout};

use apsides::nlp::{BarrierOracle, BarrierStrategy, InteriorPoint, NlpSettings};
use apsides::ocp::{Guess, Mesh, Ocp};
use apsides::radau::{Radau, Transcription};
use apsides_benches::landing::{self, Failure, Landing, method_settings};
use apsides_benches::{CpuTime, Formulas, Timed};
use apsides_problems::nlp::hock_schittkowski::collection;
use apsides_problems::{Case, find};
use clap::{Parser, Subcommand, ValueEnum};
use serde::Serialize;
use serde_json::{Value, json};

/// Writes or solves nonlinear programs.
#[derive(Debug, Parser)]
#[command(name = "program")]
struct Arguments {
    #[command(subcommand)]
    which: Which,
    /// Print formulas, start, bounds and units instead of solving.
    #[arg(long, global = true)]
    formulas: bool,
    /// Strategy of the barrier parameter.
    #[arg(long, global = true, value_enum, default_value = "monotone")]
    strategy: Strategy,
    /// Repeat each solve until so much CPU time is spent.
    #[arg(long, global = true, default_value_t = 20.0)]
    milliseconds: f64,
}

#[derive(Debug, Subcommand)]
enum Which {
    /// The collection of Hock and Schittkowski.
    HockSchittkowski,
    /// A problem of the gallery, or the mission `lunar-perilune`, on a uniform mesh.
    Problem {
        /// Name in the gallery.
        name: String,
        /// Intervals of the mesh, of each phase.
        #[arg(long)]
        intervals: usize,
        /// Collocation points per interval.
        #[arg(long)]
        points: usize,
    },
    /// The same problems by the Radau method with its defaults: meshes refined until their error is small enough.
    Refined {
        /// Name in the gallery, or `lunar-perilune`.
        name: String,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Strategy {
    /// Default of the solver.
    Monotone,
    /// Adaptive by the quality function.
    Quality,
    /// Adaptive by probing.
    Probing,
    /// Default of the Radau method: probing from a small barrier parameter.
    Trajectory,
}

impl Strategy {
    fn apply(self, base: NlpSettings) -> InteriorPoint {
        let adaptive = |barrier_oracle| NlpSettings {
            barrier: BarrierStrategy::Adaptive,
            barrier_oracle,
            ..base.clone()
        };
        InteriorPoint::new(match self {
            Self::Monotone => base,
            Self::Quality => adaptive(BarrierOracle::QualityFunction),
            Self::Probing => adaptive(BarrierOracle::Probing),
            Self::Trajectory => method_settings(),
        })
    }
}

/// The part that both kinds of programs have.
#[derive(Serialize)]
struct Entry<T> {
    name: String,
    /// Published optimum; none for the landing.
    optimum: Option<f64>,
    /// Largest difference from it, relative.
    tolerance: f64,
    #[serde(flatten)]
    content: T,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let output = match &arguments.which {
        Which::HockSchittkowski => collection_entries(&arguments)?,
        Which::Problem { name, intervals, points } => problem_entry(&arguments, name, *intervals, *points)?,
        Which::Refined { name } => refined_entry(&arguments, name)?,
    };
    writeln!(stdout(), "{output}")?;
    Ok(())
}

/// All programs of the collection, solved or as formulas.
fn collection_entries(arguments: &Arguments) -> Result<Value, Failure> {
    let solver = arguments.strategy.apply(NlpSettings::default());
    let entries = collection().into_iter().map(|program| {
        let name = program.number.to_string();
        let (optimum, tolerance) = (Some(program.optimum), program.tolerance);
        let content = if arguments.formulas {
            // One program without a formula leaves the others to compare.
            match Formulas::of_program(&program) {
                Ok(formulas) => json!(formulas),
                Err(error) => json!({ "no_formula": error.to_string() }),
            }
        } else {
            json!(Timed::run(&solver, arguments.milliseconds, || Ok(program.clone()))?)
        };
        Ok(json!(Entry { name, optimum, tolerance, content }))
    });
    entries.collect::<Result<Vec<_>, Failure>>().map(Value::Array)
}

fn problem_entry(
    arguments: &Arguments,
    name: &str,
    intervals: usize,
    points: usize,
) -> Result<Value, Failure> {
    let (ocp, guess, optimum, tolerance) = pose(name)?;
    let mesh = Mesh::uniform(&ocp, intervals, points)?;
    let content = if arguments.formulas {
        let mut nlp = Transcription::new(&ocp, &mesh, &guess)?;
        json!(Formulas::of_problem(&ocp, &mesh, &mut nlp)?)
    } else {
        let solver = arguments.strategy.apply(landing::settings(BarrierStrategy::Monotone));
        json!(Timed::run(&solver, arguments.milliseconds, || Ok(Transcription::new(&ocp, &mesh, &guess)?))?)
    };
    Ok(json!(Entry { name: name.into(), optimum, tolerance, content }))
}

/// Whole calls of the method, from problem and guess to the trajectory.
fn refined_entry(arguments: &Arguments, name: &str) -> Result<Value, Failure> {
    let (ocp, guess, optimum, tolerance) = pose(name)?;
    let mut call_ms = Vec::new();
    loop {
        let clock = CpuTime::start();
        let solution = Radau::default().solve(&ocp, &guess)?;
        call_ms.push(clock.milliseconds());
        if call_ms.iter().sum::<f64>() >= arguments.milliseconds {
            let content = json!({
                "call_ms": call_ms,
                "solved": solution.accurate && solution.status.is_success(),
                "objective": solution.trajectory.objective,
                "meshes": solution.meshes.len(),
                "iterations": solution.meshes.iter().map(|mesh| mesh.counters.iterations).sum::<usize>(),
            });
            return Ok(json!(Entry { name: name.into(), optimum, tolerance, content }));
        }
    }
}

/// Problem, guess, optimum and its tolerance.
fn pose(name: &str) -> Result<(Ocp, Guess, Option<f64>, f64), Failure> {
    if name == landing::MISSION {
        let Landing { ocp, guess, .. } = Landing::pose()?;
        return Ok((ocp, guess, None, 0.0));
    }
    let problem = find(name).ok_or_else(|| format!("no problem `{name}` in the gallery"))?;
    let Case { ocp, guess } = problem.pose()?;
    Ok((ocp, guess, Some(problem.optimum.value), problem.optimum.relative_tolerance))
}
