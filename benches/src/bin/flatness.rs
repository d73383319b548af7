//! Solves a landing with constant thrust on B-splines or Radau points, or writes its program for a peer. Prints JSON.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write, stdout};
use std::path::PathBuf;

use apsides::nlp::{BarrierOracle, BarrierStrategy, InteriorPoint, NlpSettings};
use apsides::ocp::{Ocp, Trajectory};
use apsides::verify::{VerifySettings, verify};
use apsides_benches::flat::{FlatLanding, Splines, default_method};
use apsides_benches::landing::{Dump, Failure, method_settings, settings};
use apsides_benches::{CpuTime, Landing, Numbers, Timed};
use apsides_flatness::FlatnessSettings;
use clap::{Parser, Subcommand, ValueEnum};
use serde::Serialize;
use serde_json::json;

/// Writes or solves a landing on one grid.
#[derive(Debug, Parser)]
#[command(name = "flatness")]
struct Arguments {
    #[command(subcommand)]
    which: Which,
    /// Mission with constant thrust.
    #[arg(long, global = true, default_value = "lunar-perilune")]
    mission: String,
    /// Settings of the interior-point method.
    #[arg(long, global = true, value_enum, default_value = "monotone")]
    strategy: Strategy,
    /// Repeat each solve until so much CPU time is spent.
    #[arg(long, global = true, default_value_t = 20.0)]
    milliseconds: f64,
    /// Write the program to this file.
    #[arg(long, global = true, value_name = "FILE")]
    dump: Option<PathBuf>,
    /// Also re-simulate the solution.
    #[arg(long, global = true)]
    verify: bool,
}

#[derive(Clone, Copy, Debug, Subcommand)]
enum Which {
    /// Flat outputs on B-splines.
    Flat {
        /// The splines.
        #[arg(value_enum)]
        splines: Splines,
        /// Start from the guess fitted to splines, not from the method's coarse solution.
        #[arg(long)]
        fitted: bool,
    },
    /// States at Radau points.
    Radau {
        /// Intervals of the uniform mesh.
        #[arg(long)]
        intervals: usize,
        /// Points per interval.
        #[arg(long)]
        points: usize,
    },
    /// The whole call of the method on B-splines: start, solves, estimates, trajectory.
    Call {
        /// The splines; refined with the default settings.
        #[arg(value_enum)]
        splines: Splines,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Strategy {
    /// Default of the solver.
    Monotone,
    /// Adaptive by the quality function.
    Quality,
    /// Default of the method: that of the flat one, or that of the Radau method.
    Method,
}

impl Strategy {
    fn solver(self, which: Which) -> InteriorPoint {
        InteriorPoint::new(match (self, which) {
            (Self::Monotone, _) => settings(BarrierStrategy::Monotone),
            (Self::Quality, _) => NlpSettings {
                barrier_oracle: BarrierOracle::QualityFunction,
                ..settings(BarrierStrategy::Adaptive)
            },
            (Self::Method, Which::Radau { .. }) => method_settings(),
            (Self::Method, _) => NlpSettings { tolerance: 1e-8, ..FlatnessSettings::default().nlp },
        })
    }
}

/// CPU time of whole calls, one entry per repetition.
#[derive(Serialize)]
struct Calls {
    call_ms: Vec<f64>,
    /// Variables, constraints and iterations of each program, that of the start first.
    programs: Vec<(usize, usize, usize)>,
    objective: f64,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let Arguments { which, milliseconds, .. } = arguments;
    let solver = arguments.strategy.solver(which);
    let (timed, misses) = match which {
        Which::Flat { splines, fitted } => {
            let flat = FlatLanding::pose(&arguments.mission)?;
            let method = flat.method(splines, !fitted)?;
            let solution = flat.solve(&method)?;
            if let Some(path) = &arguments.dump {
                write(path, &flat.dump(&method, &solution)?)?;
            }
            let timed = Timed::run(&solver, milliseconds, || flat.program(&method))?;
            let misses = misses(&arguments, &flat.landing.ocp, &solution.trajectory, &timed)?;
            (timed, misses)
        }
        Which::Radau { intervals, points } => {
            let landing = Landing::of(&arguments.mission)?;
            let pose = || landing.transcription(&landing.guess, intervals, points);
            if let Some(path) = &arguments.dump {
                let numbers = Numbers::new(&mut pose()?);
                let mission_file = landing.mission_file.clone();
                write(path, &Dump { mission_file, intervals, points, numbers })?;
            }
            let timed = Timed::run(&solver, milliseconds, pose)?;
            let mut nlp = pose()?;
            let report = solver.solve(&mut nlp)?;
            let trajectory = nlp.trajectory(&landing.ocp, &report)?;
            let misses = misses(&arguments, &landing.ocp, &trajectory, &timed)?;
            (timed, misses)
        }
        Which::Call { splines } => {
            let calls = calls(&arguments, splines)?;
            writeln!(stdout(), "{}", json!(calls))?;
            return Ok(());
        }
    };
    let mut output = json!(timed);
    output["misses"] = json!(misses);
    writeln!(stdout(), "{output}")?;
    Ok(())
}

fn write(path: &PathBuf, content: &impl Serialize) -> Result<(), Failure> {
    serde_json::to_writer(BufWriter::new(File::create(path)?), content)?;
    Ok(())
}

/// The misses of the re-simulated flight at the end, by state and in its unit.
fn misses(
    arguments: &Arguments,
    ocp: &Ocp,
    trajectory: &Trajectory,
    timed: &Timed,
) -> Result<BTreeMap<String, f64>, Failure> {
    if !arguments.verify {
        return Ok(BTreeMap::new());
    }
    if (trajectory.objective - timed.objective).abs() > 1e-8 * timed.objective.abs() {
        return Err(
            format!("optimum {}, but {} of the trajectory", timed.objective, trajectory.objective).into()
        );
    }
    let certificate = verify(ocp, trajectory, &VerifySettings::default())?.certificate;
    let states = certificate.checks.iter().filter_map(|check| {
        let (name, _) = check.name.strip_prefix("re-simulated ")?.split_once(" at the end")?;
        Some((name.to_owned(), check.value))
    });
    Ok(states.collect())
}

fn calls(arguments: &Arguments, splines: Splines) -> Result<Calls, Failure> {
    let flat = FlatLanding::pose(&arguments.mission)?;
    let method = if splines == Splines::Refined { default_method() } else { flat.method(splines, true)? };
    let mut call_ms = Vec::new();
    loop {
        let clock = CpuTime::start();
        let solution = flat.solve(&method)?;
        call_ms.push(clock.milliseconds());
        if call_ms.iter().sum::<f64>() >= arguments.milliseconds {
            let programs = solution.presolve.iter().chain(&solution.solves);
            return Ok(Calls {
                call_ms,
                programs: programs
                    .map(|s| (s.counters.variables, s.counters.constraints, s.counters.iterations))
                    .collect(),
                objective: solution.trajectory.objective,
            });
        }
    }
}
